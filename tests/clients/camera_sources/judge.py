"""A recording against what its device showed, read by `mcap` and its decoder of protobuf."""

import io

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image


def messages(file):
    """Decoded messages by topic."""
    found = {}
    with file.open("rb") as stream:
        for _, channel, _, message in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
    return found


def nanoseconds(message):
    return message.timestamp.seconds * 10**9 + message.timestamp.nanos


def check_pinhole(message, expected):
    fx, fy, cx, cy = expected
    k = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
    assert np.allclose(message.K, k, rtol=1e-6, atol=1e-6), f"{list(message.K)}, expected {k}"


def rotation_of(q):
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
    )


def check_transform(message, expected):
    """The message is the colour camera in the depth camera's frame; expected is the other way."""
    rotation = rotation_of(message.rotation).T
    t = message.translation
    translation = -rotation @ (t.x, t.y, t.z)
    assert np.allclose(rotation, expected.rotation, atol=1e-6), rotation
    assert np.allclose(translation, expected.translation, atol=1e-6), translation


def check_depth(message, expected):
    """Share of equal pixels."""
    assert message.encoding == "16UC1", message.encoding
    got = np.frombuffer(message.data, "<u2").reshape(message.height, message.width)
    want = expected.depth_mm(nanoseconds(message))
    assert want is not None, f"no frame of the device at {nanoseconds(message)}"
    share = np.mean(got == want)
    assert share >= expected.share, f"{share:.4%} of pixels at {nanoseconds(message)}"
    assert np.count_nonzero(got), "no reading"
    return share


def check_color(message, expected):
    """The middle of the picture: rectification moves edges."""
    image = np.asarray(Image.open(io.BytesIO(message.data)), int)
    got, want = image[image.shape[0] // 2, image.shape[1] // 2], np.array(expected.color(nanoseconds(message)), int)
    assert np.abs(got - want).max() <= 4, f"{got}, expected {want}"


def judge(file, family):
    """Figures of a recording; fails where it differs."""
    expected, found = family.expected(), messages(file)
    depths = found.get("/camera/depth", [])
    assert len(depths) >= family.frames, f"{len(depths)} frames, expected {family.frames}"
    shares = [check_depth(m, expected) for m in depths]
    check_pinhole(found["/camera/depth/calibration"][0], expected.depth_k)
    if expected.color_k:
        check_pinhole(found["/camera/color/calibration"][0], expected.color_k)
        check_transform(found["/tf"][0], expected)
    colors = found.get("/camera/color", [])
    assert len(colors) == len(depths), f"{len(colors)} colours of {len(depths)} frames"
    if expected.color:
        for m in colors:
            check_color(m, expected)
    return {"frames": len(depths), "equal": round(float(min(shares)), 6)}
