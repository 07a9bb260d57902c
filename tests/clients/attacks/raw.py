"""Clients that decide their own flow control: gRPC over `h2`, and gRPC-web over HTTP/1.1 on a plain socket."""

from __future__ import annotations

import contextlib
import socket
import struct
import time

import h2.config
import h2.connection
import h2.events
import h2.exceptions

from .credentials import Metadata

COMPOSITOR = "/tryon.v1.CompositorService/"


def framed(message: bytes) -> bytes:
    """A gRPC message with its prefix: no compression, length."""
    return struct.pack(">BI", 0, len(message)) + message


class Inbox:
    """Splits bytes into gRPC messages."""

    def __init__(self) -> None:
        self.data = bytearray()

    def take(self) -> bytes | None:
        """The next whole message; those with a trailer flag are skipped."""
        while len(self.data) >= 5:
            flag, length = struct.unpack(">BI", self.data[:5])
            if len(self.data) < 5 + length:
                return None
            message = bytes(self.data[5 : 5 + length])
            del self.data[: 5 + length]
            if not flag & 0x80:
                return message
        return None


class Http2Call:
    """One gRPC call on a connection of its own; bytes are acknowledged only as messages are taken."""

    def __init__(self, address: str, path: str, body: bytes, metadata: Metadata = ()):
        host, port = address.split(":")
        self.socket = socket.create_connection((host, int(port)), 10)
        self.h2 = h2.connection.H2Connection(h2.config.H2Configuration(header_encoding="utf-8"))
        self.h2.initiate_connection()
        self.headers: dict[str, str] = {}
        self.is_ended = False
        self.inbox, self.unacknowledged = Inbox(), 0
        self.stream = self.h2.get_next_available_stream_id()
        self.h2.send_headers(self.stream, [*request_headers(address, path), *metadata])
        if body:
            self.h2.send_data(self.stream, body, end_stream=True)
        self.flush()

    def flush(self) -> None:
        """Sends what the connection has to say."""
        self.socket.sendall(self.h2.data_to_send())

    def pump(self, limit: float) -> bool:
        """Reads once; `False` when nothing came in time or the call is over."""
        self.socket.settimeout(max(0.001, limit))
        try:
            data = self.socket.recv(65536)
        except TimeoutError:
            return False
        except OSError:
            data = b""
        if not data:
            self.is_ended = True
            return False
        with contextlib.suppress(h2.exceptions.ProtocolError):
            for event in self.h2.receive_data(data):
                self.handle(event)
        with contextlib.suppress(OSError):
            self.flush()
        return True

    def handle(self, event: h2.events.Event) -> None:
        """Keeps headers, data and the end."""
        if isinstance(event, (h2.events.ResponseReceived, h2.events.TrailersReceived)):
            self.headers |= dict(event.headers)
        elif isinstance(event, h2.events.DataReceived):
            self.inbox.data += event.data
            self.unacknowledged += event.flow_controlled_length
        elif isinstance(event, (h2.events.StreamEnded, h2.events.StreamReset, h2.events.ConnectionTerminated)):
            self.is_ended = True

    def message(self, limit: float) -> bytes | None:
        """The next message, acknowledged; `None` when it does not come in time."""
        end = time.monotonic() + limit
        while (m := self.inbox.take()) is None:
            # A message larger than the window needs its first part acknowledged.
            self.acknowledge()
            rest = end - time.monotonic()
            if self.is_ended or rest <= 0:
                return None
            self.pump(rest)
        return m

    def acknowledge(self) -> None:
        """Opens the window by what has been read."""
        if self.unacknowledged and not self.is_ended:
            with contextlib.suppress(h2.exceptions.ProtocolError, OSError):
                self.h2.acknowledge_received_data(self.unacknowledged, self.stream)
                self.flush()
        self.unacknowledged = 0

    def status(self, limit: float = 10.0) -> int:
        """Code of gRPC at the end; 2 (UNKNOWN) without one, -1 when the call does not end."""
        end = time.monotonic() + limit
        while not self.is_ended and time.monotonic() < end:
            self.pump(end - time.monotonic())
            self.acknowledge()
        return int(self.headers.get("grpc-status", "2")) if self.is_ended else -1

    def close(self) -> None:
        """Closes the socket."""
        self.socket.close()


def request_headers(address: str, path: str) -> list[tuple[str, str]]:
    """Headers of a gRPC call."""
    return [
        (":method", "POST"), (":scheme", "http"), (":authority", address), (":path", path),
        ("te", "trailers"), ("content-type", "application/grpc"),
    ]


class Http1Call:
    """One gRPC-web call over HTTP/1.1: the reader decides how much it takes off the socket."""

    def __init__(self, address: str, method: str, message: bytes, metadata: Metadata = ()):
        host, port = address.split(":")
        self.socket = socket.create_connection((host, int(port)), 10)
        body = framed(message)
        head = (
            f"POST {COMPOSITOR}{method} HTTP/1.1\r\nHost: {address}\r\nContent-Type: application/grpc-web+proto\r\n"
            f"X-Grpc-Web: 1\r\nContent-Length: {len(body)}\r\n"
        ) + "".join(f"{k}: {v}\r\n" for k, v in metadata) + "\r\n"
        self.socket.sendall(head.encode() + body)
        self.file = self.socket.makefile("rb", buffering=4096)
        while self.file.readline().strip():
            pass
        self.inbox, self.is_ended = Inbox(), False

    def message(self, limit: float) -> bytes | None:
        """The next message; reads no chunk beyond it."""
        self.socket.settimeout(limit)
        while (m := self.inbox.take()) is None:
            try:
                size = int(self.file.readline().strip() or b"0", 16)
                self.inbox.data += self.file.read(size)
                self.file.readline()
            except (OSError, ValueError):
                size = 0
            if size == 0:
                self.is_ended = True
                return None
        return m

    def close(self) -> None:
        """Closes the socket."""
        self.socket.close()
