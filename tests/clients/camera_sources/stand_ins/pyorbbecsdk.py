"""Stand-in of Orbbec's SDK 2, not the SDK: the part of its interface that examples/cameras/orbbec.py calls, over the scene
of the tests. Types, shapes and units are those of pyorbbecsdk2 2.1: `rot` 3 × 3 and `transform` in millimetres (f32),
`get_depth_scale` in millimetres a unit, `get_data` flat bytes, colour as MJPG."""

import enum
import io
import types

import numpy as np
from camera_sources import scene
from PIL import Image

OBFormat = enum.Enum("OBFormat", "RGB BGR MJPG YUYV Y16")
OBSensorType = enum.Enum("OBSensorType", "DEPTH_SENSOR COLOR_SENSOR")
OBFrameAggregateOutputMode = enum.Enum("OBFrameAggregateOutputMode", "FULL_FRAME_REQUIRE ANY_SITUATION")
OBCameraDistortionModel = enum.Enum("OBCameraDistortionModel", "NONE BROWN_CONRADY")


def _intrinsic(size, k):
    return types.SimpleNamespace(width=size[0], height=size[1], fx=k[0], fy=k[1], cx=k[2], cy=k[3])


def _distortion(model, coefficients):
    k1, k2, p1, p2, k3 = coefficients
    return types.SimpleNamespace(model=model, k1=k1, k2=k2, k3=k3, k4=0.0, k5=0.0, k6=0.0, p1=p1, p2=p2)


class _Frame:
    def __init__(self, number, form, data):
        self._number, self._form = number, form
        self._data = np.frombuffer(data, np.uint8)

    def get_data(self):
        return self._data

    def get_format(self):
        return self._form

    def get_timestamp_us(self):
        return scene.time_us(self._number)

    def get_depth_scale(self):
        assert self._form == OBFormat.Y16
        return np.float32(scene.UNIT * 1e3).item()


class _FrameSet:
    def __init__(self, number):
        self._number = number

    def get_depth_frame(self):
        return _Frame(self._number, OBFormat.Y16, scene.depth(self._number).tobytes())

    def get_color_frame(self):
        jpeg = io.BytesIO()
        Image.fromarray(scene.color(self._number)).save(jpeg, "JPEG", quality=95)
        return _Frame(self._number, OBFormat.MJPG, jpeg.getvalue())


class _Profiles:
    def __init__(self, sensor):
        self._sensor = sensor

    def get_default_video_stream_profile(self):
        return self._sensor


class Config:
    def __init__(self):
        self.streams, self.mode = [], None

    def enable_stream(self, profile):
        self.streams.append(profile)

    def set_frame_aggregate_output_mode(self, mode):
        self.mode = mode


class PlaybackDevice:
    def __init__(self, file):
        assert file == "scene.bag", file

    def get_device_info(self):
        return types.SimpleNamespace(get_name=lambda: "Stand-in Gemini", get_serial_number=lambda: "0043")


class Pipeline:
    def __init__(self, device):
        self._device, self._next, self._is_synced = device, None, False

    def get_device(self):
        return self._device

    def get_stream_profile_list(self, sensor):
        return _Profiles(sensor)

    def enable_frame_sync(self):
        self._is_synced = True

    def start(self, config):
        assert config.streams == list(OBSensorType) and self._is_synced
        assert config.mode == OBFrameAggregateOutputMode.FULL_FRAME_REQUIRE
        self._next = 0

    def get_camera_param(self):
        assert self._next is not None, "not started"
        return types.SimpleNamespace(
            depth_intrinsic=_intrinsic(scene.DEPTH_SIZE, scene.DEPTH_K),
            depth_distortion=_distortion(OBCameraDistortionModel.NONE, [0.0] * 5),
            rgb_intrinsic=_intrinsic(scene.COLOR_SIZE, scene.COLOR_K),
            rgb_distortion=_distortion(OBCameraDistortionModel.BROWN_CONRADY, scene.COLOR_DISTORTION),
            transform=types.SimpleNamespace(
                rot=scene.rotation().astype(np.float32), transform=np.float32(scene.TRANSLATION) * np.float32(1e3)
            ),
        )

    def wait_for_frames(self, timeout_ms):
        if self._next == scene.COUNT:
            return None
        self._next += 1
        return _FrameSet(self._next - 1)
