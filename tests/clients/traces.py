#!/usr/bin/env python3
"""Traces of frames through four processes, received by a collector that shares nothing with this project but OTLP.

    cargo build --release --workspace --bins
    python3 tests/clients/traces.py [--bin target/release] [--rate 15]

Needs `pip install grpcio grpcio-tools opentelemetry-proto`. Exit status 0 when one trace holds spans of all four services
under the root of capture, with their stages as children; the figures are printed as JSON."""

import argparse
import collections
import json
import os
import pathlib
import sys
import tempfile
import threading
import time
from concurrent import futures

import grpc
from opentelemetry.proto.collector.trace.v1 import trace_service_pb2 as otlp
from opentelemetry.proto.collector.trace.v1 import trace_service_pb2_grpc as collector

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from grpc_client import stubs  # noqa: E402
from separate_processes import LIVE_S, SERVICES, Box, Viewer  # noqa: E402

WAIT_S = 20.0


class Collector(collector.TraceServiceServicer):
    """Spans by trace: (service, span), in order of arrival."""

    def __init__(self):
        self.traces = collections.defaultdict(list)
        self.lock = threading.Lock()

    def Export(self, request, context):
        with self.lock:
            for r in request.resource_spans:
                names = [a.value.string_value for a in r.resource.attributes if a.key == "service.name"]
                for scope in r.scope_spans:
                    for span in scope.spans:
                        self.traces[span.trace_id].append((names[0], span))
        return otlp.ExportTraceServiceResponse()

    def complete(self):
        """Traces with spans of all four services."""
        wanted = {f"tryon-{name}" for name in SERVICES}
        with self.lock:
            return [spans for spans in self.traces.values() if {service for service, _ in spans} == wanted]


def judge(spans):
    """Figures of one trace; fails where its tree is not that of the chain."""
    of_service = {s.name: (service, s) for service, s in spans if s.name in SERVICES}
    assert set(of_service) == set(SERVICES), sorted(of_service)
    root = of_service["capture"][1]
    assert not root.parent_span_id, "capture's span is not the root"
    stages = collections.defaultdict(list)
    for service, s in spans:
        assert service == f"tryon-{s.name.split('.')[0]}", (service, s.name)
        assert s.start_time_unix_nano <= s.end_time_unix_nano
        if s.name in SERVICES:
            assert s.name == "capture" or s.parent_span_id == root.span_id, f"{s.name} is not below capture"
        else:
            parent = s.name.split(".")[0]
            assert s.parent_span_id == of_service[parent][1].span_id, f"{s.name} is not below {parent}"
            stages[parent].append(s.name)
    assert all(stages[name] for name in SERVICES), dict(stages)
    ends = [of_service[name][1].end_time_unix_nano for name in SERVICES]
    assert ends == sorted(ends), "the chain ends in another order"
    return {"stages": {k: len(v) for k, v in stages.items()}, "ms": round((ends[-1] - root.start_time_unix_nano) / 1e6, 1)}


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--bin", type=pathlib.Path, default=HERE.parents[1] / "target/release")
    args.add_argument("--rate", type=float, default=15.0, help="frames a second of the camera")
    args = args.parse_args()
    received = Collector()
    server = grpc.server(futures.ThreadPoolExecutor(4))
    collector.add_TraceServiceServicer_to_server(received, server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    os.environ["TRYON_TELEMETRY__OTLP"] = f"http://127.0.0.1:{port}"
    with tempfile.TemporaryDirectory() as folder:
        box = Box(args.bin.resolve(), pathlib.Path(folder), args.rate)
        try:
            viewer = Viewer(box, stubs(), "shopper", "front", ["tshirt"])
            viewer.until(lambda m: viewer.picture(m, "LIVE"), LIVE_S, "LIVE")
            begun = time.monotonic()
            before = len(received.traces)
            while len(received.complete()) < 3 and time.monotonic() < begun + WAIT_S:
                time.sleep(0.1)
            took = time.monotonic() - begun
            traced = (len(received.traces) - before) / took
        finally:
            box.stop()
    complete = received.complete()
    assert len(complete) >= 3, f"{len(complete)} of {len(received.traces)} traces have spans of all four services"
    # One exposure a second of each of two cameras.
    assert traced < 4, f"{traced:.1f} traces a second"
    figures = judge(complete[-1])
    print(json.dumps({"traces": len(received.traces), "complete": len(complete), "a_second": round(traced, 1), **figures}))


if __name__ == "__main__":
    main()
