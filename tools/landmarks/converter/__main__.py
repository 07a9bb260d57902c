"""`python -m converter`: writes the colour model that `src/landmarks` reads."""

import argparse
import hashlib
from pathlib import Path

from .inputs import PACKAGE, SOURCES
from .onnx_graph import OnnxGraph
from .tflite_graph import TfliteGraph

FOLDER = Path(__file__).resolve().parents[1]
ROOT = FOLDER.parents[1]
# The one place of the result's SHA-256: src/landmarks refuses every other file.
CHECKSUM = ROOT / "src/landmarks/model.sha256"


def main():
    arguments = parse()
    data = {prefix: source.read(arguments.package) for prefix, source in SOURCES.items()}
    graph = OnnxGraph()
    for prefix, source in SOURCES.items():
        graph.add(prefix, TfliteGraph(data[prefix]), source.outputs)
    model = graph.model({"source": PACKAGE, **{f"{k}.sha256": s.sha256 for k, s in SOURCES.items()}})
    written = model.SerializeToString(deterministic=True)

    if arguments.check:
        from .check import check

        check(model, data, arguments.expected)
    digest = hashlib.sha256(written).hexdigest()
    if arguments.new_checksum:
        CHECKSUM.write_text(digest + "\n")
    expected = CHECKSUM.read_text().strip()
    if digest != expected:
        raise SystemExit(f"the result's SHA-256 is {digest}, {CHECKSUM} expects {expected}: "
                         "other versions than requirements.txt pins?")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    # A reader never meets half a file.
    part = arguments.out.with_name(arguments.out.name + ".part")
    part.write_bytes(written)
    part.replace(arguments.out)
    print(f"{arguments.out}: {len(written)} bytes")


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="convert", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "target/landmarks.onnx",
                        help="file to write (default: %(default)s)")
    parser.add_argument("--package", type=Path, default=FOLDER / "node_modules/@mediapipe/pose",
                        help="folder of the npm package (default: %(default)s)")
    parser.add_argument("--check", action="store_true",
                        help="compare with LiteRT, which runs the original files, and say the differences")
    parser.add_argument("--expected", type=Path, metavar="FILE",
                        help="with --check: write LiteRT's outputs for a test image, which src/landmarks' tests read")
    parser.add_argument("--new-checksum", action="store_true",
                        help="for developers: accept the result as the one that src/landmarks reads")
    return parser.parse_args()


main()
