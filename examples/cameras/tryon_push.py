"""Feeds a camera of the capture service whose `source` is "push", from whatever program reads the device.

    pip install grpcio grpcio-tools numpy
"""

import argparse
import os
import pathlib
import queue
import sys
import time

import grpc
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto"))
messages, services = grpc.protos_and_services("tryon/v1/capture.proto")
common = grpc.protos("tryon/v1/common.proto")

RGB8, BGR8, JPEG, YUYV = (messages.ColorEncoding.Value(f"COLOR_ENCODING_{n}") for n in ("RGB8", "BGR8", "JPEG", "YUYV"))


def parser(doc):
    """Arguments of a program that feeds a camera."""
    p = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--address", default="127.0.0.1:7451", help="of the capture service")
    p.add_argument("--camera", default="front")
    p.add_argument("--token", default=os.environ.get("TRYON_TOKEN"), help="a file (TRYON_TOKEN)")
    p.add_argument("--play", help="a recording instead of a device")
    return p


def lens(width, height, fx, fy, cx, cy, distortion=()):
    """A pinhole in pixels, and OpenCV's k1, k2, p1, p2, k3, k4, k5, k6: none, four, five or eight of them."""
    pinhole = common.Intrinsics(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy)
    return messages.Lens(intrinsics=pinhole, distortion=map(float, distortion))


def pose(rotation, translation):
    """From a 3 × 3 rotation, row by row, and metres."""
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(rotation, float)
    # Shepperd 1978: of four forms the one with the largest divisor.
    q = max(
        (1 + a + e + i, (h - f, c - g, d - b, 1 + a + e + i)),
        (1 + a - e - i, (1 + a - e - i, b + d, c + g, h - f)),
        (1 - a + e - i, (b + d, 1 - a + e - i, f + h, c - g)),
        (1 - a - e + i, (c + g, f + h, 1 - a - e + i, d - b)),
    )[1]
    norm = sum(v * v for v in q) ** 0.5
    x, y, z, w = (v / norm for v in q)
    return common.RigidTransform(
        translation=common.Vector3(**dict(zip("xyz", map(float, np.ravel(translation))))),
        rotation=common.Quaternion(x=x, y=y, z=z, w=w)
    )


class Push:
    """One camera, from its description to `close`. `waits`: frames of a recording are sent until somebody watches."""

    def __init__(self, address, camera, depth, waits=False, metadata=(), **described):
        self._requests, self._number, self._waits = queue.Queue(), 0, waits
        described = {"depth_unit": 0.001, **described}
        description = messages.CameraDescription(camera=camera, depth=depth, **described)
        self._requests.put(messages.PublishFramesRequest(description=description))
        # Raw pictures are larger than gRPC's messages are by default.
        channel = grpc.insecure_channel(address, options=[("grpc.max_send_message_length", 1 << 24)])
        stub = services.CaptureServiceStub(channel)
        self._answers = stub.PublishFrames(iter(self._requests.get, None), metadata=metadata)

    def send(self, depth, color, encoding, time_ns):
        """Sends a frame and waits for its answer: TAKEN, REPLACED, UNWATCHED or REFUSED (and why)."""
        self._number += 1
        frame = messages.CameraFrame(
            number=self._number,
            capture_time_ns=time_ns,
            depth=bytes(depth),
            color=bytes(color),
            color_encoding=encoding,
        )
        while True:
            self._requests.put(messages.PublishFramesRequest(frame=frame))
            answer = next(self._answers)
            outcome = messages.FrameOutcome.Name(answer.outcome).removeprefix("FRAME_OUTCOME_")
            if outcome != "UNWATCHED" or not self._waits:
                return outcome, answer.detail
            time.sleep(0.1)

    def close(self):
        self._requests.put(None)
        for _ in self._answers:
            pass


def opened(args, **described):
    """The camera of a program's arguments."""
    token = pathlib.Path(args.token).read_text().strip() if args.token else ""
    metadata = [("authorization", f"Bearer {token}")] if token else ()
    return Push(args.address, args.camera, waits=bool(args.play), metadata=metadata, **described)
