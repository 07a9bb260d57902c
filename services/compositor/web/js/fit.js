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
