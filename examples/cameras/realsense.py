"""RealSense D400 series, L515, or a recording of one: frames to the capture service.

    pip install pyrealsense2 grpcio grpcio-tools numpy
    python3 realsense.py [--address 127.0.0.1:7451] [--camera front] [--play FILE.bag]
"""

import argparse

import numpy as np
import pyrealsense2 as rs
import tryon_push as push


def lens(profile):
    k = profile.as_video_stream_profile().intrinsics
    # Only these two models are polynomials of the ray; inverse ones are undistorted by the device.
    coefficients = list(k.coeffs) if k.model in (rs.distortion.brown_conrady, rs.distortion.modified_brown_conrady) else []
    return push.lens(k.width, k.height, k.fx, k.fy, k.ppx, k.ppy, coefficients)


def described(profile):
    """Description of a started pipeline."""
    depth, color = profile.get_stream(rs.stream.depth), profile.get_stream(rs.stream.color)
    way = depth.get_extrinsics_to(color)
    # Rotations of librealsense are column by column.
    rotation = np.array(way.rotation).reshape(3, 3).T
    device = profile.get_device()
    unit = device.first_depth_sensor().get_depth_scale()
    name = f"{device.get_info(rs.camera_info.name)} {device.get_info(rs.camera_info.serial_number)}"
    return {
        "depth": lens(depth),
        "color": lens(color),
        "color_from_depth": push.pose(rotation, way.translation),
        "depth_unit": unit,
        "device": name[:64],
    }


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--address", default="127.0.0.1:7451")
    p.add_argument("--camera", default="front")
    p.add_argument("--play", help="a recording instead of a device")
    args = p.parse_args()
    pipeline, config = rs.pipeline(), rs.config()
    if args.play:
        config.enable_device_from_file(args.play, repeat_playback=False)
    config.enable_stream(rs.stream.depth, 0, 0, 0, rs.format.z16, 30)
    config.enable_stream(rs.stream.color, 0, 0, 0, rs.format.rgb8, 30)
    sender = push.Push(args.address, args.camera, **described(pipeline.start(config)))
    while True:
        frames = pipeline.wait_for_frames()
        depth, color = frames.get_depth_frame(), frames.get_color_frame()
        sender.send(depth.get_data(), color.get_data(), push.RGB8, int(frames.get_timestamp() * 1e6))


if __name__ == "__main__":
    main()
