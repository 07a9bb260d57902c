"""Somebody who listens on the network between services: frames that pass, keys that pass, frames that both open."""

from __future__ import annotations

import os
import re
import socket
import struct
import threading

# A sealed frame (frame.proto) names its key; a FrameKey (common.proto) has the same number beside the secret.
SEALED = re.compile(rb"TRS1(.{8})", re.DOTALL)
KEY = re.compile(rb"\x09(.{8})\x12\x20.{32}", re.DOTALL)
# Longest of both patterns, which two segments may share.
TAIL = 64
ALL_PROTOCOLS, OUTGOING = 3, 4


class Listener:
    """Everything that passes the loopback interface from and to addresses of one block, until `close`."""

    def __init__(self, block: str):
        self.block = socket.inet_aton(f"{block}.0")[:3]
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(ALL_PROTOCOLS))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32 << 20)
        self.socket.bind(("lo", 0))
        self.socket.settimeout(0.2)
        self.tails: dict[bytes, bytes] = {}
        self.sealed: list[bytes] = []
        self.keys: set[bytes] = set()
        self.is_open = True
        self.thread = threading.Thread(target=self.listen, daemon=True)
        self.thread.start()

    @staticmethod
    def is_allowed() -> bool:
        """The system lets this process listen."""
        return os.geteuid() == 0

    def listen(self) -> None:
        """Looks through each packet once: the loopback interface shows it going out and coming in."""
        while self.is_open:
            try:
                packet, (_, _, kind, *_) = self.socket.recvfrom(1 << 17)
            except TimeoutError:
                continue
            # A caller's own address is 127.0.0.1.
            is_inside = self.block in (packet[12:15], packet[16:19])
            if kind == OUTGOING and is_inside and packet[9] == socket.IPPROTO_TCP:
                self.hear(packet)

    def hear(self, packet: bytes) -> None:
        """A packet of IPv4 with TCP."""
        head = (packet[0] & 15) * 4
        flow = packet[12:20] + packet[head : head + 4]
        payload = packet[head + (packet[head + 12] >> 4) * 4 : struct.unpack_from("!H", packet, 2)[0] or None]
        heard = self.tails.get(flow, b"") + payload
        # What ends within the tail of the packet before was counted with it.
        old = len(heard) - len(payload)
        self.sealed += [m[1] for m in SEALED.finditer(heard) if m.end() > old]
        self.keys |= {m[1] for m in KEY.finditer(heard)}
        self.tails[flow] = heard[-TAIL:]

    def close(self) -> dict[str, int]:
        """Stops; counts of what was heard."""
        self.is_open = False
        self.thread.join()
        self.socket.close()
        return {"sealed": len(self.sealed), "keys": len(self.keys), "opened": sum(k in self.keys for k in self.sealed)}


def prove(block: str) -> None:
    """A listener hears a key, and a frame that it opens, on a plain connection."""
    key = bytes(range(8))
    listener = Listener(block)
    with socket.create_server((f"{block}.1", 0)) as server:
        with socket.create_connection(server.getsockname(), source_address=(f"{block}.2", 0)) as client:
            accepted, _ = server.accept()
            with accepted:
                for part in (b"..\x09" + key + b"\x12", b"\x20" + bytes(32), b"TRS1" + key + bytes(24)):
                    client.sendall(part)
                    accepted.recv(100)
    threading.Event().wait(0.5)
    heard = listener.close()
    assert heard == {"sealed": 1, "keys": 1, "opened": 1}, f"a listener who hears nothing proves nothing: {heard}"
