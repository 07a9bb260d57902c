"""Stand-in of DepthAI 3, not the SDK: the part of its interface that examples/cameras/depthai.py calls, over the scene of
the tests. As in depthai 3.12, depth is `getFrame` (u16, millimetres), colour `getCvFrame` (BGR), times are timedeltas, and
the calibration answers with rows of a matrix. Depth follows colour only where the pipeline links it so."""

import datetime
import enum
import types

import numpy as np
from camera_sources import scene

Platform = enum.Enum("Platform", "RVC2 RVC4")
CameraBoardSocket = enum.Enum("CameraBoardSocket", "CAM_A CAM_B CAM_C")
# Of the undistorted colour camera, at the size asked for.
K = (450.0, 451.0, 320.5, 199.0)


def depth_mm(number, size):
    """Depth in the view of colour."""
    w, h = size
    return (700 + 13 * number + np.arange(w * h, dtype=np.uint32).reshape(h, w) % 3000).astype(np.uint16)


class _Output:
    def __init__(self, node, name, size=None, is_undistorted=False):
        self.node, self.name, self.size, self.is_undistorted = node, name, size, is_undistorted

    def link(self, to):
        to.linked = self

    def createOutputQueue(self):
        return _Queue(self.node)


class _Input:
    linked = None


class _Camera:
    def build(self, socket):
        assert socket == CameraBoardSocket.CAM_A
        return self

    def requestOutput(self, size, enableUndistortion=None):
        return _Output(self, "color", size, enableUndistortion)


class _StereoDepth:
    def __init__(self):
        self.depth, self.inputAlignTo = _Output(self, "depth"), _Input()

    def build(self, autoCreateCameras, size):
        assert autoCreateCameras and size
        return self


class _Sync:
    def __init__(self):
        self.inputs, self.out = {"depth": _Input(), "color": _Input()}, _Output(self, "out")


node = types.SimpleNamespace(Camera=_Camera, StereoDepth=_StereoDepth, Sync=_Sync)


class _Queue:
    def __init__(self, sync):
        depth, color = (sync.inputs[name].linked for name in ("depth", "color"))
        assert depth.node.inputAlignTo.linked is color and color.is_undistorted
        self._size, self._number = color.size, 0

    def get(self):
        number, (w, h) = self._number, self._size
        self._number += 1
        Pipeline.is_running = self._number < scene.COUNT
        time = datetime.timedelta(microseconds=scene.time_us(number))
        picture = np.full((h, w, 3), (150, 90, 30 + 20 * number), np.uint8)
        return {
            "depth": types.SimpleNamespace(getFrame=lambda: depth_mm(number, (w, h)), getTimestampDevice=lambda: time),
            "color": types.SimpleNamespace(getCvFrame=lambda: picture),
        }


class _Calibration:
    def getCameraIntrinsics(self, socket, width, height):
        assert (socket, width, height) == (CameraBoardSocket.CAM_A, 640, 400)
        fx, fy, cx, cy = K
        return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


class _Device:
    def getPlatform(self):
        return Platform.RVC2

    def getDeviceName(self):
        return "Stand-in OAK-D"

    def getDeviceId(self):
        return "0044"

    def readCalibration(self):
        return _Calibration()


class Pipeline:
    is_running = False

    def getDefaultDevice(self):
        return _Device()

    def create(self, kind):
        return kind()

    def enableHolisticReplay(self, path):
        assert path == "scene"

    def start(self):
        Pipeline.is_running = True

    def isRunning(self):
        return Pipeline.is_running
