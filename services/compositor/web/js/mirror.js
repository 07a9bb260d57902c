// The glass: encoded pictures in, the newest one drawn. A picture that is overtaken while it waits is counted, not drawn.

import { Codec } from './messages.js';

const TYPE = { [Codec.JPEG]: 'image/jpeg', [Codec.PNG]: 'image/png' };

export class Mirror {
  #waiting = null;
  #busy = false;
  #generation = 0;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ shown(picture, now: number, decodeMs: number): void, missed(): void, failed(error: Error): void }} on
   */
  constructor(canvas, on) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d', { alpha: false });
    this.on = on;
  }

  /** Takes the newest picture; returns at once. */
  offer(picture) {
    if (this.#waiting) this.on.missed();
    this.#waiting = { picture, at: performance.now() };
    if (!this.#busy) this.#drain();
  }

  async #drain() {
    this.#busy = true;
    while (this.#waiting) {
      const { picture, at } = this.#waiting;
      this.#waiting = null;
      const generation = this.#generation;
      try {
        const blob = new Blob([picture.image], { type: TYPE[picture.codec] ?? TYPE[Codec.JPEG] });
        const bitmap = await createImageBitmap(blob);
        if (generation === this.#generation) this.#draw(bitmap, picture, at);
        bitmap.close();
      } catch (error) {
        this.on.failed(error);
      }
      // One picture for each refresh of the screen: what arrives in between replaces what waits.
      await new Promise((next) => requestAnimationFrame(next));
    }
    this.#busy = false;
  }

  #draw(bitmap, picture, at) {
    const { canvas } = this;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    this.context.drawImage(bitmap, 0, 0);
    canvas.dataset.sequence = String(picture.frame?.sequence ?? '');
    const now = performance.now();
    this.on.shown(picture, now, now - at);
  }

  /** Wipes the glass and forgets what waits: the next user must not see the last one. */
  clear() {
    this.#generation += 1;
    this.#waiting = null;
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    delete this.canvas.dataset.sequence;
  }
}
