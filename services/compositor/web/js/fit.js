// How garments fit, in words and units.

import { FIT } from './messages.js';

/** Rows of the fit table: garment and size, then region, class, stretch in %, pressure in kPa, room in cm. */
export function fitRows(fit) {
  return fit.flatMap(({ garment, size, regions }) => [
    { head: `${garment.replaceAll('_', ' ')} ${size}` },
    ...regions.map((r) => ({
      region: r.region,
      fit: FIT[r.fit] ?? '',
      cells: [`${(100 * r.stretch).toFixed(0)} %`, `${(r.pressure / 1000).toFixed(1)} kPa`, `${(100 * r.gap).toFixed(1)} cm`],
    })),
  ]);
}

/** Where a garment is not as drawn and by how much, in one line: `tight at the chest (stretched by 18 %)`. */
export function fitWords({ size, regions }) {
  const told = regions.flatMap((r) => {
    const fit = FIT[r.fit] ?? '';
    if (fit === 'tight') return [`tight at the ${r.region} (stretched by ${(100 * r.stretch).toFixed(0)} %)`];
    return fit === 'loose' ? [`loose at the ${r.region} (${(100 * r.gap).toFixed(0)} cm off you)`] : [];
  });
  return regions.length === 0 ? '' : `${size}: ${told.length > 0 ? told.join(', ') : 'fits'}`;
}
