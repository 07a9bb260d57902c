#!/usr/bin/env python3
"""Distances, barrier and friction of IPC Toolkit beside this project's, on the same contact pairs.

    cargo run --release -p tryon-bench --example contact_potentials -- out/contact
    python3 benches/peers/contact_ipctk.py out/contact [--example target/release/examples/contact_potentials]

With --example the project's potentials run in the same call, before the peer. Prints the largest relative difference of
value, gradient and Hessian (norm of the difference over the norm), and for distances inside of both features the largest
relative error of value and gradient of either against exact rationals. Hessians are compared as they are, unprojected.
The toolkit's time is the thread's for a loop of Python calls, less an empty call (its `point_point_distance`); its barrier
is that with PSDProjectionMethod.CLAMP. Needs numpy and ipctk.
"""

import argparse
import pathlib
import subprocess
import time
from fractions import Fraction

import ipctk
import numpy as np

# Those of the example.
STIFFNESS, ACTIVATION, MU, SLIP = 1.0, 1e-3, 0.3, 1e-5
FIELD = [("value", "f8"), ("gradient", "f8", 12), ("hessian", "f8", (12, 12))]
OURS = np.dtype([("slides", "f8"), ("threshold", "f8"), ("distance", FIELD), ("barrier", FIELD), ("friction", FIELD)])
# The toolkit's barrier has the unit of its argument squared (m⁴).
UNIT = ACTIVATION**4


def exact_distance(corners, faces):
    """Squared distance of point and plane, or of two lines, in rationals, and its rounded gradient."""
    a, b, c, d = [[Fraction(float(x)) for x in p] for p in corners]
    minus = lambda p, q: [x - y for x, y in zip(p, q)]  # noqa: E731
    dot = lambda p, q: sum(x * y for x, y in zip(p, q))  # noqa: E731
    cross = lambda p, q: [p[i - 2] * q[i - 1] - p[i - 1] * q[i - 2] for i in range(3)]  # noqa: E731
    u, v, r = (minus(c, b), minus(d, b), minus(a, b)) if faces else (minus(b, a), minus(d, c), minus(a, c))
    n = cross(u, v)
    area, height = dot(n, n), dot(n, r)
    if faces:
        s, t = dot(cross(r, v), n) / area, dot(cross(u, r), n) / area
        weights = [1, s + t - 1, -s, -t]
    else:
        s, t = -dot(r, cross(v, n)) / area, -dot(r, cross(u, n)) / area
        weights = [1 - s, s, t - 1, -t]
    gradient = [float(2 * w * height * x / area) for w in weights for x in n]
    return height**2 / area, np.array(gradient)


class Toolkit:
    """Stencil functions of one kind of pair."""

    def __init__(self, faces):
        self.faces = faces
        kind = "point_triangle" if faces else "edge_edge"
        self.functions = [getattr(ipctk, f"{kind}_distance{d}") for d in ("", "_gradient", "_hessian")]
        self.barrier = ipctk.BarrierPotential(ACTIVATION, STIFFNESS / UNIT)
        self.friction = ipctk.FrictionPotential(SLIP)

    def distance(self, corners):
        return [f(*corners) for f in self.functions]

    def pair(self, threshold):
        if self.faces:
            return ipctk.FaceVertexNormalCollision(0, 0)
        return ipctk.EdgeEdgeNormalCollision(0, 1, threshold)

    def lagged(self, pair, corners):
        kind = ipctk.FaceVertexTangentialCollision if self.faces else ipctk.EdgeEdgeTangentialCollision
        lagged = kind(pair, corners, self.barrier)
        lagged.mu_s = lagged.mu_k = MU
        lagged.mu_s_effective_lagged = lagged.mu_k_effective_lagged = MU
        return lagged


def expand(potential, pair, x):
    return potential(pair, x), potential.gradient(pair, x), potential.hessian(pair, x)


def differences(ours, theirs):
    """Relative differences of value, gradient and Hessian."""
    norm = lambda a: np.linalg.norm(np.ravel(a))  # noqa: E731
    pairs = zip((ours["value"], ours["gradient"], ours["hessian"]), theirs)
    return [norm(a - b) / max(norm(a), norm(b), 1e-300) for a, b in pairs]


def microseconds(calls):
    best = np.inf
    for _ in range(5):
        start = time.thread_time()
        for f, arguments in calls:
            f(*arguments)
        best = min(best, time.thread_time() - start)
    return 1e6 * best / len(calls)


def compare(folder, name):
    faces = name.startswith("face")
    toolkit = Toolkit(faces)
    positions = np.fromfile(folder / f"{name}.pairs").reshape(-1, 2, 4, 3)
    ours = np.fromfile(folder / f"{name}.ours", OURS)
    worst = {field: [] for field in ("distance", "barrier", "friction")}
    errors, timed = [], {"empty": [], "distance": [], "Hessian": [], "barrier": [], "friction": []}
    for (here, now), mine in zip(positions, ours):
        worst["distance"].append(differences(mine["distance"], toolkit.distance(here)))
        timed["empty"].append((ipctk.point_point_distance, here[:2]))
        timed["distance"].append((toolkit.functions[0], here))
        timed["Hessian"].append((toolkit.functions[2], here))
        if mine["slides"] != 2:
            continue  # The toolkit has other classes for these.
        exact, slope = exact_distance(here, faces)
        found = (mine["distance"]["value"], mine["distance"]["gradient"]), [f(*here) for f in toolkit.functions[:2]]
        value = [abs(float((Fraction(float(v)) - exact) / exact)) for v, _ in found]
        gradient = [np.linalg.norm(g - slope) / np.linalg.norm(slope) for _, g in found]
        errors.append([*value, *gradient])
        pair, x = toolkit.pair(mine["threshold"]), here.ravel()
        worst["barrier"].append(differences(mine["barrier"], expand(toolkit.barrier, pair, x)))
        lagged = toolkit.lagged(pair, x)
        moved = (now - here).ravel()
        # The toolkit's friction takes the load of a barrier that is not mollified.
        factor = pair.mollifier(x) if pair.is_mollified() else 1.0
        friction = [factor * e for e in expand(toolkit.friction, lagged, moved)]
        worst["friction"].append(differences(mine["friction"], friction))
        clamp = ipctk.PSDProjectionMethod.CLAMP
        timed["barrier"].append((toolkit.barrier.hessian, (pair, x, clamp)))
        timed["friction"].append((toolkit.friction.hessian, (lagged, moved)))
    return worst, np.array(errors), {k: microseconds(v) for k, v in timed.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--example", help="built example, run first")
    options = parser.parse_args()
    ipctk.set_num_threads(1)
    if options.example:
        subprocess.run([options.example, str(options.folder)], check=True, stdout=subprocess.DEVNULL)

    for path in sorted(options.folder.glob("*.ours")):
        worst, errors, times = compare(options.folder, path.stem)
        ours = dict(zip(("distance", "Hessian", "barrier", "friction"), map(float, path.with_suffix(".times").read_text().split())))
        print(f"{path.stem}: {len(worst['distance'])} pairs, {len(errors)} inside of both features")
        for field, rows in worst.items():
            rows = np.array(rows)
            cells = [f"{np.max(c):8.1e} (p50 {np.median(c):7.1e})" for c in rows.T]
            print(f"  {field:9} largest difference of value, gradient, Hessian: {', '.join(cells)}")
        ours_value, their_value, ours_gradient, their_gradient = errors.max(axis=0)
        print(f"  squared distance against exact: ours {ours_value:.1e}, ipctk {their_value:.1e}")
        print(f"  its gradient against exact:     ours {ours_gradient:.1e}, ipctk {their_gradient:.1e}")
        for what, mine in ours.items():
            theirs = times[what] - times["empty"]
            print(f"  {what:9} {1e-3 * mine:6.2f} µs, ipctk {theirs:6.2f} µs (call {times['empty']:.2f} µs apart)")


if __name__ == "__main__":
    main()
