// The finer picture of the photo dialog: garments draped on finer meshes, from the request to the picture or a refusal.

import { byId, setData, setImage, setText } from './elements.js';
import { Code } from './grpc_web.js';

const OFFER = 'In the pose you hold as you press. It takes up to a minute, and stepping out of view ends it.';
const DONE = 'Finer folds, in the pose you held. Your phone still gets the quick photo.';

/** Words for the newest drape step, null or zeros before the first. They change once per mesh, so that a screen reader can follow. */
export function progressWords(step) {
  const points = step?.vertex_count ? `: ${step.vertex_count.toLocaleString('en')} points` : '';
  return `Settling the cloth${points}. Stay in view…`;
}

/** One sentence for a call that ended without a picture; the quick photo stays. */
export function failureWords(error) {
  const wait = error?.retryAfter ? `${Math.ceil(error.retryAfter)} s` : 'a moment';
  switch (error?.code) {
    case Code.FAILED_PRECONDITION: return 'The cloth does not hang right for this yet: stand a little differently and try again.';
    case Code.RESOURCE_EXHAUSTED: return `The fitting room is busy: try again in ${wait}.`;
    case Code.ABORTED: return 'It was interrupted: stay in view and try again.';
    default: return `It did not work this time: try again in ${wait}.`;
  }
}

export class FinePicture {
  #call = null;

  constructor() {
    this.dialog = byId('photo');
    this.image = byId('photo-image');
    this.button = byId('fine-start');
    this.words = byId('fine-words');
    this.alt = this.image.alt;
  }

  /** Ends a call in progress and offers a new one, with garments to drape. The image is the caller's. */
  reset(hasGarments = true) {
    this.#call?.abort();
    this.image.alt = this.alt;
    this.button.hidden = !hasGarments;
    this.words.hidden = !hasGarments;
    this.#show(null, OFFER);
  }

  /** Replaces the photo by its finer picture. Does nothing while a call is in progress. */
  async take(tryOn) {
    if (this.#call) return;
    const call = new AbortController();
    this.#show(call, progressWords(null));
    let hasPicture = false;
    let failure = null;
    try {
      for await (const { drape, picture } of tryOn.takeFinePicture(call.signal)) {
        if (this.#call !== call) return;
        if (drape) this.#show(call, progressWords(drape));
        if (picture) {
          setImage(this.image, picture.image, 'image/jpeg');
          this.image.alt = `${this.alt}, with finer folds`;
          hasPicture = true;
        }
      }
    } catch (error) {
      failure = error;
    }
    if (this.#call === call) this.#show(null, hasPicture ? DONE : failureWords(failure));
  }

  #show(call, words) {
    this.#call = call;
    setData(this.dialog, 'working', call ? '' : null);
    // Not `disabled`, which would take the focus of who pressed it.
    this.button.setAttribute('aria-disabled', String(call !== null));
    setText(this.words, words);
  }
}
