"""A RealSense recording of the scene: librealsense's software device, written by its recorder."""

import time

import numpy as np
import pyrealsense2 as rs

from . import scene


def intrinsics(size, k, model, coefficients):
    i = rs.intrinsics()
    i.width, i.height = size
    i.fx, i.fy, i.ppx, i.ppy = k
    i.model, i.coeffs = model, coefficients
    return i


def stream(sensor, kind, number, lens, form, bytes_per_pixel):
    s = rs.video_stream()
    s.type, s.index, s.uid, s.fmt = kind, 0, number, form
    s.width, s.height, s.fps, s.bpp = lens.width, lens.height, 30, bytes_per_pixel
    s.intrinsics = lens
    return sensor.add_video_stream(s).as_video_stream_profile()


def picture(profile, pixels, bytes_per_pixel, number):
    f = rs.software_video_frame()
    f.pixels, f.stride, f.bpp = pixels, pixels.shape[1] * bytes_per_pixel, bytes_per_pixel
    f.timestamp, f.domain = scene.time_us(number) * 1e-3, rs.timestamp_domain.hardware_clock
    f.frame_number, f.profile, f.depth_units = number + 1, profile, scene.UNIT
    return f


def record(path):
    device = rs.software_device()
    device.register_info(rs.camera_info.name, "Software D400")
    device.register_info(rs.camera_info.serial_number, "0042")
    depth, color = device.add_sensor("Stereo Module"), device.add_sensor("RGB Camera")
    depth.add_read_only_option(rs.option.depth_units, scene.UNIT)
    lens = intrinsics(scene.DEPTH_SIZE, scene.DEPTH_K, rs.distortion.brown_conrady, [0.0] * 5)
    of_depth = stream(depth, rs.stream.depth, 1, lens, rs.format.z16, 2)
    lens = intrinsics(scene.COLOR_SIZE, scene.COLOR_K, rs.distortion.inverse_brown_conrady, list(scene.COLOR_DISTORTION))
    of_color = stream(color, rs.stream.color, 2, lens, rs.format.rgb8, 3)
    way = rs.extrinsics()
    # Column by column.
    way.rotation, way.translation = list(scene.rotation().T.ravel()), list(scene.TRANSLATION)
    of_depth.register_extrinsics_to(of_color, way)

    recorder = rs.recorder(str(path), device)
    sensors = recorder.query_sensors()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(lambda frame: None)
    for number in range(scene.COUNT):
        depth.on_video_frame(picture(of_depth, scene.depth(number), 2, number))
        color.on_video_frame(picture(of_color, np.ascontiguousarray(scene.color(number)), 3, number))
        # The recorder writes on a thread of its own.
        time.sleep(0.05)
    for sensor in sensors:
        sensor.stop()
        sensor.close()
