#!/usr/bin/env python3
"""Every topology that `deploy/` ships, as real processes: its own files, with this machine's addresses.

    python3 tests/topologies/main.py [--bin target/release] [--only compose store …] [--rate 15] [--out DIR]

A shopper sees garments live, and somebody listens to everything between the services, who may open no frame (without
identities, in `base`, all); then each process in turn is killed with SIGKILL and started again, and the shopper sees them
live again. Listening takes root and is skipped loudly without. Needs tests/clients/attacks/requirements.txt, and kubectl for the overlays, which are skipped loudly without it. Ends with 0 when all of it
happens; the figures are printed as JSON."""

import argparse
import contextlib
import json
import os
import pathlib
import shutil
import sys
import tempfile
import time
import types

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "clients")]
from attacks.range import stubs  # noqa: E402
from attacks.viewer import Viewer  # noqa: E402
from listener import Listener, prove  # noqa: E402
from running import Camera, Running, running  # noqa: E402
from shipped import TOPOLOGIES  # noqa: E402

READY_S, LIVE_S, CUT_S = 60.0, 60.0, 15.0


def shopper(ground: types.SimpleNamespace, box: Running) -> Viewer:
    """Somebody who wears a T-shirt."""
    return Viewer(ground, box, "shopper", garments=("tshirt",), width=320, height=240)


def is_live(seen: object) -> bool:
    """A picture with garments."""
    return seen.is_picture and seen.state == "LIVE"


def live_again(box: Running, ground: types.SimpleNamespace, viewer: Viewer, name: str) -> tuple[Viewer, float]:
    """Kills a process, and starts it again once the probe says so; seconds from its start to the next live picture."""
    box.kill(name)
    box.wait_ready(CUT_S, is_ready=False)
    # Pictures on their way arrive before the next start is timed.
    time.sleep(1.0)
    begun = time.monotonic()
    box.start(name)
    if name in ("compositor", "box"):
        viewer.close()
        box.wait_ready(READY_S)
        viewer = shopper(ground, box)
    at = viewer.wait(is_live, LIVE_S, since=begun)
    assert at - begun < LIVE_S, f"not live again after {name}; states {sorted(viewer.states())}; {box.log(name)}"
    return viewer, at - begun


def visit(ground: types.SimpleNamespace, box: Running) -> dict[str, object]:
    """A shopper's visit, and what it showed."""
    begun = time.monotonic()
    listener = Listener(box.block) if Listener.is_allowed() else None
    box.wait_ready(READY_S)
    ready = time.monotonic() - begun
    viewer = shopper(ground, box)
    viewer.wait_live(LIVE_S)
    figures: dict[str, object] = {"ready_s": round(ready, 2), "live_s": round(time.monotonic() - begun, 2)}
    if listener:
        figures["heard"] = heard = listener.close()
        is_private = heard["opened"] == 0
        assert is_private == box.has_identity, f"a listener between services: {heard}"
    box.wait_ready(CUT_S)
    again = {}
    for process in box.topology.lasting:
        viewer, seconds = live_again(box, ground, viewer, process.name)
        again[process.name] = round(seconds, 2)
        box.wait_ready(CUT_S)
    viewer.close()
    return figures | {"live_again_s": again}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, default=HERE.parents[1] / "target/release")
    parser.add_argument("--only", nargs="+", choices=TOPOLOGIES, default=list(TOPOLOGIES), metavar="NAME")
    parser.add_argument("--rate", type=float, default=15.0, help="frames a second of the camera")
    parser.add_argument("--out", type=pathlib.Path, help="keeps logs and files here")
    args = parser.parse_args()
    os.environ["PATH"] += f":{HERE.parents[1] / 'target/deploy-tools/bin'}"
    ground = types.SimpleNamespace(api=stubs())
    figures, faults = {}, 0
    if Listener.is_allowed():
        prove("127.19.0")
    elif os.environ.get("TRYON_REQUIRE_ALL"):
        parser.error("listening between services takes root")
    else:
        print("SKIPPED listening between services: takes root", flush=True)
    with contextlib.ExitStack() as stack:
        folder = args.out or pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for name in args.only:
            if name not in ("compose", "systemd", "up") and not shutil.which("kubectl"):
                print(f"SKIPPED {name}: no kubectl (tests/deploy/check fetches one)", flush=True)
                continue
            try:
                with running(TOPOLOGIES[name](), args.bin.resolve(), folder / name, Camera(rate=args.rate)) as box:
                    figures[name] = visit(ground, box)
                print(f"ok   {name}: {json.dumps(figures[name])}", flush=True)
            except (AssertionError, TimeoutError) as e:
                faults += 1
                print(f"MISS {name}: {e}", flush=True)
    print(json.dumps(figures, indent=1))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
