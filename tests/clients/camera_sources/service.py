"""A capture service with one camera that is fed, recorded while a program feeds it."""

import subprocess
import sys
import time

import grpc

from .protos import capture

NAME = "front"


class CaptureService:
    def __init__(self, binaries, folder):
        self._folder = folder
        settings = [
            "capture.address=127.0.0.1:0",
            "capture.admin=127.0.0.1:0",
            f"capture.recordings={folder}",
            f'capture.cameras=[{{name="{NAME}",source="push",rate=30.0}}]',
            f'bus.listen=["unixsock-stream/{folder}/bus"]',
        ]
        command = [str(binaries / "tryon-capture"), *(part for s in settings for part in ("--set", s))]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=sys.stderr, text=True)
        # "… grpc ADDRESS …"
        line = next(line for line in self._process.stdout if "grpc" in line)
        self.address = line.split(" ")[2]
        messages, services = capture()
        self._messages = messages
        self._stub = services.CaptureServiceStub(grpc.insecure_channel(self.address))

    def camera(self):
        return self._stub.ListCameras(self._messages.ListCamerasRequest()).cameras[0]

    def begin_recording(self, limit_s):
        """Records as soon as a program feeds the camera. Its consent covers the recording."""
        end = time.monotonic() + limit_s
        while self.camera().state != self._messages.CAMERA_STATE_RUNNING:
            assert time.monotonic() < end, f"no program feeds the camera within {limit_s} s"
            time.sleep(0.05)
        self._stub.StartRecording(self._messages.StartRecordingRequest(camera=NAME, consent=True))
        self._begun = time.monotonic()

    def wait_for_frames(self, count, limit_s):
        """Waits until so many frames were recorded, as the time that they take."""
        time.sleep(min(limit_s, 1.0 + count / 15.0))

    def end_recording(self):
        """The file, and the device as the program named it."""
        device = self.camera().source
        ended = self._stub.StopRecording(self._messages.StopRecordingRequest(camera=NAME))
        assert ended.dropped == 0, ended
        return self._folder / ended.file, device

    def stop(self):
        self._process.kill()
        self._process.wait()
