"""Families of cameras: how their program is run, and what must come out of it."""

import dataclasses
import os
import pathlib
from collections.abc import Callable

import numpy as np

from . import scene

HERE = pathlib.Path(__file__).resolve().parent
SHARED = pathlib.Path(os.environ.get("TRYON_SHARED", HERE.parents[3] / "shared"))
LIBRARIES = pathlib.Path("/usr/lib/x86_64-linux-gnu")


@dataclasses.dataclass
class Expected:
    """What a device shows: pinholes (fx, fy, cx, cy), the way from depth to colour, and millimetres by time [ns]."""

    depth_k: tuple
    depth_mm: Callable[[int], np.ndarray | None]
    color_k: tuple | None = None
    rotation: np.ndarray | None = None
    translation: tuple | None = None
    # Red, green and blue of the whole picture.
    color: Callable[[int], tuple] | None = None
    # Share of pixels that must be equal: less than all only where lens distortion is removed on the way.
    share: float = 1.0


@dataclasses.dataclass
class Family:
    name: str
    # Frames that must arrive.
    frames: int
    # Of the program; makes the recording in a folder.
    prepare: Callable[[pathlib.Path], list]
    expected: Callable[[], Expected]
    environment: Callable[[pathlib.Path], dict] = lambda folder: {}
    # The program ends by itself, at the end of a recording.
    ends: bool = True

    @property
    def program(self):
        return f"{self.name}.py"


def number(time_ns):
    """Frame of the scene at a time."""
    return round((time_ns * 1e-3 - scene.time_us(0)) / (scene.time_us(1) - scene.time_us(0)))


def of_scene():
    return Expected(
        depth_k=scene.DEPTH_K,
        depth_mm=lambda t: scene.depth_mm(number(t)),
        color_k=scene.COLOR_K,
        rotation=scene.rotation(),
        translation=scene.TRANSLATION,
        color=lambda t: tuple(scene.color(number(t))[0, 0]),
    )


def record_realsense(folder):
    from . import realsense

    # The wheel's recorder insists on the extension.
    path = folder / "scene.db3"
    realsense.record(path)
    return ["--play", str(path)]


def of_depthai():
    from .stand_ins import depthai

    return Expected(
        depth_k=depthai.K,
        depth_mm=lambda t: depthai.depth_mm(number(t), (640, 400)),
        color=lambda t: tuple(scene.color(number(t))[0, 0]),
    )


def k4a_recording():
    path = SHARED / "data/rgbd/k4a_recording/recording.mkv"
    assert path.exists(), f"{path} is missing"
    return path


def of_k4a():
    from . import k4a

    return k4a.expected(k4a_recording())


class OpenNi(Family):
    """The dummy device is read a second time beside the program."""

    def __init__(self):
        super().__init__("openni", 20, self.read, lambda: self.reading.expected(), self.libraries, ends=False)

    def libraries(self, folder):
        """The wrapper looks for libOpenNI2.so, and the library for its drivers beside itself."""
        for name, file in {"libOpenNI2.so": "libOpenNI2.so.0", "OpenNI2": "OpenNI2"}.items():
            if not (folder / name).exists():
                (folder / name).symlink_to(LIBRARIES / file)
        return {"OPENNI2_REDIST": str(folder)}

    def read(self, folder):
        from . import openni

        self.reading = openni.Reading(folder, {**os.environ, **self.libraries(folder)})
        return ["--play", "Dummy", "--fov", "58", "45"]


ALL = [
    Family("realsense", scene.COUNT - 1, record_realsense, of_scene),
    Family("k4a", 1, lambda folder: ["--play", str(k4a_recording())], of_k4a),
    OpenNi(),
    # Its playback goes on while the program waits for somebody to watch.
    Family("orbbec", scene.COUNT // 2, lambda folder: ["--play", str(HERE / "orbbec.bag")], of_scene),
    Family("depthai", scene.COUNT, lambda folder: ["--play", "scene"], of_depthai),
]
