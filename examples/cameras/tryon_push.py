"""Feeds a camera of the capture service whose `source` is "push", from whatever program reads the device.

    pip install grpcio grpcio-tools numpy
"""

import pathlib
import queue
import sys

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto"))
messages, services = grpc.protos_and_services("tryon/v1/capture.proto")
common = grpc.protos("tryon/v1/common.proto")

RGB8, BGR8, JPEG, YUYV = (messages.ColorEncoding.Value(f"COLOR_ENCODING_{n}") for n in ("RGB8", "BGR8", "JPEG", "YUYV"))


def lens(width, height, fx, fy, cx, cy, distortion=()):
    """A pinhole in pixels, and OpenCV's k1, k2, p1, p2, k3, k4, k5, k6."""
    pinhole = common.Intrinsics(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy)
    return messages.Lens(intrinsics=pinhole, distortion=distortion)


def pose(rotation, translation):
    """From a 3 × 3 rotation, row by row, and metres."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
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
        translation=common.Vector3(**dict(zip("xyz", translation))), rotation=common.Quaternion(x=x, y=y, z=z, w=w)
    )


class Push:
    """One camera, from its description to `close`."""

    def __init__(self, address, camera, depth, color=None, color_from_depth=None, depth_unit=0.001, device="", metadata=()):
        self._requests, self._number = queue.Queue(), 0
        described = messages.CameraDescription(
            camera=camera, depth=depth, color=color, color_from_depth=color_from_depth, depth_unit=depth_unit, device=device
        )
        self._requests.put(messages.PublishFramesRequest(description=described))
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
        self._requests.put(messages.PublishFramesRequest(frame=frame))
        answer = next(self._answers)
        return messages.FrameOutcome.Name(answer.outcome).removeprefix("FRAME_OUTCOME_"), answer.detail

    def close(self):
        self._requests.put(None)
        for _ in self._answers:
            pass
