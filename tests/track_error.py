#!/usr/bin/env python3
"""Mean joint error of `tryon track` against truth.json.

    track_error.py [--from-frame 30] [--max-mm 40] [--per-joint] OUT.jsonl SEQUENCE/truth.json

Lines of OUT.jsonl are {"frame": n, "status": ..., "joints": {"name": [x, y, z], ...}}, camera frame, metres. Joints
are compared by name. Prints the mean over joints and frames and counts lost frames; exits 1 when the mean is above
--max-mm, a frame is missing or the status of a compared frame is not live.
"""

import argparse
import json
import sys

import numpy as np


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result")
    parser.add_argument("truth")
    parser.add_argument("--from-frame", type=int, default=30)
    parser.add_argument("--max-mm", type=float, default=40.0)
    parser.add_argument("--per-joint", action="store_true")
    a = parser.parse_args()

    with open(a.truth, encoding="utf-8") as f:
        truth = json.load(f)
    names, wanted = truth["joint_names"], np.array(truth["joints"])
    frames = {}
    with open(a.result, encoding="utf-8") as f:
        for number, line in enumerate(f, 1):
            try:
                record = json.loads(line)
                frames[record["frame"]] = record
            except (json.JSONDecodeError, KeyError) as e:
                print(f"{a.result}:{number}: {e}", file=sys.stderr)
                return 1

    lost, errors = [], []
    for k in range(a.from_frame, len(wanted)):
        record = frames.get(k)
        live = record is not None and record["status"] in ("tracking", "calibrating")
        if not live:
            lost.append(k)
            continue
        got = np.array([record.get("joints", {}).get(n, [np.nan] * 3) for n in names])
        errors.append(np.linalg.norm(got - wanted[k], axis=1) * 1000.0)
    if not errors:
        print("no frame to compare", file=sys.stderr)
        return 1
    errors = np.array(errors)
    if np.isnan(errors).any():
        missing = [n for n, e in zip(names, errors.T) if np.isnan(e).any()]
        print(f"joints missing in the result: {', '.join(missing)}", file=sys.stderr)
        return 1
    mean = errors.mean()
    worst = errors.mean(axis=1)
    print(f"mean {mean:.1f} mm over {errors.shape[1]} joints and {len(errors)} frames, "
          f"worst frame {worst.max():.1f} mm, lost {len(lost)}")
    if a.per_joint:
        for n, e in sorted(zip(names, errors.mean(axis=0)), key=lambda x: -x[1]):
            print(f"  {n:16s} {e:6.1f}")
    return 0 if mean <= a.max_mm and not lost else 1


if __name__ == "__main__":
    sys.exit(main())
