"""What OpenNI2's dummy device shows: a ball whose place is that of its frame's number. Read by a process of its own, since
the library ends with a fault."""

import math
import pathlib
import subprocess
import sys

import numpy as np

from .families import Expected

READ = """
import sys
import numpy as np
from primesense import openni2
openni2.initialize()
stream = openni2.Device(b"Dummy").create_depth_stream()
stream.start()
times, images = [], []
for _ in range(int(sys.argv[2])):
    frame = stream.read_frame()
    times.append(frame.timestamp * 1000)
    images.append(np.array(frame.get_buffer_as_uint16(), np.uint16).reshape(240, 320))
np.savez(sys.argv[1], times=times, images=images)
"""
# Ten seconds: the program has long ended by then.
FRAMES = 300


class Reading:
    """A reading that runs beside the program."""

    def __init__(self, folder: pathlib.Path, environment):
        self._file = folder / "dummy.npz"
        command = [sys.executable, "-c", READ, str(self._file), str(FRAMES)]
        self._process = subprocess.Popen(command, env=environment)

    def expected(self):
        self._process.wait(60)
        read = np.load(self._file)
        images = dict(zip(read["times"].tolist(), read["images"]))
        return Expected(
            # 320 × 240, and the angles that the program is given.
            depth_k=(160 / math.tan(math.radians(29)), 120 / math.tan(math.radians(22.5)), 159.5, 119.5),
            depth_mm=images.get,
        )
