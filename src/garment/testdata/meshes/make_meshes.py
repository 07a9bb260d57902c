"""Meshes as exporters write them, of one tube, and `expected.json`: what each of them is.

    pip install numpy==2.* DracoPy meshoptimizer
    python make_meshes.py            # writes beside itself

Compressed streams are those of Google's Draco and of meshoptimizer, by their Python packages; the rest follows the
specifications of Wavefront OBJ and glTF 2.0.
"""

import base64
import json
from pathlib import Path

import DracoPy
import meshoptimizer
import numpy as np

HERE = Path(__file__).parent
AROUND, ALONG, RADIUS, HEIGHT = 12, 4, 0.2, 0.6
FLOAT, SHORT, UNSIGNED_SHORT, UNSIGNED_BYTE, UNSIGNED = 5126, 5122, 5123, 5121, 5125
EXPECTED = {}


def tube(radius=RADIUS):
    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    rows = np.linspace(0, HEIGHT, ALONG + 1)
    points = [[radius * np.sin(a), y, radius * np.cos(a)] for y in rows for a in turn]
    faces = []
    for a, b, c, d in quads():
        faces += [[a, b, c], [a, c, d]]
    return np.array(points), np.array(faces)


def quads():
    for j in range(ALONG):
        for i in range(AROUND):
            k = (i + 1) % AROUND
            yield j * AROUND + i, j * AROUND + k, (j + 1) * AROUND + k, (j + 1) * AROUND + i


POINTS, FACES = tube()


def area(points, faces=FACES):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def save(name, data, points=POINTS, faces=len(FACES), **expected):
    """Writes a file; `expected` adds to the area and bounds of `points`."""
    (HERE / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    low, high = points.min(0).tolist(), points.max(0).tolist()
    if "area" not in expected:
        expected["area"] = area(points)
    EXPECTED[name] = {"low": low, "high": high, "faces": faces, "pieces": 1} | expected


# OBJ


def obj(points, faces):
    text = "".join("v %.6g %.6g %.6g\n" % tuple(p) for p in points)
    return text + "".join("f %d %d %d\n" % tuple(f + 1) for f in faces)


def objs():
    text = obj(POINTS, FACES)
    save("utf16_big_endian.obj", b"\xfe\xff" + text.encode("utf-16-be"))
    save("utf8_mark_crlf_tabs.obj", b"\xef\xbb\xbf" + text.replace("\n", "\r\n").replace(" ", "\t").encode())
    n = len(POINTS)
    lines = "".join("f %d %d %d %d\n" % tuple(v - n for v in q) for q in quads())
    save("quads_from_the_end.obj", text.split("f")[0] + lines)
    soup = POINTS[FACES].reshape(-1, 3)
    loose = np.arange(len(soup)).reshape(-1, 3)
    save("soup.obj", obj(soup, loose), note=f"{len(soup) - n} vertices joined")
    save("both_sides.obj", obj(POINTS, np.r_[FACES, FACES[:, ::-1]]), note="96 repeated faces")
    save("every_other_turned.obj", obj(POINTS, np.r_[FACES[::2], FACES[1::2, ::-1]]), note="turned over")
    inner, _ = tube(RADIUS - 0.004)
    rims = []
    for row, side in ((0, 1), (ALONG, -1)):
        for i in range(AROUND):
            a, b = row * AROUND + i, row * AROUND + (i + 1) % AROUND
            rims += [[a, n + a, n + b][::side], [a, n + b, b][::side]]
    walls = np.r_[FACES, FACES[:, ::-1] + n, rims]
    # Chords are nearer than circles.
    thickness = 0.004 * np.cos(np.pi / AROUND)
    save("walls_of_4_mm.obj", obj(np.r_[POINTS, inner], walls), thickness=thickness, note="inner sheet")
    second = "".join("f %d %d %d\n" % tuple(f + n + 1) for f in FACES)
    moved = POINTS + [1, 0, 0]
    save(
        "two_objects.obj",
        f"o Avatar\n{text}o Shirt\ng body\nusemtl cotton\n{obj(moved, FACES[:0])}{second}",
        points=np.r_[POINTS, moved],
        faces=2 * len(FACES),
        area=2 * area(POINTS),
        pieces=2,
        parts=["Avatar", "Shirt / body / cotton"],
    )


# glTF


class Gltf:
    """A document with one buffer, in a data URI."""

    def __init__(self, *required):
        self.data = b""
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        for key in ("nodes", "meshes", "accessors", "bufferViews"):
            self.json[key] = []
        self.json["buffers"] = []
        if required:
            self.json |= {"extensionsUsed": required, "extensionsRequired": required}

    def add(self, key, item):
        self.json[key].append(item)
        return len(self.json[key]) - 1

    def view(self, data, **more):
        self.data += bytes(-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)} | more
        self.data += data
        return self.add("bufferViews", view)

    def accessor(self, rows, component, kind, view=True, **more):
        rows = np.ascontiguousarray(rows)
        item = {"componentType": component, "type": kind, "count": len(rows)} | more
        if kind == "VEC3":
            item |= {"min": rows.min(0).tolist(), "max": rows.max(0).tolist()}
        if view:
            row = rows.reshape(len(rows), -1).view(np.uint8).reshape(len(rows), -1)
            padded = np.pad(row, ((0, 0), (0, 0 if kind == "SCALAR" else -row.shape[1] % 4)))
            stride = {} if kind == "SCALAR" else {"byteStride": padded.shape[1]}
            item["bufferView"] = self.view(padded.tobytes(), **stride)
        return self.add("accessors", item)

    def surface(self, points=POINTS, faces=FACES, **more):
        position = self.accessor(points.astype(np.float32), FLOAT, "VEC3")
        indices = self.accessor(faces.astype(np.uint32).reshape(-1), UNSIGNED, "SCALAR")
        return {"attributes": {"POSITION": position}, "indices": indices} | more

    def mesh(self, *primitives, name="tube", **more):
        return self.add("meshes", {"name": name, "primitives": primitives} | more)

    def node(self, is_root=True, **more):
        index = self.add("nodes", more)
        if is_root:
            self.json["scenes"][0]["nodes"].append(index)
        return index

    def text(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        buffers = [{"byteLength": len(self.data), "uri": uri}] + self.json["buffers"]
        return json.dumps(self.json | {"buffers": buffers})


def quantised():
    middle, half = (POINTS.min(0) + POINTS.max(0)) / 2, np.ptp(POINTS, axis=0).max() / 2
    for name, component, kind, most in (("i16", SHORT, np.int16, 32767), ("i8", 5120, np.int8, 127)):
        g = Gltf("KHR_mesh_quantization")
        rows = np.round((POINTS - middle) / half * most).astype(kind)
        position = g.accessor(rows, component, "VEC3", normalized=True)
        indices = g.accessor(FACES.astype(np.uint8).reshape(-1), UNSIGNED_BYTE, "SCALAR")
        primitive = {"attributes": {"POSITION": position}, "indices": indices}
        g.node(mesh=g.mesh(primitive), translation=middle.tolist(), scale=[half] * 3)
        tolerance = 0.02 if most == 127 else 1e-3
        save(f"quantised_{name}.gltf", g.text(), tolerance=tolerance)


def placed():
    g = Gltf()
    half = 0.5**0.5
    leaf = g.node(False, mesh=g.mesh(g.surface()), translation=[0, 1, 0], name="leaf")
    middle = g.node(False, children=[leaf], rotation=[half, 0, 0, half])
    g.node(children=[middle], scale=[-2, 2, 2])
    x, y, z = (POINTS + [0, 1, 0]).T
    save("mirrored.gltf", g.text(), points=np.c_[-2 * x, -2 * z, 2 * y], parts=["leaf / tube"], outward=True)

    g = Gltf("EXT_mesh_gpu_instancing")
    moved = g.accessor(np.array([[0, 0, 0], [1, 0, 0]], np.float32), FLOAT, "VEC3")
    scaled = g.accessor(np.array([[1, 1, 1], [2, 2, 2]], np.float32), FLOAT, "VEC3")
    attributes = {"TRANSLATION": moved, "SCALE": scaled}
    g.node(mesh=g.mesh(g.surface()), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    both = np.r_[POINTS, 2 * POINTS + [1, 0, 0]]
    save("instances.gltf", g.text(), points=both, area=5 * area(POINTS), faces=2 * len(FACES), pieces=2)


def modes():
    g = Gltf()
    strip = g.accessor(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32), FLOAT, "VEC3")
    fan = g.accessor(np.array([[2, 0, 0], [3, 0, 0], [3, 1, 0], [2, 1, 0]], np.float32), FLOAT, "VEC3")
    linked = g.accessor(np.array([0, 1, 2, 2, 2, 2, 1, 3], np.uint8), UNSIGNED_BYTE, "SCALAR")
    primitives = [
        {"attributes": {"POSITION": strip}, "indices": linked, "mode": 5},
        {"attributes": {"POSITION": fan}, "mode": 6},
        {"attributes": {"POSITION": fan}, "mode": 1},
    ]
    g.node(mesh=g.mesh(*primitives))
    corners = np.array([[0, 0, 0], [3, 1, 0]])
    save("strip_fan_lines.gltf", g.text(), points=corners, area=2, faces=4, pieces=2, note="points or lines")


def deformed():
    g = Gltf()
    wide = POINTS * [1, 0, 0]
    surface = g.surface()
    surface["targets"] = [{"POSITION": g.accessor(wide.astype(np.float32), FLOAT, "VEC3")}]
    g.node(mesh=g.mesh(surface, weights=[0.5]))
    save("morph.gltf", g.text(), points=POINTS + 0.5 * wide)

    g = Gltf()
    surface = g.surface()
    new = np.array([[0, -1, 0.2], [0.05, -1, 0.2]], np.float32)
    places = {"bufferView": g.view(np.array([0, 1], np.uint16).tobytes()), "componentType": UNSIGNED_SHORT}
    values = {"bufferView": g.view(new.tobytes())}
    g.json["accessors"][0]["sparse"] = {"count": 2, "indices": places, "values": values}
    g.node(mesh=g.mesh(surface))
    save("sparse.gltf", g.text(), points=np.r_[new, POINTS[2:]])

    # A skeleton in centimetres; the node of the mesh is placed elsewhere, which has no effect.
    g = Gltf()
    surface = g.surface(100 * POINTS)
    upper = POINTS[:, 1] / HEIGHT
    joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (len(POINTS), 1))
    weights = np.c_[1 - upper, upper, 0 * upper, 0 * upper].astype(np.float32)
    surface["attributes"] |= {
        "JOINTS_0": g.accessor(joints, UNSIGNED_BYTE, "VEC4"),
        "WEIGHTS_0": g.accessor(weights, FLOAT, "VEC4"),
    }
    inverse = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    inverse[1, 3, 1] = -30
    inverse = g.accessor(inverse.reshape(2, 16), FLOAT, "MAT4")
    top = g.node(False, translation=[0, 40, 0])
    bottom = g.node(False, children=[top])
    g.node(children=[bottom], scale=[0.01] * 3)
    g.json["skins"] = [{"joints": [bottom, top], "inverseBindMatrices": inverse}]
    g.node(mesh=g.mesh(surface), skin=0, translation=[5, 5, 5])
    save("skin.gltf", g.text(), points=POINTS + np.c_[0 * upper, 0.1 * upper, 0 * upper])


def compressed():
    g = Gltf("KHR_draco_mesh_compression")
    stream = DracoPy.encode(POINTS, faces=FACES.astype(np.uint32), quantization_bits=14)
    decoded = DracoPy.decode(stream)
    rows, corners = np.asarray(decoded.points, np.float32), np.asarray(decoded.faces, np.uint32)
    position = g.accessor(rows, FLOAT, "VEC3", view=False)
    indices = g.accessor(corners.reshape(-1), UNSIGNED, "SCALAR", view=False)
    extension = {"bufferView": g.view(stream), "attributes": {"POSITION": 0}}
    primitive = {"attributes": {"POSITION": position}, "indices": indices}
    primitive["extensions"] = {"KHR_draco_mesh_compression": extension}
    g.node(mesh=g.mesh(primitive))
    save("draco.gltf", g.text(), tolerance=1e-3)

    name = "EXT_meshopt_compression"
    g = Gltf(name, "KHR_mesh_quantization")
    low, size = POINTS.min(0), np.ptp(POINTS, axis=0).max()
    rows = np.zeros((len(POINTS), 4), np.uint16)
    rows[:, :3] = np.round((POINTS - low) / size * 65535)
    meshoptimizer.encode_vertex_version(0)
    vertices = bytes(meshoptimizer.encode_vertex_buffer(rows, len(rows), 8))
    corners = FACES.astype(np.uint32).reshape(-1)
    triangles = bytes(meshoptimizer.encode_index_buffer(corners, len(corners), len(rows)))
    streams = [(vertices, 8, len(rows), "ATTRIBUTES"), (triangles, 4, len(corners), "TRIANGLES")]
    for stream, stride, count, mode in streams:
        index = g.view(stream)
        own = {"buffer": 0, "byteOffset": g.json["bufferViews"][index]["byteOffset"]}
        own |= {"byteLength": len(stream), "byteStride": stride, "count": count, "mode": mode}
        view = {"buffer": 1, "byteLength": stride * count, "extensions": {name: own}}
        g.json["bufferViews"][index] = view | ({"byteStride": 8} if mode == "ATTRIBUTES" else {})
    longest = max(8 * len(rows), 4 * len(corners))
    g.json["buffers"] = [{"byteLength": longest, "extensions": {name: {"fallback": True}}}]
    bounds = {"min": [0] * 3, "max": [65535] * 3}
    g.add("accessors", {"bufferView": 0, "componentType": UNSIGNED_SHORT, "type": "VEC3", "count": len(rows)} | bounds)
    g.add("accessors", {"bufferView": 1, "componentType": UNSIGNED, "type": "SCALAR", "count": len(corners)})
    mesh = g.mesh({"attributes": {"POSITION": 0}, "indices": 1})
    g.node(mesh=mesh, translation=low.tolist(), scale=[size / 65535] * 3)
    save("meshopt.gltf", g.text(), tolerance=1e-3)


objs()
quantised()
placed()
modes()
deformed()
compressed()
(HERE / "expected.json").write_text(json.dumps(EXPECTED, indent=1) + "\n")
