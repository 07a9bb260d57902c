// How garments fit, in words and units.

import { FIT } from './messages.js';

/** In place of the size while that of the body has not settled. */
const MEASURING = 'measuring your size';

/** Rows of the fit table: garment and size, then region, class, stretch in %, pressure in kPa, distance from the skin in
 * cm, and how much longer than the body the garment is around it, in cm. */
export function fitRows(fit) {
  return fit.flatMap(({ garment, size, regions, provisional = false }) => [
    { head: `${garment.replaceAll('_', ' ')} ${provisional ? MEASURING : size}` },
    ...regions.map((r) => ({
      region: r.region,
      fit: FIT[r.fit] ?? '',
      cells: [`${(100 * r.stretch).toFixed(0)} %`, `${(r.pressure / 1000).toFixed(1)} kPa`, `${(100 * r.gap).toFixed(1)} cm`, around(r.ease ?? null)],
    })),
  ]);
}

/** Where a garment is not as drawn and by how much, and where it ends, in one line:
 * `S: 2 cm too tight at the chest, ends 4 cm below the crotch`. Nothing of it is told before the size is known. */
export function fitWords({ size, regions, hem_above: above = null, hem_mark: mark = '', provisional = false }) {
  if (provisional) return regions.length === 0 ? '' : `${MEASURING[0].toUpperCase()}${MEASURING.slice(1)} …`;
  const told = regions.flatMap((r) => {
    const fit = FIT[r.fit] ?? '';
    const known = Number.isFinite(r.ease ?? NaN) && Number.isFinite(r.ease_needed ?? NaN);
    const lacks = known ? cm(r.ease_needed - r.ease) : 0;
    if (lacks > 0) return [`${lacks} cm too tight at the ${r.region}`];
    if (fit === 'tight') return [`tight at the ${r.region} (stretched by ${(100 * r.stretch).toFixed(0)} %)`];
    if (fit !== 'loose') return [];
    return [known ? `loose at the ${r.region} (${cm(r.ease)} cm of room)` : `loose at the ${r.region} (${cm(r.gap)} cm off you)`];
  });
  if (regions.length === 0) return '';
  const length = above === null || !mark ? [] : [`ends ${where(above, mark)}`];
  return `${size ? `${size}: ` : ''}${[...(told.length > 0 ? told : ['fits']), ...length].join(', ')}`;
}

const around = (ease) => (ease === null ? '' : `${ease < 0 ? '−' : '+'}${Math.abs(100 * ease).toFixed(0)} cm`);
const cm = (metres) => Math.round(100 * metres);

function where(above, mark) {
  const by = Math.abs(cm(above));
  return by === 0 ? `at ${mark}` : `${by} cm ${above > 0 ? 'above' : 'below'} ${mark}`;
}
