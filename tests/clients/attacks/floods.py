"""Floods: of connections that prove nothing, of bad tokens, of control frames. A client with a token must not notice."""

from __future__ import annotations

import contextlib
import http.client
import math
import pathlib
import socket
import ssl
import subprocess
import threading
import time
from collections.abc import Callable

import grpc
from separate_processes import free_ports

from .box import Box, Setup
from .raw import COMPOSITOR, Http2Call, framed
from .range import Range
from .readers import run_all
from .report import Figure, attack
from .sockets import PREFACE, SETTINGS, frame
from .viewer import Client

HELD = 2000
PING, PING_S = 6, 1.0
HELLO = PREFACE + frame(SETTINGS, 0, 0, b"")
# Begin of a TLS handshake that never goes on: record and message promise more bytes than follow.
HALF_HELLO = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(32)


def other_address() -> str | None:
    """An address of this machine beyond loopback, whose connections count as those of another machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        with contextlib.suppress(OSError):
            # Sends nothing: it chooses the route.
            s.connect(("192.0.2.1", 9))
            return s.getsockname()[0]
    return None


def certificate(folder: pathlib.Path) -> dict[str, object]:
    """Section `[tls]` with a certificate by openssl."""
    key, cert = (str(folder / n) for n in ("flood.key.pem", "flood.pem"))
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ed25519", "-nodes", "-days", "1", "-subj", "/CN=box",
                    "-keyout", key, "-out", cert], check=True, capture_output=True)
    return {"certificate": cert, "key": key}


class Crowd:
    """Connections held at one address, each with `hello` sent, and `repeat` again every second. Those that the other
    side closes are opened again."""

    def __init__(self, address: tuple[str, int], hello: bytes, repeat: bytes = b"", n: int = HELD):
        self.address, self.hello, self.repeat, self.n = address, hello, repeat, n
        self.sockets: list[socket.socket] = []
        self.is_over = False
        self.thread = threading.Thread(target=self.run, daemon=True)

    def __enter__(self) -> Crowd:
        # A full queue of the listener takes none: then the crowd is as large as it gets.
        while len(self.sockets) < self.n and self.add():
            if len(self.sockets) % 64 == 0:
                time.sleep(0.02)
        self.thread.start()
        time.sleep(1.0)
        return self

    def __exit__(self, *_: object) -> None:
        self.is_over = True
        self.thread.join()
        for s in self.sockets:
            s.close()

    def add(self) -> bool:
        """Opens one connection, if it is taken."""
        try:
            s = socket.create_connection(self.address, 2)
        except OSError:
            return False
        s.setblocking(False)
        self.sockets.append(s)
        with contextlib.suppress(OSError):
            s.send(self.hello)
        return True

    def is_held(self, s: socket.socket) -> bool:
        """Reads what waits and sends `repeat`; `False` when the other side has closed."""
        try:
            while s.recv(65536):
                pass
            return False
        except BlockingIOError:
            pass
        except OSError:
            return False
        with contextlib.suppress(OSError):
            if self.repeat:
                s.send(self.repeat)
        return True

    def run(self) -> None:
        """Keeps the crowd large."""
        while not self.is_over:
            held = [s for s in self.sockets if self.is_held(s)]
            for s in set(self.sockets) - set(held):
                s.close()
            self.sockets = held
            for _ in range(min(200, self.n - len(held))):
                if self.is_over or not self.add():
                    break
            time.sleep(PING_S)


def worst_call(call: Callable[[], bool], n: int = 10, pause: float = 0.2) -> float:
    """Longest of `n` calls, each on a connection of its own (s); infinite when one fails."""
    worst = 0.0
    for _ in range(n):
        begun = time.monotonic()
        with contextlib.suppress(OSError, http.client.HTTPException, grpc.RpcError):
            if call():
                worst = max(worst, time.monotonic() - begun)
                time.sleep(pause)
                continue
        return math.inf
    return worst


def list_plain(box: Box, host: str = "127.0.0.1") -> bool:
    """ListGarmentChoices with a token."""
    address = f"{host}:{box.ports['compositor']}"
    call = Http2Call(address, COMPOSITOR + "ListGarmentChoices", framed(b""), box.metadata)
    code = call.status(5.0)
    call.close()
    return code == 0


def list_encrypted(box: Box, host: str) -> bool:
    """The same as gRPC-web, through TLS. The services behind have no certificate that the compositor trusts, so that
    UNAVAILABLE is an answer to a client that got in."""
    context = ssl._create_unverified_context()  # noqa: S323
    connection = http.client.HTTPSConnection(host, box.ports["compositor"], timeout=5, context=context)
    headers = {"Content-Type": "application/grpc-web+proto", "X-Grpc-Web": "1", **dict(box.metadata)}
    connection.request("POST", COMPOSITOR + "ListGarmentChoices", framed(b""), headers)
    answer = connection.getresponse()
    code = answer.headers.get("grpc-status", "0")
    connection.close()
    return answer.status == 200 and code in ("0", "14")


@attack("strangers-held", "2,000 sockets that prove nothing are held: a client with a token gets in within")
def strangers_held(ground: Range) -> list[Figure]:
    """Silent, pinging and half-open ones from loopback, then pinging ones from another address."""
    figures = []
    with ground.box() as box:
        address = ("127.0.0.1", box.ports["compositor"])
        kinds = {"silent": (b"", b""), "pinging": (HELLO, frame(PING, 0, 0, bytes(8)))}
        for name, (hello, repeat) in kinds.items():
            with Crowd(address, hello, repeat):
                figures.append(Figure(name, worst_call(lambda: list_plain(box)), 1, 0.1, " s"))
    port = free_ports(1)[0]
    settings = {"tls": certificate(ground.folder), "compositor": {"address": f"0.0.0.0:{port}"}}
    with ground.box(Setup(settings=settings)) as box:
        hosts = {"TLS half-open": "127.0.0.1", "TLS from elsewhere": other_address()}
        for name, host in hosts.items():
            if host:
                with Crowd((host, port), HALF_HELLO):
                    figures.append(Figure(name, worst_call(lambda: list_encrypted(box, host)), 1, 0.1, " s"))
    return figures


@attack("admin-sockets", "1,200 silent sockets at the admin port: a client gets in at the main port, a probe at the admin port")
def admin_sockets(ground: Range) -> list[Figure]:
    """The program has the 1,024 descriptors that a login shell and systemd give."""
    with ground.box() as box:
        address = ("127.0.0.1", box.admin_ports["compositor"])
        with Crowd(address, b"", n=1200):
            client = worst_call(lambda: list_plain(box))
            probe = worst_call(lambda: get(address, "/healthz") == 200)
            held = box.descriptors()
    return [
        Figure("client", client, 1, 0.1, " s"),
        Figure("probe", probe, 1, 0.1, " s"),
        Figure("descriptors", held, 512, 256),
    ]


def get(address: tuple[str, int], path: str, token: str = "", context: ssl.SSLContext | None = None) -> int:
    """Status of a GET; 0 when there is none."""
    kind = http.client.HTTPConnection
    if context:
        kind = lambda *a, **k: http.client.HTTPSConnection(*a, context=context, **k)
    connection = kind(*address, timeout=5)
    try:
        connection.request("GET", path, headers={"Authorization": f"Bearer {token}"} if token else {})
        return connection.getresponse().status
    except (OSError, http.client.HTTPException):
        return 0
    finally:
        connection.close()


@attack("admin-beyond", "pages of an admin port beyond loopback that are read without TLS or without a token; probes refused")
def admin_beyond(ground: Range) -> list[Figure]:
    """Metrics name cameras, stores and times; an orchestrator's probes carry no token."""
    port, host = free_ports(1)[0], other_address()
    settings = {"tls": certificate(ground.folder), "compositor": {"admin": f"0.0.0.0:{port}"}}
    context, address = ssl._create_unverified_context(), (str(host), port)  # noqa: S323
    with ground.box(Setup(settings=settings)) as box:
        good, bad = ground.authority.token(), ground.authority.token(aud=["elsewhere"])
        read = refused = 0
        for path in ("/metrics", "/readyz/all"):
            for token, encrypted in (("", None), (good, None), ("", context), (bad, context), ("x", context)):
                read += get(address, path, token, encrypted) == 200
            refused += get(address, path, good, context) not in (200, 503)
        for path in ("/healthz", "/readyz"):
            refused += get(address, path) != 200
            refused += get(address, path, "", context) != 200
        refused += get(("127.0.0.1", port), "/metrics") != 200
    return [Figure("read", read, 0, 0), Figure("refused", refused, 0, 0)]


@attack("token-flood", "bad tokens from one address without a pause: of 32 clients there with fresh tokens, refused; slowest")
def token_flood(ground: Range) -> list[Figure]:
    """Four connections at a time send well-formed tokens of a foreign issuer, from the address of the good ones."""
    host, port = other_address() or "127.0.0.1", free_ports(1)[0]
    settings = {"process": {"insecure": True}, "compositor": {"address": f"0.0.0.0:{port}"}}
    with ground.box(Setup(settings=settings)) as box:
        is_over, sent = threading.Event(), []
        header, payload, _ = ground.authority.token().split(".")
        flood = lambda i: flood_tokens(f"{host}:{port}", f"{header}.{payload}.", i, is_over, sent)
        threads = [threading.Thread(target=flood, args=(i,), daemon=True) for i in range(4)]
        for t in threads:
            t.start()
        time.sleep(ground.pick(5, 20))
        times: list[float] = []
        run_all([lambda: times.append(fresh_token(ground, f"{host}:{port}")) for _ in range(32)])
        is_over.set()
        for t in threads:
            t.join()
    refused = sum(map(math.isinf, times))
    print(f"          {sum(sent)} bad tokens", flush=True)
    return [Figure("refused", refused, 0, 0), Figure("slowest", max(times), 1, 0.1, " s")]


def fresh_token(ground: Range, address: str) -> float:
    """Seconds of a call with a token that was never seen; infinite when it is refused."""
    token = ground.authority.token()
    begun = time.monotonic()
    with contextlib.suppress(OSError):
        metadata = (("authorization", f"Bearer {token}"),)
        call = Http2Call(address, COMPOSITOR + "ListGarmentChoices", framed(b""), metadata)
        code = call.status(5.0)
        call.close()
        if code == 0:
            return time.monotonic() - begun
    return math.inf


def flood_tokens(address: str, signed: str, seed: int, is_over: threading.Event, sent: list[int]) -> None:
    """Sends tokens with signatures that are none, each another one, eight to a connection."""
    host, port = address.split(":")
    n = 0
    while not is_over.is_set():
        requests = []
        for _ in range(8):
            n += 1
            token = f"{signed}{seed:02}{n:08}".ljust(len(signed) + 86, "A")
            requests.append(f"POST {COMPOSITOR}ListGarmentChoices HTTP/1.1\r\nHost: {address}\r\nContent-Length: 0\r\n"
                            f"Content-Type: application/grpc-web+proto\r\nAuthorization: Bearer {token}\r\n\r\n")
        with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 5) as s:
            s.settimeout(1.0)
            s.sendall("".join(requests).encode())
            answers = b""
            while answers.count(b"HTTP/1.1 ") < len(requests) and (data := s.recv(65536)):
                answers += data
    sent.append(n)


@attack("control-frames", "floods of PING and SETTINGS on 4 connections that are opened again: processor; longest one")
def control_frames(ground: Range) -> list[Figure]:
    """Each connection sends frames as fast as they are taken."""
    figures = []
    kinds = {"PING": frame(PING, 0, 0, bytes(8)), "SETTINGS": frame(SETTINGS, 0, 0, b"")}
    with ground.box() as box:
        Client(ground, box).list()
        for name, data in kinds.items():
            lives: list[float] = []
            begun, before, seconds = time.monotonic(), box.cpu_seconds(), ground.pick(3, 10)
            run_all([lambda: flood_frames(box, data, begun + seconds, lives) for _ in range(4)])
            cores = (box.cpu_seconds() - before) / (time.monotonic() - begun)
            figures += [Figure(name, cores, 0.5, 0.2, " cores"), Figure(f"one {name}", max(lives), 1, 0.1, " s")]
    return figures


def flood_frames(box: Box, data: bytes, end: float, lives: list[float]) -> None:
    """Floods until `end`, and keeps the time that each connection lived."""
    block = data * 500
    while time.monotonic() < end:
        begun = time.monotonic()
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", box.ports["compositor"]), 5) as s:
            s.settimeout(0.05)
            s.sendall(HELLO)
            while time.monotonic() < end:
                s.sendall(block)
                with contextlib.suppress(TimeoutError):
                    if not s.recv(1 << 20):
                        break
        lives.append(time.monotonic() - begun)
        time.sleep(0.01)
