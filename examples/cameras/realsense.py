"""RealSense D400 series, L515, or a recording of one: frames to the capture service.

    pip install pyrealsense2 grpcio grpcio-tools numpy
    python3 realsense.py [--address 127.0.0.1:7451] [--camera front] [--play FILE]
"""

import numpy as np
import pyrealsense2 as rs
import tryon_push as push

# The SDK finds rays of the inverse model as of OpenCV's too.
MODELS = ("none", "brown_conrady", "modified_brown_conrady", "inverse_brown_conrady")


def lens(profile):
    k = profile.intrinsics
    if k.model.name not in MODELS:
        raise SystemExit(f"lens model {k.model} is not known here")
    return push.lens(k.width, k.height, k.fx, k.fy, k.ppx, k.ppy, k.coeffs)


def described(profile):
    """Description of a started pipeline."""
    depth, color = (profile.get_stream(s).as_video_stream_profile() for s in (rs.stream.depth, rs.stream.color))
    way, device = depth.get_extrinsics_to(color), profile.get_device()
    name = f"{device.get_info(rs.camera_info.name)} {device.get_info(rs.camera_info.serial_number)}"
    return {
        "depth": lens(depth),
        "color": lens(color),
        # Rotations of librealsense are column by column.
        "color_from_depth": push.pose(np.reshape(way.rotation, (3, 3)).T, way.translation),
        "depth_unit": device.first_depth_sensor().get_depth_scale(),
        "device": name[:64],
    }


def main():
    args = push.parser(__doc__).parse_args()
    pipeline, config = rs.pipeline(), rs.config()
    if args.play:
        config.enable_device_from_file(args.play, repeat_playback=False)
    config.enable_stream(rs.stream.depth, 0, 0, 0, rs.format.z16, 30)
    config.enable_stream(rs.stream.color, 0, 0, 0, rs.format.rgb8, 30)
    profile = pipeline.start(config)
    if args.play:
        profile.get_device().as_playback().set_real_time(False)
    sender = push.opened(args, **described(profile))
    while (found := pipeline.try_wait_for_frames(5000))[0]:
        depth, color = found[1].get_depth_frame(), found[1].get_color_frame()
        # The SDK first pairs a depth image with the colour before it, more than half a period (17 ms) away.
        is_one_clock = depth.frame_timestamp_domain == color.frame_timestamp_domain
        if not is_one_clock or abs(depth.get_timestamp() - color.get_timestamp()) < 17:
            sender.send(depth.get_data(), color.get_data(), push.RGB8, round(depth.get_timestamp() * 1e6))
    sender.close()


if __name__ == "__main__":
    main()
