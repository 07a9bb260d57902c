// The wardrobe: a card for each garment, size and colour for each one worn. Reads and changes an Outfit, sends nothing.

import { byId, drawing, el, setData, setText } from './elements.js';
import { fitWords } from './fit.js';
import { css } from './outfit.js';

/** Colours offered beside a garment's own, sRGB. */
const COLORS = [['Ivory', 0xf1ece0], ['Charcoal', 0x33363b], ['Clay', 0xb2553a], ['Sage', 0x74876a], ['Denim', 0x46689a]];

const DRAWINGS = [[/dress|one_piece/, 'g-dress'], [/shoes/, 'g-shoes'], [/skirt/, 'g-skirt'], [/trouser|pant|jean|short|bottom/, 'g-trousers'], [/long|sweater|hoodie|jacket|under/, 'g-longsleeve']];

function drawingOf(info) {
  const found = DRAWINGS.find(([pattern]) => pattern.test(info.name));
  if (found) return found[1];
  return info.category === 'bottom' ? 'g-trousers' : 'g-tshirt';
}

export class Wardrobe {
  #cards = new Map();

  /** @param {import('./outfit.js').Outfit} outfit @param {() => void} changed called after the user changed it */
  constructor(outfit, changed) {
    this.outfit = outfit;
    this.changed = changed;
    this.garments = byId('garments');
    this.options = byId('options');
    this.empty = byId('wardrobe-empty');
  }

  /** The library changed: all cards anew. */
  fill() {
    const { outfit } = this;
    this.#cards = new Map(outfit.library.map((info) => [info.name, this.#card(info)]));
    this.garments.replaceChildren(...this.#cards.values());
    this.empty.hidden = this.#cards.size > 0;
    this.update();
  }

  say(text) {
    setText(this.empty, text);
  }

  #card(info) {
    const toggle = () => {
      this.outfit.toggle(info.name);
      this.update();
      this.changed();
    };
    return el('button', { class: 'garment', type: 'button', 'data-garment': info.name, onclick: toggle },
      drawing(drawingOf(info), 'drawing'),
      el('span', {}, info.title || info.name),
      el('span', { class: 'mark' }, drawing('i-check', 'icon')));
  }

  /** Shows what is worn. `fitting`: garments that are chosen and not on yet. */
  update(fitting = new Set()) {
    for (const [name, card] of this.#cards) {
      const worn = this.outfit.worn(name);
      const color = worn?.color_rgb ?? this.outfit.info(name).color_rgb;
      card.setAttribute('aria-pressed', String(worn !== null && worn !== undefined));
      card.querySelector('.drawing').style.fill = css(color);
      setData(card, 'fitting', fitting.has(name) ? '' : null);
    }
    const worn = this.outfit.library.filter((info) => this.outfit.worn(info.name));
    const key = worn.map((info) => info.name).join();
    if (this.options.dataset.key !== key && this.#cards.size > 0) {
      this.options.dataset.key = key;
      const hint = el('p', { class: 'fine' }, 'Touch a piece to put it on, touch it again to take it off.');
      this.options.replaceChildren(...(worn.length > 0 ? worn.map((info) => this.#option(info)) : [hint]));
    }
  }

  /** How what is worn fits, under its name; `fit` as pictures carry it. */
  sayFit(fit) {
    for (const line of this.options.querySelectorAll('[data-fit-of]')) {
      const worn = fit.find((f) => f.garment === line.dataset.fitOf);
      setText(line, worn ? fitWords(worn) : '');
    }
  }

  #option(info) {
    const choice = this.outfit.worn(info.name);
    const pick = (change) => () => {
      change();
      this.update();
      this.changed();
    };
    const chip = (group, label, checked, more, change) =>
      el('label', { class: `chip ${more.class ?? ''}` },
        el('input', { type: 'radio', name: `${group}-${info.name}`, checked, 'aria-label': more.name ?? null, 'data-value': label, onchange: pick(change) }),
        el('span', {}, more.class ? '' : label));
    const sizes = ['', ...info.sizes].map((size) =>
      chip('size', size || (info.sizes.length > 0 ? 'My size' : 'One size'), choice.size === size, size ? { name: `Size ${size}` } : {}, () => this.outfit.setSize(info.name, size)));
    const colors = [['As made', null], ...COLORS].map(([name, rgb]) => {
      const swatch = chip('color', name, choice.color_rgb === rgb, { class: 'swatch', name }, () => this.outfit.setColor(info.name, rgb));
      swatch.style.setProperty('--swatch', css(rgb ?? info.color_rgb));
      return swatch;
    });
    const title = info.title || info.name;
    return el('div', { class: 'option' },
      el('h3', {}, title),
      el('p', { class: 'fine', 'data-fit-of': info.name }),
      el('div', { class: 'chips', role: 'radiogroup', 'aria-label': `${title}: size` }, ...sizes),
      el('div', { class: 'chips', role: 'radiogroup', 'aria-label': `${title}: colour` }, ...colors));
  }
}
