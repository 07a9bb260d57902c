// Rates and latencies over the last few seconds, for the details panel. Pure: times are given, nothing is asked.

/** Window of the figures, ms. */
export const WINDOW_MS = 4000;

/** Nearest-rank percentile of an unsorted list; NaN when empty. */
export function percentile(values, p) {
  if (values.length === 0) return NaN;
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.max(0, Math.ceil((p / 100) * sorted.length) - 1))];
}

export class Stats {
  #shown = [];
  #stages = new Map();
  #missed = 0;
  #droppedByServer = 0;

  /** A picture reached the glass. `decodeMs` from its arrival to the drawn canvas. */
  shown(picture, now, decodeMs) {
    this.#shown.push({ at: now, latency: picture.latency_ms, decode: decodeMs });
    while (this.#shown.length > 0 && this.#shown[0].at < now - WINDOW_MS) this.#shown.shift();
    this.#droppedByServer = Number(picture.dropped);
    // Smoothed, so that the bars can be read; a stage that is no longer reported disappears.
    const next = new Map();
    for (const { stage, ms } of picture.stages) {
      // A service's total repeats its parts.
      const part = stage.slice(0, stage.indexOf('.') + 1);
      if (stage === `${part}total` && picture.stages.some((s) => s.stage !== stage && s.stage.startsWith(part))) continue;
      const before = this.#stages.get(stage);
      next.set(stage, (next.get(stage) ?? 0) + (before === undefined ? ms : before + 0.15 * (ms - before)));
    }
    this.#stages = next;
  }

  /** A picture arrived and a newer one overtook it before it was drawn. */
  missed() {
    this.#missed += 1;
  }

  /** @returns {{rate, p50, p99, decode, missed, dropped, stages: [string, number][], recent: number[]}} */
  summary(now) {
    const recent = this.#shown.filter((s) => s.at >= now - WINDOW_MS);
    const span = recent.length > 1 ? recent.at(-1).at - recent[0].at : 0;
    const fresh = recent.length > 0 && now - recent.at(-1).at < 1000;
    return {
      rate: span > 0 && fresh ? ((recent.length - 1) * 1000) / span : 0,
      p50: percentile(recent.map((s) => s.latency), 50),
      p99: percentile(recent.map((s) => s.latency), 99),
      decode: percentile(recent.map((s) => s.decode), 50),
      missed: this.#missed,
      dropped: this.#droppedByServer,
      stages: [...this.#stages],
      recent: recent.map((s) => s.latency),
    };
  }
}
