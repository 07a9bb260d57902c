// Shape of the pictures that a page asks for.

import { Framing } from './messages.js';

/** Longest side of an upright picture: twice a camera's rows, beyond which a mirror of two cores loses its rate. */
const LONGEST = 960;

/**
 * An upright glass asks for upright pictures, which follow the person; others get the camera's.
 * @param {number} width of the glass, device pixels
 * @param {number} height of the glass, device pixels
 */
export function pictureShape(width, height) {
  if (!(width > 0 && height > width)) return {};
  const scale = Math.min(1, LONGEST / height);
  const even = (side) => Math.max(16, 2 * Math.round((side * scale) / 2));
  return { width: even(width), height: even(height), framing: Framing.COVER };
}
