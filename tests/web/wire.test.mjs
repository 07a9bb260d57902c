// The wire module against protobuf's own documented bytes, and the schemas against the contract's text.

import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import test from 'node:test';

import * as messages from '../../services/compositor/web/js/messages.js';
import { Reader, WireError, decode, encode } from '../../services/compositor/web/js/wire.js';

const bytes = (hex) => Uint8Array.from(hex.match(/../g) ?? [], (h) => Number.parseInt(h, 16));
const hex = (array) => Buffer.from(array).toString('hex');

// protobuf.dev/programming-guides/encoding: Test1 { a = 150 }, Test2 { b = "testing" }, Test3 { c = Test1 }.
const Test1 = { name: 'Test1', fields: [[1, 'a', 'uint32']] };
const Test2 = { name: 'Test2', fields: [[2, 'b', 'string']] };
const Test3 = { name: 'Test3', fields: [[3, 'c', 'message', Test1]] };

test('the examples of the encoding guide', () => {
  assert.deepEqual(decode(Test1, bytes('089601')), { a: 150 });
  assert.deepEqual(decode(Test2, bytes('120774657374696e67')), { b: 'testing' });
  assert.deepEqual(decode(Test3, bytes('1a03089601')), { c: { a: 150 } });
  assert.equal(hex(encode(Test1, { a: 150 })), '089601');
  assert.equal(hex(encode(Test2, { b: 'testing' })), '120774657374696e67');
  assert.equal(hex(encode(Test3, { c: { a: 150 } })), '1a03089601');
});

test('64-bit numbers keep all their bits', () => {
  const id = { epoch: 0xffff_ffff_ffff_ffffn, sequence: 1n << 63n, capture_time_ns: 9007199254740993n, received_unix_ns: 0n, trace: 9n };
  assert.deepEqual(decode(messages.FrameId, encode(messages.FrameId, id)), id);
  assert.equal(hex(encode(messages.FrameId, { epoch: (1n << 64n) - 1n })), '08ffffffffffffffffff01');
});

test('a negative enum from a newer contract is read as its low bits, not refused', () => {
  assert.equal(decode(messages.TryOnStatus, bytes('08ffffffffffffffffff01')).state, 0xffffffff);
});

test('every kind survives a round trip', () => {
  const picture = {
    frame: { epoch: 7n, sequence: 42n, capture_time_ns: 1n, received_unix_ns: 1_700_000_000_000_000_001n, trace: 0n },
    state: messages.State.DEGRADED, reason: messages.Reason.PERSON_LEFT, degraded_age: 1.5, codec: 1, width: 640, height: 480,
    image: Uint8Array.of(0xff, 0xd8, 0, 1), outfit_revision: 3n, latency_ms: 87.25,
    stages: [{ stage: 'tracking.solve', ms: 12.5 }, { stage: 'cloth.step', ms: 9 }], dropped: 0n, cloth_detail: 2,
    fit: [{ garment: 'tshirt', size: 'M', tightness: new Uint8Array([129, 0, 127]), regions: [{ region: 'chest', fit: 2, stretch: 0.5, pressure: 250, touching: 0.25, gap: 0.125, ease: 0.0625, ease_needed: null }], hem_above: -0.5, hem_mark: 'the knee', provisional: true }],
    off_person: { share: 0.125, parts: [{ part: 'left arm', share: 0.0625 }] },
  };
  assert.deepEqual(decode(messages.Picture, encode(messages.Picture, picture)), picture);
});

test('of a choice the fields that are not sent are null', () => {
  const drape = { vertex_count: 7836, steps: 12, motion: 0.25, settled: true };
  assert.deepEqual(decode(messages.TakeFinePictureResponse, encode(messages.TakeFinePictureResponse, { drape })), { drape, picture: null });
  assert.equal(hex(encode(messages.TakeFinePictureRequest, { try_on_id: 'a', vertices: 0, codec: messages.Codec.JPEG })), '0a01611801');
});

test('an optional zero is sent, an absent one is not', () => {
  const choice = { garment: 'tshirt', size: '', color_rgb: 0, print: null };
  assert.equal(hex(encode(messages.GarmentChoice, choice)), '0a06747368697274' + '1800');
  assert.deepEqual(decode(messages.GarmentChoice, encode(messages.GarmentChoice, choice)), choice);
  assert.equal(decode(messages.GarmentChoice, bytes('')).color_rgb, null);
});

test('unknown fields of all wire types are skipped', () => {
  // fields 10 varint, 11 fixed64, 12 length-delimited, 13 fixed32, then field 1 of Test1
  assert.deepEqual(decode(Test1, bytes('5001' + '590102030405060708' + '6203aabbcc' + '6d01020304' + '089601')), { a: 150 });
});

test('bytes are a view into the message, at the right place', () => {
  const outer = new Uint8Array([9, 9, ...encode(messages.Picture, { image: Uint8Array.of(1, 2, 3) })]);
  assert.deepEqual([...decode(messages.Picture, outer.subarray(2)).image], [1, 2, 3]);
});

test('broken bytes are typed errors', () => {
  for (const broken of ['08', '0896', '1207', '12077465', '1a05089601', '00', '0fff', '08ffffffffffffffffffff01', '0d010203', '1201ff']) {
    assert.throws(() => decode(Test2, bytes(broken)), WireError, broken);
  }
  assert.throws(() => decode(Test1, bytes('0a0161')), WireError, 'field 1 with the wrong wire type');
  // A length of 4 GiB is refused before anything is taken for it.
  assert.throws(() => decode(Test2, bytes('12ffffffff0f')), WireError);
});

test('random bytes never do anything but decode or throw WireError', () => {
  let seed = 12345;
  const random = () => (seed = (Math.imul(seed, 1103515245) + 12345) >>> 0) >>> 16;
  for (let round = 0; round < 20_000; round += 1) {
    const noise = Uint8Array.from({ length: random() % 24 }, () => random() & 0xff);
    try {
      decode(messages.StreamFramesResponse, noise);
    } catch (error) {
      assert.ok(error instanceof WireError, `${hex(noise)}: ${error}`);
    }
  }
});

test('a reader walks fields in order', () => {
  const reader = new Reader(bytes('089601120774657374696e67'));
  assert.ok(reader.next());
  assert.equal(reader.field, 1);
  reader.skip();
  assert.ok(reader.next());
  assert.equal(reader.field, 2);
  reader.skip();
  assert.ok(!reader.next());
});

// ── the schemas and the contract ──────────────────────────────────────────────────────────────────────────────────

const folder = new URL('../../proto/tryon/v1/', import.meta.url);

function contract() {
  const text = readdirSync(folder)
    .filter((name) => name.endsWith('.proto'))
    .map((name) => readFileSync(new URL(name, folder), 'utf8').replace(/\/\/.*$/gm, ''))
    .join('\n');
  const found = { messages: new Map(), enums: new Map() };
  for (const [, kind, name, body] of text.matchAll(/\b(message|enum)\s+(\w+)\s*\{((?:[^{}]|\{[^{}]*\})*)\}/g)) {
    if (kind === 'enum') {
      const values = [...body.matchAll(/(\w+)\s*=\s*(\d+)\s*;/g)].map(([, n, v]) => [n, Number(v)]);
      found.enums.set(name, new Map(values));
    } else {
      const fields = [...body.matchAll(/(repeated\s+|optional\s+)?([\w.]+)\s+(\w+)\s*=\s*(\d+)\s*;/g)]
        .map(([, label, type, n, number]) => ({ number: Number(number), name: n, type, label: label?.trim() ?? '' }));
      found.messages.set(name, fields);
    }
  }
  return found;
}

test('schemas say what proto/tryon/v1 says', () => {
  const { messages: defined, enums } = contract();
  const google = new Set(['Any', 'Status', 'Duration', 'RetryInfo', 'FieldViolation', 'BadRequest']);
  const schemas = Object.values(messages).filter((m) => m.fields && !google.has(m.name));
  assert.ok(schemas.length > 10);
  for (const schema of schemas) {
    const fields = defined.get(schema.name);
    assert.ok(fields, `${schema.name} is not in the contract`);
    const expected = fields.map(({ number, name, type, label }) => {
      const kind = enums.has(type) ? 'enum' : defined.has(type) ? 'message' : type;
      return [number, name, kind + (label === 'repeated' ? '[]' : label === 'optional' ? '?' : ''), ...(kind === 'message' ? [type] : [])];
    });
    const ours = schema.fields.map(([number, name, kind, inner]) => [number, name, kind, ...(inner ? [inner.name] : [])]);
    assert.deepEqual(ours, expected, schema.name);
  }
});

test('enums say what proto/tryon/v1 says', () => {
  const { enums } = contract();
  for (const [ours, theirs, prefix] of [
    [messages.State, 'TryOnState', 'TRY_ON_STATE_'],
    [messages.Reason, 'DegradedReason', 'DEGRADED_REASON_'],
    [messages.Codec, 'PictureCodec', 'PICTURE_CODEC_'],
  ]) {
    const expected = Object.fromEntries([...enums.get(theirs)].filter(([, v]) => v !== 0).map(([n, v]) => [n.slice(prefix.length), v]));
    assert.deepEqual({ ...ours }, expected, theirs);
  }
});
