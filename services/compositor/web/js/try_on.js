// One try-on as the page sees it: open, stream, and when the line breaks, wait and open again. Draws nothing.

import { Code, RpcError } from './grpc_web.js';
import { Codec, End, State } from './messages.js';
import { Backoff } from './backoff.js';

/** The contract: no message for a second means that the compositor is gone. One more for a busy network, ms. */
export const SILENCE_MS = 2000;

/** Messages on the way before the first acknowledgement is back: a network of 100 ms at 30 a second. */
const MAX_UNACKNOWLEDGED = 4;

/** Answers that another try cannot change. */
const HOPELESS = new Set([Code.INVALID_ARGUMENT, Code.FAILED_PRECONDITION, Code.UNAUTHENTICATED, Code.PERMISSION_DENIED]);

const sleep = (ms, signal) =>
  new Promise((resolve) => {
    const timer = setTimeout(done, ms);
    function done() {
      clearTimeout(timer);
      signal.removeEventListener('abort', done);
      resolve();
    }
    signal.addEventListener('abort', done);
    if (signal.aborted) done();
  });

/** Random, unguessable, in the characters that an id may have. */
export function drawId() {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return `web-${Array.from(bytes, (b) => b.toString(16).padStart(2, '0')).join('')}`;
}

/**
 * Calls `on(event)` with
 *   { kind: 'link', link: 'opening' | 'streaming' | 'waiting' | 'refused' | 'withdrawn' | 'closed', retryIn?, error?, tries? }
 *   { kind: 'picture', picture } and { kind: 'status', status }, in the stream's order.
 */
export class TryOn {
  #stop = new AbortController();
  #wake = new AbortController();
  #shaped = new AbortController();
  #choice = 0;
  #fit = false;
  #withdrawn = false;

  constructor({ client, on, garments, shape = () => ({}), camera = {}, backoff = new Backoff(), silenceMs = SILENCE_MS }) {
    this.client = client;
    this.on = on;
    this.garments = garments;
    this.shape = shape;
    this.camera = camera;
    this.backoff = backoff;
    this.silenceMs = silenceMs;
    this.id = drawId();
    this.finished = this.#run();
  }

  async #run() {
    const stop = this.#stop.signal;
    while (!stop.aborted) {
      let error = null;
      try {
        this.on({ kind: 'link', link: 'opening', tries: this.backoff.tries });
        await this.#openAndStream(stop);
      } catch (caught) {
        error = caught;
      }
      if (stop.aborted) break;
      if (this.#withdrawn) {
        // Somebody else withdrew the consent that this page was given: it must ask anew.
        this.on({ kind: 'link', link: 'withdrawn' });
        return;
      }
      if (error instanceof RpcError && HOPELESS.has(error.code)) {
        this.on({ kind: 'link', link: 'refused', error });
        return;
      }
      const delay = this.backoff.next(error?.retryAfter ?? null);
      this.on({ kind: 'link', link: 'waiting', retryIn: delay, error, tries: this.backoff.tries });
      this.#wake = new AbortController();
      await sleep(delay * 1000, AbortSignal.any([stop, this.#wake.signal]));
    }
    this.on({ kind: 'link', link: 'closed' });
  }

  async #openAndStream(stop) {
    const { store = '', camera = '' } = this.camera;
    // A TryOn exists only after somebody has touched Start, below the words that say what that means.
    const request = { try_on_id: this.id, store, camera, garments: this.garments(), consent: { given: true } };
    const opened = await this.client.openTryOn(request, { signal: stop });
    // A try-on that outlived our connection still wears what it wore: say again what is wanted.
    if (!opened.created) await this.#choose();
    if (this.#fit) await this.showFit(true);

    do {
      this.#shaped = new AbortController();
      await this.#stream(stop, this.#shaped.signal);
    } while (this.#shaped.signal.aborted && !stop.aborted);
  }

  /** Reads pictures until the stream ends, breaks, or another shape is wanted. */
  async #stream(stop, shaped) {
    const line = new AbortController();
    const signal = AbortSignal.any([stop, line.signal, shaped]);
    let watchdog = null;
    const heard = () => {
      clearTimeout(watchdog);
      watchdog = setTimeout(() => line.abort(), this.silenceMs);
    };
    heard();
    try {
      const wanted = { try_on_id: this.id, max_unacknowledged: MAX_UNACKNOWLEDGED, ...this.shape() };
      for await (const event of this.client.streamFrames(wanted, { signal })) {
        heard();
        this.backoff.reset();
        this.#acknowledge(event, signal);
        if (event.picture) this.on({ kind: 'picture', picture: event.picture });
        if (event.status) this.on({ kind: 'status', status: event.status });
        if (event.status?.state === State.CLOSED) this.#withdrawn = event.status.end === End.WITHDRAWN;
        if (event.status?.state === State.DRAINING || event.status?.state === State.CLOSED) break;
      }
    } catch (error) {
      if (shaped.aborted) return;
      if (line.signal.aborted && !stop.aborted) throw new RpcError(Code.UNAVAILABLE, 'nothing was heard from the mirror');
      throw error;
    } finally {
      clearTimeout(watchdog);
    }
  }

  /** Streams again in the shape that is wanted now. */
  reshape() {
    this.#shaped.abort();
  }

  /** The next acknowledgement covers one that is lost. */
  #acknowledge({ stream, number }, signal) {
    this.client.acknowledgeFrames({ try_on_id: this.id, stream, number }, { signal }).catch(() => {});
  }

  /** Sends the wanted garments; of several quick choices only the last one's answer counts (null for the others). */
  async #choose() {
    this.#choice += 1;
    const mine = this.#choice;
    const request = { try_on_id: this.id, garments: this.garments() };
    const answer = await this.client.chooseGarments(request, { signal: this.#stop.signal });
    return mine === this.#choice ? answer.outfit_revision : null;
  }

  /** Revision that pictures will show, null when a later choice overtook this one. Throws RpcError. */
  choose() {
    return this.#choose();
  }

  /** Garments in the colours of their fit, also after the line broke. */
  async showFit(show) {
    this.#fit = show;
    await this.client.showFit({ try_on_id: this.id, show }, { signal: this.#stop.signal });
  }

  /** The newest picture, and a link to it that a phone may follow once. */
  offerPhoto() {
    return this.client.offerPhoto({ try_on_id: this.id }, { signal: this.#stop.signal });
  }

  /** Steps of a finer drape, then its picture. Ends with the try-on or `signal`. */
  takeFinePicture(signal) {
    const request = { try_on_id: this.id, codec: Codec.JPEG };
    return this.client.takeFinePicture(request, { signal: AbortSignal.any([this.#stop.signal, signal]) });
  }

  /** Tries at once instead of at the end of the wait. */
  retryNow() {
    this.backoff.reset();
    this.#wake.abort();
  }

  /**
   * Withdraws the consent: ends it here and in every service. Never throws: a compositor that can't be told stops the
   * camera by itself once nobody streams.
   */
  async close({ keepalive = false } = {}) {
    if (this.#stop.signal.aborted) return;
    this.#stop.abort();
    await this.client.withdrawConsent({ try_on_id: this.id }, { keepalive }).catch(() => {});
  }
}
