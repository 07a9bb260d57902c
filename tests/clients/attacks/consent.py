"""What remains of a person: frames without consent, pictures after withdrawal, files, logs and metrics."""

from __future__ import annotations

import base64
import contextlib
import math
import pathlib
import re
import subprocess
import time

import grpc

from . import scenes
from .box import Box, Camera, Setup
from .range import Range
from .report import Figure, NotBuilt, attack
from .viewer import Viewer

FILE_CALLS = "openat,open,creat,rename,renameat,renameat2,link,linkat,mkdir,mkdirat,memfd_create"
WRITES = re.compile(r'(?:openat?\([^"]*"(?P<opened>[^"]+)"[^)]*O_(?:WRONLY|RDWR|CREAT)|creat\("(?P<made>[^"]+)"|'
                    r'(?:rename|link|mkdir)\w*\([^"]*"(?P<named>[^"]+)")')
# Devices and the process's own tables are no storage.
NO_STORAGE = re.compile(r"^/(?:proc|sys|dev/(?!shm))|^$")
# Bytes of a picture by which it is found elsewhere, and how many such pieces of each are searched.
PIECE, PIECES = 24, 40
# Bytes of memory read at a time.
CHUNK = 16 << 20


@attack("withdrawal", "frames without consent; last picture after withdrawal; files, logs and metrics with image data")
def withdrawal(ground: Range) -> list[Figure]:
    """One try-on under strace: nobody, then consent, then withdrawal, then a kiosk that vanishes."""
    trace = ground.folder / "trace.txt"
    strace = ("strace", "-f", "-qq", "--seccomp-bpf", "-e", f"trace={FILE_CALLS}", "-o", str(trace))
    camera = scenes.noise(ground.folder / "person")
    with ground.box(Setup([camera], prefix=strace)) as box:
        before = frames_in(ground, box, 2.0)
        viewer = Viewer(ground, box, "person", keep=True)
        viewer.wait_picture()
        time.sleep(2.0)
        seen = in_memory(box)
        is_built, withdrawn = withdraw(viewer)
        time.sleep(2.0)
        last = max((s.at - withdrawn for s in viewer.pictures(withdrawn)), default=0.0)
        after = frames_in(ground, box, 2.0)
        remembered = in_memory(box)
        kiosk = Viewer(ground, box, "kiosk")
        kiosk.wait_picture()
        kiosk.close()
        time.sleep(1.0)
        lost = frames_in(ground, box, 2.0)
        leaks = traces(viewer, box.log() + box.metrics())
    figures = [
        Figure("last picture", last, 1, 0.2, " s"),
        Figure("frames before consent", before, 0, 0),
        Figure("after withdrawal", after, 0, 0),
        Figure("after a lost kiosk", lost, 0, 0),
        # What is never found while it is shown proves nothing when it is not found later.
        Figure("pieces of images in memory", remembered if seen else math.nan, 0, 0),
        Figure("files written", files_written(trace.read_text(errors="replace")), 0, 0),
        Figure("pieces of images in logs and metrics", leaks, 0, 0),
    ]
    if not is_built:
        raise NotBuilt("WithdrawConsent: CloseTryOn was called in its place", figures)
    return figures


def withdraw(viewer: Viewer) -> tuple[bool, float]:
    """Withdraws consent; whether that call exists, and the time of the call."""
    client, begun = viewer.client, time.monotonic()
    is_built = hasattr(client.rpc, "WithdrawConsent")
    if is_built:
        client.rpc.WithdrawConsent(client.pb.WithdrawConsentRequest(try_on_id=viewer.name), timeout=5, metadata=client.metadata)
    else:
        client.end(viewer.name)
    return is_built, begun


def frames_in(ground: Range, box: Box, seconds: float) -> int:
    """Frames that capture publishes."""
    channel = grpc.insecure_channel(box.of("capture"))
    rpc, pb = ground.api.capture_rpc.CaptureServiceStub(channel), ground.api.capture
    count = lambda: sum(c.frames for c in rpc.ListCameras(pb.ListCamerasRequest(), timeout=5, metadata=box.metadata).cameras)
    begun = count()
    time.sleep(seconds)
    frames = count() - begun
    channel.close()
    return frames


def in_memory(box: Box) -> int:
    """Pieces of depth images in the memory of the program: rows of the wall that the camera sees."""
    row = scenes.WALL_MM.to_bytes(2, "little") * (scenes.WIDTH // 2)
    found = 0
    for process in box.tree():
        with contextlib.suppress(OSError):
            found += pieces_of(process.pid, row)
    return found


def pieces_of(pid: int, piece: bytes) -> int:
    """Occurrences of a piece in the writable memory of a process."""
    ranges = re.findall(r"^([0-9a-f]+)-([0-9a-f]+) rw.. .*$", pathlib.Path(f"/proc/{pid}/maps").read_text(), re.M)
    found = 0
    with open(f"/proc/{pid}/mem", "rb", buffering=0) as memory:
        for begin, end in ((int(b, 16), int(e, 16)) for b, e in ranges):
            for at in range(begin, end, CHUNK):
                with contextlib.suppress(OSError, ValueError):
                    memory.seek(at)
                    found += memory.read(min(CHUNK, end - at)).count(piece)
    return found


def files_written(trace: str) -> float:
    """Number of paths that were opened for writing, made or renamed; NaN when nothing was traced at all."""
    if "O_RDONLY" not in trace:
        return math.nan
    found = {next(filter(None, m.groups()), "") for m in WRITES.finditer(trace)}
    return len([path for path in found if not NO_STORAGE.match(path)])


def traces(viewer: Viewer, text: str) -> int:
    """Pieces of received pictures in a text, as base64, hexadecimal or a list of numbers."""
    found = 0
    for seen in viewer.pictures()[-5:]:
        step = max(1, len(seen.image) // PIECES)
        for at in range(0, len(seen.image) - PIECE, step):
            piece = seen.image[at : at + PIECE]
            # Whole groups of three bytes, wherever the piece begins in its stream.
            coded = [base64.b64encode(piece[i:])[:20].decode() for i in range(3)]
            found += any(c in text for c in [*coded, piece.hex(), ", ".join(map(str, piece))])
    return found


@attack("stored-photo", "the page offers the photo as a download into the kiosk user's folder: places")
def stored_photo(ground: Range) -> list[Figure]:
    """curl fetches the page and its scripts."""
    with ground.box(Setup([Camera()])) as box:
        page = fetch(f"http://{box.address}/")
        scripts = [fetch(f"http://{box.address}/{path.lstrip('/')}") for path in re.findall(r'src="([^"]+\.js)"', page)]
        downloads = len(re.findall(r"<a\b[^>]*\bdownload\b|\.download\s*=", "\n".join([page, *scripts])))
    return [Figure("downloads", downloads, 0, 0)]


def fetch(url: str) -> str:
    """Text of a URL."""
    with contextlib.suppress(subprocess.CalledProcessError):
        return subprocess.run(["curl", "-sfm", "5", url], capture_output=True, text=True, check=True).stdout
    return ""
