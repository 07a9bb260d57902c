#!/usr/bin/env python3
"""Crossings of worn cloth by libigl's exact predicates beside this project's own count, on the same meshes.

    tryon-bench worn --motion calm --meshes 40 --out DIR
    python3 tests/clients/crossings.py DIR/meshes

Ends with 1 where one finds crossings and the other none. libigl counts pairs of faces, this project edges through faces.
Faces that share a corner never cross here and may there, so those pairs are left out. Needs `pip install libigl numpy`
(2.6.3 here).
"""

import argparse
import json
import pathlib
import sys

import numpy as np
from igl import predicates


def read(file):
    rows = [line.split() for line in file.read_text().splitlines()]
    vertices = np.array([row[1:] for row in rows if row[0] == "v"], dtype=np.float64)
    faces = np.array([row[1:] for row in rows if row[0] == "f"], dtype=np.int64) - 1
    return vertices, faces


def crossing_pairs(vertices, faces):
    pairs = predicates.find_self_intersections(vertices, faces)[1]
    apart = [not set(faces[a]) & set(faces[b]) for a, b in pairs]
    return int(np.count_nonzero(apart))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="meshes and crossings.json of `tryon-bench worn --meshes`")
    folder = parser.parse_args().folder
    ours = json.loads((folder / "crossings.json").read_text())
    assert ours, "no meshes"
    differ = []
    for name, counts in sorted(ours.items()):
        theirs = crossing_pairs(*read(folder / name))
        if (theirs > 0) != (sum(counts) > 0):
            differ.append(name)
            print(f"{name}: {theirs} pairs of faces by libigl, {sum(counts)} edges here")
    crossed = sum(sum(counts) > 0 for counts in ours.values())
    print(f"{len(ours)} meshes, {crossed} with crossings, {len(differ)} told differently")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
