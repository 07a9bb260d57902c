// Messages to the user, as a pure function of state. A picture that isn't fresh is never called live.

import { Code } from './grpc_web.js';
import { Reason, State } from './messages.js';

/** A picture older than this is shown dimmed with its age, ms. Half the slowest rate worth calling live (2 Hz). */
export const STALE_MS = 1000;

/** A picture older than this is taken off the glass: nobody may find the last user there, ms. */
export const BLANK_MS = 12_000;

const REASONS = {
  [Reason.NO_PERSON]: ['nobody in view', 'Step in front of the mirror.'],
  [Reason.PERSON_LEFT]: ['you stepped out of view', 'Come back into the picture to go on.'],
  [Reason.TRACKING_LOST]: ['we lost track of you', 'Face the mirror, arms slightly away from your body.'],
  [Reason.PERSON_SITS]: ['you are sitting', 'Stand up to see the garments on you.'],
  [Reason.CAMERA_SILENT]: ['the camera is silent', 'We are waiting for its next picture.'],
  [Reason.TRACKING_UNAVAILABLE]: ['body tracking is restarting', 'You see yourself without garments until it is back.'],
  [Reason.CLOTH_UNAVAILABLE]: ['the fitting room is restarting', 'You see yourself without garments until it is back.'],
  [Reason.GARMENTS_LATE]: ['the garments are late', 'They will catch up in a moment.'],
  [Reason.GARMENT_OFF_PERSON]: ['a garment hangs beside you', 'Move a little slower until it is back.'],
  [Reason.STEP_FAILED]: ['one moment went wrong', 'The mirror carries on with the next one.'],
};

/** Reasons that a person in front of the mirror can mend; only these count towards the idle time. */
export const AWAY = new Set([Reason.NO_PERSON, Reason.PERSON_LEFT]);

export function reasonWords(reason) {
  return REASONS[reason] ?? ['something is missing', 'The mirror carries on as soon as it can.'];
}

/** "0.4 s", "12 s", "3 min". */
export function ageWords(ms) {
  const s = ms / 1000;
  if (s < 10) return `${Math.max(s, 0).toFixed(1)} s`;
  if (s < 90) return `${Math.round(s)} s`;
  return `${Math.round(s / 60)} min`;
}

/**
 * @param {{link: string, retryAt: number|null, state: number, reason: number, degradedAge: number,
 *          shownAt: number|null, exposedAt: number|null, measured: boolean, error: Error|null}} known
 *   times in ms of one clock: when the last picture was drawn, and when the camera saw what it shows; `measured`: this
 *   person has been live, so calibrating again is about the garments
 * @returns {{tone: 'idle'|'busy'|'live'|'degraded'|'down', title: string, hint: string, age: string,
 *            dim: ''|'soft'|'hard', blank: boolean, guide: boolean}}
 */
export function present(known, now) {
  const sincePicture = known.exposedAt === null ? null : now - known.exposedAt;
  const stale = sincePicture === null || sincePicture > STALE_MS;
  const blank = sincePicture === null || sincePicture > BLANK_MS;
  const age = stale && sincePicture !== null ? `Last picture ${ageWords(sincePicture)} ago` : '';
  const say = (tone, title, hint, more = {}) => ({ tone, title, hint, age, dim: stale ? 'hard' : '', blank, guide: false, ...more });

  if (known.link === 'refused' && [Code.UNAUTHENTICATED, Code.PERMISSION_DENIED].includes(known.error?.code)) {
    // Whoever may not watch any more may not keep the last picture either.
    return say('down', 'Degraded: this mirror may not be watched', 'Its token is missing, has ended or is for another mirror.', { blank: true });
  }
  if (known.link === 'refused') {
    return say('down', 'Degraded: this mirror cannot start', known.error?.message ?? '');
  }
  if (known.link === 'waiting' || (known.link === 'opening' && known.retryAt !== null)) {
    const wait = known.retryAt === null ? 0 : known.retryAt - now;
    const when = known.link === 'waiting' && wait > 500 ? `Trying again in ${Math.ceil(wait / 1000)} s.` : 'Trying again now.';
    return say('down', 'Degraded: the mirror does not answer', when, { dim: 'hard' });
  }
  switch (known.state) {
    case State.CALIBRATING:
      if (known.measured) return say('busy', 'Putting it on', '');
      return say('busy', 'Getting your measure', 'Stand facing the mirror, arms slightly away from your body.', { guide: true });
    case State.LIVE:
      if (known.shownAt === null) return say('busy', 'Waking the mirror', 'This takes a moment.');
      if (stale) {
        const late = known.shownAt !== null && now - known.shownAt < STALE_MS;
        const title = late ? 'Degraded: the picture is late' : 'Degraded: no new picture';
        return say('degraded', title, late ? 'The mirror is catching up.' : 'We are waiting for the next one.', { dim: 'hard' });
      }
      return say('live', 'Live', '');
    case State.DEGRADED: {
      const [title, hint] = reasonWords(known.reason);
      const bare = !stale && known.degradedAge >= STALE_MS / 1000 ? `Without garments for ${ageWords(known.degradedAge * 1000)}` : '';
      const guide = !stale && known.reason === Reason.NO_PERSON;
      return say('degraded', `Degraded: ${title}`, hint, { age: age || bare, dim: stale ? 'hard' : 'soft', guide });
    }
    case State.DRAINING:
      return say('down', 'Degraded: the mirror is restarting', 'It will be back in a moment.', { dim: 'hard' });
    case State.CLOSED:
      return say('down', 'Degraded: this session was closed', 'A new one is being opened.', { dim: 'hard' });
    default:
      return say('busy', 'Waking the mirror', 'This takes a moment.');
  }
}
