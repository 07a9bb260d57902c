// Frames in any chunking, statuses in trailers and in headers, errors that say what they are: against a real socket.

import assert from 'node:assert/strict';
import { createServer } from 'node:http';
import test from 'node:test';

import { Code, FrameParser, MAX_MESSAGE, RpcError, frame, parseTrailers, serverStream, statusError, unary }
  from '../../services/compositor/web/js/grpc_web.js';
import * as m from '../../services/compositor/web/js/messages.js';
import { encode } from '../../services/compositor/web/js/wire.js';

const trailers = (text) => {
  const out = frame(new TextEncoder().encode(text));
  out[0] = 0x80;
  return out;
};
const join = (...parts) => Uint8Array.from(Buffer.concat(parts));

test('frames come out the same for every chunking', () => {
  const whole = join(frame(Uint8Array.of(1, 2, 3)), frame(new Uint8Array(0)), frame(new Uint8Array(300).fill(7)), trailers('grpc-status:0\r\n'));
  for (let size = 1; size <= whole.length; size += 1) {
    const parser = new FrameParser();
    const got = [];
    for (let at = 0; at < whole.length; at += size) got.push(...parser.push(whole.subarray(at, at + size)));
    assert.deepEqual(got.map((f) => [f.flags, f.payload.length]), [[0, 3], [0, 0], [0, 300], [0x80, 15]], `chunks of ${size}`);
    assert.ok(parser.idle);
  }
});

test('a length prefix of 4 GiB is refused before memory is taken', () => {
  assert.throws(() => new FrameParser().push(Uint8Array.of(0, 0xff, 0xff, 0xff, 0xff)), RpcError);
  assert.ok(MAX_MESSAGE < 2 ** 27);
});

test('a cut-off frame is not idle', () => {
  const parser = new FrameParser();
  parser.push(Uint8Array.of(0, 0, 0, 0, 9, 1));
  assert.ok(!parser.idle);
});

test('trailers and statuses', () => {
  const map = parseTrailers(new TextEncoder().encode('grpc-status: 14\r\nGrpc-Message: cloth%20is%20away\r\n'));
  const error = statusError((k) => map.get(k));
  assert.equal(error.code, Code.UNAVAILABLE);
  assert.equal(error.message, 'cloth is away');
  assert.equal(statusError(() => undefined).code, Code.UNKNOWN, 'no status is no success');
  assert.equal(statusError((k) => (k === 'grpc-status' ? '0' : null)), null);
});

test('details: RetryInfo and BadRequest', () => {
  const any = (name, bytes) => ({ type_url: `type.googleapis.com/google.rpc.${name}`, value: bytes });
  const status = encode(m.Status, {
    code: 8, message: 'full',
    details: [
      any('RetryInfo', encode(m.RetryInfo, { retry_delay: { seconds: 2n, nanos: 500_000_000 } })),
      any('BadRequest', encode(m.BadRequest, { field_violations: [{ field: 'garments[0].size', description: 'XXL' }] })),
    ],
  });
  const base64 = Buffer.from(status).toString('base64').replace(/=+$/, '');
  const error = statusError((k) => ({ 'grpc-status': '8', 'grpc-message': 'full', 'grpc-status-details-bin': base64 })[k]);
  assert.equal(error.retryAfter, 2.5);
  assert.equal(error.violations[0].field, 'garments[0].size');
});

const servers = [];
test.after(() => servers.forEach((s) => s.close()));

async function answering(handler) {
  const server = createServer(handler);
  servers.push(server);
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  return `http://127.0.0.1:${server.address().port}/x`;
}

const grpc = { 'content-type': 'application/grpc-web+proto' };
const ok = trailers('grpc-status:0\r\n');
const opened = frame(encode(m.OpenTryOnResponse, { try_on_id: 'web-1', created: true }));

test('a unary call sends one frame and gets one message', async () => {
  let body = Buffer.alloc(0);
  const url = await answering(async (request, response) => {
    for await (const chunk of request) body = Buffer.concat([body, chunk]);
    assert.equal(request.headers['content-type'], 'application/grpc-web+proto');
    response.writeHead(200, grpc).end(join(opened, ok));
  });
  const answer = await unary(url, m.OpenTryOnRequest, m.OpenTryOnResponse, { try_on_id: 'web-1' });
  assert.deepEqual(answer, { try_on_id: 'web-1', created: true });
  assert.equal(body.readUInt32BE(1), body.length - 5);
});

test('an error in the headers, in the trailers, in HTTP, and none at all', async () => {
  const cases = [
    [Code.NOT_FOUND, (r) => r.writeHead(200, { ...grpc, 'grpc-status': '5', 'grpc-message': 'no such try-on' }).end()],
    [Code.UNAVAILABLE, (r) => r.writeHead(200, grpc).end(join(trailers('grpc-status:14\r\ngrpc-message:away\r\n')))],
    [Code.UNAVAILABLE, (r) => r.writeHead(503).end()],
    [Code.UNAVAILABLE, (r) => r.writeHead(200, grpc).end(opened)],
    [Code.UNAVAILABLE, (r) => { r.writeHead(200, grpc); r.write(opened.subarray(0, 7)); setTimeout(() => r.destroy(), 20); }],
    [Code.INTERNAL, (r) => r.writeHead(200, grpc).end(join(frame(Uint8Array.of(0x0a, 0x50)), ok))],
  ];
  for (const [code, act] of cases) {
    const url = await answering((request, response) => act(response));
    await assert.rejects(unary(url, m.OpenTryOnRequest, m.OpenTryOnResponse, {}), (e) => e instanceof RpcError && e.code === code, String(act));
  }
  await assert.rejects(unary('http://127.0.0.1:9/x', m.OpenTryOnRequest, m.OpenTryOnResponse, {}), { code: Code.UNAVAILABLE });
});

test('a call that takes too long ends with DEADLINE_EXCEEDED, and the server was told', async () => {
  let hear;
  const told = new Promise((done) => { hear = done; });
  const url = await answering((request) => hear(request.headers['grpc-timeout']));
  // Long enough for the request to reach the server on a busy machine: a call given up before says nothing to anyone.
  await assert.rejects(unary(url, m.OpenTryOnRequest, m.OpenTryOnResponse, {}, { timeoutMs: 900 }), { code: Code.DEADLINE_EXCEEDED });
  assert.equal(await told, '900m');
  servers.at(-1).closeAllConnections();
});

test('messages arrive one by one, and leaving the loop closes the connection', async () => {
  let closed;
  const gone = new Promise((done) => { closed = done; });
  const url = await answering((request, response) => {
    response.writeHead(200, grpc);
    let n = 0;
    const timer = setInterval(() => response.write(frame(encode(m.StreamFramesResponse, { status: { state: 2, age: n++ } }))), 5);
    response.on('close', () => { clearInterval(timer); closed(); });
  });
  let seen = 0;
  for await (const { status, picture } of serverStream(url, m.StreamFramesRequest, m.StreamFramesResponse, {})) {
    assert.equal(picture, null);
    assert.equal(status.age, seen);
    seen += 1;
    if (seen === 5) break;
  }
  await gone;
});

test('an abort ends the stream with CANCELLED', async () => {
  const url = await answering((request, response) => { response.writeHead(200, grpc); response.write(frame(new Uint8Array(0))); });
  const stop = new AbortController();
  await assert.rejects(async () => {
    for await (const _ of serverStream(url, m.StreamFramesRequest, m.StreamFramesResponse, {}, { signal: stop.signal })) stop.abort();
  }, { code: Code.CANCELLED });
});
