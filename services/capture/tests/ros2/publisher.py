"""ROS 2 cameras on zenoh by others' hands: messages by rosbags, the network by zenoh's own Python client.

    python3 publisher.py tcp/127.0.0.1:PORT EXPECTED.json

A router listens on the endpoint, and a peer publishes through it as rmw_zenoh's nodes and zenoh-bridge-ros2dds do.
EXPECTED.json gets the pictures of each camera, as numpy and Pillow have them. Prints `ready`, then one line whenever
somebody begins or ends to subscribe: `TOPIC on` or `TOPIC off`. Ends with its standard input.
"""

import io
import json
import re
import struct
import sys
import threading
import time
from pathlib import Path

import numpy as np
import zenoh
import zenoh.ext
from PIL import Image
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
INFO, TF = "sensor_msgs/msg/CameraInfo", "tf2_msgs/msg/TFMessage"
PERIOD = 0.04
PICTURES = 4
WIDTH, HEIGHT = 16, 12
COLOR_WIDTH, COLOR_HEIGHT = 48, 32
DEPTH_K = [20.5, 0.0, 7.5, 0.0, 21.0, 5.25, 0.0, 0.0, 1.0]
COLOR_K = [42.0, 0.0, 23.75, 0.0, 43.5, 15.5, 0.0, 0.0, 1.0]
QUANT = (1000.0, -20.0)
NAMESPACE = "robot1"


SAYING = threading.Lock()


def say(line):
    """Prints a line whole: callbacks come on several threads."""
    with SAYING:
        print(line, flush=True)


def depth_mm(k):
    v = np.arange(WIDTH * HEIGHT, dtype=np.uint32).reshape(HEIGHT, WIDTH)
    image = (500 + v * 37 + k * 11).astype(np.uint16)
    image[0, 0] = 0
    return image


def rgb(k):
    v = np.arange(COLOR_WIDTH * COLOR_HEIGHT, dtype=np.uint32).reshape(COLOR_HEIGHT, COLOR_WIDTH)
    return np.stack([v % 256, (v * 3 + 40 * k) % 256, (255 - v) % 256], axis=-1).astype(np.uint8)


def smooth_rgb(k):
    """A picture that JPEG keeps."""
    y, x = np.mgrid[0:COLOR_HEIGHT, 0:COLOR_WIDTH]
    return np.stack([x * 5, y * 7, 60 * k + 0 * x], axis=-1).astype(np.uint8)


def make(name, **fields):
    return STORE.types[name](**fields)


def header(stamp, frame):
    time_ = make("builtin_interfaces/msg/Time", sec=stamp // 10**9, nanosec=stamp % 10**9)
    return make("std_msgs/msg/Header", stamp=time_, frame_id=frame)


def raw(stamp, frame, encoding, array):
    step = array.shape[1] * array.itemsize * (array.shape[2] if array.ndim == 3 else 1)
    return IMAGE, make(
        IMAGE, header=header(stamp, frame), height=array.shape[0], width=array.shape[1], encoding=encoding,
        is_bigendian=0, step=step, data=np.frombuffer(array.tobytes(), np.uint8))


def compressed(stamp, frame, form, data):
    return COMPRESSED, make(
        COMPRESSED, header=header(stamp, frame), format=form, data=np.frombuffer(data, np.uint8))


def file_of(array, form, **options):
    out = io.BytesIO()
    Image.fromarray(array).save(out, form, **options)
    return out.getvalue()


def camera_info(stamp, frame, width, height, k):
    p = [k[0], 0, k[2], 0, 0, k[4], k[5], 0, 0, 0, 1, 0]
    roi = make(
        "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    arrays = {"d": [0.0] * 5, "k": k, "r": [1, 0, 0, 0, 1, 0, 0, 0, 1], "p": p}
    return INFO, make(
        INFO, header=header(stamp, frame), height=height, width=width, distortion_model="plumb_bob", binning_x=0,
        binning_y=0, roi=roi, **{n: np.array(v, np.float64) for n, v in arrays.items()})


def transforms(edges):
    def stamped(parent, child, xyz, q):
        vector = make("geometry_msgs/msg/Vector3", **dict(zip("xyz", xyz)))
        rotation = make("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", q)))
        transform = make("geometry_msgs/msg/Transform", translation=vector, rotation=rotation)
        return make(
            "geometry_msgs/msg/TransformStamped", header=header(0, parent), child_frame_id=child, transform=transform)

    return TF, make(TF, transforms=[stamped(*e) for e in edges])


# Kinds of streams: suffix of the topic, message of a picture, and the picture as it shall be read.
def uint16(stamp, frame, k):
    return raw(stamp, frame, "16UC1", depth_mm(k)), depth_mm(k)


def float32(stamp, frame, k):
    metres = depth_mm(k).astype(np.float32) / np.float32(1000)
    metres[0, 0], metres[0, 1] = np.nan, np.inf
    want = depth_mm(k).copy()
    want[0, 1] = 0
    return raw(stamp, frame, "32FC1", metres), want


def compressed_depth(stamp, frame, k):
    data = struct.pack("<Iff", 0, 0.0, 0.0) + file_of(depth_mm(k), "PNG")
    return compressed(stamp, frame, "16UC1; compressedDepth png", data), depth_mm(k)


def inverse_depth(stamp, frame, k):
    a, b = QUANT
    inverse = a / (np.maximum(depth_mm(k), 1) / 1000.0) + b
    values = np.where(depth_mm(k) == 0, 0, np.round(inverse)).astype(np.uint16)
    data = struct.pack("<Iff", 0, a, b) + file_of(values, "PNG")
    want = np.where(values == 0, 0, np.round(1000.0 * a / (values - b))).astype(np.uint16)
    return compressed(stamp, frame, "32FC1; compressedDepth png", data), want


def rgb8(stamp, frame, k):
    return raw(stamp, frame, "rgb8", rgb(k)), rgb(k)


def bgr8(stamp, frame, k):
    return raw(stamp, frame, "bgr8", np.ascontiguousarray(rgb(k)[:, :, ::-1])), rgb(k)


def jpeg(stamp, frame, k):
    data = file_of(smooth_rgb(k), "JPEG", quality=95, subsampling=0)
    want = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    return compressed(stamp, frame, "rgb8; jpeg compressed bgr8", data), want


def png(stamp, frame, k):
    return compressed(stamp, frame, "rgb8; png compressed bgr8", file_of(rgb(k), "PNG")), rgb(k)


SUFFIX = {compressed_depth: "/compressedDepth", inverse_depth: "/compressedDepth", jpeg: "/compressed", png: "/compressed"}

# Camera: whether the bridge carries it, depth, colour, seconds that colour's stamps are late.
CAMERAS = {
    "raw": (False, uint16, rgb8, 0.005),
    "metres": (False, float32, jpeg, -0.005),
    "small": (True, compressed_depth, jpeg, 0.005),
    "bridged": (True, uint16, bgr8, 0.005),
    "inverse": (False, inverse_depth, png, 0.0),
    "apart": (False, uint16, rgb8, 5.0),
    "alone": (True, float32, None, 0.0),
    "broken": (True, uint16, rgb8, 0.005),
}


def config(mode, **settings):
    c = zenoh.Config()
    c.insert_json5("mode", json.dumps(mode))
    c.insert_json5("scouting/multicast/enabled", "false")
    for key, value in settings.items():
        c.insert_json5(key.replace("_", "/"), json.dumps(value))
    return c


class Readers:
    """Subscribers that nodes of rmw_zenoh show by tokens: (topic, type)."""

    def __init__(self, session):
        self.shown = {}
        self.subscriber = session.liveliness().declare_subscriber("@ros2_lv/0/**", self.change, history=True)

    def change(self, sample):
        token = str(sample.key_expr)
        chunks = token.split("/")
        if len(chunks) == 13 and chunks[5] == "MS" and re.fullmatch("[12]?:[12]?:[12]?,[0-9]*:,:,:,,", chunks[12]):
            self.shown[token] = sample.kind == zenoh.SampleKind.PUT and (chunks[9].replace("%", "/"), *chunks[10:12])

    def has(self, *topic):
        return topic in list(self.shown.values())


class Topic:
    """Publisher of a topic under the key of rmw_zenoh, with its token, or under that of the bridge. As drivers do, it
    publishes only while somebody is known to subscribe."""

    def __init__(self, session, readers, name, kind, bridged, cached=False):
        self.name, self.sequence = name, 0
        dds = kind.replace("/msg/", "::msg::dds_::") + "_"
        zid = session.zid()
        if bridged:
            key = f"{NAMESPACE}{name}"
            token = f"@/{zid}/@ros2_lv/MP/{key.replace('/', '§')}/{kind.replace('/', '§')}/:::"
        else:
            type_hash = STORE.hash_rihs01(kind)
            key = f"0{name}/{dds}/{type_hash}"
            mangled = name.replace("/", "%")
            token = f"@ros2_lv/0/{zid}/0/{id(self)}/MP/%/%/driver/{mangled}/{dds}/{type_hash}/::,7:,:,:,,"
        if bridged or cached:
            self.is_read = lambda: True
        else:
            self.is_read = lambda: readers.has(name, dds, type_hash)
        self.token = session.liveliness().declare_token(token)
        if cached:
            # As rmw_zenoh does for transient_local.
            cache = zenoh.ext.CacheConfig(max_samples=1)
            self.publisher = zenoh.ext.declare_advanced_publisher(session, key, cache=cache, publisher_detection=True)
        else:
            self.publisher = session.declare_publisher(key)
            self.listener = self.publisher.declare_matching_listener(self.matches)

    def matches(self, status):
        say(f"{self.name} {'on' if status.matching else 'off'}")

    def put(self, message, broken=False):
        if not self.is_read():
            return
        kind, fields = message
        self.sequence += 1
        data = bytes(STORE.serialize_cdr(fields, kind))
        if broken and self.sequence % 2:
            data = data[: 1 + 7 * self.sequence % len(data)]
        attachment = struct.pack("<qqB", self.sequence, time.time_ns(), 16) + bytes(16)
        self.publisher.put(data, attachment=attachment)


class Camera:
    """Driver of one camera: images and their camera_info."""

    def __init__(self, session, readers, name, bridged, depth, color, late):
        self.name, self.depth, self.color, self.late = name, depth, color, int(late * 1e9)
        self.topics = {}
        for stream, picture in (("depth", depth), ("color", color)):
            if picture:
                kind = COMPRESSED if picture in SUFFIX else IMAGE
                image = f"/{name}/{stream}/image_raw{SUFFIX.get(picture, '')}"
                self.topics[stream] = Topic(session, readers, image, kind, bridged)
                self.topics[stream, INFO] = Topic(
                    session, readers, f"/{name}/{stream}/camera_info", INFO, bridged)

    def expected(self):
        pictures = []
        for k in range(PICTURES):
            depth = self.depth(0, "", k)[1]
            color = self.color(0, "", k)[1].flatten().tolist() if self.color else None
            pictures.append({"depth": depth.flatten().tolist(), "color": color})
        names = {s: self.topics[s].name for s in ("depth", "color") if s in self.topics}
        return {"topics": names, "pictures": pictures}

    def publish(self, k, stamp):
        frame = f"{self.name}_depth_optical"
        self.topics["depth", INFO].put(camera_info(stamp, frame, WIDTH, HEIGHT, DEPTH_K))
        self.topics["depth"].put(self.depth(stamp, frame, k)[0], broken=self.name == "broken")
        if self.color:
            stamp, frame = stamp + self.late, f"{self.name}_color_optical"
            self.topics["color", INFO].put(camera_info(stamp, frame, COLOR_WIDTH, COLOR_HEIGHT, COLOR_K))
            self.topics["color"].put(self.color(stamp, frame, k)[0])


def main():
    endpoint, expected = sys.argv[1:]
    router = zenoh.open(config("router", listen_endpoints=[endpoint]))
    session = zenoh.open(config("peer", connect_endpoints=[endpoint], timestamping_enabled=True))
    readers = Readers(session)
    cameras = [Camera(session, readers, name, *of) for name, of in CAMERAS.items()]
    # Transforms of one camera: colour is 25 mm to the right of depth, and 2 mm above it.
    optical = (-0.5, 0.5, -0.5, 0.5)
    tf = Topic(session, readers, "/tf_static", TF, bridged=False, cached=True)
    tf.put(transforms([
        ("link", "raw_depth_optical", (0.0, 0.01, 0.0), optical),
        ("link", "raw_color_optical", (0.0, -0.015, 0.002), optical)]))
    Path(expected).write_text(json.dumps({c.name: c.expected() for c in cameras}))
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    say("ready")
    k = 0
    while not ended.wait(PERIOD):
        stamp = time.time_ns()
        for camera in cameras:
            camera.publish(k % PICTURES, stamp)
        k += 1
    session.close()
    router.close()


if __name__ == "__main__":
    main()
