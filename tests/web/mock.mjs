// A compositor made of nothing: the page's files and CompositorService over gRPC-web, with a drawn user, for work on
// the page without the chain. `node mock.mjs [PORT]`; POST /mock/{live,calibrate,degrade?reason=N,freeze,break,mend,fine?code=N}.

import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { crc32, deflateSync } from 'node:zlib';

import { frame } from '../../services/compositor/web/js/grpc_web.js';
import * as m from '../../services/compositor/web/js/messages.js';
import { decode, encode } from '../../services/compositor/web/js/wire.js';

const WEB = fileURLToPath(new URL('../../services/compositor/web/', import.meta.url));
const TYPES = { '.html': 'text/html; charset=utf-8', '.css': 'text/css; charset=utf-8', '.js': 'text/javascript; charset=utf-8', '.svg': 'image/svg+xml' };
const CSP = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

const LIBRARY = [
  { name: 'longsleeve', title: 'Long-sleeved shirt', category: 'top', sizes: ['XS', 'S', 'M', 'L', 'XL'], color_rgb: 0x5d7a68 },
  { name: 'skirt', title: 'Skirt', category: 'bottom', sizes: ['S', 'M', 'L'], color_rgb: 0x8c3f4a },
  { name: 'trousers', title: 'Trousers', category: 'bottom', sizes: ['S', 'M', 'L', 'XL'], color_rgb: 0x3b4252 },
  { name: 'tshirt', title: 'T-shirt', category: 'top', sizes: ['XS', 'S', 'M', 'L', 'XL'], color_rgb: 0xd9d2c3 },
];

// ── a user of capsules, shaded by distance ────────────────────────────────────────────────────────────────────

const WIDTH = 480, HEIGHT = 360, LOOP = 40;

/** [x0, y0, x1, y1, r0, r1, part] in units of the picture's height, from the middle. */
function figure(phase) {
  const s = Math.sin(phase), c = Math.cos(phase), lean = 0.012 * s;
  const arm = (side, lift) => {
    const sx = side * 0.078 + lean, ex = side * (0.135 + 0.03 * lift) + lean, hx = side * (0.165 + 0.07 * lift) + lean;
    return [[sx, 0.245, ex, 0.36 - 0.05 * lift, 0.03, 0.024, 'sleeve'], [ex, 0.36 - 0.05 * lift, hx, 0.48 - 0.14 * lift, 0.024, 0.018, 'arm']];
  };
  const leg = (side) => [[side * 0.042 + lean * 0.5, 0.5, side * 0.055, 0.7, 0.05, 0.035, 'thigh'], [side * 0.055, 0.7, side * 0.058, 0.9, 0.035, 0.022, 'shin'],
    [side * 0.058, 0.915, side * 0.072, 0.93, 0.024, 0.02, 'shoe']];
  return [...leg(-1), ...leg(1), [lean, 0.24, lean * 0.6, 0.5, 0.078, 0.082, 'torso'], [lean, 0.25, lean, 0.25, 0.085, 0.085, 'torso'],
    ...arm(-1, 0.5 + 0.5 * s), ...arm(1, 0.5 + 0.5 * c), [lean, 0.15, lean, 0.21, 0.03, 0.032, 'skin'], [lean * 1.2, 0.1, lean * 1.2, 0.125, 0.05, 0.042, 'skin']];
}

const SKIN = 0xc79a7b, OWN = { torso: 0x8d8f94, sleeve: 0x8d8f94, arm: SKIN, thigh: 0x4a5263, shin: 0x4a5263, shoe: 0x2a2826, skin: SKIN };

function clothes(outfit) {
  const colors = { ...OWN };
  for (const { garment, color_rgb } of outfit) {
    const color = color_rgb ?? LIBRARY.find((g) => g.name === garment)?.color_rgb ?? 0;
    if (garment === 'tshirt' || garment === 'longsleeve') colors.torso = colors.sleeve = color;
    if (garment === 'longsleeve') colors.arm = color;
    if (garment === 'trousers') colors.thigh = colors.shin = color;
    if (garment === 'skirt') colors.skirt = color;
  }
  return colors;
}

function paint(phase, outfit, person) {
  const rows = Buffer.alloc(HEIGHT * (1 + WIDTH * 3));
  const colors = clothes(outfit);
  const parts = person ? figure(phase) : [];
  if (colors.skirt !== undefined && person) parts.push([0, 0.47, 0.012 * Math.sin(phase * 2), 0.68, 0.08, 0.135, 'skirt']);
  for (let y = 0; y < HEIGHT; y += 1) {
    const v = (y + 0.5) / HEIGHT;
    for (let x = 0; x < WIDTH; x += 1) {
      const u = (x + 0.5 - WIDTH / 2) / HEIGHT;
      const wall = v < 0.86;
      const light = wall ? 1 - 0.35 * Math.hypot(u + 0.25, v - 0.3) : 0.86 - 0.5 * (v - 0.86);
      let [r, g, b] = wall ? [203 * light, 196 * light, 184 * light] : [150 * light, 128 * light, 104 * light];
      const shadow = Math.exp(-((u / 0.16) ** 2) - (((v - 0.935) / 0.018) ** 2));
      if (person) [r, g, b] = [r, g, b].map((channel) => channel * (1 - 0.45 * shadow));
      for (const [x0, y0, x1, y1, r0, r1, part] of parts) {
        if (Math.abs(u - x0) > 0.3) continue;
        const dx = x1 - x0, dy = y1 - y0, l = dx * dx + dy * dy || 1;
        let t = ((u - x0) * dx + (v - y0) * dy) / l;
        if (part === 'skirt' && (t < 0 || t > 1)) continue;
        t = Math.min(1, Math.max(0, t));
        const radius = r0 + (r1 - r0) * t, px = u - x0 - dx * t, d = Math.hypot(px, v - y0 - dy * t) / radius;
        if (d > 1) continue;
        const nz = Math.sqrt(1 - d * d), fold = part === 'skirt' ? 0.08 * Math.sin(px * 110) : 0;
        const shade = 0.42 + 0.55 * nz - 0.28 * (px / radius) + fold;
        const rgb = colors[part];
        [r, g, b] = [(rgb >> 16) * shade, ((rgb >> 8) & 255) * shade, (rgb & 255) * shade];
      }
      const at = y * (1 + WIDTH * 3) + 1 + x * 3;
      rows[at] = Math.min(255, r); rows[at + 1] = Math.min(255, g); rows[at + 2] = Math.min(255, b);
    }
  }
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const out = Buffer.alloc(body.length + 8);
    out.writeUInt32BE(data.length);
    body.copy(out, 4);
    out.writeUInt32BE(crc32 ? crc32(body) : crc(body), body.length + 4);
    return out;
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(WIDTH);
  head.writeUInt32BE(HEIGHT, 4);
  head.set([8, 2, 0, 0, 0], 8);
  return Buffer.concat([Buffer.from('89504e470d0a1a0a', 'hex'), chunk('IHDR', head), chunk('IDAT', deflateSync(rows, { level: 1 })), chunk('IEND', Buffer.alloc(0))]);
}

/** For a Node whose zlib has no crc32 yet. */
function crc(bytes) {
  let c = 0xffffffff;
  for (const byte of bytes) {
    c ^= byte;
    for (let k = 0; k < 8; k += 1) c = c & 1 ? (c >>> 1) ^ 0xedb88320 : c >>> 1;
  }
  return (c ^ 0xffffffff) >>> 0;
}

const painted = new Map();

function picture(index, outfit, person) {
  const key = JSON.stringify([index % LOOP, outfit.map((c) => [c.garment, c.color_rgb]), person]);
  if (!painted.has(key)) painted.set(key, paint(((index % LOOP) / LOOP) * 2 * Math.PI, outfit, person));
  return painted.get(key);
}

/** Vertices of the meshes of a finer drape, the steps on each, and the time between two steps, ms. */
const FINE_MESHES = [512, 1985, 7836, 31_122], FINE_STEPS = 4, FINE_STEP_MS = 100;

/** Stands for a QR code. */
const QR = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 3 3"><path d="M0 0h1v1H0zM2 0h1v1H2zM0 2h1v1H0zM1 1h1v1H1z"/></svg>';

// ── the service ──────────────────────────────────────────────────────────────────────────────────────────────────

export function startMock({ port = 0, rate = 20 } = {}) {
  const tryOns = new Map();
  const world = { state: m.State.LIVE, reason: 0, since: Date.now(), frozen: false, broken: false, fine: 0 };
  const sockets = new Set();
  let sequence = 0n;

  const trailers = (code, message = '') => {
    const out = frame(new TextEncoder().encode(`grpc-status:${code}\r\ngrpc-message:${encodeURIComponent(message)}\r\n`));
    out[0] = 0x80;
    return out;
  };
  const stateOf = (tryOn) => (world.state === m.State.LIVE && Date.now() - tryOn.opened < 2500 ? m.State.CALIBRATING : world.state);
  const stages = () => [['capture.encode', 7], ['tracking.segment', 5], ['tracking.solve', 23], ['cloth.step', 14], ['compositor.render', 11], ['compositor.encode', 4]]
    .map(([stage, ms]) => ({ stage, ms: ms * (0.85 + 0.3 * Math.random()) }));

  function nextPicture(tryOn, codec = m.Codec.PNG) {
    const state = stateOf(tryOn);
    const away = world.reason === m.Reason.NO_PERSON || world.reason === m.Reason.PERSON_LEFT;
    const dressed = state === m.State.LIVE && Date.now() - tryOn.chosen > 700;
    const image = picture(Number(sequence), dressed ? tryOn.garments : [], !away);
    return {
      frame: { epoch: 1n, sequence, capture_time_ns: sequence * 33_000_000n, received_unix_ns: BigInt(Date.now()) * 1_000_000n },
      state, reason: state === m.State.DEGRADED ? world.reason : 0,
      degraded_age: state === m.State.DEGRADED ? (Date.now() - world.since) / 1000 : 0,
      codec, width: WIDTH, height: HEIGHT, image, outfit_revision: dressed ? tryOn.revision : 0n,
      latency_ms: 78 + 18 * Math.random(), stages: stages(), dropped: 0n,
      fit: dressed ? tryOn.garments.map(({ garment, size }) => ({ garment, size, regions: [
        { region: 'chest', fit: 2, stretch: 0.01, pressure: 120, touching: 0.4, gap: 0.012, ease: 0.062, ease_needed: 0.04 },
        { region: 'waist', fit: 1, stretch: 0.07, pressure: 1600, touching: 0.9, gap: 0.002, ease: -0.05, ease_needed: -0.03 },
        { region: 'hip', fit: 3, stretch: 0.0, pressure: 0, touching: 0, gap: 0.045, ease: 0.21, ease_needed: 0.02 }],
      hem_above: 0.04, hem_mark: 'the knee' })) : [],
    };
  }
  const nextStatus = (tryOn) => ({ state: stateOf(tryOn), reason: world.reason, age: (Date.now() - world.since) / 1000, service: '', detail: '', retry_after: 0 });

  const unary = {
    OpenTryOn: [m.OpenTryOnRequest, m.OpenTryOnResponse, ({ try_on_id: id, garments, consent }) => {
      if (!consent?.given) throw 9;
      const created = !tryOns.has(id);
      if (created) tryOns.set(id, { garments, revision: 1n, opened: Date.now(), chosen: Date.now() });
      return { try_on_id: id, created };
    }],
    WithdrawConsent: [m.WithdrawConsentRequest, m.WithdrawConsentResponse, ({ try_on_id: id }) => { tryOns.delete(id); return {}; }],
    ListGarmentChoices: [m.ListGarmentChoicesRequest, m.ListGarmentChoicesResponse, () => ({ garments: LIBRARY })],
    ChooseGarments: [m.ChooseGarmentsRequest, m.ChooseGarmentsResponse, ({ try_on_id: id, garments }) => {
      const tryOn = tryOns.get(id);
      if (!tryOn) throw 5;
      Object.assign(tryOn, { garments, revision: tryOn.revision + 1n, chosen: Date.now() });
      return { outfit_revision: tryOn.revision };
    }],
    ShowFit: [m.ShowFitRequest, m.ShowFitResponse, ({ try_on_id: id, show }) => {
      if (!tryOns.has(id)) throw 5;
      tryOns.get(id).fit = show;
      return {};
    }],
    OfferPhoto: [m.OfferPhotoRequest, m.OfferPhotoResponse, ({ try_on_id: id }) => {
      if (!tryOns.has(id)) throw 5;
      return { picture: nextPicture(tryOns.get(id)), url: 'http://127.0.0.1/photo/0', qr_svg: QR, seconds: 300 };
    }],
  };

  function stream(request, response) {
    const tryOn = tryOns.get(decode(m.StreamFramesRequest, request).try_on_id);
    if (!tryOn) return response.end(Buffer.from(trailers(5, 'no such try-on')));
    const send = (message) => response.write(frame(encode(m.StreamFramesResponse, message)));
    send({ status: nextStatus(tryOn) });
    let quiet = 0;
    const timer = setInterval(() => {
      if (world.frozen) {
        quiet += 1;
        if (quiet % Math.round(rate / 3) === 0) send({ status: nextStatus(tryOn) });
        return;
      }
      sequence += 1n;
      if (response.writableLength < 1_000_000) send({ picture: nextPicture(tryOn) });
    }, 1000 / rate);
    response.on('close', () => clearInterval(timer));
  }

  /** Steps of a drape, then its picture; without garments or after /mock/fine?code=N the error of that code. */
  function finePicture(request, response) {
    const { try_on_id: id, codec } = decode(m.TakeFinePictureRequest, request);
    const tryOn = tryOns.get(id);
    const refusal = !tryOn ? 5 : tryOn.garments.length === 0 ? 9 : world.fine;
    if (refusal) return response.end(Buffer.from(trailers(refusal, 'no fine picture')));
    const send = (message) => response.write(frame(encode(m.TakeFinePictureResponse, message)));
    let step = 0;
    const timer = setInterval(() => {
      if (tryOns.get(id) !== tryOn) return response.end(Buffer.from(trailers(10, 'the try-on ended')));
      const steps = (step % FINE_STEPS) + 1;
      const vertex_count = FINE_MESHES[Math.floor(step / FINE_STEPS)];
      step += 1;
      if (vertex_count) return send({ drape: { vertex_count, steps, motion: 0.004 / steps, settled: steps === FINE_STEPS } });
      clearInterval(timer);
      send({ picture: nextPicture(tryOn, codec) });
      response.end(Buffer.from(trailers(0)));
    }, FINE_STEP_MS);
    response.on('close', () => clearInterval(timer));
  }

  const streams = { StreamFrames: stream, TakeFinePicture: finePicture };

  function control(what, query) {
    const set = (more) => Object.assign(world, { since: Date.now(), frozen: false, ...more });
    if (what === 'live') set({ state: m.State.LIVE, reason: 0 });
    if (what === 'calibrate') set({ state: m.State.CALIBRATING, reason: 0 });
    if (what === 'degrade') set({ state: m.State.DEGRADED, reason: Number(query.get('reason') ?? 1) });
    if (what === 'freeze') set({ state: m.State.DEGRADED, reason: m.Reason.CAMERA_SILENT, frozen: true });
    if (what === 'fine') world.fine = Number(query.get('code') ?? 0);
    if (what === 'break' || what === 'mend') world.broken = what === 'break';
    if (what === 'break') {
      tryOns.clear();
      for (const socket of sockets) socket.destroy();
    }
  }

  const server = createServer(async (request, response) => {
    const { pathname, searchParams } = new URL(request.url, 'http://mock');
    if (request.method === 'GET') {
      const path = normalize(join(WEB, pathname === '/' ? 'index.html' : pathname));
      try {
        if (!path.startsWith(WEB)) throw new Error('outside');
        const body = readFileSync(path);
        response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream', 'content-security-policy': CSP }).end(body);
      } catch {
        response.writeHead(404).end();
      }
      return;
    }
    if (pathname.startsWith('/mock/')) {
      response.end('ok\n', () => control(pathname.slice(6), searchParams));
      return;
    }
    if (world.broken) return request.socket.destroy();
    const chunks = [];
    for await (const chunk of request) chunks.push(chunk);
    const message = new Uint8Array(Buffer.concat(chunks)).subarray(5);
    const name = pathname.split('/').at(-1);
    response.writeHead(200, { 'content-type': 'application/grpc-web+proto' });
    if (streams[name]) return streams[name](message, response);
    try {
      const [ask, answer, act] = unary[name];
      response.write(frame(encode(answer, act(decode(ask, message)))));
      response.end(Buffer.from(trailers(0)));
    } catch (code) {
      response.end(Buffer.from(trailers(Number.isInteger(code) ? code : 13, String(code))));
    }
  });
  server.on('connection', (socket) => {
    sockets.add(socket);
    socket.on('close', () => sockets.delete(socket));
  });
  return new Promise((done) => server.listen(port, '127.0.0.1', () => done({
    url: `http://127.0.0.1:${server.address().port}/`, control: (what, query = '') => control(what, new URLSearchParams(query)),
    close: () => { server.close(); server.closeAllConnections(); },
  })));
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const { url } = await startMock({ port: Number(process.argv[2] ?? 8090) });
  console.log(url);
}
