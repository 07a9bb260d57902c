#!/usr/bin/env python3
"""MuJoCo's flex on the pinned squares of the standard scenes, beside this project's simulator, in one run.

    python3 benches/peers/cloth_mujoco.py --scenes ../shared/data/scenes [--tryon target/release/tryon] [--scene A_pin_1k]

Both get the same mesh, pins and fabric; the sheet is MuJoCo's Kirchhoff plate (`elastic2d="both"`) whose thickness and
modulus give the scene's membrane and bending stiffness. No damping, no contact. Errors against the scene's reference:
root mean square of the centre of mass over the whole time, of the vertices at 0.5 s; 99th percentile of the edges'
stretch at the end. Processor time of one thread for 1/60 s, median. Needs `pip install mujoco numpy` (4.0.0 here).
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
import time

import mujoco
import numpy as np

STEPS = (1, 4, 8, 16)
FRAME = 1.0 / 60.0


def read_obj(path):
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif kind == "f":
            faces.append([int(x.split("/")[0]) - 1 for x in rest])
    return np.array(vertices), np.array(faces)


def model(scene, vertices, faces, steps):
    fabric = scene["material"]
    membrane, bending, nu = fabric["young_membrane_N_m"], fabric["bending_rigidity_N_m"], fabric["poisson"]
    # A plate of thickness t has membrane E·t and bending E·t³ / (12 (1 − ν²)).
    thickness = np.sqrt(12.0 * (1.0 - nu**2) * bending / membrane)
    flat = lambda a: " ".join(f"{x:.9g}" for x in np.asarray(a).ravel())  # noqa: E731
    area = 0.5 * np.linalg.norm(
        np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]), axis=1
    ).sum()
    xml = f"""<mujoco>
      <option timestep="{FRAME / steps}" gravity="{flat(scene['gravity'])}" integrator="discrete"/>
      <size memory="500M"/>
      <worldbody>
        <flexcomp name="cloth" type="direct" dim="2" mass="{area * fabric['area_density_kg_m2']}" radius="1e-4"
                  point="{flat(vertices)}" element="{flat(faces)}">
          <elasticity young="{membrane / thickness}" poisson="{nu}" thickness="{thickness}" elastic2d="both"/>
          <contact selfcollide="none" contype="0" conaffinity="0"/>
          <edge equality="false"/>
          <pin id="{flat(scene['pinned_vertices'])}"/>
        </flexcomp>
      </worldbody></mujoco>"""
    return mujoco.MjModel.from_xml_string(xml)


def errors(positions, reference, vertices, faces):
    n = min(len(positions), len(reference))
    mass = lambda p: p[:n].mean(axis=1)  # noqa: E731
    centre = np.sqrt(((mass(positions) - mass(reference)) ** 2).sum(axis=1).mean())
    half = 30
    at_half = np.sqrt(((positions[half] - reference[half]) ** 2).sum(axis=1).mean())
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    length = lambda p: np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1)  # noqa: E731
    strain = np.percentile(length(positions[-1]) / length(vertices) - 1.0, 99)
    return f"{centre * 1e3:.1f} | {at_half * 1e3:.1f} | {strain * 100:.2f}"


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--scenes", type=pathlib.Path, default="../shared/data/scenes")
    args.add_argument("--scene", action="append", default=None)
    args.add_argument("--tryon", type=pathlib.Path, default="target/release/tryon")
    args = args.parse_args()
    for name in args.scene or ["A_pin_1k"]:
        scene = json.loads((args.scenes / f"{name}.json").read_text())
        vertices, faces = read_obj(args.scenes / scene["mesh"])
        reference = np.load(args.scenes / f"{name}.reference.npy")
        print(f"\n{name}: simulator | ms for 1/60 s | centre of mass, mm | vertices at 0.5 s, mm | p99 stretch, %")
        for steps in STEPS:
            m = model(scene, vertices, faces, steps)
            d = mujoco.MjData(m)
            positions, times = [vertices], []
            for _ in range(int(scene["duration_s"] / FRAME + 0.5)):
                start = time.thread_time()
                mujoco.mj_step(m, d, steps)
                times.append(time.thread_time() - start)
                positions.append(d.flexvert_xpos.copy())
            positions = np.array(positions)
            note = "" if np.isfinite(positions).all() else " (not finite)"
            print(f"MuJoCo {mujoco.__version__}, {steps} steps{note} | {np.median(times) * 1e3:.1f} | "
                  f"{errors(positions, reference, vertices, faces)}", flush=True)
        with tempfile.TemporaryDirectory() as out:
            path = args.scenes / f"{name}.json"
            subprocess.run([args.tryon, "simulate", "--scene", path, "--out", out], check=True, capture_output=True)
            positions = np.load(pathlib.Path(out) / "positions.npy")
            report = json.loads((pathlib.Path(out) / "report.json").read_text())
        print(f"this project | {report['ms_median']:.2f} | {errors(positions, reference, vertices, faces)}")


if __name__ == "__main__":
    main()
