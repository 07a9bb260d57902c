// What the user wants to wear: at most one garment of each category, inner layers first. Pure.

/** Order of layers: what is not listed goes on top. */
const LAYERS = ['shoes', 'bottom', 'under', 'top'];

const layer = (category) => {
  const at = LAYERS.indexOf(category);
  return at < 0 ? LAYERS.length : at;
};

/** sRGB 0xRRGGBB as CSS. */
export const css = (rgb) => `#${(rgb & 0xffffff).toString(16).padStart(6, '0')}`;

export class Outfit {
  #library = new Map();
  #worn = new Map();

  /** Takes the library as listed; garments that are gone are taken off. Returns whether the outfit changed. */
  setLibrary(garments) {
    this.#library = new Map(garments.map((g) => [g.name, g]));
    const before = this.#worn.size;
    for (const [category, choice] of this.#worn) if (!this.#library.has(choice.garment)) this.#worn.delete(category);
    return this.#worn.size !== before;
  }

  get library() {
    return [...this.#library.values()];
  }

  info(name) {
    return this.#library.get(name);
  }

  /** Puts a garment on in place of the one of its category, or takes it off when it is worn. */
  toggle(name) {
    const info = this.#library.get(name);
    if (!info) return false;
    if (this.#worn.get(info.category)?.garment === name) this.#worn.delete(info.category);
    else this.#worn.set(info.category, { garment: name, size: '', color_rgb: null });
    return true;
  }

  worn(name) {
    const info = this.#library.get(name);
    const choice = info && this.#worn.get(info.category);
    return choice?.garment === name ? choice : null;
  }

  /** Empty lets the service choose. Sizes that the garment does not come in are refused. */
  setSize(name, size) {
    const choice = this.worn(name);
    if (!choice || (size !== '' && !this.#library.get(name).sizes.includes(size))) return false;
    choice.size = size;
    return true;
  }

  /** Null is the garment's own colour. */
  setColor(name, rgb) {
    const choice = this.worn(name);
    if (!choice) return false;
    choice.color_rgb = rgb;
    return true;
  }

  clear() {
    this.#worn.clear();
  }

  /** As the contract wants it. */
  choices() {
    return [...this.#worn]
      .sort(([a], [b]) => layer(a) - layer(b))
      .map(([, c]) => ({ garment: c.garment, size: c.size, ...(c.color_rgb === null ? {} : { color_rgb: c.color_rgb }) }));
  }
}
