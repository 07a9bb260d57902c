// gRPC-web over fetch: unary calls and server streams, binary framing, cancelled by AbortSignal.
//
// A body is a run of frames: one flag byte, four bytes of big-endian length, payload. Flag 0 is a message, 0x80 the
// trailers as text. A call that fails before its first message may carry its status in the HTTP headers instead.

import { WireError, decode, encode } from './wire.js';
import { BadRequest, RetryInfo, Status } from './messages.js';

/** Largest message taken, bytes: a lossless 4096² picture stays below it, a corrupt length prefix does not. */
export const MAX_MESSAGE = 64 * 1024 * 1024;

const HEADER = 5;
const TRAILERS = 0x80;
const COMPRESSED = 0x01;

/** Status codes the page acts on. */
export const Code = Object.freeze({
  OK: 0, CANCELLED: 1, UNKNOWN: 2, INVALID_ARGUMENT: 3, DEADLINE_EXCEEDED: 4, NOT_FOUND: 5, PERMISSION_DENIED: 7,
  RESOURCE_EXHAUSTED: 8, FAILED_PRECONDITION: 9, ABORTED: 10, INTERNAL: 13, UNAVAILABLE: 14, UNAUTHENTICATED: 16,
});

/** A call that did not end with OK. `retryAfter` is the server's RetryInfo in seconds or null. */
export class RpcError extends Error {
  constructor(code, message, { retryAfter = null, violations = [] } = {}) {
    super(message);
    this.name = 'RpcError';
    this.code = code;
    this.retryAfter = retryAfter;
    this.violations = violations;
  }
}

/** Cuts a byte stream into frames, whatever the chunks. Each payload is copied once, into its own buffer. */
export class FrameParser {
  #header = new Uint8Array(HEADER);
  #have = 0;
  #payload = null;

  /** Takes a chunk and returns the frames that it completes: `[{ flags, payload }]`. */
  push(chunk) {
    const frames = [];
    let at = 0;
    while (at < chunk.length) {
      if (!this.#payload) {
        const take = Math.min(HEADER - this.#have, chunk.length - at);
        this.#header.set(chunk.subarray(at, at + take), this.#have);
        this.#have += take;
        at += take;
        if (this.#have < HEADER) break;
        const length = new DataView(this.#header.buffer).getUint32(1);
        if (length > MAX_MESSAGE) throw new RpcError(Code.INTERNAL, `a message of ${length} bytes was announced`);
        this.#payload = new Uint8Array(length);
      }
      const done = this.#have - HEADER;
      const take = Math.min(this.#payload.length - done, chunk.length - at);
      this.#payload.set(chunk.subarray(at, at + take), done);
      this.#have += take;
      at += take;
      if (this.#have === HEADER + this.#payload.length) {
        frames.push({ flags: this.#header[0], payload: this.#payload });
        this.#payload = null;
        this.#have = 0;
      }
    }
    return frames;
  }

  /** True between frames: a body that ends elsewhere was cut off. */
  get idle() {
    return this.#have === 0;
  }
}

/** One message as a request body. */
export function frame(bytes) {
  const out = new Uint8Array(HEADER + bytes.length);
  new DataView(out.buffer).setUint32(1, bytes.length);
  out.set(bytes, HEADER);
  return out;
}

/** Trailer text (`key: value` lines) to a Map with lower-case keys. */
export function parseTrailers(payload) {
  const trailers = new Map();
  for (const line of new TextDecoder().decode(payload).split('\r\n')) {
    const colon = line.indexOf(':');
    if (colon > 0) trailers.set(line.slice(0, colon).trim().toLowerCase(), line.slice(colon + 1).trim());
  }
  return trailers;
}

function unescapeMessage(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

function fromBase64(text) {
  const binary = atob(text);
  return Uint8Array.from(binary, (c) => c.charCodeAt(0));
}

/** Null when the status is OK; `get` looks up a header or trailer. A missing status is an error. */
export function statusError(get) {
  const raw = get('grpc-status');
  if (raw === null || raw === undefined) return new RpcError(Code.UNKNOWN, 'the answer ended without a status');
  const code = Number(raw);
  if (code === Code.OK) return null;
  const extra = { retryAfter: null, violations: [] };
  const details = get('grpc-status-details-bin');
  if (details) {
    try {
      for (const any of decode(Status, fromBase64(details)).details) {
        if (any.type_url.endsWith('/google.rpc.RetryInfo')) {
          const delay = decode(RetryInfo, any.value).retry_delay;
          if (delay) extra.retryAfter = Number(delay.seconds) + delay.nanos * 1e-9;
        } else if (any.type_url.endsWith('/google.rpc.BadRequest')) {
          extra.violations = decode(BadRequest, any.value).field_violations;
        }
      }
    } catch {
      // Details are a courtesy: the code and message stand without them.
    }
  }
  const message = unescapeMessage(get('grpc-message') ?? '') || `status ${code}`;
  return new RpcError(Number.isInteger(code) ? code : Code.UNKNOWN, message, extra);
}

/** HTTP answers that never reached a gRPC server, in gRPC's own mapping. */
function httpError(status) {
  const code = status === 404 ? Code.NOT_FOUND : [429, 502, 503, 504].includes(status) ? Code.UNAVAILABLE : Code.UNKNOWN;
  return new RpcError(code, `HTTP ${status}`);
}

async function post(url, body, { signal, timeoutMs, keepalive, token }) {
  const headers = { 'content-type': 'application/grpc-web+proto', accept: 'application/grpc-web+proto', 'x-grpc-web': '1' };
  if (token) headers.authorization = `Bearer ${token}`;
  if (timeoutMs) headers['grpc-timeout'] = `${Math.round(timeoutMs)}m`;
  try {
    return await fetch(url, { method: 'POST', headers, body, signal, keepalive, cache: 'no-store', credentials: 'omit' });
  } catch (error) {
    throw asRpcError(error, signal);
  }
}

function asRpcError(error, signal) {
  if (error instanceof RpcError) return error;
  if (error instanceof WireError) return new RpcError(Code.INTERNAL, error.message);
  if (error?.name === 'TimeoutError' || signal?.reason?.name === 'TimeoutError') {
    return new RpcError(Code.DEADLINE_EXCEEDED, 'no answer in time');
  }
  if (error?.name === 'AbortError' || signal?.aborted) return new RpcError(Code.CANCELLED, 'cancelled');
  return new RpcError(Code.UNAVAILABLE, error?.message || 'the connection failed');
}

/**
 * Calls a server-streaming method and yields its messages in order. Throws RpcError unless the call ends with OK.
 * Leaving the loop early cancels the call.
 */
export async function* serverStream(url, request, response, message, options = {}) {
  const { signal } = options;
  const answer = await post(url, frame(encode(request, message)), options);
  if (!answer.ok) throw httpError(answer.status);
  if (answer.headers.has('grpc-status')) {
    const failed = statusError((key) => answer.headers.get(key));
    if (failed) throw failed;
  }
  const reader = answer.body.getReader();
  const parser = new FrameParser();
  let trailers = answer.headers.has('grpc-status') ? new Map([['grpc-status', '0']]) : null;
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      for (const { flags, payload } of parser.push(value)) {
        if (flags & TRAILERS) trailers = parseTrailers(payload);
        else if (flags & COMPRESSED) throw new RpcError(Code.INTERNAL, 'a compressed message was not asked for');
        else yield decode(response, payload);
      }
    }
  } catch (error) {
    throw asRpcError(error, signal);
  } finally {
    reader.cancel().catch(() => {});
  }
  if (!parser.idle || !trailers) throw new RpcError(Code.UNAVAILABLE, 'the stream was cut off');
  const failed = statusError((key) => trailers.get(key));
  if (failed) throw failed;
}

/** Calls a unary method; `timeoutMs` is also told to the server, `keepalive` lets the call outlive the page. */
export async function unary(url, request, response, message, { signal, timeoutMs = 5000, keepalive = false, token } = {}) {
  const timeout = AbortSignal.timeout(timeoutMs);
  const both = signal ? AbortSignal.any([signal, timeout]) : timeout;
  let result = null;
  const options = { signal: both, timeoutMs, keepalive, token };
  for await (const one of serverStream(url, request, response, message, options)) result ??= one;
  if (result === null) throw new RpcError(Code.INTERNAL, 'the answer holds no message');
  return result;
}
