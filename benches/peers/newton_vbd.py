#!/usr/bin/env python3
"""Vertex block descent of NVIDIA Newton on a pinned square of the standard scenes, on the CPU.

    python3 benches/peers/newton_vbd.py --scenes ../shared/data/scenes [--scene A_pin_1k] [--steps 8] [--iterations 10]

Mesh, pins, mass and fabric are the scene's: its membrane is Newton's neo-Hookean one with the scene's Lamé moduli, its
bending a stiffness of 3 D |e| / (A₁ + A₂) for each hinge. No damping, no contact; implicit Euler steps. Prints one JSON
line: milliseconds for 1/60 s (processor time of the calling thread, on which Warp's CPU kernels run from a captured graph;
median), distance to the scene's reference at 0.5 s (root mean square over vertices) and of the centre of mass over the
whole time, 99th percentile of the edges' stretch at the end. Needs `pip install -r benches/peers/newton_vbd.txt`.
"""

import argparse
import json
import pathlib
import time

import newton
import numpy as np
import warp as wp

FRAME = 1.0 / 60.0
HALF_SECOND = 30


def read_obj(path):
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        kind, *rest = line.split() or [""]
        if kind == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif kind == "f":
            faces.append([int(x.split("/")[0]) - 1 for x in rest])
    return np.array(vertices), np.array(faces)


def build(scene, vertices, faces):
    fabric = scene["material"]
    builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=scene["gravity"])
    builder.add_cloth_mesh(
        pos=wp.vec3(0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0),
        vertices=[wp.vec3(*p) for p in vertices],
        indices=faces.ravel().tolist(),
        density=fabric["area_density_kg_m2"],
        tri_ke=fabric["lame_mu_2d_N_m"],
        tri_ka=fabric["lame_lambda_2d_N_m"],
        tri_kd=0.0,
        tri_drag=0.0,
        tri_lift=0.0,
        edge_ke=0.0,
        edge_kd=0.0,
        particle_radius=1e-4,
    )
    for i, hinge in enumerate(builder.edge_indices):
        if min(hinge) < 0:
            continue
        a, b, start, end = (vertices[v] for v in hinge)
        edge = end - start
        double_areas = sum(np.linalg.norm(np.cross(edge, p - start)) for p in (a, b))
        stiffness = 6.0 * fabric["bending_rigidity_N_m"] * np.linalg.norm(edge) / double_areas
        builder.edge_bending_properties[i] = (stiffness, 0.0)
    for v in scene["pinned_vertices"]:
        builder.particle_mass[v] = 0.0
        builder.particle_flags[v] = builder.particle_flags[v] & ~newton.ParticleFlags.ACTIVE
    builder.color(include_bending=True)
    return builder.finalize(device="cpu")


def simulate(model, frames, steps, iterations):
    solver = newton.solvers.SolverVBD(model, iterations=iterations, particle_enable_self_contact=False)
    states, control = [model.state(), model.state()], model.control()

    def frame():
        for _ in range(steps):
            states[0].clear_forces()
            solver.step(states[0], states[1], control, None, FRAME / steps)
            states.reverse()

    # A graph writes to the states it was captured with: an even number of steps leaves them in place.
    with wp.ScopedCapture(device="cpu") as capture:
        frame()
    positions, times = [states[0].particle_q.numpy().copy()], []
    for _ in range(frames):
        start = time.thread_time()
        wp.capture_launch(capture.graph)
        times.append(time.thread_time() - start)
        positions.append(states[0].particle_q.numpy().copy())
    return np.array(positions), times


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path, default="../shared/data/scenes")
    parser.add_argument("--scene", default="A_pin_1k")
    parser.add_argument("--steps", type=int, default=8, help="implicit Euler steps for 1/60 s, an even number")
    parser.add_argument("--iterations", type=int, default=10, help="passes over the vertices for a step")
    args = parser.parse_args()
    if args.steps < 2 or args.steps % 2 or args.iterations < 1:
        parser.error("--steps must be even and --iterations positive")
    wp.config.log_level = wp.LOG_WARNING
    scene = json.loads((args.scenes / f"{args.scene}.json").read_text())
    vertices, faces = read_obj(args.scenes / scene["mesh"])
    reference = np.load(args.scenes / f"{args.scene}.reference.npy")
    frames = int(scene["duration_s"] / FRAME + 0.5)
    positions, times = simulate(build(scene, vertices, faces), frames, args.steps, args.iterations)

    n = min(len(positions), len(reference))
    centre = (positions[:n] - reference[:n]).mean(axis=1)
    apart = positions[HALF_SECOND] - reference[HALF_SECOND]
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    length = lambda p: np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1)  # noqa: E731
    print(
        json.dumps(
            {
                "scene": args.scene,
                "newton": newton.__version__,
                "warp": wp.__version__,
                "steps": args.steps,
                "iterations": args.iterations,
                "is_finite": bool(np.isfinite(positions).all()),
                "ms": round(float(np.median(times)) * 1e3, 2),
                "rms_mm_at_half_second": round(float(np.sqrt((apart**2).sum(axis=1).mean())) * 1e3, 2),
                "centre_of_mass_rms_mm": round(float(np.sqrt((centre**2).sum(axis=1).mean())) * 1e3, 2),
                "stretch_p99_percent": round(float(np.percentile(length(positions[-1]) / length(vertices) - 1, 99)) * 100, 2),
            }
        )
    )


if __name__ == "__main__":
    main()
