#!/usr/bin/env python3
"""Alpha expansion of gco-wrapper and PyMaxflow beside this project's solver, on the same integer energies.

    cargo run --release -p tryon-bench --example potts_labelling -- out/potts
    python3 benches/peers/alpha_expansion.py out/potts [--example target/release/examples/potts_labelling]

With --example the project's solver runs in the same call, before the peers. All start from the labels of least
unary cost and expand labels in ascending order until none changes. Times are medians of wall time, one thread each.
gco: `expansion` alone, and with the construction of its graph. PyMaxflow has no expansion on general graphs: the moves
are numpy here, the maximum flows are its own; its time is that of `maxflow` alone, and of the whole. Needs numpy,
gco-wrapper and PyMaxflow.
"""

import argparse
import pathlib
import statistics
import subprocess
import time

import gco
import maxflow
import numpy as np


def read(folder, name):
    """Edges, weights, unary costs and initial labels."""
    load = lambda array, kind: np.fromfile(folder / f"{name}.{array}", kind)  # noqa: E731
    init = load("init", "<u4").astype(np.int64)
    unary = load("unary", "<f4").astype(np.int64).reshape(len(init), -1)
    return load("edges", "<u4").astype(np.int64).reshape(-1, 2), load("weights", "<f4").astype(np.int64), unary, init


def energy(edges, weights, unary, labels):
    cut = labels[edges[:, 0]] != labels[edges[:, 1]]
    return int(unary[np.arange(len(labels)), labels].sum() + weights[cut].sum())


def run_gco(edges, weights, unary, init):
    start = time.perf_counter()
    nodes, labels = unary.shape
    graph = gco.GCO()
    graph.create_general_graph(nodes, labels, energy_is_float=False)
    graph.set_data_cost(unary.astype(np.intc))
    low, high = np.sort(edges.astype(np.intc), axis=1).T  # The reverse order is silently ignored.
    graph.set_all_neighbors(np.ascontiguousarray(low), np.ascontiguousarray(high), weights.astype(np.intc))
    graph.set_smooth_cost((1 - np.eye(labels)).astype(np.intc))
    for node, label in enumerate(init):
        graph.init_label_at_site(node, int(label))
    built = time.perf_counter()
    graph.expansion(-1)
    end = time.perf_counter()
    found = np.asarray(graph.get_labels()).astype(np.int64)
    graph.destroy_graph()
    return end - built, end - start, found


def run_maxflow(edges, weights, unary, init):
    start, in_flow = time.perf_counter(), 0.0
    nodes, count = unary.shape
    labels, everyone = init.copy(), np.arange(nodes)
    p, q = edges.T
    unchanged, label = 0, 0
    while unchanged < count:
        # Twice the energy: half of a cut edge's weight on either side stays an integer.
        same = labels[p] == labels[q]
        keep = 2 * unary[everyone, labels]
        take = 2 * unary[:, label]
        np.subtract.at(take, p[~same], weights[~same])
        np.subtract.at(take, q[~same], weights[~same])
        capacity = np.where(same, 2 * weights, weights)
        take = np.where(labels == label, keep, take)
        keep = np.where(labels == label, keep + 4 * weights.sum(), keep)
        graph = maxflow.Graph[int](nodes, len(edges))
        graph.add_nodes(nodes)
        graph.add_edges(p, q, capacity, capacity)
        graph.add_grid_tedges(everyone, keep - np.minimum(keep, take), take - np.minimum(keep, take))
        before = time.perf_counter()
        graph.maxflow()
        in_flow += time.perf_counter() - before
        # The source side pays the sink's capacity, `take`.
        moved = ~graph.get_grid_segments(everyone) & (labels != label)
        new = np.where(moved, label, labels)
        improves = energy(edges, weights, unary, new) < energy(edges, weights, unary, labels)
        unchanged = 1 if improves else unchanged + 1
        labels = new if improves else labels
        label = (label + 1) % count
    return in_flow, time.perf_counter() - start, labels


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--example", help="built example, run first")
    parser.add_argument("--runs", type=int, default=9)
    options = parser.parse_args()
    if options.example:
        subprocess.run([options.example, str(options.folder)], check=True, stdout=subprocess.DEVNULL)

    print("energy    solver      solve [ms]  with graph [ms]      energy  energy/ours  time/ours")
    for result in sorted(options.folder.glob("*.result")):
        name = result.stem
        problem = read(options.folder, name)
        solve, build, found = map(float, result.read_text().split())
        rows = [("ours", solve, build, int(found))]
        for solver, run in (("gco", run_gco), ("PyMaxflow", run_maxflow)):
            runs = [run(*problem) for _ in range(options.runs)]
            times = [1e3 * statistics.median(r[i] for r in runs) for i in (0, 1)]
            rows.append((solver, *times, energy(*problem[:3], runs[0][2])))
        for solver, alone, whole, value in rows:
            ratios = f"{value / found:11.5f}  {alone / solve:9.2f}"
            print(f"{name:9} {solver:9} {alone:12.2f}  {whole:15.2f}  {value:10}  {ratios}")


if __name__ == "__main__":
    main()
