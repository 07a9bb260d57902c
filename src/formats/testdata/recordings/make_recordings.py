"""Recordings of 3 frames by the trade's own writers, and `expected.json`: their content as the same libraries read it.

    pip install rosbags mcap mcap-ros1-support mcap-ros2-support numpy pillow
    python make_recordings.py        # writes beside itself

Depth is 12×9, colour 48×32 from a camera of its own, 5 ms later; infrared and an IMU lie beside them.
"""

import io
import json
import shutil
import struct
import zlib
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros1.decoder import DecoderFactory as Ros1Decoder
from mcap_ros2.decoder import DecoderFactory as Ros2Decoder
from PIL import Image
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import StoragePlugin, Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = Path(__file__).parent
START = 1_700_000_000_000_000_000
STEP = 33_333_333
FRAMES = 3
WIDTH, HEIGHT = 12, 9
# Large enough for overflow pages of SQLite.
COLOR_WIDTH, COLOR_HEIGHT = 48, 32
DEPTH_K = [10.5, 0.0, 5.5, 0.0, 11.0, 4.25, 0.0, 0.0, 1.0]
COLOR_K = [42.0, 0.0, 23.75, 0.0, 43.5, 15.5, 0.0, 0.0, 1.0]
COLOR_D = [-0.21, 0.05, 0.001, -0.002, 0.01]
# Poses of the optical frames in `camera_link`: translation and quaternion x, y, z, w.
OPTICAL = (-0.5, 0.5, -0.5, 0.5)
POSES = {
    "depth_optical": ((0.0, 0.01, 0.0), OPTICAL),
    "color_optical": ((0.0, -0.015, 0.002), OPTICAL),
}
# 1 m and out of range, as compressed_depth_image_transport quantises inverse depth.
QUANT = (1000.0, -20.0)


def depth_image(i):
    v = np.arange(WIDTH * HEIGHT, dtype=np.uint32).reshape(HEIGHT, WIDTH)
    image = (500 + v * 37 + i * 11).astype(np.uint16)
    image[0, 0] = 0
    return image


def color_image(i):
    v = np.arange(COLOR_WIDTH * COLOR_HEIGHT, dtype=np.uint32).reshape(COLOR_HEIGHT, COLOR_WIDTH)
    return np.stack([v % 256, (v * 3 + i) % 256, (255 - v) % 256], axis=-1).astype(np.uint8)


def png(array):
    out = io.BytesIO()
    Image.fromarray(array).save(out, "PNG")
    return out.getvalue()


class Messages:
    """Constructors of messages for one typestore of rosbags."""

    def __init__(self, store, is_ros1):
        self.types, self.is_ros1 = store.types, is_ros1

    def make(self, name, **fields):
        return self.types[name](**fields)

    def header(self, time, frame):
        stamp = self.make("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)
        extra = {"seq": 7} if self.is_ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **extra)

    def image(self, time, frame, encoding, array, big_endian=False):
        data = array.astype(array.dtype.newbyteorder(">")) if big_endian else array
        return self.make(
            "sensor_msgs/msg/Image",
            header=self.header(time, frame),
            height=array.shape[0],
            width=array.shape[1],
            encoding=encoding,
            is_bigendian=int(big_endian),
            step=array.shape[1] * array.itemsize * (array.shape[2] if array.ndim == 3 else 1),
            data=np.frombuffer(data.tobytes(), np.uint8),
        )

    def compressed(self, time, frame, form, data):
        data = np.frombuffer(data, np.uint8)
        header = self.header(time, frame)
        return self.make("sensor_msgs/msg/CompressedImage", header=header, format=form, data=data)

    def camera(self, time, frame, width, height, k, d):
        keys = ("D", "K", "R", "P") if self.is_ros1 else ("d", "k", "r", "p")
        p = [k[0], 0, k[2], 0, 0, k[4], k[5], 0, 0, 0, 1, 0]
        values = (d, k, [1, 0, 0, 0, 1, 0, 0, 0, 1], p)
        roi = self.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self.make(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(time, frame),
            height=height,
            width=width,
            distortion_model="plumb_bob",
            binning_x=0,
            binning_y=0,
            roi=roi,
            **{key: np.array(v, np.float64) for key, v in zip(keys, values)},
        )

    def transform(self, translation, rotation):
        x, y, z = translation
        vector = self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
        x, y, z, w = rotation
        quaternion = self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
        return self.make("geometry_msgs/msg/Transform", translation=vector, rotation=quaternion)

    def transforms(self, time):
        stamped = [
            self.make(
                "geometry_msgs/msg/TransformStamped",
                header=self.header(time, "camera_link"),
                child_frame_id=frame,
                transform=self.transform(*pose),
            )
            for frame, pose in POSES.items()
        ]
        return self.make("tf2_msgs/msg/TFMessage", transforms=stamped)

    def imu(self, time):
        zero = self.make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        none = np.zeros(9)
        return self.make(
            "sensor_msgs/msg/Imu",
            header=self.header(time, "imu"),
            orientation=self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=none,
            angular_velocity=zero,
            angular_velocity_covariance=none,
            linear_acceleration=zero,
            linear_acceleration_covariance=none,
        )


def ros_topics(m):
    """(topic, type, time, message), grouped by topic: colour after all depth."""
    tf, info, image = "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Image"
    yield "/tf_static", tf, START, m.transforms(START)
    yield "/cam/imu", "sensor_msgs/msg/Imu", START, m.imu(START)
    camera = m.camera(START, "depth_optical", WIDTH, HEIGHT, DEPTH_K, [0.0] * 5)
    yield "/cam/depth/camera_info", info, START, camera
    camera = m.camera(START, "color_optical", COLOR_WIDTH, COLOR_HEIGHT, COLOR_K, COLOR_D)
    yield "/cam/color/camera_info", info, START, camera
    for i in range(FRAMES):
        t = START + i * STEP
        big = i == 1
        yield "/cam/depth/image_raw", image, t, m.image(t, "depth_optical", "16UC1", depth_image(i), big)
        infra = np.full((HEIGHT, WIDTH), 40, np.uint8)
        yield "/cam/infra1/image_raw", image, t, m.image(t, "depth_optical", "mono8", infra)
    for i in range(FRAMES):
        t = START + i * STEP + 5_000_000
        bgr = np.ascontiguousarray(color_image(i)[:, :, ::-1])
        yield "/cam/color/image_raw", image, t, m.image(t, "color_optical", "bgr8", bgr)


def realsense_topics(m):
    """The layout of the RealSense SDK's recorder: no frames of reference, mono16, a unit of 0.1 mm."""
    image, sensor = "sensor_msgs/msg/Image", "/device_0/sensor_{}"
    streams = {
        "Depth_0": (0, WIDTH, HEIGHT, DEPTH_K, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))),
        "Color_0": (1, COLOR_WIDTH, COLOR_HEIGHT, COLOR_K, ((0.0149, 0.0002, -0.0003), (0.0, 0.0, 0.0, 1.0))),
    }
    unit = m.make("std_msgs/msg/Float32", data=0.0001)
    yield "/device_0/sensor_0/option/Depth Units/value", "std_msgs/msg/Float32", 1, unit
    for name, (s, width, height, k, pose) in streams.items():
        prefix = f"{sensor.format(s)}/{name}"
        camera = m.camera(0, "", width, height, k, [0.0] * 5)
        yield f"{prefix}/info/camera_info", "sensor_msgs/msg/CameraInfo", 1, camera
        yield f"{prefix}/tf/0", "geometry_msgs/msg/Transform", 1, m.transform(*pose)
    for i in range(FRAMES):
        t = START + i * STEP
        depth = m.image(t, "0", "mono16", depth_image(i) * np.uint16(10))
        yield "/device_0/sensor_0/Depth_0/image/data", image, t, depth
        infra = np.full((HEIGHT, WIDTH), 40, np.uint8)
        yield "/device_0/sensor_0/Infrared_1/image/data", image, t, m.image(t, "0", "8UC1", infra)
        color = m.image(t + 5_000_000, "0", "rgb8", color_image(i))
        yield "/device_0/sensor_1/Color_0/image/data", image, t + 5_000_000, color


def write_bag(path, topics, store, compression=None):
    path.unlink(missing_ok=True)
    writer = BagWriter(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {}
        for topic, kind, time, message in topics:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], time, store.serialize_ros1(message, kind))


def write_rosbag2(path, topics, store, plugin):
    shutil.rmtree(path, ignore_errors=True)
    with Rosbag2Writer(path, version=8, storage_plugin=plugin) as writer:
        connections = {}
        for topic, kind, time, message in topics:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], time, store.serialize_cdr(message, kind))


IMAGE_DEFINITION = """std_msgs/Header header
string format
uint8[] data
================================================================================
MSG: std_msgs/Header
{seq}{time} stamp
string frame_id
"""
INFO_DEFINITION = """std_msgs/Header header
uint32 height
uint32 width
string distortion_model
float64[] {d}
float64[9] {k}
float64[9] {r}
float64[12] {p}
================================================================================
MSG: std_msgs/Header
{seq}{time} stamp
string frame_id
"""


def compressed_topics(m):
    """compressedDepth (16UC1 and inverse depth) and PNG colour, as image_transport publishes them."""
    image = "sensor_msgs/msg/CompressedImage"
    camera = m.camera(START, "cam", WIDTH, HEIGHT, DEPTH_K, [])
    yield "/cam/camera_info", "sensor_msgs/msg/CameraInfo", START, camera
    for i in range(FRAMES):
        t = START + i * STEP
        data = png(color_image(i)[:HEIGHT, :WIDTH])
        color = m.compressed(t, "cam", "rgb8; png compressed bgr8", data)
        yield "/cam/rgb/compressed", image, t, color
        if m.is_ros1:
            raw, kind, quant = depth_image(i), "16UC1", (0.0, 0.0)
        else:
            inverse = QUANT[0] / (np.maximum(depth_image(i), 1) / 1000.0) + QUANT[1]
            raw = np.where(depth_image(i) == 0, 0, np.round(inverse)).astype(np.uint16)
            kind, quant = "32FC1", QUANT
        data = struct.pack("<Iff", 0, *quant) + png(raw)
        depth = m.compressed(t, "cam", f"{kind}; compressedDepth png", data)
        yield "/cam/depth/compressedDepth", image, t, depth


def definitions(is_ros1):
    words = {"seq": "uint32 seq\n" if is_ros1 else "", "time": "time" if is_ros1 else "builtin_interfaces/Time"}
    words |= dict(zip("dkrp", "DKRP" if is_ros1 else "dkrp"))
    tail = "" if is_ros1 else "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    texts = {"CompressedImage": IMAGE_DEFINITION, "CameraInfo": INFO_DEFINITION}
    return {name: text.format(**words) + tail for name, text in texts.items()}


def write_compressed(path, m, serialize):
    """MCAP in zstd chunks, the writer's default."""
    encoding, schema = ("ros1", "ros1msg") if m.is_ros1 else ("cdr", "ros2msg")
    texts, channels = definitions(m.is_ros1), {}
    with open(path, "wb") as out:
        writer = Writer(out)
        writer.start(encoding)
        for topic, kind, time, message in compressed_topics(m):
            if topic not in channels:
                name = kind.replace("/msg", "") if m.is_ros1 else kind
                text = texts[kind.split("/")[-1]].encode()
                known = writer.register_schema(name, schema, text)
                channels[topic] = writer.register_channel(topic, encoding, known)
            writer.add_message(channels[topic], time, bytes(serialize(message, kind)), time)
        writer.finish()


def stamp_of(header):
    stamp = header.stamp
    return getattr(stamp, "sec", getattr(stamp, "secs", 0)) * 10**9 + getattr(
        stamp, "nanosec", getattr(stamp, "nsecs", 0))


def pixels(message):
    """Depth in millimetres or RGB, by numpy and Pillow from what the library decoded."""
    if hasattr(message, "format"):
        data = bytes(message.data)
        if "compressedDepth" not in message.format:
            return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
        _, a, b = struct.unpack_from("<Iff", data)
        raw = np.asarray(Image.open(io.BytesIO(data[12:]))).astype(np.float64)
        if message.format.startswith("16UC1"):
            return raw.astype(int)
        return np.where(raw == 0, 0, np.round(1000.0 * a / (raw - b))).astype(int)
    shape = (message.height, message.width)
    data = bytes(message.data)
    if message.encoding in ("16UC1", "mono16"):
        order = ">" if message.is_bigendian else "<"
        return np.frombuffer(data, order + "u2").reshape(shape).astype(int)
    image = np.frombuffer(data, np.uint8).reshape(*shape, 3)
    return image[:, :, ::-1] if message.encoding == "bgr8" else image


def decoded(path):
    """(topic, message) by the library of the file's kind."""
    if path.suffix == ".mcap" and path.is_file():
        factories = [Ros1Decoder(), Ros2Decoder()]
        with open(path, "rb") as stream:
            for _, channel, _, message in make_reader(stream, decoder_factories=factories).iter_decoded_messages():
                yield channel.topic, message
        return
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([path], default_typestore=store) as reader:
        for connection, _, data in reader.messages():
            yield connection.topic, reader.deserialize(data, connection.msgtype)


def expected(path, depth_topic, color_topic, scale=1):
    depth, color, cameras = [], [], {}
    for topic, m in decoded(path):
        if topic == depth_topic:
            depth.append((stamp_of(m.header), pixels(m) // scale))
        elif topic == color_topic:
            color.append((stamp_of(m.header), pixels(m)))
        elif topic.endswith("camera_info"):
            k, d = (m.K, m.D) if hasattr(m, "K") else (m.k, m.d)
            cameras["color" if "olor" in topic else "depth"] = {
                "size": [m.width, m.height], "k": [float(x) for x in k], "d": [float(x) for x in d]}
    frames = []
    for time, image in depth:
        nearest = min(color, key=lambda c: abs(c[0] - time))
        frames.append({
            "time_ns": time, "depth": image.flatten().tolist(), "color_crc32": zlib.crc32(nearest[1].tobytes())})
    return {"cameras": cameras, "frames": frames}


def main():
    ros1, ros2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
    tf = "geometry_msgs/TransformStamped[] transforms"
    ros1.register(get_types_from_msg(tf, "tf2_msgs/msg/TFMessage"))
    m1, m2 = Messages(ros1, True), Messages(ros2, False)
    raw = ("/cam/depth/image_raw", "/cam/color/image_raw")
    sdk = ("/device_0/sensor_0/Depth_0/image/data", "/device_0/sensor_1/Color_0/image/data")
    compressed = ("/cam/depth/compressedDepth", "/cam/rgb/compressed")
    formats = BagWriter.CompressionFormat
    out = {}
    for name, compression in (("stored", None), ("bz2", formats.BZ2), ("lz4", formats.LZ4)):
        path = HERE / f"ros1_{name}.bag"
        write_bag(path, ros_topics(m1), ros1, compression)
        out[path.name] = expected(path, *raw)
    path = HERE / "realsense.bag"
    write_bag(path, realsense_topics(m1), ros1)
    out[path.name] = expected(path, *sdk, scale=10)
    for name, plugin in (("sqlite", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
        path = HERE / f"ros2_{name}"
        write_rosbag2(path, ros_topics(m2), ros2, plugin)
        out[path.name] = expected(path, *raw)
    for m, serialize in ((m1, ros1.serialize_ros1), (m2, ros2.serialize_cdr)):
        path = HERE / f"compressed_ros{1 if m.is_ros1 else 2}.mcap"
        write_compressed(path, m, serialize)
        out[path.name] = expected(path, *compressed)
    (HERE / "expected.json").write_text(json.dumps(out) + "\n")


if __name__ == "__main__":
    main()
