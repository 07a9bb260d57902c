"""Writes orbbec.bag: the scene as a Femto Bolt of Orbbec's SDK 2 records it, in the messages of its `RosbagWriter`.

    pip install rosbags numpy && cd tests/clients && python3 -m camera_sources.make_orbbec_bag
"""

import pathlib
import struct

import numpy as np
from rosbags.rosbag1 import Writer

from . import scene

FILE = pathlib.Path(__file__).with_name("orbbec.bag")
# Sums that the SDK's headers state for its own message types; that of images is ROS's.
DEVICE_SUM, OTHER_SUM = "afef5328bb4abebd1a309e1ea8b26b3a", "0123456789abcdef0123456789abcdef"
IMAGE_SUM = "060021388200f6f0f447d0fcd9c64743"
# Numbers of the SDK: sensors, frames and streams, formats, lens models.
COLOR, DEPTH = 2, 3
Y16, RGB = 8, 22
NO_MODEL, BROWN_CONRADY = 0, 3
# Vendor and product of a Femto Bolt, whose unit of depth is the millimetre.
DEVICE = (0x2BC5, 0x066B)
# Property that holds the version of the file's layout, a double.
VERSION_PROPERTY = 0


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def blob(data):
    return struct.pack("<I", len(data)) + data


def header(time_us):
    return struct.pack("<III", 0, time_us // 10**6, time_us % 10**6 * 1000) + text("")


def floats(values):
    return np.asarray(values, "<f4").tobytes()


def device_info(time_us):
    names = "Femto Bolt", "Playback of the scene", "asic"
    versions = "uid", "0043", "1.0.0", "1.0", "2.0.0", "USB3.0"
    parts = *map(text, names), struct.pack("<HH", *DEVICE), *map(text, versions), struct.pack("<HB", 0, 0), text(""), text("")
    return header(time_us) + b"".join(parts)


def stream_profile(time_us, stream, form, size, k, distortion, model):
    """`distortion` is k1 … k6, p1, p2; the way from depth to colour in millimetres."""
    way = floats(scene.rotation().ravel()) + floats(np.array(scene.TRANSLATION) * 1e3)
    lens = floats(k) + floats(distortion) + struct.pack("<B", model)
    return header(time_us) + struct.pack("<BB", stream, form) + way + struct.pack("<HHH", *size, 30) + lens


def image(time_us, number, encoding, pixels):
    step = pixels.strides[0]
    size = struct.pack("<II", *pixels.shape[:2])
    stamps = struct.pack("<IQQQ", number, time_us, time_us, time_us)
    return header(time_us) + size + text(encoding) + struct.pack("<BI", 0, step) + blob(pixels.tobytes()) + stamps + blob(b"") + struct.pack("<I", 0)


def main():
    FILE.unlink(missing_ok=True)
    start = scene.time_us(0)
    k1, k2, p1, p2, k3 = scene.COLOR_DISTORTION
    with Writer(FILE) as bag:

        def connection(topic, kind, md5):
            return bag.add_connection(topic, kind, msgdef="Header header\n", md5sum=md5)

        depth, color = (connection(f"/cam/sensor_{s}/frameType_{s}", "sensor_msgs/msg/Image", IMAGE_SUM) for s in (DEPTH, COLOR))
        for number in range(scene.COUNT):
            time_us = scene.time_us(number)
            bag.write(depth, time_us * 1000, image(time_us, number, "mono16", scene.depth_mm(number)))
            bag.write(color, time_us * 1000, image(time_us, number, "rgb8", scene.color(number)))
        at = start * 1000
        bag.write(connection("/cam/deviceInfo", "custom_msg/msg/OBDeviceInfo", DEVICE_SUM), at, device_info(start))
        version = struct.pack("<d", 2.0)
        stated = header(start) + struct.pack("<I", VERSION_PROPERTY) + blob(version) + struct.pack("<I", len(version))
        bag.write(connection("/cam/property", "custom_msg/msg/OBProperty", OTHER_SUM), at, stated)
        for stream, *lens in (
            (DEPTH, Y16, scene.DEPTH_SIZE, scene.DEPTH_K, [0] * 8, NO_MODEL),
            (COLOR, RGB, scene.COLOR_SIZE, scene.COLOR_K, [k1, k2, k3, 0, 0, 0, p1, p2], BROWN_CONRADY),
        ):
            topic = connection(f"/cam/streamProfileType_{stream}", "custom_msg/msg/OBStreamProfileInfo", OTHER_SUM)
            bag.write(topic, at, stream_profile(start, stream, *lens))


if __name__ == "__main__":
    main()
