#!/usr/bin/env python3
"""Attacks a box from outside: faults, load, strangers. One line an attack: its figures, each with bar and goal.

    cargo build --release --workspace --bins
    python3 tests/clients/attack.py --bin target/release [--short] [--only NAME…] [--json FILE] [--markdown FILE]
        [--known FILE]

Needs `pip install -r tests/clients/attacks/requirements.txt`; curl, strace and kubectl for some lines. Exit status 0
when every attack passes, 1 on a miss (a feature that is not built is one), 64 for an unknown name."""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import resource
import sys
import tempfile
import time
import traceback

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
# Processes are started beside grpcio's threads.
os.environ["GRPC_ENABLE_FORK_SUPPORT"] = "false"
# Refused handshakes are what some attacks look for.
os.environ.setdefault("GRPC_VERBOSITY", "NONE")

from attacks import all_attacks  # noqa: E402
from attacks.credentials import Authority  # noqa: E402
from attacks.range import Range, knows_tokens, stubs  # noqa: E402
from attacks.report import Attack, NotBuilt, Row  # noqa: E402

EXIT_USAGE = 64


def arguments() -> argparse.Namespace:
    """The command line."""
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--bin", type=pathlib.Path, default=HERE.parents[1] / "target/release",
                      help="folder of tryon and of tryon-capture, -tracking, -cloth, -compositor")
    args.add_argument("--short", action="store_true", help="fewer kills, shorter soak: what CI runs")
    args.add_argument("--only", nargs="+", metavar="NAME", default=[], help="these attacks")
    args.add_argument("--list", action="store_true", help="names and lines of all attacks")
    args.add_argument("--json", type=pathlib.Path, metavar="FILE", help="writes the figures")
    args.add_argument("--markdown", type=pathlib.Path, metavar="FILE", help="writes the table of docs/attack.md")
    args.add_argument("--known", type=pathlib.Path, metavar="FILE",
                      help="names of attacks that are known to miss, a line each: they cost no exit status")
    args.add_argument("--out", type=pathlib.Path, help="keeps logs and configurations here")
    return args.parse_args()


def run(attack: Attack, ground: Range) -> Row:
    """Runs one attack; whatever goes wrong is a miss with its reason."""
    row, begun = Row(attack.name, []), time.monotonic()
    ground.boxes.clear()
    try:
        row.figures = attack.run(ground)
    except NotBuilt as e:
        row.is_built, row.reason = False, str(e)
        row.figures = e.figures
    except Exception as e:  # noqa: BLE001: an attack that breaks is a miss, and the next one runs
        where = traceback.extract_tb(e.__traceback__)[-1]
        row.reason = f"{type(e).__name__}: {str(e).splitlines()[0] if str(e) else ''} ({where.name}:{where.lineno})"
    row.panics = sum(box.panics() for box in ground.boxes)
    row.seconds = time.monotonic() - begun
    return row


def verdict(rows: list[Row], known: set[str]) -> int:
    """Exit status: 1 for a miss that is not known. Known ones that pass are named: the list should shrink."""
    missed = {r.name for r in rows if r.verdict != "PASS"}
    passed = {r.name for r in rows} - missed
    stale = passed & known
    print(f"{len(passed)} of {len(rows)} pass; missed: {' '.join(sorted(missed)) or 'none'}")
    if stale:
        print(f"known to miss, and pass: {' '.join(sorted(stale))}; take them off the list")
    return int(bool(missed - known))


def write(rows: list[Row], figures: pathlib.Path | None, table: pathlib.Path | None) -> None:
    """Writes what there is so far, so that a run that is cut off leaves its figures."""
    if figures:
        figures.write_text(json.dumps([r.as_json() for r in rows], indent=1) + "\n")
    if table:
        head = "| attack | figures (bar, goal) | verdict |\n|---|---|---|\n"
        table.write_text(head + "".join(r.as_markdown() for r in rows))


def main() -> int:
    """Runs the attacks that were asked for."""
    args = arguments()
    attacks = all_attacks()
    if args.list:
        print("\n".join(f"{a.name:16} {a.line}" for a in attacks.values()))
        return 0
    if unknown := set(args.only) - set(attacks):
        print(f"no attack {' '.join(sorted(unknown))}; --list shows them", file=sys.stderr)
        return EXIT_USAGE
    known = set(args.known.read_text().split()) if args.known else set()
    # Thousands of sockets: the soft limit of a login shell is 1024.
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        folder, binaries = args.out or pathlib.Path(scratch), args.bin.resolve()
        ground = Range(binaries, folder, args.short, stubs(), Authority(folder / "authority"), knows_tokens(binaries))
        for name in args.only or attacks:
            rows.append(run(attacks[name], ground))
            print(rows[-1], flush=True)
            write(rows, args.json, args.markdown)
    return verdict(rows, known)


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    # Threads of grpcio that still read must not hold the end.
    os._exit(status)
