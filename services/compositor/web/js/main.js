// The page's story: wait for somebody, open a try-on with consent, show it, and leave nothing behind.
//
// Address: ?store=… &camera=… choose the camera; &idle=SECONDS ends a session that nobody stands before (0: never);
// #token=… lets it call the compositor.

import { compositor } from './client.js';
import { takeToken } from './credentials.js';
import { Backoff } from './backoff.js';
import { Details } from './details.js';
import { byId, setData, setImage, setText } from './elements.js';
import { FinePicture } from './fine_picture.js';
import { Code } from './grpc_web.js';
import { State } from './messages.js';
import { Mirror } from './mirror.js';
import { Outfit } from './outfit.js';
import { AWAY, present } from './presentation.js';
import { pictureShape } from './shape.js';
import { Stats } from './stats.js';
import { TryOn } from './try_on.js';
import { Wardrobe } from './wardrobe.js';

const query = new URLSearchParams(location.search);
/** Seconds without anybody in view before the mirror asks, and that it then waits for an answer. */
const IDLE_S = Number(query.get('idle') ?? 30);
const ANSWER_S = 15;
/** Seconds that a user waits for a mirror that is not live, whatever the reason, before the mirror asks. */
const ABANDONED_S = 180;
/** Picture figures and ages are rewritten this often, ms. */
const TICK_MS = 200;
/** Several touches in a row become one request, ms. */
const CHOICE_MS = 180;
/** A glass that is dragged to another shape is done after this, ms. */
const RESHAPE_MS = 300;
/** Hosts that only this machine reaches. */
const LOOPBACK = /^(localhost|127\..*|\[::1\])$/;

const client = compositor('', takeToken({ location, history, store: sessionStorage }));
const outfit = new Outfit();
const details = new Details();
const finePicture = new FinePicture();
const wardrobe = new Wardrobe(outfit, choiceChanged);
const stage = byId('stage');
const NOTHING = { link: 'opening', retryAt: null, state: 0, reason: 0, degradedAge: 0, shownAt: null, exposedAt: null, measured: false, error: null };

let session = null; // { tryOn, known, stats, picture, revision, fitting, awaySince }
let listing = new AbortController();

const mirror = new Mirror(byId('glass'), {
  shown(picture, now, decodeMs) {
    if (!session) return;
    session.stats.shown(picture, now, decodeMs);
    session.picture = picture;
    session.known.shownAt = now;
    // What the camera saw is older than the drawing of it by what the chain took.
    session.known.exposedAt = now - (Number.isFinite(picture.latency_ms) ? Math.max(0, picture.latency_ms) : 0);
    const on = session.revision !== null && picture.state === State.LIVE && picture.outfit_revision >= session.revision;
    if (on && session.fitting.size > 0) {
      session.fitting = new Set();
      wardrobe.update();
    }
    refresh();
  },
  missed: () => session?.stats.missed(),
  failed: (error) => console.warn('a picture could not be decoded:', error.message),
});

// ── the session ──────────────────────────────────────────────────────────────────────────────────────────────────

/** Shape of the pictures that the glass shows now; `{}` for the camera's. */
function glassShape() {
  if (stage.classList.contains('whole')) return {};
  return pictureShape(stage.clientWidth * devicePixelRatio, stage.clientHeight * devicePixelRatio);
}

let shown = '{}';
let settling = null;

/** Asks for pictures of the glass's shape once it has stopped changing. */
function reshape() {
  clearTimeout(settling);
  settling = setTimeout(() => {
    const wanted = JSON.stringify(glassShape());
    if (wanted === shown) return;
    shown = wanted;
    session?.tryOn.reshape();
  }, RESHAPE_MS);
}
new ResizeObserver(reshape).observe(stage);

function start() {
  if (session) return;
  const mine = { known: { ...NOTHING }, stats: new Stats(), picture: null, revision: null, fitting: new Set(), awaySince: null };
  session = mine;
  mine.tryOn = new TryOn({
    client,
    camera: { store: query.get('store') ?? '', camera: query.get('camera') ?? '' },
    garments: () => outfit.choices(),
    shape: glassShape,
    on: (event) => session === mine && heard(event),
  });
  showScreen('fitting');
  refresh();
}

/** Ends the try-on and wipes everything that shows the user. */
function finish() {
  if (!session) return;
  const { tryOn } = session;
  session = null;
  clearTimeout(choiceTimer);
  tryOn.close();
  mirror.clear();
  closePhoto();
  byId('still').close();
  outfit.clear();
  wardrobe.update();
  details.show(false);
  byId('details-toggle').setAttribute('aria-expanded', 'false');
  byId('fit-colors').setAttribute('aria-pressed', 'false');
  showScreen('welcome');
}

function heard(event) {
  const { known } = session;
  if (event.link === 'withdrawn') return finish();
  if (event.kind === 'link') {
    known.link = event.link;
    known.error = event.error ?? null;
    if (event.link === 'waiting') {
      known.retryAt = performance.now() + event.retryIn * 1000;
      // The next opening says what is worn and counts revisions anew.
      if (session.revision !== null) session.revision = 0n;
    }
  } else {
    known.link = 'streaming';
    known.retryAt = null;
    const said = event.picture ?? event.status;
    known.state = said.state;
    known.reason = said.reason;
    if (known.state === State.LIVE) known.measured = true;
    else if (known.state === State.DEGRADED && AWAY.has(known.reason)) known.measured = false;
    known.degradedAge = event.picture ? said.degraded_age : said.state === State.DEGRADED ? said.age : 0;
    if (event.picture) mirror.offer(event.picture);
  }
  refresh();
}

// ── what is worn ─────────────────────────────────────────────────────────────────────────────────────────────────

let choiceTimer = null;

function choiceChanged() {
  if (!session) return;
  const mine = session;
  mine.revision = null;
  mine.fitting = new Set(outfit.choices().map((c) => c.garment));
  wardrobe.update(mine.fitting);
  clearTimeout(choiceTimer);
  choiceTimer = setTimeout(() => sendChoice(mine), CHOICE_MS);
}

async function sendChoice(mine) {
  try {
    const revision = await mine.tryOn.choose();
    if (revision !== null) mine.revision = revision;
  } catch (error) {
    if (session !== mine || error.code === Code.CANCELLED) return;
    const violation = error.violations?.[0];
    if (error.code === Code.INVALID_ARGUMENT) {
      mine.fitting = new Set();
      wardrobe.update();
      toast(violation ? `That can’t be worn: ${violation.description || violation.field}` : 'That can’t be worn.');
    } else {
      // The wish is kept: by the compositor when it answered, by this page's next opening when it did not.
      toast('The fitting room is not answering. Your choice is kept.');
    }
  }
}

/** Asks until the wardrobe is known; it is the same for every user. */
async function loadWardrobe() {
  listing = new AbortController();
  const backoff = new Backoff();
  for (;;) {
    try {
      const { garments } = await client.listGarmentChoices({ signal: listing.signal });
      outfit.setLibrary(garments);
      wardrobe.fill();
      wardrobe.say('There is nothing to wear here yet.');
      byId('readiness').hidden = true;
      return;
    } catch (error) {
      if (error.code === Code.CANCELLED) return;
      const refused = [Code.UNAUTHENTICATED, Code.PERMISSION_DENIED].includes(error.code);
      wardrobe.say(refused ? 'This mirror has no valid token.' : 'The wardrobe does not answer yet. It opens by itself.');
      setText(byId('readiness'), refused ? 'This mirror has no valid token: open the whole address, with what follows #.' : 'The mirror is getting ready…');
      byId('readiness').hidden = false;
      await new Promise((next) => setTimeout(next, backoff.next(error.retryAfter) * 1000));
    }
  }
}

// ── what is shown ────────────────────────────────────────────────────────────────────────────────────────────────

let announced = '';
let refreshing = false;

/** At most once a frame. */
function refresh() {
  if (refreshing) return;
  refreshing = true;
  requestAnimationFrame(() => {
    refreshing = false;
    if (session) show(session);
  });
}

function show({ known, stats, picture, fitting }) {
  const now = performance.now();
  const said = present(known, now);
  setData(stage, 'tone', said.tone);
  setData(stage, 'dim', said.dim && known.shownAt !== null ? said.dim : null);
  setData(stage, 'guide', said.guide ? '' : null);
  if (said.blank && stage.dataset.blank === undefined) mirror.clear();
  setData(stage, 'blank', said.blank ? '' : null);

  const dressing = said.tone === 'live' && fitting.size > 0;
  setText(byId('pill-text'), dressing ? 'Putting it on' : said.tone === 'degraded' || said.tone === 'down' ? 'Degraded' : said.title);
  byId('notice').hidden = said.tone === 'live' || (said.tone === 'busy' && said.hint === '');
  setText(byId('notice-title'), said.title);
  setText(byId('notice-hint'), said.hint);
  setText(byId('notice-age'), said.age);
  byId('retry').hidden = known.link !== 'waiting';
  byId('shutter').disabled = said.dim === 'hard' || known.shownAt === null;
  // Spoken once per change; ages and countdowns are for the eye.
  if (said.title !== announced) {
    announced = said.title;
    setText(byId('announce'), said.tone === 'live' ? 'The mirror is live.' : `${said.title}. ${said.hint}`);
  }

  const summary = stats.summary(now);
  setText(byId('figures'), summary.rate ? `${Math.round(summary.rate)} fps · ${Math.round(summary.p50)} ms` : '');
  details.update(summary, picture);
  wardrobe.sayFit(picture?.fit ?? []);
  watchIdle(known, said.tone, now);
}

function showScreen(name) {
  document.body.dataset.screen = name;
  byId('welcome').hidden = name !== 'welcome';
  byId('fitting').hidden = name !== 'fitting';
  const first = name === 'welcome' ? byId('start') : byId('garments').querySelector('button') ?? byId('finish');
  first.focus({ preventScroll: true });
  if (name === 'welcome') setText(byId('announce'), 'Session finished. Nothing was stored.');
  announced = '';
}

/** A mirror that nobody stands before, or that has shown nothing for long, asks and then clears itself for the next. */
function watchIdle(known, tone, now) {
  const still = byId('still');
  if (tone === 'live' || IDLE_S <= 0) {
    session.awaySince = null;
    if (still.open) still.close();
    return;
  }
  session.awaySince ??= now;
  const away = known.link === 'streaming' && known.state === State.DEGRADED && AWAY.has(known.reason);
  const patience = away ? IDLE_S : Math.max(IDLE_S, ABANDONED_S);
  const left = patience + ANSWER_S - (now - session.awaySince) / 1000;
  if (left <= 0) finish();
  else if (left <= ANSWER_S) {
    if (!still.open) still.showModal();
    setText(byId('still-count'), String(Math.ceil(left)));
  } else if (still.open) still.close();
}

function goOn() {
  if (session) session.awaySince = performance.now();
  byId('still').close();
}

let toastTimer = null;

function toast(text) {
  const element = byId('toast');
  element.hidden = false;
  setText(element, text);
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => { element.hidden = true; }, 5000);
}

// ── the photo ────────────────────────────────────────────────────────────────────────────────────────────────────

/** Offers the newest picture to a phone: the link is in a QR code, works once, and nothing is saved on this machine. */
async function takePhoto() {
  const mine = session;
  if (!mine || byId('shutter').disabled || byId('photo').open) return;
  try {
    const { picture, url, qr_svg: qr, seconds } = await mine.tryOn.offerPhoto();
    if (session !== mine || !picture) return;
    setImage(byId('photo-image'), picture.image, 'image/jpeg');
    setImage(byId('photo-code'), qr, 'image/svg+xml');
    finePicture.reset(outfit.choices().length > 0);
    setText(byId('photo-minutes'), String(Math.round(seconds / 60)));
    // A phone does not reach the loopback address of another machine.
    const isLocal = LOOPBACK.test(new URL(url).hostname);
    byId('photo-local').hidden = !isLocal;
    if (isLocal) byId('photo-link').href = url;
    byId('photo').showModal();
  } catch (error) {
    if (session === mine && error.code !== Code.CANCELLED) toast('There is no fresh picture to keep. Try again in a moment.');
  }
}

/** This page's copy is forgotten at once; the one behind the link with its time, its use or the session. */
function closePhoto() {
  finePicture.reset();
  setImage(byId('photo-image'));
  setImage(byId('photo-code'));
  byId('photo-link').removeAttribute('href');
  if (byId('photo').open) byId('photo').close();
}

// ── touch and keys ───────────────────────────────────────────────────────────────────────────────────────────────

function toggleDetails() {
  details.show(!details.open);
  byId('details-toggle').setAttribute('aria-expanded', String(details.open));
  refresh();
}

/** Garments in the colours of their fit: red tight, green fitted, blue loose. */
async function toggleFitColors() {
  const button = byId('fit-colors');
  const show = button.getAttribute('aria-pressed') !== 'true';
  button.setAttribute('aria-pressed', String(show));
  try {
    await session?.tryOn.showFit(show);
  } catch (error) {
    if (error.code !== Code.CANCELLED) toast('The mirror is not answering. The colours come when it is back.');
  }
}

function toggleFit() {
  byId('fit').setAttribute('aria-pressed', String(stage.classList.toggle('whole')));
  reshape();
}

byId('start').addEventListener('click', start);
byId('finish').addEventListener('click', finish);
byId('still-no').addEventListener('click', finish);
byId('still-yes').addEventListener('click', goOn);
byId('still').addEventListener('cancel', goOn);
byId('retry').addEventListener('click', () => session?.tryOn.retryNow());
byId('shutter').addEventListener('click', takePhoto);
byId('fine-start').addEventListener('click', () => session && finePicture.take(session.tryOn));
byId('photo-close').addEventListener('click', closePhoto);
byId('photo').addEventListener('close', closePhoto);
byId('fit').addEventListener('click', toggleFit);
byId('details-toggle').addEventListener('click', toggleDetails);
byId('fit-colors').addEventListener('click', toggleFitColors);

document.addEventListener('keydown', (event) => {
  if (!session || event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return;
  const act = { s: takePhoto, d: toggleDetails, f: toggleFit }[event.key.toLowerCase()];
  if (act) {
    event.preventDefault();
    act();
  }
});
// A touch screen's long press must not offer to save the picture or leave the page.
document.addEventListener('contextmenu', (event) => event.preventDefault());
// Told at once, a compositor frees the camera's session at once; it would notice by itself later.
addEventListener('pagehide', () => session?.tryOn.close({ keepalive: true }));
addEventListener('pageshow', (event) => event.persisted && finish());

// A new token typed into the address bar loads no page by itself.
addEventListener('hashchange', () => location.reload());

setInterval(refresh, TICK_MS);
loadWardrobe();
