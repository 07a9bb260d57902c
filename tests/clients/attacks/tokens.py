"""Who may call what: every method of every port against every kind of bad token."""

from __future__ import annotations

import math
import subprocess
import time

from .box import SERVICES, Box, Setup
from .credentials import bearer
from .range import Range
from .raw import Http2Call, framed
from .report import Figure, NotBuilt, attack
from .viewer import Viewer

UNAUTHENTICATED, PERMISSION_DENIED = 16, 7
MINE, THEIRS = "mine", "theirs"
# Probes carry no token.
OPEN_TO_ALL = "grpc.health."


def methods(ground: Range) -> list[tuple[str, str, bytes]]:
    """Service, path and a request that names a foreign session, of every method in the protos."""
    found = []
    for service in SERVICES:
        for descriptor in getattr(ground.api, service).DESCRIPTOR.services_by_name.values():
            for m in descriptor.methods:
                found.append((service, f"/{descriptor.full_name}/{m.name}", foreign_request(ground, service, m)))
        found.append((service, "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo", b"\x3a\x00"))
    return found


def foreign_request(ground: Range, service: str, method: object) -> bytes:
    """A request with the session of somebody else, where it has one."""
    message = getattr(getattr(ground.api, service), method.input_type.name)()
    for field in ("try_on_id", "session_id"):
        if field in method.input_type.fields_by_name:
            setattr(message, field, THEIRS)
    return message.SerializeToString()


def is_allowed(box: Box, service: str, path: str, body: bytes, token: str | None, limit: float = 5.0) -> bool:
    """The call is answered by anything but UNAUTHENTICATED or PERMISSION_DENIED; a closed connection is no answer."""
    call = Http2Call(box.of(service), path, framed(body), metadata=bearer(token))
    code = call.status(limit)
    call.close()
    is_closed = call.is_ended and not call.headers
    return not is_closed and code not in (UNAUTHENTICATED, PERMISSION_DENIED)


@attack("tokens", "every method × {none, expired, wrong audience, other session, other store, revoked, forged}: allowed")
def matrix(ground: Range) -> list[Figure]:
    """Right tokens must pass, or a box that refuses everybody would win."""
    allowed = refused = calls = 0
    with ground.box() as box:
        bad = ground.authority.forgeries(MINE)
        time.sleep(1.0)
        good = ground.authority.token()
        for service, path, body in methods(ground):
            for kind, token in bad.items():
                if kind == "other session" and THEIRS.encode() not in body:
                    continue
                calls += 1
                if is_allowed(box, service, path, body, token):
                    allowed += 1
                    print(f"          {path} allows a token: {kind}", flush=True)
            # Streams that are allowed do not end.
            refused += not is_allowed(box, service, path, body, good, limit=1.0)
        ended = math.inf if not ground.has_tokens else revocation(ground, box)
    figures = [
        Figure(f"allowed of {calls}", allowed, 0, 0),
        Figure("right tokens refused", refused, 0, 0),
        Figure("revoked stream ends within", ended, 1, 0.3, " s"),
    ]
    if not ground.has_tokens:
        raise NotBuilt(f"`tryon token`: {complaint(ground)}", figures)
    return figures


def complaint(ground: Range) -> str:
    """First line that the program says about the subcommand."""
    run = subprocess.run([str(ground.binaries / "tryon"), "token", "--help"], capture_output=True, text=True, check=False)
    return (run.stderr.strip() or "no such command").splitlines()[0]


def revocation(ground: Range, box: Box) -> float:
    """Seconds from a token's revocation to the end of its stream."""
    claims = ground.authority.claims()
    viewer = Viewer(ground, box, "revoked", metadata=bearer(ground.authority.token(**claims)))
    viewer.wait_picture()
    begun = time.monotonic()
    ground.authority.revoke(str(claims["jti"]))
    with viewer.arrived:
        viewer.arrived.wait_for(lambda: viewer.ended is not None, 5.0)
    return viewer.ended[0] - begun if viewer.ended else math.inf


@attack("plain-token", "tokens over a connection beyond loopback without TLS: accepted")
def tls(ground: Range) -> list[Figure]:
    """`[tls]` must be a section of the configuration; openssl makes its files."""
    with ground.box() as box:
        files = [str(box.folder / n) for n in ("key.pem", "cert.pem")]
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ed25519", "-nodes", "-days", "1", "-subj", "/CN=box",
                        "-keyout", files[0], "-out", files[1]], check=True, capture_output=True)
        config = box.folder / "tls.toml"
        config.write_text(f'{box.config.read_text()}[tls]\ncertificate = "{files[1]}"\nkey = "{files[0]}"\n')
        run = subprocess.run([str(box.binaries / "tryon"), "up", "--check", "--config", str(config)],
                             capture_output=True, text=True, check=False, timeout=10)
    if run.returncode:
        raise NotBuilt(f"[tls] is refused: {run.stderr.strip().splitlines()[0]}")
    with ground.box(Setup(settings={"tls": {"certificate": files[1], "key": files[0]}})) as box:
        plain = is_allowed(box, "compositor", "/tryon.v1.CompositorService/ListGarmentChoices", b"", ground.authority.token())
    return [Figure("accepted in plain text", int(plain), 0, 0)]
