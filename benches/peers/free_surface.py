#!/usr/bin/env python3
"""Non-rigid registration and sparse solvers of others beside this project's free surface, on the same scan and system.

    cargo run --release -p tryon-bench --example free_surface -- out/surface
    python3 benches/peers/free_surface.py out/surface [--example target/release/examples/free_surface] [--only solve]

With --example the project runs in the same call, before the peers. Registration: all start at the body model fitted to
the scan and move its mesh onto the scan's points. trimesh: `nricp_amberg`, an affine map a vertex, each vertex to its
nearest scan point, with its own schedule of stiffness and with a softer one, no landmarks. pycpd: coherent point drift
has dense matrices of model times scan, so that it gets 1 of 8 vertices and 1 of 15 points; its field moves the other
vertices. All are judged alike: distance of all scan points from the mesh, and the change of edge lengths, which shows
noise taken for shape. Solve: one system of the last iteration, an edge Laplacian with a row a scan point and a pull to
the model, three right-hand sides. CHOLMOD is that of cvxopt, SuperLU that of scipy. Times are wall time, one thread each,
medians of 5 for the systems. Needs numpy, scipy, trimesh, rtree, networkx, pycpd and cvxopt.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import time

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import cvxopt  # noqa: E402
import cvxopt.cholmod  # noqa: E402
import numpy as np  # noqa: E402
import pycpd  # noqa: E402
import scipy.sparse as sp  # noqa: E402
import scipy.sparse.linalg as spl  # noqa: E402
import scipy.spatial as spatial  # noqa: E402
import trimesh  # noqa: E402

RUNS = 5
CPD = [(0.05, 1.0), (0.05, 10.0), (0.1, 1.0)]  # Kernel width in metres, stiffness.
CPD_MODEL, CPD_SCAN = 8, 15
CPD_START = 0.03  # Standard deviation of the first matches, metres.
# Steps of nricp_amberg: stiffness, landmarks, exponent of the normals' cosine, most iterations.
SOFTER = [[0.01, 0, 0.5, 10], [0.003, 0, 0.5, 10], [0.001, 0, 0.5, 10], [0.0003, 0, 0.5, 10]]
NEAREST_FACES = 24


def read(folder, name, columns):
    kind = {"f32": "<f4", "f64": "<f8", "u32": "<u4"}[name.split(".")[1]]
    return np.fromfile(folder / name, kind).reshape(-1, columns)


def distances(points, vertices, faces):
    """Distance of each point from a mesh: exact for the faces whose centres are nearest."""
    triangles = vertices[faces]
    _, near = spatial.cKDTree(triangles.mean(axis=1)).query(points, NEAREST_FACES)
    best = np.full(len(points), np.inf)
    for column in near.T:
        closest = trimesh.triangles.closest_point(triangles[column], points)
        best = np.minimum(best, np.linalg.norm(closest - points, axis=1))
    return best


def edge_change(vertices, model, faces):
    """Mean relative change of the edges' lengths."""
    a, b = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0).T
    length = lambda v: np.linalg.norm(v[a] - v[b], axis=1)  # noqa: E731
    return np.abs(length(vertices) / length(model) - 1).mean()


def amberg(steps):
    def run(scan, model, faces):
        mesh = trimesh.Trimesh(model, faces, process=False)
        return trimesh.registration.nricp_amberg(mesh, trimesh.PointCloud(scan), steps=steps, use_faces=False)

    return run


def drift(beta, alpha):
    def run(scan, model, _faces):
        some = model[::CPD_MODEL]
        settings = {"w": 0.05, "sigma2": CPD_START**2, "max_iterations": 30, "tolerance": 1e-9}
        registration = pycpd.DeformableRegistration(beta=beta, alpha=alpha, X=scan[::CPD_SCAN], Y=some, **settings)
        registration.register()
        kernel = np.exp(-spatial.distance.cdist(model, some, "sqeuclidean") / (2 * beta**2))
        return model + kernel @ registration.W

    return run


def register(folder, ours):
    scan, model, surface = (read(folder, f"{n}.f32", 3).astype(float) for n in ("scan", "model", "surface"))
    faces = read(folder, "faces.u32", 3).astype(np.int64)
    print(f"{len(scan)} points, {len(model)} vertices\n")
    print("registration                     time [s]  mean [mm]  95 % [mm]  edges changed [%]")

    def judge(name, seconds, vertices):
        found = 1e3 * distances(scan, vertices, faces)
        change = 100 * edge_change(vertices, model, faces)
        high = np.quantile(found, 0.95)
        print(f"{name:32} {seconds:8.2f} {found.mean():10.2f} {high:10.2f} {change:18.1f}", flush=True)

    judge("body model, the start", 0.0, model)
    judge("ours", ours / 1e3, surface)
    peers = [(f"pycpd, width {b} m, stiffness {a}", drift(b, a)) for b, a in CPD]
    peers += [("trimesh, nricp_amberg", amberg(None)), ("trimesh, nricp_amberg, softer", amberg(SOFTER))]
    for name, run in peers:
        start = time.perf_counter()
        vertices = run(scan, model, faces)
        judge(name, time.perf_counter() - start, vertices)


def superlu(lower, rhs):
    full = (lower + sp.tril(lower, -1).T).tocsc()
    start = time.perf_counter()
    factor = spl.splu(full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    factored = time.perf_counter()
    x = factor.solve(rhs)
    return x, [0.0, factored - start, time.perf_counter() - factored]


def superlu_default(lower, rhs):
    full = (lower + sp.tril(lower, -1).T).tocsc()
    start = time.perf_counter()
    x = spl.spsolve(full, rhs)
    return x, [0.0, 0.0, time.perf_counter() - start]


def cholmod(lower, rhs):
    coo = lower.tocoo()
    matrix = cvxopt.spmatrix(coo.data, coo.row.astype(int), coo.col.astype(int), lower.shape)
    x = cvxopt.matrix(rhs)
    start = time.perf_counter()
    factor = cvxopt.cholmod.symbolic(matrix)
    analysed = time.perf_counter()
    cvxopt.cholmod.numeric(matrix, factor)
    factored = time.perf_counter()
    cvxopt.cholmod.solve(factor, x)
    return np.array(x), [analysed - start, factored - analysed, time.perf_counter() - factored]


def solve(folder, ours):
    places, values = read(folder, "places.u32", 2), read(folder, "entries.f64", 1).ravel()
    rhs, solution = read(folder, "rhs.f64", 3), read(folder, "solution.f64", 3)
    lower = sp.csc_matrix((values, places.T.astype(np.int64)), (len(rhs), len(rhs)))
    print(f"\n{len(rhs)} unknowns, {len(values)} entries of the lower triangle\n")
    print("solver                 analysis [ms]  factor [ms]  solve [ms]  largest difference [mm]")
    line = "{:22} {:13.1f} {:12.1f} {:11.1f} {:24.1e}"
    print(line.format("ours", *ours, 0.0))
    peers = [("CHOLMOD", cholmod), ("SuperLU, symmetric", superlu), ("SuperLU, spsolve", superlu_default)]
    for name, run in peers:
        runs = [run(lower, rhs) for _ in range(RUNS)]
        times = [1e3 * statistics.median(r[1][k] for r in runs) for k in range(3)]
        print(line.format(name, *times, 1e3 * np.abs(runs[0][0] - solution).max()), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--example", help="built example, run first")
    parser.add_argument("--only", choices=["register", "solve"])
    options = parser.parse_args()
    if options.example:
        subprocess.run([options.example, str(options.folder)], check=True, stdout=subprocess.DEVNULL)
    fit, *system = map(float, (options.folder / "times").read_text().split())
    if options.only != "solve":
        register(options.folder, fit)
    if options.only != "register":
        solve(options.folder, system)


if __name__ == "__main__":
    main()
