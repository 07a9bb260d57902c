"""Connections: silent, half-open, many at once, small packets, bombs."""

from __future__ import annotations

import contextlib
import gzip
import http.client
import math
import socket
import struct
import time

import grpc
import hpack

from .box import Box, Setup
from .range import Range
from .raw import COMPOSITOR, Http2Call, framed, request_headers
from .readers import CUT_BAR_S, CUT_GOAL_S, CUT_LIMIT_S, run_all, time_calls
from .report import Figure, attack, percentile
from .viewer import Client

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RST_STREAM, SETTINGS, CONTINUATION = 0, 1, 3, 4, 9
END_STREAM, END_HEADERS = 1, 4
# Size of a malformed request, and how many are held open at once: memory of one is told from noise.
REQUEST_BYTES, HELD = 10 * 1024, 64


def connect(box: Box, data: bytes = b"") -> socket.socket:
    """A socket to the compositor on which `data` has been sent."""
    s = socket.create_connection(("127.0.0.1", box.ports["compositor"]), 10)
    with contextlib.suppress(OSError):
        s.sendall(data)
    return s


@attack("half-open", "half-open requests (HTTP/1.1 head, body; HTTP/2 preface; nothing): closed after")
def half_open(ground: Range) -> list[Figure]:
    """Each waits for the other side to close."""
    head = b"POST /tryon.v1.CompositorService/ListGarmentChoices HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    halves = {
        "head": head,
        "body": head + b"Content-Type: application/grpc-web+proto\r\nContent-Length: 50\r\n\r\n\0\0",
        "preface": PREFACE[:10],
        "nothing": b"",
    }
    found: dict[str, float] = {}
    with ground.box() as box:

        def wait(name: str) -> None:
            s = connect(box, halves[name])
            found[name] = box.seconds_until_closed(s, CUT_LIMIT_S)
            s.close()

        run_all([lambda n=n: wait(n) for n in halves])
    return [Figure(name, found[name], CUT_BAR_S, CUT_GOAL_S, " s") for name in halves]


@attack("silent-sockets", "2,000 silent sockets: a new client gets in within")
def silent_sockets(ground: Range) -> list[Figure]:
    """The program has the 1,024 descriptors that a login shell and systemd give."""
    with ground.box() as box:
        silent = fill(box, 2000)
        time.sleep(1.0)
        client, begun = Client(ground, box), time.monotonic()
        try:
            client.list(timeout=10)
            took = time.monotonic() - begun
        except grpc.RpcError:
            took = math.inf
        client.close()
        for s in silent:
            s.close()
    return [Figure("in within", took, 1, 0.1, " s")]


def fill(box: Box, n: int) -> list[socket.socket]:
    """Up to `n` silent sockets, fewer where no more are taken."""
    silent: list[socket.socket] = []
    with contextlib.suppress(OSError):
        while len(silent) < n:
            # A full queue of the listener drops the first packet, which is sent again after 1 and 3 s.
            silent.append(socket.create_connection(("127.0.0.1", box.ports["compositor"]), 5))
            if len(silent) % 64 == 0:
                time.sleep(0.02)
    return silent


@attack("reconnect", "200 clients reconnect at once: all served or refused within")
def reconnect(ground: Range) -> list[Figure]:
    """Each opens a try-on of its own and streams it when it may; eight places."""
    times: list[float] = []
    with ground.box(Setup(settings={"compositor": {"max_try_ons": 8}})) as box:
        time.sleep(1.0)
        begun = time.monotonic()
        run_all([lambda i=i: times.append(served(ground, box, f"client-{i}", begun)) for i in range(200)])
    late = [t for t in times if math.isinf(t)]
    return [Figure("all", max(times), 5, 2, " s"), Figure("without an answer", len(late) + 200 - len(times), 0, 0)]


def served(ground: Range, box: Box, name: str, begun: float) -> float:
    """Seconds since `begun` to the first message, or to a refusal with a type; infinite for anything else."""
    pb = ground.api.compositor
    try:
        request = pb.OpenTryOnRequest(try_on_id=name, consent=pb.Consent(given=True)).SerializeToString()
        opening = Http2Call(box.address, COMPOSITOR + "OpenTryOn", framed(request), box.metadata)
        code = opening.status(20.0)
        opening.close()
        if code == 0:
            request = pb.StreamFramesRequest(try_on_id=name).SerializeToString()
            stream = Http2Call(box.address, COMPOSITOR + "StreamFrames", framed(request), box.metadata)
            code = 0 if stream.message(20.0) is not None else -1
            stream.close()
        # RESOURCE_EXHAUSTED and UNAVAILABLE are refusals.
        return time.monotonic() - begun if code in (0, 8, 14) else math.inf
    except OSError:
        return math.inf


@attack("nodelay", "ListGarmentChoices back to back on a warm connection: p50")
def nodelay(ground: Range) -> list[Figure]:
    """Nagle's algorithm against delayed acknowledgements makes 44 ms of 1."""
    with ground.box() as box:
        client, seconds = Client(ground, box), ground.pick(2, 5)
        client.list()
        http2 = time_calls(client, seconds, 0.0)
        http1 = time_http1(box, seconds)
    return [Figure(name, 1e3 * percentile(t, 0.5), 5, 1, " ms") for name, t in (("grpcio", http2), ("HTTP/1.1", http1))]


def time_http1(box: Box, seconds: float) -> list[float]:
    """Duration of gRPC-web calls on one connection (s)."""
    connection = http.client.HTTPConnection(box.address, timeout=10)
    headers = {"Content-Type": "application/grpc-web+proto", "X-Grpc-Web": "1", **dict(box.metadata)}
    times, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        begun = time.monotonic()
        connection.request("POST", COMPOSITOR + "ListGarmentChoices", framed(b""), headers)
        connection.getresponse().read()
        times.append(time.monotonic() - begun)
    connection.close()
    return times


def frame(kind: int, flags: int, stream: int, payload: bytes) -> bytes:
    """One frame of HTTP/2."""
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def call(box: Box, method: str, body: bytes, extra: tuple[tuple[str, str], ...] = ()) -> bytes:
    """A connection with one call, as bytes."""
    headers = [*request_headers(box.address, COMPOSITOR + method), *box.metadata, *extra]
    block = hpack.Encoder().encode(headers)
    data = b"".join(frame(DATA, 0, 1, body[i : i + 16384]) for i in range(0, len(body), 16384))
    return PREFACE + frame(SETTINGS, 0, 0, b"") + frame(HEADERS, END_HEADERS, 1, block) + data


def bombs(box: Box) -> dict[str, bytes]:
    """Malformed and oversized requests of about 10 KiB."""
    opened = PREFACE + frame(SETTINGS, 0, 0, b"")
    # A header of 4 kB put into the table once, then repeated by references of one byte.
    stored = b"\x40" + b"\x01x" + b"\x7f" + bytes([0xE1, 0x1E]) + b"a" * 4000
    zeros = gzip.compress(bytes(10 << 20), 9)
    garments = b"\x22\x00" * (REQUEST_BYTES // 2)
    nested = b"\x7b" * REQUEST_BYTES
    resets = b"".join(
        frame(HEADERS, END_HEADERS | END_STREAM, i, b"\x82\x86\x84") + frame(RST_STREAM, 0, i, bytes(4))
        for i in range(1, 800, 2)
    )
    return {
        "garbage": bytes(range(256)) * 40,
        "garbage frames": opened + bytes(range(256)) * 40,
        "references": opened + frame(HEADERS, END_HEADERS, 1, stored + b"\xbe" * 6000),
        "length of 4 GiB": call(box, "OpenTryOn", b"\0\xff\xff\xff\xff" + bytes(REQUEST_BYTES)),
        "gzip bomb": call(box, "OpenTryOn", b"\x01" + struct.pack(">I", len(zeros)) + zeros, (("grpc-encoding", "gzip"),)),
        "empty garments": call(box, "OpenTryOn", framed(garments)),
        "nested groups": call(box, "OpenTryOn", framed(nested)),
        "continuations": opened + frame(HEADERS, 0, 1, b"\x82") + frame(CONTINUATION, 0, 1, b"\x82" * 100) * 90,
        "rapid reset": opened + resets,
        "long head": b"GET / HTTP/1.1\r\nX: " + b"a" * REQUEST_BYTES,
    }


@attack("bombs", "malformed, oversized, bombs: memory per 10 KiB request; panics; control call after")
def bombs_held(ground: Range) -> list[Figure]:
    """64 connections of each kind are held open; the largest growth of memory counts."""
    worst, worst_name, deaf = 0.0, "", 0
    with ground.box() as box:
        Client(ground, box).list()
        hold(box, call(box, "ListGarmentChoices", framed(b"")))
        for name, data in bombs(box).items():
            growth = hold(box, data) / HELD
            if growth > worst:
                worst, worst_name = growth, name
            deaf += not is_served(ground, box)
        panics = box.panics()
    return [
        Figure(f"memory ({worst_name})", worst, 1, 0.2, " MiB"),
        Figure("panics", panics, 0, 0),
        Figure("not served after", deaf, 0, 0),
    ]


def hold(box: Box, data: bytes) -> float:
    """Growth of memory while connections that sent `data` stand (MiB)."""
    before = box.memory_mib()
    held = [connect(box, data) for _ in range(HELD)]
    time.sleep(0.5)
    growth = box.memory_mib() - before
    for s in held:
        s.close()
    return growth


def is_served(ground: Range, box: Box) -> bool:
    """A control call is answered within a second."""
    client = Client(ground, box)
    with contextlib.suppress(grpc.RpcError):
        client.list(timeout=1.0)
        return True
    return False
