"""Weights inside the npm package, checked before use."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

PACKAGE = "@mediapipe/pose 0.5.1675469404 (Apache-2.0)"


@dataclass(frozen=True)
class Source:
    """One TFLite file: its place, its length within that file [bytes], its SHA-256, the outputs kept."""

    file: str
    length: int
    sha256: str
    # Name of each kept output, and its place in the TFLite file. The landmarks' 2 and 3, mask and heat maps, are left out.
    outputs: dict[str, int]

    def read(self, package: Path) -> bytes:
        """The file's bytes, from the unpacked package."""
        path = package / self.file
        if not path.is_file():
            raise SystemExit(f"{path} is missing: run `npm ci` in {package.parents[2]} first")
        data = path.read_bytes()[: self.length]
        found = hashlib.sha256(data).hexdigest()
        if found != self.sha256:
            raise SystemExit(f"{path}: SHA-256 {found} of its first {self.length} bytes, expected {self.sha256}")
        return data


SOURCES = {
    "detector": Source(
        "pose_solution_packed_assets.data",
        2_962_288,
        "a63c614bef30d35947f13be361820b1e4e3bec9cfeebf4d11216a18373108e85",
        {"boxes": 0, "scores": 1},
    ),
    "landmarks": Source(
        "pose_landmark_lite.tflite",
        2_819_824,
        "f17bfbecadb61c3be1baa8b8d851cc6619c870a87167b32848ad20db306b9d61",
        {"screen": 0, "presence": 1, "world": 4},
    ),
}
