"""Ground on which attacks run: binaries, a scratch folder, stubs, and how long they may take."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import pathlib
import subprocess
import sys
import tempfile
import types
from collections.abc import Iterator

from grpc_tools import protoc

from .box import Box, Setup, running
from .credentials import Authority

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROTO = ROOT / "proto"
FILES = ("capture", "tracking", "cloth", "compositor", "common", "frame")


def stubs() -> types.SimpleNamespace:
    """Modules of tryon.v1, generated into a folder that goes away: `api.compositor`, `api.compositor_rpc` …"""
    with tempfile.TemporaryDirectory() as out:
        files = [f"tryon/v1/{name}.proto" for name in FILES]
        options = [f"-I{PROTO}", f"--python_out={out}", f"--grpc_python_out={out}"]
        assert protoc.main(["protoc", *options, *files]) == 0, "the protos do not compile"
        sys.path.insert(0, out)
        api = types.SimpleNamespace()
        for name in FILES:
            setattr(api, name, importlib.import_module(f"tryon.v1.{name}_pb2"))
            setattr(api, f"{name}_rpc", importlib.import_module(f"tryon.v1.{name}_pb2_grpc"))
    return api


@dataclasses.dataclass
class Range:
    """Arguments of every attack."""

    binaries: pathlib.Path
    folder: pathlib.Path
    is_short: bool
    api: types.SimpleNamespace
    authority: Authority
    # The program knows tokens: boxes are started with the authority's key, and clients use its tokens.
    has_tokens: bool
    # Boxes of the attack under way, for their logs.
    boxes: list[Box] = dataclasses.field(default_factory=list)

    def pick(self, short: float, full: float) -> float:
        """A duration or a number: the first with `--short`."""
        return short if self.is_short else full

    @contextlib.contextmanager
    def box(self, setup: Setup | None = None) -> Iterator[Box]:
        """A running box in a folder of its own."""
        folder, setup = pathlib.Path(tempfile.mkdtemp(dir=self.folder)), setup or Setup()
        if self.has_tokens:
            setup = dataclasses.replace(setup, authority=self.authority)
        with running(self.binaries, folder, setup) as box:
            self.boxes.append(box)
            yield box


def knows_tokens(binaries: pathlib.Path) -> bool:
    """The program has the subcommand `token`."""
    run = subprocess.run([str(binaries / "tryon"), "token", "--help"], capture_output=True, check=False)
    return run.returncode == 0
