#!/usr/bin/env python3
"""The programs of examples/cameras, each run against a capture service and a device that needs no hardware: librealsense's
software device and its recorder, libk4a's playback of a device's recording, OpenNI2's dummy device, the playback of
Orbbec's SDK, and a stand-in of DepthAI, whose pipelines want a device. What the service records is read by PyPI's `mcap` and must be what the device showed.

    apt-get install libopenni2-0 && pip install -r tests/clients/camera_sources/requirements.txt
    pip install --no-deps pyorbbecsdk2  # The wheel asks for viewers that its module does without.
    python3 tests/clients/cameras.py [--bin target/debug] [--only realsense,k4a,openni,orbbec,depthai]

Exit status 0 when every frame's depth is equal pixel for pixel, and every calibration to 1e-6."""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from camera_sources import families  # noqa: E402
from camera_sources.judge import judge  # noqa: E402
from camera_sources.service import CaptureService  # noqa: E402

EXAMPLES = HERE.parents[1] / "examples/cameras"
# A started program imports its SDK and finds its device within this time.
LIMIT_S = 60.0


def run(family, binaries, folder):
    """Figures of one family."""
    service = CaptureService(binaries, folder)
    path = [str(HERE), str(HERE / "camera_sources/stand_ins"), os.environ.get("PYTHONPATH", "")]
    arguments = family.prepare(folder)
    environment = {**os.environ, **family.environment(folder), "PYTHONPATH": os.pathsep.join(path)}
    command = [sys.executable, str(EXAMPLES / family.program), "--address", service.address, *arguments]
    # Some SDKs leave a log where they run.
    program = subprocess.Popen(command, env=environment, cwd=folder)
    try:
        service.begin_recording(LIMIT_S)
        if family.ends:
            assert program.wait(LIMIT_S) == 0, f"{family.program} failed"
        else:
            service.wait_for_frames(family.frames, LIMIT_S)
        file, device = service.end_recording()
        return {"device": device, **judge(file, family)}
    finally:
        program.kill()
        program.wait()
        service.stop()


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--bin", type=pathlib.Path, default=HERE.parents[1] / "target/debug")
    args.add_argument("--only", default="", help="families, with commas between")
    args = args.parse_args()
    chosen = [f for f in families.ALL if not args.only or f.name in args.only.split(",")]
    assert chosen, f"no family of {args.only}"
    figures = {}
    for family in chosen:
        with tempfile.TemporaryDirectory() as folder:
            figures[family.name] = run(family, args.bin.resolve(), pathlib.Path(folder))
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
