#!/usr/bin/env python3
"""Continuous collision detection of the IPC Toolkit beside this project's, on the same queries in one run.

    python3 benches/peers/ccd_ipctk.py ../shared/data/ccd/sample_queries_mit [--bench target/release/tryon-bench]

Tight Inclusion (Wang et al. 2021) and additive CCD (Li et al. 2021) at their defaults. Missed impacts and false alarms against the exact truth.
Nanoseconds a query: median over queries of the best of five calls, less a call of the same binding that ends at once
(far points), which is what Python costs. Needs `pip install ipctk numpy` (1.6.0 here).
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import time
from fractions import Fraction

import ipctk
import numpy as np

ipctk.set_logger_level(ipctk.LoggerLevel.error)

REPEATS = 5
LONG = 1e-3  # seconds after which a call isn't repeated


def read_queries(file):
    rows = [[int(x) for x in line.split(",")] for line in file.read_text().splitlines() if line.strip()]
    for first in range(0, len(rows), 8):
        eight = rows[first : first + 8]
        points = np.array([[float(Fraction(r[k], r[k + 1])) for k in (0, 2, 4)] for r in eight])
        yield points, eight[0][6] == 1


def read_tree(root):
    for file in sorted(root.rglob("*.csv")):
        kind = file.parent.name
        if kind in ("vertex-face", "edge-edge"):
            for points, truth in read_queries(file):
                yield file.parent.parent.name, kind, points, truth


def seconds(call, points):
    best = float("inf")
    for _ in range(REPEATS):
        start = time.perf_counter()
        hit, _ = call(*points)
        best = min(best, time.perf_counter() - start)
        if best > LONG:
            break
    return hit, best


def judge(method, queries):
    calls = {"vertex-face": method.point_triangle_ccd, "edge-edge": method.edge_edge_ccd}
    far = np.array([[x, 0.0, 0.0] for x in (0.0, 9.0, 10.0, 11.0)] * 2)
    overhead = {kind: min(seconds(call, far)[1] for _ in range(1000)) for kind, call in calls.items()}
    impacts = missed = alarms = 0
    times = []
    for _, kind, points, truth in queries:
        hit, best = seconds(calls[kind], points)
        impacts += truth
        missed += truth and not hit
        alarms += hit and not truth
        times.append(max(best - overhead[kind], 0.0) * 1e9)
    return impacts, missed, alarms, statistics.median(times), statistics.fmean(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--bench", default="target/release/tryon-bench")
    args = parser.parse_args()
    queries = list(read_tree(args.root))
    free = sum(not q[3] for q in queries)
    methods = {
        "Tight Inclusion": ipctk.TightInclusionCCD(),
        "additive CCD": ipctk.AdditiveCCD(),
    }
    print(f"{len(queries)} queries, {len(queries) - free} impacts")
    print(f"{'method':34} {'missed':>6} {'false':>6} {'of free %':>9} {'median ns':>9} {'mean ns':>9}")
    line = "{:34} {:6d} {:6d} {:9.2f} {:9.0f} {:9.0f}"
    for name, method in methods.items():
        _, missed, alarms, median, mean = judge(method, queries)
        print(line.format(name, missed, alarms, 100.0 * alarms / free, median, mean), flush=True)
    done = subprocess.run([args.bench, "ccd", "--queries", args.root, "--json"], check=True, capture_output=True, text=True)
    total = json.loads(done.stdout)["total"]
    alarms = total["false_alarms"]
    row = (total["missed"], alarms, 100.0 * alarms / free, total["median_ns"], total["mean_ns"])
    print(line.format("tryon", *row))


if __name__ == "__main__":
    main()
