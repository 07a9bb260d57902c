"""OpenNI2 cameras (PrimeSense, Xtion, Astra): frames to the capture service.

    apt-get install libopenni2-0 && pip install primesense grpcio grpcio-tools numpy
    python3 openni.py [--address 127.0.0.1:7451] [--camera front]
"""

import argparse
import math

import tryon_push as push
from primesense import openni2
from primesense import _openni2 as c


def lens(stream):
    """OpenNI2 tells the field of view and no distortion."""
    mode = stream.video_mode
    w, h = mode.resolutionX, mode.resolutionY
    fx = 0.5 * w / math.tan(0.5 * stream.horizontal_fov)
    fy = 0.5 * h / math.tan(0.5 * stream.vertical_fov)
    return push.lens(w, h, fx, fy, 0.5 * (w - 1), 0.5 * (h - 1))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--address", default="127.0.0.1:7451")
    p.add_argument("--camera", default="front")
    args = p.parse_args()
    openni2.initialize()
    device = openni2.Device.open_any()
    depth, color = device.create_depth_stream(), device.create_color_stream()
    # The device draws depth in the view of the colour camera, so that one pinhole serves both.
    device.set_image_registration_mode(c.OniImageRegistrationMode.ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR)
    device.set_depth_color_sync_enabled(True)
    depth.start()
    color.start()
    name = device.get_device_info().name.decode()
    sender = push.Push(args.address, args.camera, depth=lens(depth), depth_unit=0.001, device=name[:64])
    while True:
        d, rgb = depth.read_frame(), color.read_frame()
        sender.send(d.get_buffer_as_uint8(), rgb.get_buffer_as_uint8(), push.RGB8, d.timestamp * 1000)


if __name__ == "__main__":
    main()
