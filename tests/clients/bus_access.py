"""deploy/zenoh/router.json5 under the zenoh of others (eclipse-zenoh): who may do what on the bus.

    python3 tests/clients/bus_access.py [--bin DIR]

Starts a router from the shipped file, with certificates of `tryon identity`, and asks it as each service, as a holder of a
certificate for something else, with a certificate of another authority, with none, and without TLS. Then the four services
run across such a router. Ends with 0 when everybody gets what is theirs and no more.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading
import time

import grpc
import zenoh

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHIPPED = ROOT / "deploy/zenoh/router.json5"
FRAMES, OTHER = "tryon/store/front/rgbd", "tryon/store/front/elsewhere"
WAIT_S = 1.0


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


def router_of(folder: pathlib.Path, endpoint: str, capture: str) -> zenoh.Session:
    """The shipped router with the certificate of a folder."""
    text = SHIPPED.read_text().replace("/etc/tryon/bus", str(folder))
    text = text.replace("tls/0.0.0.0:7447", endpoint).replace("tls/capture:7447", capture)
    file = folder / "router.json5"
    file.write_text(text)
    return zenoh.open(zenoh.Config.from_file(str(file)))


def client(endpoint: str, folder: pathlib.Path | None) -> zenoh.Session:
    """A client as the services are: no scouting, one endpoint. Raises `zenoh.ZError` when it is not let in."""
    config = zenoh.Config()
    tls = {}
    if folder:
        own = {f"connect_{kind}": str(folder / f"{name}.pem") for kind, name in (("certificate", "certificate"), ("private_key", "key"))}
        tls = {"enable_mtls": True, "root_ca_certificate": str(folder / "ca.pem"), **own}
    for key, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "listen/endpoints": [],
        "scouting/multicast/enabled": False,
        "connect/timeout_ms": 2000,
        **{f"transport/link/tls/{k}": v for k, v in tls.items()},
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def received(publisher: zenoh.Session, reader: zenoh.Session, key: str) -> int:
    """Messages of one session that reach another."""
    seen = []
    subscriber = reader.declare_subscriber("tryon/**" if key == OTHER else key, lambda s: seen.append(s))
    time.sleep(WAIT_S)
    for _ in range(3):
        publisher.put(key, b"frame")
    time.sleep(WAIT_S)
    subscriber.undeclare()
    return len(seen)


def is_let_in(endpoint: str, folder: pathlib.Path | None) -> bool:
    """A connection comes about."""
    try:
        client(endpoint, folder).close()
        return True
    except zenoh.ZError:
        return False


def certificate(binaries: pathlib.Path, authority: pathlib.Path, name: str) -> pathlib.Path:
    """Folder of a certificate for that name of an authority, which is made where there is none."""
    out = authority.with_suffix("") / name
    command = [binaries / "tryon", "identity", "issue", name, f"--authority={authority}", f"--out={out}"]
    subprocess.run([*command, "--name=localhost", "--name=127.0.0.1"], check=True)
    return out


def pictures_across(binaries: pathlib.Path, authority: pathlib.Path, folder: pathlib.Path) -> bool:
    """The services, each with a certificate of its own, show a camera's pictures across a router."""
    from attacks.box import SERVICES, Box, Setup
    from attacks.range import stubs

    at_router, at_capture = f"tls/127.0.0.1:{free_port()}", f"tls/127.0.0.1:{free_port()}"
    router = router_of(certificate(binaries, authority, "router"), at_router, at_capture)
    settings = {"bus": {"listen": [at_capture], "connect": [at_router]}, "identity": {"authority": str(authority)}}
    box = Box(binaries, folder, Setup(is_apart=True, settings=settings))
    try:
        for service in SERVICES:
            box.spawn(service, [str(binaries / f"tryon-{service}"), "--config", str(box.config)])
        box.wait_ready()
        api, channel = stubs(), grpc.insecure_channel(box.address)
        rpc, pb = api.compositor_rpc.CompositorServiceStub(channel), api.compositor
        rpc.OpenTryOn(pb.OpenTryOnRequest(try_on_id="tls", consent=pb.Consent(given=True)), timeout=5)
        stream = rpc.StreamFrames(pb.StreamFramesRequest(try_on_id="tls"), timeout=20)
        return any(m.WhichOneof("event") == "picture" for m in stream)
    except grpc.RpcError as e:
        print(e.code(), e.details(), box.log()[-600:])
        return False
    finally:
        box.destroy()
        threading.Thread(target=router.close, daemon=True).start()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "target/release", help="folder of tryon and tryon-capture, -tracking, -cloth, -compositor")
    args = parser.parse_args()
    faults = 0

    def must(is_met: bool, what: str) -> None:
        nonlocal faults
        faults += not is_met
        print(f"{'ok' if is_met else 'MISS':4} {what}", flush=True)

    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        binaries = args.bin.resolve()
        ours, theirs = folder / "ours.pem", folder / "theirs.pem"
        port = free_port()
        router = router_of(certificate(binaries, ours, "router"), f"tls/127.0.0.1:{port}", f"tls/127.0.0.1:{free_port()}")
        endpoint = f"tls/localhost:{port}"
        names = ("capture", "tracking", "compositor", "intruder")
        capture, tracking, compositor, stranger = (client(endpoint, certificate(binaries, ours, n)) for n in names)

        must(received(capture, tracking, FRAMES) == 3, "tracking receives the frames of capture")
        must(received(capture, compositor, FRAMES) == 3, "so does the compositor")
        must(received(capture, stranger, FRAMES) == 0, "a certificate for something else receives none")
        must(received(stranger, tracking, FRAMES) == 0, "and publishes none")
        must(received(tracking, compositor, FRAMES) == 0, "tracking publishes no frames")
        must(received(capture, tracking, OTHER) == 0, "capture publishes nothing else")
        must(not is_let_in(endpoint, certificate(binaries, theirs, "tracking")), "another authority's certificate is not let in")
        must(not is_let_in(endpoint, None), "none is not let in")
        must(not is_let_in(f"tcp/127.0.0.1:{port}", None), "nor is plain TCP")
        for session in (capture, tracking, compositor, stranger, router):
            threading.Thread(target=session.close, daemon=True).start()
        must(pictures_across(binaries, ours, folder / "box"), "pictures come across the router")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
