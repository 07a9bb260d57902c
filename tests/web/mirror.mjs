// The page in a real browser, as a user uses it.
//
//   node mirror.mjs URL [--out DIR] [--break URL --mend URL | --stdio] [--rounds N] [--timeout SECONDS] [--fine]
//   node mirror.mjs --mock [--out DIR]
//
// Opens the page, starts a try-on, sees 30 different pictures, changes a garment, takes a photo, asks for its finer
// picture (with a real chain only after --fine, for it takes a minute and may be refused in words), closes the dialog while
// one is in progress, sees «Degraded» when the chain is broken and «Live» when it is mended, finishes. Nothing may be asked
// of another host and nothing but the broken connections themselves may be logged as an error.
// Who breaks the chain: a POST to the --break and --mend addresses; or with --stdio whoever started this, asked by a
// line "BREAK" or "MEND" on standard output and answering with any line on standard input; without either that part is
// not judged. Ends with 0 and "PASSED", or says what was missing.

import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { parseArgs } from 'node:util';
import { chromium } from 'playwright-core';

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    out: { type: 'string', default: 'target/browser' },
    break: { type: 'string' },
    mend: { type: 'string' },
    stdio: { type: 'boolean', default: false },
    mock: { type: 'boolean', default: false },
    fine: { type: 'boolean', default: false },
    rounds: { type: 'string', default: '1' },
    // Seconds for each thing waited for; software rendering of a debug build on two busy cores is slow.
    timeout: { type: 'string', default: '60' },
    chromium: { type: 'string', default: process.env.CHROMIUM ?? '/usr/bin/chromium' },
  },
});

const PICTURES = 30;
const TIMEOUT_MS = Number(options.timeout) * 1000;
/** For a finer drape beside a live one. */
const FINE_MS = Math.max(TIMEOUT_MS, 180_000);

let mock = null;
let url = positionals[0];
if (options.mock) {
  const { startMock } = await import('./mock.mjs');
  mock = await startMock({});
  url = mock.url;
}
if (!url) {
  console.error('usage: node mirror.mjs URL [--out DIR] [--break URL --mend URL | --stdio]   or   --mock');
  process.exit(64);
}
const origin = new URL(url).origin;
mkdirSync(options.out, { recursive: true });

const answers = options.stdio ? createInterface({ input: process.stdin })[Symbol.asyncIterator]() : null;
const canBreak = options.stdio || mock || (options.break && options.mend);

async function tell(what) {
  if (mock) mock.control(what);
  else if (options.stdio) {
    console.log(what.toUpperCase());
    await answers.next();
  } else await fetch(options[what], { method: 'POST' });
}

function must(condition, what) {
  if (!condition) throw new Error(what);
  console.log(`ok  ${what}`);
}

const browser = await chromium.launch({
  executablePath: options.chromium,
  args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
let page = null;
let failed = null;
try {
  const context = await browser.newContext({ viewport: { width: 1080, height: 1920 }, reducedMotion: 'reduce' });
  page = await context.newPage();
  page.setDefaultTimeout(TIMEOUT_MS);
  // Pictures that the page made and has not forgotten.
  await page.addInitScript(() => {
    window.pictures = new Set();
    const { createObjectURL, revokeObjectURL } = URL;
    URL.createObjectURL = (blob) => {
      const made = createObjectURL.call(URL, blob);
      window.pictures.add(made);
      return made;
    };
    URL.revokeObjectURL = (made) => {
      window.pictures.delete(made);
      revokeObjectURL.call(URL, made);
    };
  });
  const foreign = [];
  const errors = [];
  const requests = new Map();
  let broken = false;
  page.on('request', (request) => {
    const target = new URL(request.url());
    if (target.protocol !== 'blob:' && target.origin !== origin) foreign.push(request.url());
    requests.set(target.pathname, (requests.get(target.pathname) ?? 0) + 1);
  });
  page.on('pageerror', (error) => errors.push(`uncaught: ${error.message}`));
  page.on('console', (message) => {
    // A browser logs each failed request itself; while we break the chain that is what should happen.
    const expected = broken && /Failed to load resource/.test(message.text());
    if (message.type() === 'error' && !expected) errors.push(`${message.text()} (${message.location().url})`);
  });
  const shot = (name) => page.screenshot({ path: join(options.out, `${name}.png`) });
  const waitTone = (tone) => page.waitForSelector(`#stage[data-tone="${tone}"]`);

  await page.goto(url);
  await page.waitForSelector('[data-garment]', { state: 'attached' });
  await shot('1-welcome');
  must(/nothing is stored/i.test(await page.textContent('#consent')), 'the page asks for consent before it shows anything');
  must((requests.get('/tryon.v1.CompositorService/OpenTryOn') ?? 0) === 0, 'no try-on is opened before consent');
  must(await page.getByRole('button', { name: 'Start' }).isVisible(), 'Start can be reached by role and name');

  await page.focus('#start');
  await page.keyboard.press('Enter');
  await waitTone('live');
  must(true, 'a try-on reaches Live');

  await page.evaluate((wanted) => {
    // Pictures are told apart by their pixels, not by what the page says of them.
    const glass = document.getElementById('glass');
    const seen = new Set();
    window.distinct = { seen, done: false };
    const small = new OffscreenCanvas(64, 48);
    const context = small.getContext('2d', { willReadFrequently: true });
    const look = () => {
      context.drawImage(glass, 0, 0, 64, 48);
      const { data } = context.getImageData(0, 0, 64, 48);
      let hash = 2166136261;
      for (let i = 0; i < data.length; i += 1) hash = Math.imul(hash ^ data[i], 16777619);
      seen.add(hash);
      if (seen.size >= wanted) window.distinct.done = true;
      else requestAnimationFrame(look);
    };
    look();
  }, PICTURES);
  await page.waitForFunction(() => window.distinct.done);
  must(true, `${PICTURES} different pictures`);

  const cards = await page.$$eval('[data-garment]', (all) => all.map((c) => c.dataset.garment));
  const first = cards.includes('tshirt') ? 'tshirt' : cards[0];
  const worn = () => page.waitForFunction(() => !document.querySelector('[data-fitting]'));
  await page.click(`[data-garment="${first}"]`);
  await page.waitForSelector(`[data-garment="${first}"][aria-pressed="true"]`);
  await worn();
  must(true, `${first} is put on and pictures say so`);
  const other = cards.find((c) => c !== first) ?? first;
  await page.click(`[data-garment="${other}"]`);
  await worn();
  must((requests.get('/tryon.v1.CompositorService/ChooseGarments') ?? 0) >= 2, `the garment is changed: ${other}`);
  await waitTone('live');
  await shot('2-live');
  const sizes = page.getByRole('radiogroup', { name: /size/ }).first().getByRole('radio');
  if ((await sizes.count()) > 1) {
    await sizes.nth(1).check();
    await worn();
    must(true, 'a size is chosen');
  }

  await page.keyboard.press('d');
  await page.waitForFunction(() => Number(document.getElementById('d-rate').textContent) > 0);
  const stages = await page.$$eval('#d-stages th', (all) => all.map((t) => t.textContent));
  must(stages.length >= 3, `latency by stage: ${stages.join(', ')}`);
  console.log(`    ${await page.textContent('#d-rate')} pictures a second, ${await page.textContent('#d-p50')} ms at the half, ${await page.textContent('#d-p99')} ms at 99 %`);
  // Read at once: the table is empty again while garments are put on.
  const shown = await page.waitForFunction(() => {
    const rows = [...document.querySelectorAll('#d-fit tr')].map((t) => t.textContent);
    return document.querySelectorAll('#d-fit .fit').length > 0 && rows;
  });
  const fits = await shown.jsonValue();
  must(fits.length >= 3, `fit by region: ${fits.join(', ')}`);
  const said = await page.$$eval('[data-fit-of]', (all) => all.map((p) => p.textContent).filter((t) => t !== ''));
  must(said.length > 0, `fit in words: ${said.join('; ')}`);
  await page.click('#fit-colors');
  await page.waitForSelector('#fit-colors[aria-pressed="true"]');
  await page.waitForTimeout(600);
  await shot('3-details');
  must((requests.get('/tryon.v1.CompositorService/ShowFit') ?? 0) === 1, 'the fit is asked for in colours');
  await page.click('#fit-colors');
  await page.keyboard.press('d');

  await page.click('#shutter');
  await page.waitForSelector('#photo[open]');
  const isDrawn = (id) => page.waitForFunction((i) => document.getElementById(i).naturalWidth > 0, id);
  await Promise.all([isDrawn('photo-image'), isDrawn('photo-code')]);
  const link = await page.getAttribute('#photo-link', 'href');
  must(/\/photo\/[0-9a-f]+$/.test(link), 'the photo has a link, and its QR code is drawn');
  if (!options.mock) {
    const first = await fetch(link);
    const head = Buffer.from(await first.arrayBuffer()).subarray(0, 3).toString('hex');
    must(head === 'ffd8ff' && (await fetch(link)).status === 404, 'the link gives the photo once');
  }
  await shot('4-photo');
  const FINE_CALL = '/tryon.v1.CompositorService/TakeFinePicture';
  const takeFinePicture = async () => {
    const quick = await page.getAttribute('#photo-image', 'src');
    await page.evaluate(() => {
      const words = document.getElementById('fine-words');
      const bar = document.getElementById('fine-progress');
      window.fine = { words: [], bar: false };
      new MutationObserver(() => {
        window.fine.words.push(words.textContent);
        window.fine.bar ||= getComputedStyle(bar).visibility === 'visible';
      }).observe(words, { childList: true });
    });
    const button = page.getByRole('button', { name: 'Show finer folds' });
    await button.evaluate((one) => { one.click(); one.click(); });
    if (await page.isVisible('#fine-progress')) await shot('4-photo-working');
    await page.waitForSelector('#photo:not([data-working])', { timeout: FINE_MS });
    const { words: progress, bar } = await page.evaluate(() => window.fine);
    const outcome = progress.pop();
    must(requests.get(FINE_CALL) === 1, 'a second press asks for nothing');
    must((bar || !mock) && /^Settling the cloth/.test(progress[0]), `the drape is followed in words: ${progress.join(' ')}`);
    const fine = await page.getAttribute('#photo-image', 'src');
    if (fine === quick) must(!mock && /try again/.test(outcome), `no finer picture this time: «${outcome}»`);
    else {
      await isDrawn('photo-image');
      must(/finer folds/.test(await page.getAttribute('#photo-image', 'alt')), `the finer picture is shown: «${outcome}»`);
      must(await page.evaluate(() => window.pictures.size === 2), 'the quick photo is forgotten for it');
    }
    for (const [width, height] of [[1080, 1920], [1920, 1080], [390, 844]]) {
      await page.setViewportSize({ width, height });
      await shot(`4-photo-fine-${width}x${height}`);
      const fits = await page.evaluate(() => document.getElementById('photo').scrollWidth <= document.getElementById('photo').clientWidth);
      must(fits, `at ${width}×${height} the photo does not stick out of its dialog`);
    }
    await page.setViewportSize({ width: 1080, height: 1920 });
  };
  const isForgotten = () => page.evaluate(() =>
    window.pictures.size === 0 && !document.querySelector('#photo img[src]') && !document.querySelector('#photo[open], #photo[data-working]'));
  if (mock || options.fine) await takeFinePicture();
  await page.click('#photo-close');
  must(await isForgotten(), 'a closed photo is forgotten');

  await page.click('#shutter');
  await page.waitForSelector('#photo[open]');
  const ended = page.waitForEvent('requestfailed', { predicate: (r) => r.url().endsWith(FINE_CALL) }).catch(() => null);
  const wasWorking = await page.evaluate(async () => {
    document.getElementById('fine-start').click();
    await new Promise((next) => setTimeout(next, 200));
    const working = document.getElementById('photo').dataset.working !== undefined;
    document.getElementById('photo-close').click();
    return working;
  });
  must(await isForgotten(), `closed ${wasWorking ? 'while the cloth settles' : 'after the answer'}, the photo is forgotten`);
  if (wasWorking) must((await ended) !== null, 'and the call is cancelled');

  const wearing = () => page.$$eval('[aria-pressed="true"][data-garment]', (all) => all.map((c) => c.dataset.garment).join(', '));
  const before = await wearing();
  for (let round = 1; canBreak && round <= Number(options.rounds); round += 1) {
    broken = true;
    await tell('break');
    const at = Date.now();
    await page.waitForSelector('#stage[data-tone="down"], #stage[data-tone="degraded"]');
    must(true, `round ${round}: the page says so ${Date.now() - at} ms after the chain broke`);
    const title = await page.textContent('#notice-title');
    must(title.startsWith('Degraded: ') && (await page.isVisible('#notice')), `«${title}»`);
    must((await page.textContent('#announce')).startsWith('Degraded: '), 'a screen reader is told');
    must((await page.getAttribute('#stage', 'data-dim')) !== null, 'what is left of the picture is dimmed');
    await page.waitForTimeout(1500);
    await shot(`5-degraded-${round}`);
    await tell('mend');
    const mended = Date.now();
    await waitTone('live');
    await worn();
    must((await wearing()) === before, `live again ${Date.now() - mended} ms after it was mended, wearing ${before}`);
    broken = false;
  }
  if (!canBreak) console.log('--  nobody to break the chain: that part is not judged');

  for (const [width, height] of [[1080, 1920], [1920, 1080], [390, 844]]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(300);
    await shot(`6-${width}x${height}`);
    const small = await page.$$eval('#fitting button, #fitting .chip', (all) => all
      .map((e) => ({ name: e.id || e.textContent, box: e.getBoundingClientRect() }))
      .filter(({ box }) => box.width > 0 && Math.min(box.width, box.height) < 44)
      .map(({ name, box }) => `${name} ${Math.round(box.width)}×${Math.round(box.height)}`));
    must(small.length === 0, `at ${width}×${height} a finger hits everything: 44 pixels or more ${small.join(', ')}`);
    const glass = await page.locator('#stage').boundingBox();
    const share = (glass.width * glass.height) / (width * height);
    must(share > 0.4, `at ${width}×${height} the mirror has ${Math.round(100 * share)} % of the screen`);
    must(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `at ${width}×${height} nothing sticks out`);
  }

  await page.click('#finish');
  await page.waitForSelector('#welcome:not([hidden])');
  await page.waitForTimeout(300);
  must((requests.get('/tryon.v1.CompositorService/WithdrawConsent') ?? 0) === 1, 'finishing withdraws the consent');
  // The tab keeps the mirror's own token for a reload, until it is closed.
  const stored = await page.evaluate(() =>
    [localStorage.length, Object.keys(sessionStorage).filter((k) => k !== 'tryon.token').length, document.cookie.length]);
  must(stored.every((n) => n === 0), 'nothing is stored in the browser');
  const left = await page.evaluate(() => {
    const glass = document.getElementById('glass');
    return glass.getContext('2d').getImageData(0, 0, glass.width, glass.height).data.some((v, i) => i % 4 !== 3 && v !== 0);
  });
  must(!left, 'the glass is wiped');
  must(foreign.length === 0, `nothing is asked of another host${foreign.map((f) => ` ${f}`)}`);
  must(errors.length === 0, `no errors in the console${errors.map((e) => `\n      ${e}`).join('')}`);
} catch (error) {
  failed = error;
  await page?.screenshot({ path: join(options.out, 'failed.png') }).catch(() => {});
} finally {
  await browser.close();
  mock?.close();
}
if (failed) {
  console.error(`FAILED: ${failed.message}\n  the screen then: ${join(options.out, 'failed.png')}`);
  process.exit(1);
}
console.log('PASSED');
process.exit(0);
