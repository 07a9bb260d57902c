// The page's decisions without a page: what is said, when to try again, what is worn, which figures are shown.

import assert from 'node:assert/strict';
import test from 'node:test';

import { Backoff, FIRST_DELAY, LONGEST_DELAY } from '../../services/compositor/web/js/backoff.js';
import { takeToken } from '../../services/compositor/web/js/credentials.js';
import { offWords } from '../../services/compositor/web/js/details.js';
import { failureWords, progressWords } from '../../services/compositor/web/js/fine_picture.js';
import { fitRows, fitWords } from '../../services/compositor/web/js/fit.js';
import { Code, RpcError } from '../../services/compositor/web/js/grpc_web.js';
import { Codec, End, Framing, Reason, State } from '../../services/compositor/web/js/messages.js';
import { Outfit } from '../../services/compositor/web/js/outfit.js';
import { BLANK_MS, STALE_MS, ageWords, present } from '../../services/compositor/web/js/presentation.js';
import { pictureShape } from '../../services/compositor/web/js/shape.js';
import { Stats, percentile } from '../../services/compositor/web/js/stats.js';
import { TryOn, drawId } from '../../services/compositor/web/js/try_on.js';

const known = (more) => ({ link: 'streaming', retryAt: null, state: State.LIVE, reason: 0, degradedAge: 0, shownAt: 10_000, exposedAt: 10_000, measured: false, error: null, ...more });

test('only a fresh picture of a live state is called live', () => {
  for (const link of ['opening', 'streaming', 'waiting', 'refused', 'closed']) {
    for (const state of [0, ...Object.values(State)]) {
      for (const age of [0, STALE_MS - 1, STALE_MS + 1, BLANK_MS + 1]) {
        const said = present(known({ link, state, retryAt: link === 'waiting' ? 11_000 : null }), 10_000 + age);
        const fresh = age <= STALE_MS && state === State.LIVE && !['waiting', 'refused'].includes(link);
        assert.equal(said.tone === 'live', fresh, `${link} ${state} ${age}: ${said.title}`);
        if (age > STALE_MS) assert.ok(said.dim === 'hard' && said.age !== '', `a stale picture is dimmed and dated: ${link} ${state}`);
        assert.equal(said.blank, age > BLANK_MS);
      }
    }
  }
});

test('before the first picture nothing is live and nothing is wrong', () => {
  const said = present(known({ shownAt: null, exposedAt: null }), 10_000);
  assert.deepEqual([said.tone, said.blank, said.age], ['busy', true, '']);
});

test('somebody who was measured is dressed, not measured again', () => {
  assert.ok(present(known({ state: State.CALIBRATING }), 10_000).guide);
  assert.equal(present(known({ state: State.CALIBRATING, measured: true }), 10_000).title, 'Putting it on');
});

test('a picture that arrives late is not called live', () => {
  const said = present(known({ shownAt: 10_000, exposedAt: 8_000 }), 10_000);
  assert.equal(said.title, 'Degraded: the picture is late');
  assert.match(said.age, /2\.0 s ago/);
});

test('every reason has words, and an unknown one too', () => {
  const titles = [...Object.values(Reason), 99].map((reason) => present(known({ state: State.DEGRADED, reason }), 10_000).title);
  assert.equal(new Set(titles).size, titles.length);
  assert.ok(titles.every((t) => t.startsWith('Degraded: ')));
});

test('garments beside the body are told with the part that most of them are at', () => {
  const parts = [{ part: 'trunk', share: 0.01 }, { part: 'left arm', share: 0.05 }];
  assert.equal(offWords({ share: 0.06, parts }), ', 6.0 % of the garments beside the body (left arm)');
  assert.equal(offWords({ share: 0.06, parts: [] }), ', 6.0 % of the garments beside the body');
  assert.deepEqual([offWords(null), offWords({ share: 0, parts: [] })], ['', '']);
});

test('a broken line says when it tries again', () => {
  assert.match(present(known({ link: 'waiting', retryAt: 12_400 }), 10_000).hint, /again in 3 s/);
  assert.match(present(known({ link: 'opening', retryAt: 9_000 }), 10_000).title, /does not answer/);
});

test('a page that may not watch keeps no picture', () => {
  for (const code of [Code.UNAUTHENTICATED, Code.PERMISSION_DENIED]) {
    const said = present(known({ link: 'refused', error: new RpcError(code, 'no') }), 10_000);
    assert.deepEqual([said.tone, said.blank], ['down', true]);
  }
});

test('the token leaves the address and stays with the tab', () => {
  const kept = new Map();
  const store = { getItem: (k) => kept.get(k) ?? null, setItem: (k, v) => kept.set(k, v) };
  const shown = [];
  const history = { replaceState: (_state, _title, url) => shown.push(url) };
  const at = (hash) => takeToken({ location: { hash, pathname: '/', search: '?idle=9' }, history, store });
  assert.equal(at(''), '');
  assert.equal(at('#token=a.b-c_d'), 'a.b-c_d');
  assert.equal(at(''), 'a.b-c_d');
  assert.equal(at('#x=1&token=e'), 'e');
  assert.deepEqual(shown, ['/?idle=9', '/?idle=9#x=1']);
});

test('ages in words', () => {
  assert.deepEqual([400, 9_940, 12_000, 89_000, 185_000].map(ageWords), ['0.4 s', '9.9 s', '12 s', '89 s', '3 min']);
});

test('backoff doubles to a ceiling below five seconds, keeps to RetryInfo, and starts again', () => {
  const most = new Backoff(() => 1);
  assert.deepEqual([0, 1, 2, 3, 4, 5].map(() => most.next()), [1, 2, 4, 8, 12, 12].map((f) => Math.min(f * FIRST_DELAY, LONGEST_DELAY)));
  const least = new Backoff(() => 0);
  assert.equal(least.next(), FIRST_DELAY / 2);
  assert.equal(least.next(2), 2);
  assert.ok(least.next(1e9) <= 4 * LONGEST_DELAY);
  least.reset();
  assert.equal(least.next(), FIRST_DELAY / 2);
  assert.ok(LONGEST_DELAY < 5);
});

const library = [
  { name: 'longsleeve', title: 'Long sleeve', category: 'top', sizes: ['S', 'M'], color_rgb: 1 },
  { name: 'skirt', title: 'Skirt', category: 'bottom', sizes: ['M'], color_rgb: 2 },
  { name: 'tshirt', title: 'T-shirt', category: 'top', sizes: ['S', 'M', 'L'], color_rgb: 3 },
];

test('an outfit has one garment of a category, inner layer first', () => {
  const outfit = new Outfit();
  outfit.setLibrary(library);
  outfit.toggle('tshirt');
  outfit.toggle('skirt');
  assert.ok(outfit.setSize('tshirt', 'L'));
  assert.ok(!outfit.setSize('tshirt', 'XXL') && !outfit.setSize('longsleeve', 'M') && !outfit.toggle('cape'));
  outfit.setColor('skirt', 0);
  assert.deepEqual(outfit.choices(), [{ garment: 'skirt', size: '', color_rgb: 0 }, { garment: 'tshirt', size: 'L' }]);
  outfit.toggle('longsleeve');
  assert.equal(outfit.worn('tshirt'), null);
  outfit.toggle('longsleeve');
  assert.deepEqual(outfit.choices(), [{ garment: 'skirt', size: '', color_rgb: 0 }]);
  assert.ok(outfit.setLibrary(library.slice(0, 1)));
  assert.deepEqual(outfit.choices(), []);
});

test('fit in words and units', () => {
  const regions = [{ region: 'chest', fit: 1, stretch: 0.061, pressure: 1240, touching: 0.8, gap: 0.004 }];
  const rows = fitRows([{ garment: 'straight_skirt', size: 'M', regions }]);
  assert.deepEqual(rows, [{ head: 'straight skirt M' }, { region: 'chest', fit: 'tight', cells: ['6 %', '1.2 kPa', '0.4 cm', ''] }]);
  assert.deepEqual(fitRows([]), []);
  const loose = { region: 'hip', fit: 3, stretch: 0.01, pressure: 20, touching: 0.1, gap: 0.0412 };
  assert.equal(fitWords({ size: 'S', regions: [...regions, loose] }), 'S: tight at the chest (stretched by 6 %), loose at the hip (4 cm off you)');
  assert.equal(fitWords({ size: 'M', regions: [{ ...loose, fit: 2 }] }), 'M: fits');
  assert.equal(fitWords({ size: 'M', regions: [] }), '', 'not measured yet');
  assert.equal(fitWords({ size: 'M', regions, provisional: true }), 'Measuring your size …', 'no advice before the size is known');
  assert.equal(fitRows([{ garment: 'tshirt', size: 'M', regions: [], provisional: true }])[0].head, 'tshirt measuring your size');
  const room = (region, fit, ease, ease_needed) => ({ ...loose, region, fit, ease, ease_needed });
  const hem = { hem_above: -0.0712, hem_mark: 'the crotch' };
  assert.equal(fitWords({ size: 'S', regions: [room('chest', 1, 0.02, 0.04), room('hip', 3, 0.21, 0.02)], ...hem }),
    'S: 2 cm too tight at the chest, loose at the hip (21 cm of room), ends 7 cm below the crotch');
  assert.equal(fitWords({ size: 'S', regions: [room('chest', 1, 0.06, 0.04)] }), 'S: tight at the chest (stretched by 1 %)', 'stretched though there is room');
  assert.equal(fitWords({ size: '', regions: [room('chest', 2, 0.06, 0.04)], hem_above: 0.004, hem_mark: 'the knee' }), 'fits, ends at the knee');
  assert.deepEqual(fitRows([{ garment: 'skirt', size: 'M', regions: [room('hip', 2, -0.013, 0.02)] }])[1].cells[3], '−1 cm');
});

test('a finer picture: one line per mesh, one sentence per failure', () => {
  assert.equal(progressWords(null), 'Settling the cloth. Stay in view…');
  assert.equal(progressWords({ vertex_count: 7836, steps: 1 }), 'Settling the cloth: 7,836 points. Stay in view…');
  assert.equal(progressWords({ vertex_count: 7836, steps: 2 }), progressWords({ vertex_count: 7836, steps: 1 }));
  const codes = [Code.FAILED_PRECONDITION, Code.RESOURCE_EXHAUSTED, Code.ABORTED, Code.UNAVAILABLE];
  const failures = codes.map((code) => failureWords(new RpcError(code, 'no')));
  assert.equal(new Set(failures).size, codes.length);
  assert.ok(failures.every((said) => /^[A-Z][^.]*try again[^.]*\.$/.test(said)), failures.join(' '));
  assert.equal(failureWords(null), failures[3]);
  assert.match(failureWords(new RpcError(Code.RESOURCE_EXHAUSTED, 'full', { retryAfter: 1.2 })), /in 2 s\.$/);
});

test('percentiles, rate, and stages that vanish', () => {
  assert.equal(percentile([3, 1, 2], 50), 2);
  assert.equal(percentile([5], 99), 5);
  assert.ok(Number.isNaN(percentile([], 50)));
  const stats = new Stats();
  const picture = (stages) => ({ latency_ms: 80, dropped: 2n, stages });
  for (let i = 0; i < 31; i += 1) stats.shown(picture([{ stage: 'a', ms: 4 }, { stage: 'b', ms: 1 }]), i * 50, 3);
  stats.missed();
  const summary = stats.summary(1500);
  assert.equal(summary.rate, 20);
  assert.equal(summary.p50, 80);
  assert.deepEqual(summary.stages.map(([n]) => n), ['a', 'b']);
  assert.deepEqual([summary.dropped, summary.missed], [2, 1]);
  stats.shown(picture([{ stage: 'b', ms: 1 }]), 1550, 3);
  assert.deepEqual(stats.summary(1600).stages.map(([n]) => n), ['b']);
  stats.shown(picture([{ stage: 'x.total', ms: 3 }, { stage: 'x.solve', ms: 2 }, { stage: 'y.total', ms: 1 }]), 1600, 3);
  assert.deepEqual(stats.summary(1600).stages.map(([n]) => n), ['x.solve', 'y.total'], 'a total beside its parts is left out');
  assert.equal(stats.summary(60_000).rate, 0, 'an old rate is no rate');
});

// ── the try-on's life, against a client made of functions ────────────────────────────────────────────────────────

const status = (state) => ({ picture: null, status: { state, reason: 0 }, stream: 7n, number: 1n });
const forever = (signal) => new Promise((_, fail) => {
  const cancel = () => fail(new RpcError(Code.CANCELLED, 'cancelled'));
  if (signal.aborted) cancel();
  else signal.addEventListener('abort', cancel);
});

function scripted({ streams, opens = [] }) {
  const calls = { open: 0, choose: 0, close: 0, acknowledged: [] };
  const client = {
    openTryOn: async () => {
      calls.open += 1;
      const answer = opens.shift();
      if (answer instanceof Error) throw answer;
      return { try_on_id: 'x', created: answer ?? calls.open === 1 };
    },
    chooseGarments: async () => ({ outfit_revision: BigInt(++calls.choose) }),
    withdrawConsent: async () => { calls.close += 1; },
    acknowledgeFrames: async ({ stream, number }) => { calls.acknowledged.push([stream, number]); },
    streamFrames: (request, { signal }) => streams.shift()(signal),
  };
  return { client, calls };
}

function follow(script, more = {}) {
  const events = [];
  let tell = () => {};
  const tryOn = new TryOn({
    client: script.client, garments: () => [], backoff: new Backoff(() => 0), silenceMs: 80, ...more,
    on: (event) => { events.push(event); tell(); },
  });
  const until = async (condition) => { while (!condition(events)) await new Promise((done) => { tell = done; }); };
  return { tryOn, events, until };
}
const links = (events) => events.filter((e) => e.kind === 'link').map((e) => e.link);

test('a stream that breaks is opened again under the same id and says again what is worn', async () => {
  const script = scripted({
    streams: [
      async function* () { yield status(State.LIVE); throw new RpcError(Code.UNAVAILABLE, 'cut'); },
      async function* (signal) { yield status(State.LIVE); await forever(signal); },
    ],
  });
  const { tryOn, events, until } = follow(script);
  await until((e) => e.filter((x) => x.kind === 'status').length === 2);
  assert.deepEqual(links(events), ['opening', 'waiting', 'opening']);
  assert.deepEqual(script.calls, { open: 2, choose: 1, close: 0, acknowledged: [[7n, 1n], [7n, 1n]] });
  await tryOn.close();
  await tryOn.finished;
  assert.equal(script.calls.close, 1);
  assert.equal(links(events).at(-1), 'closed');
});

test('every message is acknowledged, and a lost acknowledgement ends nothing', async () => {
  const shown = (number) => ({ picture: {}, status: null, stream: 7n, number });
  const script = scripted({
    streams: [async function* (signal) { yield shown(1n); yield shown(2n); await forever(signal); }],
  });
  const keep = script.client.acknowledgeFrames;
  script.client.acknowledgeFrames = async (request) => {
    await keep(request);
    throw new RpcError(Code.UNAVAILABLE, 'lost');
  };
  const { tryOn, events, until } = follow(script);
  await until((e) => e.filter((x) => x.kind === 'picture').length === 2);
  assert.deepEqual(script.calls.acknowledged, [[7n, 1n], [7n, 2n]]);
  assert.deepEqual(links(events), ['opening']);
  await tryOn.close();
});

test('another shape streams again without opening again', async () => {
  const asked = [];
  const script = scripted({ streams: [] });
  script.client.streamFrames = async function* (request, { signal }) {
    asked.push(request.width);
    yield status(State.LIVE);
    await forever(signal);
  };
  let width = 540;
  const { tryOn, events, until } = follow(script, { shape: () => ({ width, height: 960 }), silenceMs: 5000 });
  await until((e) => e.filter((x) => x.kind === 'status').length === 1);
  width = 720;
  tryOn.reshape();
  await until((e) => e.filter((x) => x.kind === 'status').length === 2);
  assert.deepEqual([asked, links(events), script.calls.open], [[540, 720], ['opening'], 1]);
  await tryOn.close();
});

test('an upright glass asks for upright pictures of at most 960 rows', () => {
  assert.deepEqual(pictureShape(1080, 1920), { width: 540, height: 960, framing: Framing.COVER });
  assert.deepEqual(pictureShape(301, 400), { width: 302, height: 400, framing: Framing.COVER });
  for (const glass of [[1920, 1080], [800, 800], [0, 0], [NaN, 5]]) assert.deepEqual(pictureShape(...glass), {});
});

test('silence is a broken line', async () => {
  const silent = async function* (signal) { yield status(State.LIVE); await forever(signal); };
  const { tryOn, events, until } = follow(scripted({ streams: [silent, silent] }));
  await until((e) => links(e).includes('waiting'));
  assert.equal(events.find((e) => e.link === 'waiting').error.code, Code.UNAVAILABLE);
  await tryOn.close();
});

test('a withdrawn consent is not given again by the page', async () => {
  const script = scripted({
    streams: [async function* () { yield { picture: null, status: { state: State.CLOSED, reason: 0, end: End.WITHDRAWN } }; }],
  });
  const { tryOn, events } = follow(script);
  await tryOn.finished;
  assert.deepEqual(links(events), ['opening', 'withdrawn']);
  assert.equal(script.calls.open, 1);
});

test('the compositor may refuse or ask for patience', async () => {
  const script = scripted({
    opens: [new RpcError(Code.RESOURCE_EXHAUSTED, 'full', { retryAfter: 0.2 }), new RpcError(Code.INVALID_ARGUMENT, 'camera')],
    streams: [],
  });
  const { tryOn, events } = follow(script);
  await tryOn.finished;
  assert.deepEqual(links(events), ['opening', 'waiting', 'opening', 'refused']);
  assert.equal(events[1].retryIn, 0.2);
});

test('of two quick choices only the last one counts', async () => {
  const { tryOn } = follow(scripted({ streams: [async function* (signal) { yield status(State.LIVE); await forever(signal); }] }));
  const [first, second] = await Promise.all([tryOn.choose(), tryOn.choose()]);
  assert.deepEqual([first, second], [null, 2n]);
  await tryOn.close();
});

test('a finer picture ends with the try-on and with its own signal', async () => {
  const script = scripted({ streams: [async function* (signal) { yield status(State.LIVE); await forever(signal); }] });
  const { tryOn } = follow(script);
  script.client.takeFinePicture = async function* (request, { signal }) {
    assert.deepEqual(request, { try_on_id: tryOn.id, codec: Codec.JPEG });
    yield { drape: { vertex_count: 512 }, picture: null };
    await forever(signal);
  };
  for (const end of [(own) => own.abort(), () => tryOn.close()]) {
    const own = new AbortController();
    await assert.rejects(async () => {
      for await (const { drape } of tryOn.takeFinePicture(own.signal)) {
        assert.equal(drape.vertex_count, 512);
        end(own);
      }
    }, { code: Code.CANCELLED });
  }
});

test('ids are in the contract’s alphabet and differ', () => {
  assert.match(drawId(), /^[A-Za-z0-9_-]{1,64}$/);
  assert.notEqual(drawId(), drawId());
});
