#!/usr/bin/env python3
"""The same try-on by gRPC-web over plain HTTP/1.1, framed by hand: nothing but Python's standard library.

    python3 tests/clients/grpc_web_client.py [--address 127.0.0.1:8080] [--frames 100]

Exit status 0 when everything went as promised; the figures are printed as JSON."""

import argparse
import http.client
import json
import os
import pathlib
import struct
import time

PICTURE, STATUS = 1, 2  # StreamFramesResponse.event
LIVE, CLOSED = 3, 6  # TryOnState


def varint(n):
    out = b""
    while n > 0x7F:
        out += bytes([n & 0x7F | 0x80])
        n >>= 7
    return out + bytes([n])


def field(number, value):
    """One field: text and messages are length-delimited, numbers are varints."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


# OpenTryOnRequest.consent.given
CONSENT = field(5, field(1, 1))


def decode(data):
    """A message as {number: [values]}; nested messages stay bytes."""
    out, at = {}, 0

    def take():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(data):
        tag = take()
        kind = tag & 7
        if kind == 0:
            value = take()
        elif kind == 1:
            value, at = data[at:at + 8], at + 8
        elif kind == 2:
            n = take()
            value, at = data[at:at + n], at + n
        elif kind == 5:
            value, at = data[at:at + 4], at + 4
        else:
            raise ValueError(f"wire type {kind}")
        out.setdefault(tag >> 3, []).append(value)
    return out


class Call:
    """One rpc: an HTTP/1.1 POST, answered by frames of a flag, a length and a body; flag 0x80 carries the trailers."""

    headers = {"Content-Type": "application/grpc-web+proto", "X-Grpc-Web": "1"}

    def __init__(self, address, method, message):
        self.http = http.client.HTTPConnection(address, timeout=30)
        body = struct.pack(">BI", 0, len(message)) + message
        self.http.request("POST", f"/tryon.v1.CompositorService/{method}", body, self.headers)
        self.response = self.http.getresponse()
        assert self.response.status == 200, self.response.status
        self.trailers = {k.lower(): v for k, v in self.response.getheaders() if k.lower().startswith("grpc-")}

    def read(self, n):
        data = b""
        while len(data) < n:
            part = self.response.read(n - len(data))
            if not part:
                return None
            data += part
        return data

    def messages(self):
        while head := self.read(5):
            flag, length = struct.unpack(">BI", head)
            data = self.read(length) if length else b""
            if flag & 0x80:
                lines = (line.split(":", 1) for line in data.decode().split("\r\n") if ":" in line)
                self.trailers |= {k.strip().lower(): v.strip() for k, v in lines}
                return
            yield data

    def status(self):
        return int(self.trailers.get("grpc-status", "2")), self.trailers.get("grpc-message", "")


def unary(address, method, message):
    call = Call(address, method, message)
    answers = list(call.messages())
    code, why = call.status()
    assert code == 0, f"{method}: {code} {why}"
    return decode(answers[0])


def choice(name):
    return field(1, name) + field(2, "M")


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--address", default="127.0.0.1:8080")
    args.add_argument("--frames", type=int, default=100)
    args.add_argument("--first", default="tshirt")
    args.add_argument("--second", default="longsleeve")
    args.add_argument("--live", type=float, default=60, help="seconds to wait for the first LIVE picture; 0: take any")
    args.add_argument("--token", type=pathlib.Path, default=os.environ.get("TRYON_TOKEN"), metavar="FILE",
                      help="token of a box that asks for one (TRYON_TOKEN)")
    args = args.parse_args()
    if args.token:
        Call.headers["Authorization"] = f"Bearer {pathlib.Path(args.token).read_text().strip()}"

    bad = Call(args.address, "OpenTryOn", field(4, choice("cape")) + CONSENT)
    list(bad.messages())
    assert bad.status()[0] == 3, f"an unknown garment must be INVALID_ARGUMENT, not {bad.status()}"

    try_on = unary(args.address, "OpenTryOn", field(4, choice(args.first)) + CONSENT)[1][0].decode()
    stream = Call(args.address, "StreamFrames", field(1, try_on) + field(2, 640) + field(3, 480))
    begun, frames, states, revision, chosen, changed = time.monotonic(), 0, [], None, None, None
    for data in stream.messages():
        event = decode(data)
        if STATUS in event:
            states.append(decode(event[STATUS][0]).get(1, [0])[0])
            continue
        p = decode(event[PICTURE][0])
        state, shown = p.get(2, [0])[0], p.get(9, [0])[0]
        assert p[8][0][:2] == b"\xff\xd8", "not a JPEG"
        if changed:
            continue
        if frames == 0 and args.live and state != LIVE:
            assert time.monotonic() - begun < args.live, f"never live; states {states}"
            continue
        if frames == 0:
            live = time.monotonic()
        frames += 1
        if frames == args.frames:
            took = time.monotonic() - live
            answer = unary(args.address, "ChooseGarments", field(1, try_on) + field(2, choice(args.second)))
            revision, chosen = answer[1][0], time.monotonic()
        if chosen and (shown == revision or not args.live):
            changed = time.monotonic() - chosen
            unary(args.address, "CloseTryOn", field(1, try_on))
        assert not chosen or time.monotonic() - chosen < 60, "the garment never changed"
    assert stream.status()[0] == 0, stream.status()
    assert states[-1] == CLOSED, states
    print(json.dumps({
        "frames": frames,
        "first_live_s": round(live - begun, 2),
        "rate": round((args.frames - 1) / took, 1),
        "garment_changed_s": round(changed, 2),
    }))


if __name__ == "__main__":
    main()
