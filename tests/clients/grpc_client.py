#!/usr/bin/env python3
"""A client that shares nothing with this project but its protos: opens a try-on, receives 100 frames, changes a
garment, closes. Needs `pip install grpcio grpcio-tools`; the stubs are generated at run time.

    python3 tests/clients/grpc_client.py [--address 127.0.0.1:8080] [--frames 100] [--out DIR]

Exit status 0 when everything went as promised; the figures are printed as JSON."""

import argparse
import importlib
import json
import os
import pathlib
import statistics
import sys
import tempfile
import time

import grpc
from grpc_tools import protoc

PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"


def stubs():
    """Modules of tryon.v1, generated into a folder that goes away."""
    out = tempfile.TemporaryDirectory()
    files = sorted(str(p.relative_to(PROTO)) for p in (PROTO / "tryon/v1").glob("*.proto"))
    status = protoc.main(["protoc", f"-I{PROTO}", f"--python_out={out.name}", f"--grpc_python_out={out.name}", *files])
    assert status == 0, "the protos do not compile"
    sys.path.insert(0, out.name)
    load = lambda name: importlib.import_module(f"tryon.v1.{name}")
    modules = load("compositor_pb2"), load("compositor_pb2_grpc"), load("common_pb2")
    out.cleanup()
    return modules


class Presenting(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor):
    """Lets every call carry a token."""

    def __init__(self, token):
        self.metadata = [("authorization", f"Bearer {token}")]

    def intercept_unary_unary(self, call, details, request):
        return call(details._replace(metadata=self.metadata), request)

    intercept_unary_stream = intercept_unary_unary


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--address", default="127.0.0.1:8080")
    args.add_argument("--frames", type=int, default=100)
    args.add_argument("--first", default="tshirt")
    args.add_argument("--second", default="longsleeve")
    args.add_argument("--live", type=float, default=60, help="seconds to wait for the first LIVE picture; 0: take any")
    args.add_argument("--out", type=pathlib.Path, help="folder for the last picture with each outfit")
    args.add_argument("--token", type=pathlib.Path, default=os.environ.get("TRYON_TOKEN"), metavar="FILE",
                      help="token of a box that asks for one (TRYON_TOKEN)")
    args = args.parse_args()
    pb, rpc, common = stubs()
    channel = grpc.insecure_channel(args.address, options=[("grpc.max_receive_message_length", 16 << 20)])
    if args.token:
        channel = grpc.intercept_channel(channel, Presenting(pathlib.Path(args.token).read_text().strip()))
    compositor = rpc.CompositorServiceStub(channel)

    known = [g.name for g in compositor.ListGarmentChoices(pb.ListGarmentChoicesRequest(), timeout=5).garments]
    assert args.first in known and args.second in known, known
    try:
        bad = [common.GarmentChoice(garment="cape")]
        compositor.OpenTryOn(pb.OpenTryOnRequest(garments=bad, consent=pb.Consent(given=True)), timeout=5)
        raise SystemExit("an unknown garment was accepted")
    except grpc.RpcError as e:
        assert e.code() == grpc.StatusCode.INVALID_ARGUMENT and "garments[0].garment" in e.details(), e

    first = [common.GarmentChoice(garment=args.first, size="M")]
    try_on = compositor.OpenTryOn(pb.OpenTryOnRequest(garments=first, consent=pb.Consent(given=True)), timeout=5).try_on_id
    stream = compositor.StreamFrames(pb.StreamFramesRequest(try_on_id=try_on, width=640, height=480))
    begun = time.monotonic()
    frames, latencies, last, states = 0, [], None, []

    def pictures():
        nonlocal last
        for message in stream:
            kind = message.WhichOneof("event")
            if kind == "status":
                states.append(pb.TryOnState.Name(message.status.state))
                continue
            p = message.picture
            assert p.image[:2] == b"\xff\xd8", "not a JPEG"
            if last is not None and last[0] == p.frame.epoch:
                assert p.frame.sequence > last[1], "frames out of order"
            last = (p.frame.epoch, p.frame.sequence)
            yield p

    def keep(name, p):
        if args.out:
            args.out.mkdir(parents=True, exist_ok=True)
            (args.out / f"{name}.jpg").write_bytes(p.image)

    chosen = changed = None
    for p in pictures():
        if frames == 0 and args.live and p.state != pb.TRY_ON_STATE_LIVE:
            assert time.monotonic() - begun < args.live, f"never live; states {states}"
            continue
        if frames == 0:
            live = time.monotonic()
        frames += 1
        latencies.append(p.latency_ms)
        if frames == args.frames:
            keep("first", p)
            took = time.monotonic() - live
            second = [common.GarmentChoice(garment=args.second, size="M")]
            request = pb.ChooseGarmentsRequest(try_on_id=try_on, garments=second)
            revision = compositor.ChooseGarments(request, timeout=5).outfit_revision
            chosen = time.monotonic()
        if chosen and (p.outfit_revision == revision or not args.live):
            changed = time.monotonic() - chosen
            keep("second", p)
            break
        assert not chosen or time.monotonic() - chosen < 60, "the garment never changed"
    compositor.CloseTryOn(pb.CloseTryOnRequest(try_on_id=try_on), timeout=5)
    for _ in pictures():
        pass
    assert states[-1] == "TRY_ON_STATE_CLOSED", states
    print(json.dumps({
        "frames": frames,
        "first_live_s": round(live - begun, 2),
        "rate": round((args.frames - 1) / took, 1),
        "latency_ms": {"p50": round(statistics.median(latencies), 1), "p99": round(percentile(latencies, 0.99), 1)},
        "garment_changed_s": round(changed, 2),
        "stages_ms": {s.stage: round(s.ms, 2) for s in p.stages},
    }))


if __name__ == "__main__":
    main()
