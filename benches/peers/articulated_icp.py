#!/usr/bin/env python3
"""Articulated ICP on Open3D's point clouds and nearest neighbours, beside this project's tracker, on the same recordings.

    python3 benches/peers/articulated_icp.py --data ../shared/data [--frames N] [--bench target/release/tryon-bench]

Both are given the subject's own body. The peer starts from the recording's rough start (root position, rest pose), ours
from nothing. The peer: depth cropped to a box around the last pelvis, floor and back wall taken out by Open3D's
`segment_plane` once, normals by Open3D, 1,000 model and 1,500 data points matched both ways by Open3D's kd-tree within a
reach that shrinks from 20 to 6 cm and 60 degrees of the normals, point-to-plane with a Geman-McClure weight, three
rotations a joint, damped Gauss-Newton in numpy, 8 iterations a
frame from the last pose (constant velocity, ungated, diverged on the first recording). Needs numpy and
open3d. One thread each; times of the peer are processor time with and without numpy's share, as only the rest is compiled
code.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402
import open3d as o3d  # noqa: E402

SCENES = [
    ("charleston_m_heavy_tof_room", "subject_m_heavy"),
    ("jacks_f_avg_kinect1_room", "subject_f_avg"),
    ("sword_m_tall_tof_noroom_upper", "subject_m_tall"),
]
ITERATIONS, SAMPLES, READINGS = 8, 1000, 1500
FIRST_COMPARED = 30


def hat(v):
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def exp(w):
    t = np.linalg.norm(w)
    if t < 1e-12:
        return np.eye(3) + hat(w)
    k = hat(w / t)
    return np.eye(3) + np.sin(t) * k + (1 - np.cos(t)) * k @ k


class Body:
    """A skinned body in SMPL layout; the pose is a root position and one rotation a joint relative to its parent."""

    def __init__(self, path):
        d = np.load(path, allow_pickle=True)
        self.v, self.j, self.w, self.f = d["v_template"].astype(float), d["J"].astype(float), d["weights"], d["f"]
        self.parent = [int(p) if 0 <= int(p) < 22 else -1 for p in d["kintree_table"][0].astype(np.int64) % 2**32]
        self.names = list(d["joint_names"])
        n = np.zeros_like(self.v)
        a, b, c = (self.v[self.f[:, k]] for k in range(3))
        face = np.cross(b - a, c - a)
        for k in range(3):
            np.add.at(n, self.f[:, k], face)
        self.n = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
        # Evenly spread samples: farthest points of Open3D on the vertices.
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(self.v))
        tree = o3d.geometry.KDTreeFlann(cloud)
        picked = np.asarray(cloud.farthest_point_down_sample(SAMPLES).points)
        self.samples = np.array([tree.search_knn_vector_3d(p, 1)[1][0] for p in picked])
        # Which joints move which sample's dominant bone.
        self.bone = self.w[self.samples].argmax(1)
        self.moves = np.zeros((22, 22))
        for b in range(22):
            j = b
            while j >= 0:
                self.moves[b, j] = 1
                j = self.parent[j]

    def bones(self, root, turns):
        r, p = np.empty((22, 3, 3)), np.empty((22, 3))
        for k in range(22):
            q = self.parent[k]
            if q < 0:
                r[k], p[k] = turns[k], root
            else:
                r[k] = r[q] @ turns[k]
                p[k] = p[q] + r[q] @ (self.j[k] - self.j[q])
        return r, p

    def skin(self, r, p):
        s = self.samples
        at = np.einsum("kab,nkb->nka", r, self.v[s][:, None] - self.j[None]) + p[None]
        x = np.einsum("nk,nka->na", self.w[s], at)
        n = np.einsum("nab,nb->na", r[self.bone], self.n[s])
        return x, n


def read_depth(path, camera):
    image = o3d.io.read_image(str(path))
    k = o3d.camera.PinholeCameraIntrinsic(
        camera["width"], camera["height"], camera["fx"], camera["fy"], camera["cx"], camera["cy"]
    )
    return o3d.geometry.PointCloud.create_from_depth_image(image, k, depth_scale=1000.0, depth_trunc=8.0, stride=2)


def planes_of(cloud, keep_out):
    """Large planes that the person does not stand in: Open3D's RANSAC, at most three."""
    out, rest = [], cloud
    for _ in range(3):
        if len(rest.points) < 3000:
            break
        o3d.utility.random.seed(1)
        plane, inside = rest.segment_plane(0.03, 3, 200)
        if len(inside) < 0.12 * len(cloud.points) or abs(np.dot(plane[:3], keep_out) + plane[3]) < 0.25:
            break
        out.append(np.array(plane))
        rest = rest.select_by_index(inside, invert=True)
    return out


def follow(folder, body, frames):
    camera = json.load(open(folder / "camera.json"))
    truth = json.load(open(folder / "truth.json"))
    init = json.load(open(folder / "init.json"))
    order = [truth["joint_names"].index(n) for n in body.names]
    wanted = np.array(truth["joints"])[:, order]
    root = np.array(init["root_position"])
    turns = np.tile(np.eye(3), (22, 1, 1))
    turns[0] = exp([np.pi, 0, 0]) @ exp([0, np.radians(init["facing_yaw_deg"]), 0])
    planes = None
    errors, total, compiled = [], [], []
    rng = np.random.default_rng(1)
    for i, path in enumerate(sorted((folder / "depth").glob("*.png"))[:frames]):
        start, native = time.process_time(), 0.0
        tick = time.process_time()
        cloud = read_depth(path, camera)
        if planes is None:
            planes = planes_of(cloud, root)
        box = o3d.geometry.AxisAlignedBoundingBox(root - [1.1, 1.2, 0.8], root + [1.1, 1.2, 0.8])
        cloud = cloud.crop(box)
        points = np.asarray(cloud.points)
        keep = np.ones(len(points), bool)
        for p in planes:
            keep &= np.abs(points @ p[:3] + p[3]) > 0.03
        cloud = cloud.select_by_index(np.flatnonzero(keep))
        if len(cloud.points) < 50:
            total.append(time.process_time() - start)
            compiled.append(0.0)
            if i >= FIRST_COMPARED:
                errors.append(np.linalg.norm(body.bones(root, turns)[1] - wanted[i], axis=1).mean() * 1e3)
            continue
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.05, 12))
        cloud.orient_normals_towards_camera_location(np.zeros(3))
        native += time.process_time() - tick
        y, m = np.asarray(cloud.points), np.asarray(cloud.normals)
        if len(y) > READINGS:
            pick = np.sort(rng.choice(len(y), READINGS, replace=False))
            y, m = y[pick], m[pick]
        tick = time.process_time()
        data_tree = o3d.core.nns.NearestNeighborSearch(o3d.core.Tensor(np.ascontiguousarray(y, np.float32)))
        data_tree.knn_index()
        native += time.process_time() - tick
        for it in range(ITERATIONS):
            t = min(it / 4, 1.0)
            reach, sigma = 0.20 + (0.06 - 0.20) * t, 0.08 + (0.03 - 0.08) * t
            r, p = body.bones(root, turns)
            x, n = body.skin(r, p)
            u = camera["fx"] * x[:, 0] / x[:, 2] + camera["cx"]
            v = camera["fy"] * x[:, 1] / x[:, 2] + camera["cy"]
            inside = (u > 0) & (v > 0) & (u < camera["width"]) & (v < camera["height"]) & (x[:, 2] > 0)
            facing = np.flatnonzero(inside & ((n * x).sum(1) < -0.1 * np.linalg.norm(x, axis=1)))
            if len(facing) < 50 or len(y) < 50:
                break
            tick = time.process_time()
            xf = np.ascontiguousarray(x[facing], np.float32)
            a, da = data_tree.knn_search(o3d.core.Tensor(xf), 1)
            model_tree = o3d.core.nns.NearestNeighborSearch(o3d.core.Tensor(xf))
            model_tree.knn_index()
            b, db = model_tree.knn_search(o3d.core.Tensor(np.ascontiguousarray(y, np.float32)), 1)
            native += time.process_time() - tick
            a, da, b, db = (q.numpy().ravel() for q in (a, da, b, db))
            model = np.concatenate([facing, facing[b]])
            data = np.concatenate([a, np.arange(len(y))])
            near = np.concatenate([da, db]) < reach**2
            near &= (n[model] * m[data]).sum(1) > 0.5
            model, data = model[near], data[near]
            if len(model) < 50:
                break
            residual = y[data] - x[model]
            w = (sigma**2 / (sigma**2 + (residual**2).sum(1))) ** 2
            # Rows: normal; and a tenth of the distance itself. Columns: shift, then a rotation about each joint.
            moved = body.moves[body.bone[model]]
            lever = x[model][:, None] - p[None]
            spin = moved[..., None, None] * np.stack([np.cross(np.eye(3)[k], lever) for k in range(3)], -1)
            jac = np.concatenate([np.broadcast_to(np.eye(3), (len(model), 3, 3)), spin.transpose(0, 2, 1, 3).reshape(len(model), 3, 66)], 2)
            plane = np.einsum("na,nad->nd", n[model], jac)
            off = (n[model] * residual).sum(1)
            h = (plane * w[:, None]).T @ plane + 0.1 * np.einsum("nad,n,nae->de", jac, w, jac, optimize=True)
            g = plane.T @ (w * off) + 0.1 * np.einsum("nad,na->d", jac, w[:, None] * residual)
            scale = max(len(model), 1)
            # Angles are small here; the pull to the rest pose is on the whole rotation.
            pull = np.concatenate([np.zeros(6), np.full(63, 1e-6)])
            now = np.concatenate([np.zeros(6)] + [(r[body.parent[k]] @ log(turns[k])) for k in range(1, 22)])
            step = np.linalg.solve(h / scale + np.diag(pull + 1e-4), g / scale - pull * now)
            # Without a bound it flies off where little is left of a limb.
            step = np.clip(step, -0.2, 0.2)
            root = root + step[:3]
            world = [exp(step[3 + 3 * k : 6 + 3 * k]) for k in range(22)]
            turns = np.array([world[0] @ turns[0]] + [r[body.parent[k]].T @ world[k] @ r[body.parent[k]] @ turns[k] for k in range(1, 22)])
            u, _, vt = np.linalg.svd(turns)
            turns = u @ vt
            if it >= 4 and max(np.abs(step[:3]).max(), 0.25 * np.abs(step[3:]).max()) < 3e-3:
                break
        _, joints = body.bones(root, turns)
        total.append(time.process_time() - start)
        compiled.append(native)
        if i >= FIRST_COMPARED:
            errors.append(np.linalg.norm(joints - wanted[i], axis=1).mean() * 1e3)
    late = slice(min(75, len(total) // 2), None)
    return np.mean(errors), np.max(errors), np.mean(total[late]) * 1e3, np.mean(compiled[late]) * 1e3


def log(r):
    t = np.arccos(np.clip((np.trace(r) - 1) / 2, -1, 1))
    v = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2
    return v if t < 1e-6 else v * (t / max(np.sin(t), 1e-9))


def ours(program, data, scene):
    with tempfile.TemporaryDirectory() as out:
        command = [program, "tracking", "--data", str(data), "--only", scene, "--own", "--set", "{}", "--out", out]
        subprocess.run(command, capture_output=True, check=True)
        row = json.load(open(pathlib.Path(out) / "tracking.json"))["rows"][0]
    return row["errors"]["joints_mm"], row["errors"]["worst_frame_mm"], row["run_ms"]


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--data", type=pathlib.Path, required=True)
    a.add_argument("--frames", type=int, default=10_000)
    a.add_argument("--bench", default="target/release/tryon-bench")
    a = a.parse_args()
    print("| sequence | tracker | joints, mm | worst frame | ms a frame | of it compiled |\n|---|---|---|---|---|---|")
    for scene, subject in SCENES:
        folder, body = a.data / "sequences" / scene, a.data / "body/makehuman_smpl_layout" / f"{subject}.npz"
        e, w, ms, native = follow(folder, Body(body), a.frames)
        print(f"| {scene} | articulated ICP, Open3D {o3d.__version__} | {e:.1f} | {w:.1f} | {ms:.0f} | {native:.0f} |", flush=True)
        e, w, ms = ours(a.bench, a.data, scene)
        print(f"| | this project | {e:.1f} | {w:.1f} | {ms:.1f} | {ms:.1f} |", flush=True)


if __name__ == "__main__":
    main()
