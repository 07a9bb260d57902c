// The page's elements by name, and a way to make new ones without markup in strings.

const SVG = 'http://www.w3.org/2000/svg';

export const byId = (id) => {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
};

/** `el('button', { class: 'x', onclick: f }, child, 'text')`; null attributes are left out. */
export function el(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === false) continue;
    if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else made.setAttribute(key, value === true ? '' : value);
  }
  made.append(...children);
  return made;
}

/** A drawing of index.html by its symbol's id. */
export function drawing(id, className) {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('class', className);
  svg.setAttribute('aria-hidden', 'true');
  const use = document.createElementNS(SVG, 'use');
  use.setAttribute('href', `#${id}`);
  svg.append(use);
  return svg;
}

/** Writes only what changed, so that nothing is laid out or announced for nothing. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Shows an encoded picture, none without bytes, and forgets what the image showed before. */
export function setImage(image, bytes = null, type = '') {
  const old = image.getAttribute('src');
  if (bytes) image.src = URL.createObjectURL(new Blob([bytes], { type }));
  else image.removeAttribute('src');
  if (old) URL.revokeObjectURL(old);
}

/** Sets or removes a data attribute. */
export function setData(element, key, value) {
  if (value === false || value === null) delete element.dataset[key];
  else if (element.dataset[key] !== String(value)) element.dataset[key] = String(value);
}
