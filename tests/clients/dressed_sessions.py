#!/usr/bin/env python3
"""Resident memory of a box over dressed sessions, one after another: each opens a try-on, waits for a picture with
garments on, and closes.

    cargo build --release -p tryon-cli --bin tryon
    python3 tests/clients/dressed_sessions.py [--program target/release/tryon] [--sessions 500] [--most 5]

Needs `pip install grpcio grpcio-tools psutil`. Prints CSV, a line every 50 sessions: sessions, seconds since the start,
processor seconds, resident memory (MiB), its anonymous part (MiB), threads, descriptors. Exit status 1 when resident
memory grew by more than `--most` MiB from the first line to the last. Other allocators: `--env
LD_PRELOAD=/usr/lib/x86_64-linux-gnu/libjemalloc.so.2`."""

import argparse
import itertools
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import grpc
import psutil

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from grpc_client import Presenting, stubs  # noqa: E402
from separate_processes import free_ports  # noqa: E402

LIVE_S = 150.0
# After a close the sessions behind it end, and an allocator that decays returns its pages within ten seconds. The least
# of that time counts.
SETTLE_S = 20


def configuration(args):
    """One box on free ports, a synthetic person before its camera."""
    bus, *ports = free_ports(9)
    of = dict(zip(("capture", "tracking", "cloth", "compositor"), ports[:4]))
    url = {name: f"http://127.0.0.1:{port}" for name, port in of.items()}
    lines = ["[bus]", f'listen = ["tcp/127.0.0.1:{bus}"]', f'connect = ["tcp/127.0.0.1:{bus}"]']
    for (name, port), admin in zip(of.items(), ports[4:]):
        lines += [f"[{name}]", f'address = "127.0.0.1:{port}"', f'admin = "127.0.0.1:{admin}"']
        if name in ("cloth", "compositor"):
            lines += [f'tracking = "{url["tracking"]}"']
        if name == "cloth":
            lines += ["adapts_detail = false"]
        if name == "compositor":
            lines += [f'cloth = "{url["cloth"]}"', f'capture = "{url["capture"]}"', "by_capacity = false"]
    lines += ["[[capture.cameras]]", 'name = "front"', f'source = "{args.source}"', f"rate = {args.rate}"]
    return of["compositor"], "\n".join(lines) + "\n"


class Shopper:
    """Opens, wears and closes, on one connection."""

    def __init__(self, port, token, garments):
        self.pb, rpc, common = stubs()
        options = [("grpc.max_receive_message_length", 16 << 20)]
        channel = grpc.insecure_channel(f"127.0.0.1:{port}", options=options)
        self.compositor = rpc.CompositorServiceStub(grpc.intercept_channel(channel, Presenting(token)))
        self.choices = [common.GarmentChoice(garment=g, size="M") for g in garments]

    def visit(self, name):
        """One dressed session."""
        pb, consent = self.pb, self.pb.Consent(given=True)
        request = pb.OpenTryOnRequest(try_on_id=name, garments=self.choices, consent=consent)
        self.compositor.OpenTryOn(request, timeout=LIVE_S, wait_for_ready=True)
        stream = self.compositor.StreamFrames(pb.StreamFramesRequest(try_on_id=name, width=320, height=240), timeout=LIVE_S)
        is_live = lambda m: m.WhichOneof("event") == "picture" and m.picture.state == pb.TRY_ON_STATE_LIVE
        next(filter(is_live, stream))
        self.compositor.CloseTryOn(pb.CloseTryOnRequest(try_on_id=name), timeout=LIVE_S)
        for _ in stream:
            pass


def memory_mib(pid):
    """Resident memory of a process, and its anonymous part (MiB)."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return [int(re.search(rf"{key}:\s+(\d+) kB", status)[1]) / 1024 for key in ("VmRSS", "RssAnon")]


def settled(pid):
    """The least resident memory within the time in which a box settles, and its anonymous part (MiB)."""
    least = [math.inf, math.inf]
    for _ in range(SETTLE_S):
        time.sleep(1.0)
        least = min(least, memory_mib(pid))
    return least


def soak(args, box, shopper):
    """Growth of resident memory from the first count to the last (MiB)."""
    begun, process, counts = time.monotonic(), psutil.Process(box.pid), []
    print("sessions,seconds,cpu_s,resident_mib,anonymous_mib,threads,descriptors")
    for n in itertools.count(1):
        shopper.visit(f"visit-{n}")
        time.sleep(args.pause)
        if n % args.every == 0 or n == args.sessions:
            (resident, anonymous), cpu = settled(box.pid), sum(process.cpu_times()[:2])
            counts.append(resident)
            figures = f"{cpu:.0f},{resident:.1f},{anonymous:.1f},{process.num_threads()},{process.num_fds()}"
            print(f"{n},{time.monotonic() - begun:.0f},{figures}", flush=True)
        if n == args.sessions:
            return counts[-1] - counts[0]


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--program", type=pathlib.Path, default="target/release/tryon")
    args.add_argument("--sessions", type=int, default=500)
    args.add_argument("--every", type=int, default=50, help="sessions between two counts")
    args.add_argument("--source", default="synth:still")
    args.add_argument("--rate", type=float, default=15.0, help="exposures a second")
    args.add_argument("--garments", nargs="+", default=["tshirt"])
    args.add_argument("--pause", type=float, default=0.0, help="seconds between sessions")
    args.add_argument("--env", nargs="*", default=[], metavar="NAME=VALUE", help="environment of the box alone")
    args.add_argument("--most", type=float, help="growth of resident memory that passes (MiB)")
    args = args.parse_args()
    port, text = configuration(args)
    with tempfile.TemporaryDirectory() as folder:
        config = pathlib.Path(folder, "box.toml")
        config.write_text(text)
        environment = os.environ | dict(e.split("=", 1) for e in args.env)
        command = [args.program.resolve(), "up", "--config", config]
        box = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        try:
            token = next(line.split("#token=")[1].strip() for line in box.stdout if "#token=" in line)
            growth = soak(args, box, Shopper(port, token, args.garments))
        finally:
            box.terminate()
            box.wait()
    print(f"growth {growth:.1f} MiB", file=sys.stderr)
    if args.most is not None and growth > args.most:
        sys.exit(1)


if __name__ == "__main__":
    main()
