// How long to wait before the next try: doubling, jittered so that a row of kiosks doesn't knock in step.

/** Seconds. The contract promises pictures within five seconds of a restart, so the ceiling stays below that. */
export const FIRST_DELAY = 0.25;
export const LONGEST_DELAY = 3;

export class Backoff {
  #tries = 0;

  /** @param {() => number} random in [0, 1) */
  constructor(random = Math.random) {
    this.random = random;
  }

  get tries() {
    return this.#tries;
  }

  /** Next delay in seconds; a server's own RetryInfo is a lower bound, but never beyond the ceiling times four. */
  next(retryAfter = null) {
    const full = Math.min(FIRST_DELAY * 2 ** this.#tries, LONGEST_DELAY);
    this.#tries += 1;
    const jittered = full * (0.5 + 0.5 * this.random());
    return Math.max(jittered, Math.min(retryAfter ?? 0, 4 * LONGEST_DELAY));
  }

  reset() {
    this.#tries = 0;
  }
}
