// Protobuf's wire format: bytes to numbers and back, and messages by schema. No reflection, no generated code.
//
// A schema is `{ name, fields: [[number, name, kind, schema?]] }`. Kinds: uint32, uint64 (BigInt), enum, bool, float,
// double, string, bytes, message; a trailing `[]` means repeated (messages and strings only), a trailing `?` means
// optional (absent is null). Fields keep the contract's names. Unknown fields are skipped, as the format asks.

/** The bytes are not what the schema says. */
export class WireError extends Error {}

const VARINT = 0, FIXED64 = 1, LENGTH = 2, FIXED32 = 5;
const utf8 = new TextDecoder('utf-8', { fatal: true });
const toUtf8 = new TextEncoder();

/** Reads one message's fields in order: `while (r.next()) switch (r.field) …`. */
export class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
    this.field = 0;
    this.type = 0;
  }

  next() {
    if (this.at >= this.bytes.length) return false;
    const tag = this.uint32();
    this.field = tag >>> 3;
    this.type = tag & 7;
    if (this.field === 0) throw new WireError('field number 0');
    return true;
  }

  uint64() {
    let value = 0n;
    for (let i = 0; i < 10; i += 1) {
      if (this.at >= this.bytes.length) throw new WireError('a varint ends early');
      const byte = this.bytes[this.at++];
      value |= BigInt(byte & 0x7f) << BigInt(7 * i);
      if (byte < 0x80) return BigInt.asUintN(64, value);
    }
    throw new WireError('a varint longer than ten bytes');
  }

  /** Low 32 bits, as the format asks of 32-bit fields and enums. */
  uint32() {
    let low = 0;
    for (let i = 0; i < 10; i += 1) {
      if (this.at >= this.bytes.length) throw new WireError('a varint ends early');
      const byte = this.bytes[this.at++];
      if (i < 5) low |= (byte & 0x7f) << (7 * i);
      if (byte < 0x80) return low >>> 0;
    }
    throw new WireError('a varint longer than ten bytes');
  }

  /** A view, not a copy. */
  span(length) {
    if (length > this.bytes.length - this.at) throw new WireError('a field is longer than its message');
    const span = this.bytes.subarray(this.at, this.at + length);
    this.at += length;
    return span;
  }

  float() {
    const at = this.at;
    this.span(4);
    return this.view.getFloat32(at, true);
  }

  double() {
    const at = this.at;
    this.span(8);
    return this.view.getFloat64(at, true);
  }

  skip() {
    if (this.type === VARINT) this.uint64();
    else if (this.type === FIXED64) this.span(8);
    else if (this.type === LENGTH) this.span(this.uint32());
    else if (this.type === FIXED32) this.span(4);
    else throw new WireError(`wire type ${this.type}`);
  }
}

const WIRE_TYPE = {
  uint32: VARINT, uint64: VARINT, enum: VARINT, bool: VARINT,
  float: FIXED32, double: FIXED64, string: LENGTH, bytes: LENGTH, message: LENGTH,
};
const EMPTY = {
  uint32: 0, uint64: 0n, enum: 0, bool: false, float: 0, double: 0, string: '', bytes: new Uint8Array(0), message: null,
};

const base = (kind) => kind.replace(/\[\]|\?/, '');

function value(reader, kind, schema) {
  switch (kind) {
    case 'uint32': case 'enum': return reader.uint32();
    case 'uint64': return reader.uint64();
    case 'bool': return reader.uint64() !== 0n;
    case 'float': return reader.float();
    case 'double': return reader.double();
    case 'bytes': return reader.span(reader.uint32());
    case 'string': {
      try {
        return utf8.decode(reader.span(reader.uint32()));
      } catch (error) {
        throw error instanceof WireError ? error : new WireError('a string that is not UTF-8');
      }
    }
    case 'message': return decode(schema, reader.span(reader.uint32()));
    default: throw new TypeError(`kind ${kind}`);
  }
}

/** A message with every field of its schema present: proto3's defaults where the bytes are silent. */
export function decode(schema, bytes) {
  const message = {};
  for (const [, name, kind] of schema.fields) {
    message[name] = kind.endsWith('[]') ? [] : kind.endsWith('?') ? null : EMPTY[kind];
  }
  const reader = new Reader(bytes);
  while (reader.next()) {
    const field = schema.fields.find((f) => f[0] === reader.field);
    if (!field) {
      reader.skip();
      continue;
    }
    const [, name, kind, inner] = field;
    if (WIRE_TYPE[base(kind)] !== reader.type) throw new WireError(`${schema.name}.${name}: wire type ${reader.type}`);
    const read = value(reader, base(kind), inner);
    if (kind.endsWith('[]')) message[name].push(read);
    else message[name] = read;
  }
  return message;
}

function pushVarint(out, number) {
  let rest = BigInt.asUintN(64, BigInt(number));
  while (rest > 0x7fn) {
    out.push(Number(rest & 0x7fn) | 0x80);
    rest >>= 7n;
  }
  out.push(Number(rest));
}

function pushValue(out, kind, schema, v) {
  if (kind === 'float' || kind === 'double') {
    const view = new DataView(new ArrayBuffer(kind === 'float' ? 4 : 8));
    if (kind === 'float') view.setFloat32(0, v, true);
    else view.setFloat64(0, v, true);
    out.push(...new Uint8Array(view.buffer));
  } else if (WIRE_TYPE[kind] === VARINT) {
    pushVarint(out, v);
  } else {
    const bytes = kind === 'string' ? toUtf8.encode(v) : kind === 'bytes' ? v : encode(schema, v);
    pushVarint(out, bytes.length);
    for (const byte of bytes) out.push(byte);
  }
}

/** Requests are small, so this favours clarity. Defaults and absent fields take no bytes. */
export function encode(schema, message) {
  const out = [];
  for (const [number, name, kind, inner] of schema.fields) {
    const given = message[name];
    if (given === undefined || given === null) continue;
    const plain = base(kind);
    if (kind === plain && plain !== 'message' && (given === EMPTY[plain] || given.length === 0)) continue;
    for (const one of kind.endsWith('[]') ? given : [given]) {
      pushVarint(out, (number << 3) | WIRE_TYPE[plain]);
      pushValue(out, plain, inner, one);
    }
  }
  return Uint8Array.from(out);
}
