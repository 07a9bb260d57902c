"""Azure Kinect, or a recording of one (.mkv): frames to the capture service.

    pip install pyk4a-bundle "numpy<2" grpcio grpcio-tools
    python3 k4a.py [--address 127.0.0.1:7451] [--camera front] [--play FILE.mkv]
"""

import contextlib

import pyk4a
import tryon_push as push
from pyk4a import CalibrationType, ImageFormat

ENCODINGS = {ImageFormat.COLOR_MJPG: push.JPEG, ImageFormat.COLOR_YUY2: push.YUYV}
DEPTH, COLOR = CalibrationType.DEPTH, CalibrationType.COLOR
# Of colour, by the number of its resolution.
SIZES = [None, (1280, 720), (1920, 1080), (2560, 1440), (2048, 1536), (3840, 2160), (4096, 3072)]


def captures(read):
    """Captures with both images, to the end of a recording."""
    with contextlib.suppress(EOFError):
        while True:
            capture = read()
            if capture.depth is not None and capture.color is not None:
                yield capture


def lens(calibration, camera, size):
    (fx, _, cx), (_, fy, cy), _ = calibration.get_camera_matrix(camera)
    return push.lens(*size, fx, fy, cx, cy, calibration.get_distortion_coefficients(camera))


def described(calibration, depth):
    return {
        "depth": lens(calibration, DEPTH, depth.shape[::-1]),
        "color": lens(calibration, COLOR, SIZES[calibration.color_resolution]),
        "color_from_depth": push.pose(*calibration.get_extrinsic_parameters(DEPTH, COLOR)),
    }


def main():
    args = push.parser(__doc__).parse_args()
    if args.play:
        device = pyk4a.PyK4APlayback(args.play)
        device.open()
        encoding, name, read = ENCODINGS[device.configuration["color_format"]], "Azure Kinect", device.get_next_capture
    else:
        device = pyk4a.PyK4A(pyk4a.Config(color_format=ImageFormat.COLOR_MJPG))
        device.start()
        encoding, name, read = push.JPEG, f"Azure Kinect {device.serial}", device.get_capture
    sender = None
    for c in captures(read):
        sender = sender or push.opened(args, device=name, **described(device.calibration, c.depth))
        sender.send(c.depth, c.color, encoding, c.depth_timestamp_usec * 1000)
    if sender:
        sender.close()


if __name__ == "__main__":
    main()
