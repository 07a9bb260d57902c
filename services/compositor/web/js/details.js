// The details panel: rate, latency, drops, fit by region, time by stage. Drawn only while it is open.

import { byId, el, setText } from './elements.js';
import { fitRows } from './fit.js';

const whole = (x) => (Number.isFinite(x) ? String(Math.round(x)) : '–');

/** `CLOTH_DETAIL_*` in words; full detail goes without. */
const DETAIL = ['', '', ', coarser cloth', ', cloth not simulated', ', no garments'];

/** Share of the garments beside the body and where most of it is, from a tenth of a percent on. */
export function offWords(off) {
  if (!off || off.share < 0.001) return '';
  const most = off.parts.reduce((a, b) => (b.share > a.share ? b : a), { part: '', share: 0 });
  return `, ${(off.share * 100).toFixed(1)} % of the garments beside the body${most.part && ` (${most.part})`}`;
}

/** "tracking.solve" → service "tracking", and words for people. */
function stageName(stage) {
  const dot = stage.indexOf('.');
  return { part: dot < 0 ? stage : stage.slice(0, dot), words: stage.replace('.', ' · ').replaceAll('_', ' ') };
}

export class Details {
  #rows = new Map();
  #fit = '';

  constructor() {
    this.panel = byId('details');
    this.stages = byId('d-stages');
    this.trace = byId('d-trace');
  }

  get open() {
    return !this.panel.hidden;
  }

  show(open) {
    this.panel.hidden = !open;
  }

  /** @param {ReturnType<import('./stats.js').Stats['summary']>} summary */
  update(summary, picture) {
    if (!this.open) return;
    setText(byId('d-rate'), summary.rate ? summary.rate.toFixed(1) : '–');
    setText(byId('d-p50'), whole(summary.p50));
    setText(byId('d-p99'), whole(summary.p99));
    setText(byId('d-dropped'), `${summary.dropped} + ${summary.missed}`);
    this.#bars([...summary.stages, ['page.draw', summary.decode]].filter(([, ms]) => Number.isFinite(ms)));
    this.#line(summary.recent);
    this.#fits(picture?.fit ?? []);
    const size = picture ? `${picture.width} × ${picture.height}` : '';
    const cloth = DETAIL[picture?.cloth_detail] ?? '';
    const off = offWords(picture?.off_person);
    setText(byId('d-frame'), picture ? `Exposure ${picture.frame?.sequence ?? '?'}, ${size}, outfit ${picture.outfit_revision}${cloth}${off}` : '');
  }

  #bars(stages) {
    const most = Math.max(1, ...stages.map(([, ms]) => ms));
    const names = stages.map(([name]) => name);
    if (names.join() !== [...this.#rows.keys()].join()) {
      this.#rows = new Map(names.map((name) => {
        const { part, words } = stageName(name);
        const bar = el('span', { class: 'bar', 'data-part': part });
        const ms = el('td');
        return [name, { bar, ms, row: el('tr', {}, el('th', { scope: 'row' }, words), el('td', {}, bar), ms) }];
      }));
      this.stages.replaceChildren(...[...this.#rows.values()].map((r) => r.row));
    }
    for (const [name, ms] of stages) {
      const { bar, ms: cell } = this.#rows.get(name);
      bar.style.transform = `scaleX(${Math.max(0.01, ms / most).toFixed(3)})`;
      setText(cell, `${ms.toFixed(1)} ms`);
    }
  }

  #fits(fit) {
    const rows = fitRows(fit);
    const text = JSON.stringify(rows);
    if (text === this.#fit) return;
    this.#fit = text;
    byId('d-fit-title').hidden = rows.length === 0;
    byId('d-fit').replaceChildren(...rows.map((r) => (r.head
      ? el('tr', {}, el('th', { scope: 'rowgroup', colspan: '6' }, r.head))
      : el('tr', {}, el('th', { scope: 'row' }, r.region), el('td', {}, el('span', { class: 'fit', 'data-fit': r.fit }, r.fit)),
        ...r.cells.map((c) => el('td', {}, c))))));
  }

  /** Latency of the last seconds' pictures, oldest left, from zero. */
  #line(values) {
    const context = this.trace.getContext('2d');
    const { width, height } = this.trace;
    context.clearRect(0, 0, width, height);
    if (values.length < 2) return;
    const top = Math.max(100, ...values) * 1.05;
    context.beginPath();
    values.forEach((v, i) => context.lineTo((i / (values.length - 1)) * width, height - (v / top) * (height - 4) - 2));
    context.strokeStyle = '#e8e2d6';
    context.lineWidth = 3;
    context.lineJoin = 'round';
    context.stroke();
  }
}
