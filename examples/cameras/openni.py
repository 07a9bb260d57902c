"""OpenNI2 cameras (PrimeSense, Xtion, Astra), or a recording of one (.oni): frames to the capture service.

    apt-get install libopenni2-dev && pip install primesense grpcio grpcio-tools numpy
    OPENNI2_REDIST=/usr/lib/x86_64-linux-gnu python3 openni.py [--address 127.0.0.1:7451] [--camera front] [--play FILE]
"""

import math
import sys

import tryon_push as push
from primesense import openni2
from primesense import _openni2 as c

TO_COLOR = c.OniImageRegistrationMode.ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR


def lens(stream, fov):
    """OpenNI2 tells the field of view and no distortion."""
    mode = stream.video_mode
    w, h = mode.resolutionX, mode.resolutionY
    across, up = map(math.radians, fov) if fov else (stream.get_horizontal_fov(), stream.get_vertical_fov())
    return push.lens(w, h, 0.5 * w / math.tan(0.5 * across), 0.5 * h / math.tan(0.5 * up), 0.5 * (w - 1), 0.5 * (h - 1))


def main():
    p = push.parser(__doc__)
    p.add_argument("--fov", type=float, nargs=2, help="of a device that does not tell it, across and up, degrees")
    args = p.parse_args()
    openni2.initialize()
    device = openni2.Device(args.play.encode() if args.play else None)
    depth, color = device.create_depth_stream(), device.create_color_stream()
    # One pinhole serves both where depth is drawn in the view of the colour camera.
    if device.is_image_registration_mode_supported(TO_COLOR):
        device.set_image_registration_mode(TO_COLOR)
    else:
        print("depth is not registered to colour by the device: taken as registered", file=sys.stderr)
    device.set_depth_color_sync_enabled(True)
    depth.start()
    color.start()
    name = device.get_device_info().name.decode()
    sender = push.opened(args, depth=lens(depth, args.fov), depth_unit=0.001, device=name[:64])
    while True:
        d, rgb = depth.read_frame(), color.read_frame()
        sender.send(d.get_buffer_as_uint8(), rgb.get_buffer_as_uint8(), push.RGB8, d.timestamp * 1000)


if __name__ == "__main__":
    main()
