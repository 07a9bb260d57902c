#!/usr/bin/env python3
"""`tryon export RECORDING --out x.mcap`, read as Foxglove reads it: by PyPI's `mcap`, with the descriptors in the file, and
with Foxglove's own published classes.

    pip install -r tests/clients/camera_sources/requirements.txt
    python3 tests/clients/foxglove.py [--bin target/debug] [--keep x.mcap]

Exit status 0 when schemas, pixels, calibrations, frames of reference and times are those of the recording."""

import argparse
import importlib
import io
import json
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np
from google.protobuf import descriptor_pb2
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
COUNT, DEPTH_SIZE, COLOR_SIZE = 7, (40, 30), (64, 36)
CAMERA = {
    **dict(width=40, height=30, fx=38.0, fy=39.0, cx=19.25, cy=14.75, depth_scale=1000),
    "color": dict(width=64, height=36, fx=60.0, fy=61.0, cx=31.0, cy=17.5),
    "color_from_depth": {"translation": [0.025, -0.001, 0.002], "rotation": [0.0, 0.6, 0.0, 0.8]},
}
# Topic: schema.
TOPICS = {
    "/camera/depth": "foxglove.RawImage",
    "/camera/color": "foxglove.CompressedImage",
    "/camera/depth/calibration": "foxglove.CameraCalibration",
    "/camera/color/calibration": "foxglove.CameraCalibration",
    "/tf": "foxglove.FrameTransform",
}


def depth(i):
    w, h = DEPTH_SIZE
    image = (900 + 31 * i + 7 * np.arange(w * h)).astype(np.uint16).reshape(h, w)
    image[3:5] = 0
    return image


def time_ns(i):
    return 1_700_000_000_000_000_000 + 33_333_333 * i


def write_recording(folder):
    """A folder of PNG images."""
    (folder / "depth").mkdir(parents=True)
    (folder / "rgb").mkdir()
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    lists = {"depth": [], "rgb": []}
    for i in range(COUNT):
        Image.fromarray(depth(i)).save(folder / f"depth/{i}.png")
        w, h = COLOR_SIZE
        Image.fromarray(np.full((h, w, 3), (20 * i, 90, 200), np.uint8)).save(folder / f"rgb/{i}.png")
        for name, lines in lists.items():
            lines.append(f"{time_ns(i) // 10**9}.{time_ns(i) % 10**9:09} {name}/{i}.png\n")
    for name, lines in lists.items():
        (folder / f"{name}.txt").write_text("".join(lines))


def published(schema):
    """Foxglove's class of a message."""
    name = schema.removeprefix("foxglove.")
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name)


def fields(message):
    """Name, number, type, label and type name of each field."""
    return sorted((f.name, f.number, f.type, f.label, f.type_name) for f in message.field)


def check_schema(schema):
    """The embedded file descriptors: all imports are there, and fields are the published ones."""
    assert schema.encoding == "protobuf", schema.encoding
    files = {f.name: f for f in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file}
    assert all(d in files for f in files.values() for d in f.dependency), "an import is missing"
    embedded = {f".{f.package}.{m.name}": m for f in files.values() for m in f.message_type}
    waiting = [f".{schema.name}"]
    while waiting:
        name = waiting.pop()
        ours = fields(embedded[name])
        if name.startswith(".foxglove."):
            theirs = descriptor_pb2.DescriptorProto()
            published(name[1:]).DESCRIPTOR.CopyToProto(theirs)
            assert ours == fields(theirs), f"{name}: {ours}, published are {fields(theirs)}"
        waiting += [type_name for *_, type_name in ours if type_name]


def check_times(message, decoded):
    stamp = decoded.timestamp.seconds * 10**9 + decoded.timestamp.nanos
    assert stamp == message.log_time == message.publish_time, (stamp, message.log_time)
    return stamp


def check_pinhole(message, camera):
    k = [camera["fx"], 0, camera["cx"], 0, camera["fy"], camera["cy"], 0, 0, 1]
    assert list(message.K) == k and (message.width, message.height) == (camera["width"], camera["height"])
    assert len(message.P) == 12 and len(message.R) == 9 and not any(message.D), message


def check(file):
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary and summary.statistics.message_count == 2 * COUNT + 3, summary.statistics
        for schema in summary.schemas.values():
            check_schema(schema)
        assert {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()} == TOPICS
        found = {}
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            # Twice the same: by the descriptors in the file, and by Foxglove's classes.
            again = published(schema.name).FromString(message.data)
            assert again.SerializeToString(deterministic=True) == decoded.SerializeToString(deterministic=True)
            check_times(message, decoded)
            found.setdefault(channel.topic, []).append(decoded)
        # Through the index, as a viewer seeks.
        last = list(reader.iter_messages(topics=["/camera/depth"], starting_at=time_ns(COUNT - 1)))
        assert len(last) == 1, last

    for i, image in enumerate(found["/camera/depth"]):
        assert (image.encoding, image.step, image.frame_id) == ("16UC1", 2 * image.width, "depth_camera"), image.encoding
        got = np.frombuffer(image.data, "<u2").reshape(image.height, image.width)
        assert np.array_equal(got, depth(i)), f"depth {i}"
    for i, image in enumerate(found["/camera/color"]):
        assert (image.format, image.frame_id) == ("jpeg", "color_camera"), image.format
        color = np.asarray(Image.open(io.BytesIO(image.data)), int)
        assert color.shape == (*COLOR_SIZE[::-1], 3) and np.abs(color - (20 * i, 90, 200)).max() <= 4, f"colour {i}"
    assert len(found["/camera/depth"]) == len(found["/camera/color"]) == COUNT

    [of_depth], [of_color], [way] = (found[t] for t in ("/camera/depth/calibration", "/camera/color/calibration", "/tf"))
    check_pinhole(of_depth, CAMERA)
    check_pinhole(of_color, CAMERA["color"])
    assert (of_depth.frame_id, of_color.frame_id) == ("depth_camera", "color_camera")
    assert (way.parent_frame_id, way.child_frame_id) == ("depth_camera", "color_camera")
    # The pose of the colour camera in the depth camera's frame: the inverse of the recording's. About y by 0.6, 0.8.
    q, t = way.rotation, way.translation
    assert np.allclose((q.x, q.y, q.z, q.w), (0, -0.6, 0, 0.8), atol=1e-12), q
    c, s = 1 - 2 * 0.36, 2 * 0.6 * 0.8
    turned = np.array(((c, 0, s), (0, 1, 0), (-s, 0, c)))
    assert np.allclose((t.x, t.y, t.z), -turned.T @ CAMERA["color_from_depth"]["translation"], atol=1e-12), t
    return {"messages": summary.statistics.message_count, "chunks": summary.statistics.chunk_count}


def main():
    args = argparse.ArgumentParser()
    args.add_argument("--bin", type=pathlib.Path, default=HERE.parents[1] / "target/debug")
    args.add_argument("--keep", type=pathlib.Path, help="keeps the file, to be opened in a viewer")
    args = args.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write_recording(folder / "recording")
        file = folder / "x.mcap"
        subprocess.run([args.bin / "tryon", "export", folder / "recording", "--out", file], check=True, stdout=subprocess.DEVNULL)
        figures = check(file)
        if args.keep:
            shutil.copy(file, args.keep)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
