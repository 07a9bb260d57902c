"""Strangers: clients without credentials, other hosts' names, other people's sessions, the bus."""

from __future__ import annotations

import contextlib
import json
import pathlib
import re
import subprocess
import tempfile
import time

import grpc
import zenoh
from google.protobuf.message import DecodeError

from .box import Box, Setup
from .range import ROOT, Range
from .report import Figure, attack
from .viewer import Client, Viewer

# A JFIF header or that of a depth image, 8 bytes and more: sealed bytes hold three given ones by chance within seconds.
IMAGE = re.compile(rb"\xff\xd8\xff\xe0\x00\x10JFIF|TDZ1..\x00\x00..\x00\x00", re.DOTALL)
REFUSED = (grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED)


@attack("stranger", "a client without credentials opens a try-on and sees the person: pictures")
def stranger(ground: Range) -> list[Figure]:
    """Opens, streams and takes a snapshot on loopback, where `demo` and `up` put a token into the printed address."""
    seen = 0
    with ground.box() as box:
        client = Client(ground, box, metadata=())
        with contextlib.suppress(grpc.RpcError):
            client.open("stranger")
            viewer = Viewer(ground, box, "stranger", metadata=())
            viewer.wait(lambda s: s.is_picture, 5.0)
            seen = len(viewer.pictures())
            viewer.close()
        client.close()
    return [Figure("pictures", min(seen, 1), 0, 0)]


@attack("no-identity", "health of the services behind the mirror without TLS, without a certificate, with that of another store")
def no_identity(ground: Range) -> list[Figure]:
    """Everybody whom the store's authority does not know, and one whom it knows."""
    with tempfile.TemporaryDirectory() as scratch:
        ours, theirs = (pathlib.Path(scratch) / f"{name}.pem" for name in ("ours", "theirs"))
        with ground.box(Setup(settings={"identity": {"authority": str(ours)}})) as box:
            known, unknown = certificate(ground, ours), certificate(ground, theirs)
            anonymous = grpc.ssl_channel_credentials(known[0])
            foreign = grpc.ssl_channel_credentials(known[0], *unknown[1:])
            behind = [box.of(name) for name in ("capture", "tracking", "cloth")]
            let_in = sum(answers(a, c) for a in behind for c in (None, anonymous, foreign))
            own = sum(answers(a, grpc.ssl_channel_credentials(*known)) for a in behind)
    return [Figure("strangers answered", let_in, 0, 0), Figure("services not reached by one of the store", 3 - own, 0, 0)]


def certificate(ground: Range, authority: pathlib.Path) -> list[bytes]:
    """Authorities, key and certificate of somebody in the store of that authority."""
    out = authority.with_suffix("")
    subprocess.run([ground.binaries / "tryon", "identity", "issue", "guest", f"--authority={authority}", f"--out={out}"], check=True)
    return [(out / f"{name}.pem").read_bytes() for name in ("ca", "key", "certificate")]


def answers(address: str, credentials: grpc.ChannelCredentials | None) -> bool:
    """The port answers for its health; the answer is no matter."""
    channel = grpc.secure_channel(address, credentials) if credentials else grpc.insecure_channel(address)
    ask = channel.unary_unary("/grpc.health.v1.Health/Check")
    try:
        ask(b"", timeout=3)
        return True
    except grpc.RpcError as e:
        return e.code() not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED)
    finally:
        channel.close()


@attack("bus-tap", "a stranger's zenoh session reads RGBD off the bus: frames without a viewer, and readable ones with one")
def bus_tap(ground: Range) -> list[Figure]:
    """The Python client of zenoh, with nothing but the endpoint."""
    with ground.box() as box:
        frames = tap(box, 2.0)
        viewer = Viewer(ground, box, "watched")
        viewer.wait_picture()
        watched = tap(box, 2.0)
        viewer.close()
    return [Figure("frames", len(frames), 0, 0),
            Figure("readable beside a viewer", sum(is_readable(ground, f) for f in watched), 0, 0)]


def is_readable(ground: Range, payload: bytes) -> bool:
    """A frame in the clear, or pieces of one: a JPEG's or a depth image's beginning."""
    with contextlib.suppress(DecodeError):
        frame = ground.api.frame.RgbdFrame.FromString(payload)
        if frame.depth or frame.color_jpeg:
            return True
    return IMAGE.search(payload) is not None


def tap(box: Box, seconds: float) -> list[bytes]:
    """Payloads of all frames on the bus during `seconds`."""
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{box.bus}"]))
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    frames: list[bytes] = []
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        return frames
    subscriber = session.declare_subscriber("tryon/**", lambda sample: frames.append(sample.payload.to_bytes()))
    time.sleep(seconds)
    subscriber.undeclare()
    session.close()
    return frames


@attack("close-others", "session ids whole in the log, and sessions that a stranger closes with them")
def close_others(ground: Range) -> list[Figure]:
    """An id drawn by the service is looked up in its log, and closed from another connection."""
    closed = 0
    with ground.box() as box:
        owner, thief = Client(ground, box), Client(ground, box, metadata=())
        opened = owner.rpc.OpenTryOn(owner.pb.OpenTryOnRequest(consent=owner.pb.Consent(given=True)), timeout=5, metadata=owner.metadata)
        call = owner.stream(opened.try_on_id)
        next(call)
        time.sleep(0.5)
        whole = len(re.findall(re.escape(opened.try_on_id), box.log()))
        with contextlib.suppress(grpc.RpcError):
            thief.end(opened.try_on_id)
            time.sleep(0.5)
            closed = int(is_gone(owner, opened.try_on_id))
        owner.close(), thief.close()
    return [Figure("ids in the log", whole, 0, 0), Figure("closed", closed, 0, 0)]


def is_gone(client: Client, name: str) -> bool:
    """The try-on is not open any more."""
    try:
        next(client.stream(name, 5.0))
        return False
    except grpc.RpcError as e:
        return e.code() == grpc.StatusCode.NOT_FOUND


def curl(*arguments: str) -> int:
    """HTTP status of a request by curl; 0 when there is none."""
    run = subprocess.run(["curl", "-s", "-m", "5", "-o", "/dev/null", "-w", "%{http_code}", *arguments],
                         capture_output=True, text=True, check=False)
    return int(run.stdout or 0)


@attack("host-header", "foreign Host and Origin that are served (DNS rebinding): requests of 5")
def host_header(ground: Range) -> list[Figure]:
    """curl over HTTP/1.1 and HTTP/2, for the page and for gRPC-web."""
    with ground.box() as box:
        page, rpc = f"http://{box.address}/", f"http://{box.address}/tryon.v1.CompositorService/ListGarmentChoices"
        body = pathlib.Path(box.folder / "empty.bin")
        body.write_bytes(b"\0\0\0\0\0")
        web = ("-H", "Content-Type: application/grpc-web+proto", "--data-binary", f"@{body}")
        served = [
            curl("-H", "Host: evil.example", page),
            curl("-H", "Host: evil.example:8080", "-X", "POST", *web, rpc),
            curl("-H", "Origin: http://evil.example", "-X", "POST", *web, rpc),
            curl("-H", "Origin: null", "-X", "POST", *web, rpc),
            curl("--http2-prior-knowledge", "-H", "Host: evil.example", page),
        ]
    return [Figure("served", sum(200 <= s < 300 for s in served), 0, 0)]


@attack("beyond-loopback", "addresses beyond loopback that are bound without TLS, tokens and --insecure: of 4")
def beyond_loopback(ground: Range) -> list[Figure]:
    """Each port in turn on 0.0.0.0: the program must end with status 64."""
    bound = 0
    for section in ("capture", "tracking", "cloth", "compositor"):
        with ground.box() as box:
            port = box.ports[section]
            bound += not refuses(box, section, f"0.0.0.0:{port}")
    return [Figure("bound", bound, 0, 0)]


def refuses(box: Box, section: str, address: str) -> bool:
    """`tryon up --check` ends with 64 for this address; services check alike."""
    text = box.config.read_text()
    changed = re.sub(rf'(\[{section}\]\naddress = )"[^"]*"', rf'\1"{address}"', text)
    config = box.folder / f"{section}.toml"
    config.write_text(changed)
    run = subprocess.run([str(box.binaries / "tryon"), "up", "--check", "--config", str(config)],
                         capture_output=True, check=False, timeout=10)
    return run.returncode == 64


@attack("node-port", "ports of shipped overlays that a whole LAN reaches without TLS")
def node_port(ground: Range) -> list[Figure]:
    """Services of type NodePort or LoadBalancer whose pods have no TLS, by `kubectl kustomize`."""
    open_ports = 0
    for overlay in sorted((ROOT / "deploy/kustomize/overlays").iterdir()):
        run = subprocess.run(["kubectl", "kustomize", str(overlay)], capture_output=True, text=True, check=True)
        documents = run.stdout.split("\n---\n")
        exposed = [d for d in documents if re.search(r"^  type: (NodePort|LoadBalancer)$", d, re.M)]
        if not re.search(r"TRYON_TLS__CERTIFICATE|^\s*\[tls\]", run.stdout, re.M):
            open_ports += len(exposed)
    return [Figure("ports", open_ports, 0, 0)]
