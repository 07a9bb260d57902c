"""A try-on and its pictures through grpcio, collected on a thread with the time of their arrival."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import threading
import time
from collections.abc import Callable

import grpc

from .box import Box
from .credentials import Metadata
from .range import Range

# A connection of its own for each channel, as if from another machine.
OPTIONS = [("grpc.use_local_subchannel_pool", 1), ("grpc.max_receive_message_length", 64 << 20)]
LIVE_S = 90.0


@dataclasses.dataclass(frozen=True)
class Seen:
    """One message of a stream. Times in seconds, Unix time where it says so."""

    at: float
    is_picture: bool
    state: str
    service: str = ""
    epoch: int = 0
    sequence: int = 0
    received_unix: float = 0.0
    age: float = 0.0
    dropped: int = 0
    size: int = 0
    image: bytes = b""


class Client:
    """A connection to the compositor; without `metadata` one that may do everything."""

    def __init__(self, ground: Range, box: Box, metadata: Metadata | None = None):
        self.api, self.metadata = ground.api, box.metadata if metadata is None else metadata
        self.channel = grpc.insecure_channel(box.address, options=OPTIONS)
        self.rpc = ground.api.compositor_rpc.CompositorServiceStub(self.channel)
        self.pb = ground.api.compositor

    def open(self, name: str, camera: str = "front", garments: tuple[str, ...] = (), timeout: float = 5) -> None:
        """Opens a try-on; raises `grpc.RpcError`."""
        choices = [self.api.common.GarmentChoice(garment=g, size="M") for g in garments]
        request = self.pb.OpenTryOnRequest(try_on_id=name, camera=camera, garments=choices,
                                           consent=self.pb.Consent(given=True))
        self.rpc.OpenTryOn(request, timeout=timeout, metadata=self.metadata)

    def end(self, name: str) -> None:
        """Closes a try-on; raises `grpc.RpcError`."""
        self.rpc.CloseTryOn(self.pb.CloseTryOnRequest(try_on_id=name), timeout=5, metadata=self.metadata)

    def open_patiently(self, name: str, camera: str = "front", garments: tuple[str, ...] = (), limit: float = 30) -> None:
        """Opens a try-on as soon as the service is up."""
        end = time.monotonic() + limit
        while True:
            try:
                return self.open(name, camera, garments, timeout=2)
            except grpc.RpcError as e:
                is_down = e.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED)
                if not is_down or time.monotonic() > end:
                    raise
                time.sleep(0.02)

    def stream(self, name: str, deadline: float | None = None, **format: float) -> grpc.Call:
        """A picture stream; `format` holds fields of StreamFramesRequest."""
        request = self.pb.StreamFramesRequest(try_on_id=name, **format)
        return self.rpc.StreamFrames(request, timeout=deadline, metadata=self.metadata)

    def acknowledge(self, name: str, message: object) -> None:
        """Makes room for the next message of a stream."""
        request = self.pb.AcknowledgeFramesRequest(try_on_id=name, stream=message.stream, number=message.number)
        self.rpc.AcknowledgeFrames(request, timeout=5, metadata=self.metadata)

    def list(self, timeout: float = 10) -> None:
        """The control call that attacks time."""
        self.rpc.ListGarmentChoices(self.pb.ListGarmentChoicesRequest(), timeout=timeout, metadata=self.metadata)

    def seen(self, message: object, keep: bool = False) -> Seen:
        """A message of a stream, just arrived."""
        is_picture = message.WhichOneof("event") == "picture"
        event = message.picture if is_picture else message.status
        state = self.pb.TryOnState.Name(event.state)[13:]
        if not is_picture:
            return Seen(time.monotonic(), False, state, event.service)
        received = event.frame.received_unix_ns * 1e-9
        return Seen(
            at=time.monotonic(),
            is_picture=True,
            state=state,
            epoch=event.frame.epoch,
            sequence=event.frame.sequence,
            received_unix=received,
            age=time.time() - received,
            dropped=event.dropped,
            size=len(event.image),
            image=event.image if keep else b"",
        )

    def close(self) -> None:
        """Closes the connection."""
        self.channel.close()


class Viewer:
    """A reader that reads as fast as it can."""

    def __init__(self, ground: Range, box: Box, name: str, camera: str = "front", garments: tuple[str, ...] = (),
                 keep: bool = False, metadata: Metadata | None = None, **format: float):
        self.client = Client(ground, box, metadata)
        self.client.open_patiently(name, camera, garments)
        self.name, self.keep = name, keep
        self.seen: list[Seen] = []
        self.ended: tuple[float, str] | None = None
        self.arrived = threading.Condition()
        self.call = self.client.stream(name, **format)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self) -> None:
        """Collects until the stream ends; the end is kept as a status name."""
        end = "OK"
        try:
            for message in self.call:
                with self.arrived:
                    self.seen.append(self.client.seen(message, self.keep))
                    self.arrived.notify_all()
        except grpc.RpcError as e:
            end = e.code().name
        with self.arrived:
            self.ended = time.monotonic(), end
            self.arrived.notify_all()

    def wait(self, wanted: Callable[[Seen], bool], limit: float, since: float = 0.0) -> float:
        """Time of the first message from `since` on that `wanted` accepts; infinite when none comes in time."""
        end, at = time.monotonic() + limit, 0
        with self.arrived:
            while True:
                for s in self.seen[at:]:
                    if s.at >= since and wanted(s):
                        return s.at
                at = len(self.seen)
                rest = end - time.monotonic()
                if rest <= 0 or (self.ended and at == len(self.seen)):
                    return math.inf
                self.arrived.wait(rest)

    def wait_live(self, limit: float = LIVE_S) -> None:
        """Waits for garments on the person."""
        if math.isinf(self.wait(lambda s: s.is_picture and s.state == "LIVE", limit)):
            raise TimeoutError(f"{self.name} is not live within {limit} s; states {sorted(self.states())}")

    def wait_picture(self, limit: float = 20.0) -> None:
        """Waits for any picture."""
        if math.isinf(self.wait(lambda s: s.is_picture, limit)):
            raise TimeoutError(f"{self.name} has no picture within {limit} s; states {sorted(self.states())}")

    def states(self) -> set[str]:
        """States seen so far."""
        return {s.state for s in list(self.seen)}

    def pictures(self, start: float = 0.0, end: float = math.inf) -> list[Seen]:
        """Pictures that arrived in a time."""
        return [s for s in list(self.seen) if s.is_picture and start <= s.at <= end]

    def rate(self, start: float, end: float) -> float:
        """Pictures a second."""
        return len(self.pictures(start, end)) / (end - start)

    def longest_gap(self, start: float, end: float) -> float:
        """Longest time without a picture (s)."""
        times = [start, *(s.at for s in self.pictures(start, end)), end]
        return max(b - a for a, b in zip(times, times[1:]))

    def close(self) -> None:
        """Leaves; the try-on stays open."""
        with contextlib.suppress(Exception):
            self.call.cancel()
        self.client.close()


def rates(viewers: list[Viewer], seconds: float) -> list[float]:
    """Pictures a second of each viewer over the next `seconds`."""
    start = time.monotonic()
    time.sleep(seconds)
    return [v.rate(start, start + seconds) for v in viewers]


def lost_percent(before: list[float], after: list[float]) -> float:
    """Largest share of its rate that a viewer lost (%)."""
    return max(100.0 * max(0.0, 1.0 - b / a) if a > 0 else math.inf for a, b in zip(before, after))
