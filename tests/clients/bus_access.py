"""deploy/zenoh/secure under the zenoh of others (eclipse-zenoh): who may do what on the bus.

    python3 tests/clients/bus_access.py [--bin DIR]

Starts a router from the shipped file, with certificates of the shipped script, and asks it as each service, as a holder
of a certificate for something else, with a certificate of another authority, with none, and without TLS. With `--bin`
the four services of that folder run across such a router too. Ends with 0 when everybody gets what is theirs and no more.
"""

from __future__ import annotations

import argparse
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading
import time

import grpc
import zenoh

SHIPPED = pathlib.Path(__file__).resolve().parents[2] / "deploy/zenoh/secure"
FRAMES, OTHER = "tryon/store/front/rgbd", "tryon/store/front/elsewhere"
WAIT_S = 1.0


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


def shipped(name: str, folder: pathlib.Path) -> zenoh.Config:
    """A shipped file with the certificates of a folder."""
    text = (SHIPPED / name).read_text().replace("/etc/tryon/bus", str(folder))
    file = folder / name
    file.write_text(text)
    return zenoh.Config.from_file(str(file))


def client(endpoint: str, folder: pathlib.Path | None) -> zenoh.Session:
    """A peer as the services are: no scouting, one endpoint. Raises `zenoh.ZError` when it is not let in."""
    config = shipped("service.json5", folder) if folder else zenoh.Config()
    for key, value in {
        "mode": '"client"',
        "connect/endpoints": f'["{endpoint}"]',
        "listen/endpoints": "[]",
        "scouting/multicast/enabled": "false",
        "connect/timeout_ms": "2000",
    }.items():
        config.insert_json5(key, value)
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


def make(folder: pathlib.Path) -> pathlib.Path:
    subprocess.run([str(SHIPPED / "certificates.sh"), str(folder)], check=True, capture_output=True)
    return folder


def intruder(certificates: pathlib.Path) -> pathlib.Path:
    """A folder with a certificate of the store's authority for a name that no rule knows."""
    folder = certificates / "intruder"
    folder.mkdir()
    run = lambda *a: subprocess.run(["openssl", *map(str, a)], check=True, capture_output=True)
    key, request = folder / "key.pem", folder / "request.pem"
    run("genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", key)
    run("req", "-new", "-key", key, "-subj", "/CN=intruder", "-out", request)
    (folder / "ext").write_text("extendedKeyUsage=serverAuth,clientAuth\nsubjectAltName=DNS:localhost\n")
    run("x509", "-req", "-in", request, "-CA", certificates / "ca.pem", "-CAkey", certificates / "ca.key.pem", "-days", "1",
        "-extfile", folder / "ext", "-out", folder / "cert.pem")
    (folder / "ca.pem").write_bytes((certificates / "ca.pem").read_bytes())
    return folder


def pictures_across(binaries: pathlib.Path, ours: pathlib.Path, folder: pathlib.Path) -> bool:
    """The services, each with its own certificate, show a camera's pictures across a router."""
    from attacks.box import SERVICES, Box, Setup
    from attacks.range import stubs

    at_router, at_capture = free_port(), free_port()
    config = shipped("router.json5", ours / "router")
    config.insert_json5("listen/endpoints", f'["tls/127.0.0.1:{at_router}"]')
    config.insert_json5("connect/endpoints", f'["tls/localhost:{at_capture}"]')
    router = zenoh.open(config)
    bus = {"listen": [f"tls/127.0.0.1:{at_capture}"], "connect": [f"tls/localhost:{at_router}"]}
    box = Box(binaries, folder, Setup(is_apart=True, settings={"bus": bus}))
    try:
        for service in SERVICES:
            # Cloth has no business on the bus, and no certificate.
            own = []
            if service != "cloth":
                shipped("service.json5", ours / service)
                own = ["--set", f"bus.config={ours / service / 'service.json5'}"]
            box.spawn(service, [str(binaries / f"tryon-{service}"), "--config", str(box.config), *own])
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
    parser.add_argument("--bin", type=pathlib.Path, help="folder of tryon-capture, -tracking, -cloth, -compositor")
    args = parser.parse_args()
    faults = 0

    def must(is_met: bool, what: str) -> None:
        nonlocal faults
        faults += not is_met
        print(f"{'ok' if is_met else 'MISS':4} {what}", flush=True)

    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        ours, theirs = make(folder / "ours"), make(folder / "theirs")
        port = free_port()
        config = shipped("router.json5", ours / "router")
        config.insert_json5("listen/endpoints", f'["tls/127.0.0.1:{port}"]')
        config.insert_json5("connect/endpoints", "[]")
        router, endpoint = zenoh.open(config), f"tls/localhost:{port}"
        capture, tracking, compositor = (client(endpoint, ours / n) for n in ("capture", "tracking", "compositor"))
        stranger = client(endpoint, intruder(ours))

        must(received(capture, tracking, FRAMES) == 3, "tracking receives the frames of capture")
        must(received(capture, compositor, FRAMES) == 3, "so does the compositor")
        must(received(capture, stranger, FRAMES) == 0, "a certificate for something else receives none")
        must(received(stranger, tracking, FRAMES) == 0, "and publishes none")
        must(received(tracking, compositor, FRAMES) == 0, "tracking publishes no frames")
        must(received(capture, tracking, OTHER) == 0, "capture publishes nothing else")
        must(not is_let_in(endpoint, theirs / "tracking"), "another authority's certificate is not let in")
        must(not is_let_in(endpoint, None), "none is not let in")
        must(not is_let_in(f"tcp/127.0.0.1:{port}", None), "nor is plain TCP")
        for session in (capture, tracking, compositor, stranger, router):
            threading.Thread(target=session.close, daemon=True).start()
        if args.bin:
            must(pictures_across(args.bin.resolve(), ours, folder / "box"), "pictures come across the router")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
