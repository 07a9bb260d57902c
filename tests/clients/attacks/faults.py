"""Faults: killed services, an outage of the bus, a camera that goes, an end with stuck readers."""

from __future__ import annotations

import contextlib
import math
import pathlib
import select
import socket
import threading
import time

import grpc

from . import scenes
from .box import SERVICES, Box, Camera, Setup, free_ports
from .range import Range
from .readers import SHARED, noise_setup, stuck_readers
from .report import Figure, NotBuilt, attack
from .viewer import Client, Seen, Viewer

# Two viewers for each of four try-ons: a person in garments and three walls of one colour each.
WALLS = ("red", "green", "blue")
PLACES = {name: {key: 8} for name, key in
          (("compositor", "max_try_ons"), ("tracking", "max_sessions"), ("cloth", "max_sessions"))}


def eight(ground: Range, box: Box) -> list[Viewer]:
    """Eight viewers, the dressed ones first."""
    people = [Viewer(ground, box, "person", "front", ("tshirt",), width=320, height=240) for _ in range(2)]
    walls = [Viewer(ground, box, f"wall-{c}", c, keep=True, width=64, height=48) for c in WALLS for _ in range(2)]
    return people + walls


@attack("kill", "kill -9 of each service under eight viewers: typed status, pictures after its return, foreign pictures")
def kill(ground: Range) -> list[Figure]:
    """The worst of all rounds, and pictures of walls in another wall's colour."""
    cameras = [Camera("front", "synth:still", 15.0), *(scenes.wall(ground.folder / "walls", c) for c in WALLS)]
    told, back, foreign = 0.0, 0.0, 0
    with ground.box(Setup(cameras, PLACES, is_apart=True)) as box:
        viewers = eight(ground, box)
        viewers[0].wait_live()
        for _ in range(int(ground.pick(1, 20))):
            for service in SERVICES:
                told = max(told, kill_one(box, service, viewers))
                time.sleep(0.5)
                returned = time.monotonic()
                box.start(service)
                if service == "compositor":
                    foreign += sum(map(foreign_pictures, viewers))
                    viewers = eight(ground, box)
                back = max(back, *(v.wait(is_fresh, 30.0, returned) - returned for v in viewers))
                viewers[0].wait_live()
        foreign += sum(map(foreign_pictures, viewers))
    return [Figure("status", told, 1, 0.3, " s"), Figure("pictures", back, 3, 1, " s"), Figure("foreign", foreign, 0, 0)]


def is_fresh(s: Seen) -> bool:
    """A picture less than a second old."""
    return s.is_picture and s.age < 1.0


def kill_one(box: Box, service: str, viewers: list[Viewer]) -> float:
    """Kills a service; seconds until the last viewer whom it serves has a typed status."""
    killed = time.monotonic()
    box.kill(service)
    if service == "compositor":
        return max(end_of(v, 10.0) - killed for v in viewers)
    # Who wears nothing misses no cloth.
    served = viewers[:2] if service in ("cloth", "tracking") else viewers
    return max(v.wait(lambda s: s.state == "DEGRADED" and s.service in ("", service), 10.0, killed) - killed for v in served)


def end_of(v: Viewer, limit: float) -> float:
    """Time at which the stream ended with UNAVAILABLE; infinite for another end or none."""
    with v.arrived:
        v.arrived.wait_for(lambda: v.ended is not None, limit)
    return v.ended[0] if v.ended and v.ended[1] == "UNAVAILABLE" else math.inf


def foreign_pictures(v: Viewer) -> int:
    """Pictures of a wall viewer in which another wall's colour is seen."""
    own = v.name.removeprefix("wall-")
    if own not in WALLS:
        return 0
    return sum(scenes.color_of(s.image) not in (own, "") for s in v.pictures())


class Link:
    """TCP forwarder whose traffic can be stopped: without a word, or by closing."""

    def __init__(self, port: int):
        self.target, self.is_cut, self.is_closed = port, False, False
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.pairs: list[tuple[socket.socket, socket.socket]] = []
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self) -> None:
        """Takes connections and forwards both ways."""
        while True:
            try:
                near, _ = self.listener.accept()
                far = socket.create_connection(("127.0.0.1", self.target), 5)
            except OSError:
                if self.listener.fileno() < 0:
                    return
                near.close()
                continue
            if self.is_closed:
                near.close(), far.close()
                continue
            self.pairs.append((near, far))
            threading.Thread(target=self.forward, args=(near, far), daemon=True).start()

    def forward(self, near: socket.socket, far: socket.socket) -> None:
        """Copies until one side ends; waits while cut."""
        other = {near: far, far: near}
        try:
            while True:
                readable, _, _ = select.select([near, far], [], [], 0.1)
                while self.is_cut:
                    time.sleep(0.02)
                for s in readable:
                    data = s.recv(1 << 18)
                    if not data:
                        return
                    other[s].sendall(data)
        except (OSError, ValueError):
            return
        finally:
            near.close(), far.close()

    def set(self, mode: str) -> None:
        """`open`; `silent`: nothing passes; `closed`: connections end, and new ones at once."""
        self.is_cut, self.is_closed = mode == "silent", mode == "closed"
        if self.is_closed:
            self.end_pairs()

    def end_pairs(self) -> None:
        """Ends all connections."""
        for pair in self.pairs:
            for s in pair:
                with contextlib.suppress(OSError):
                    s.shutdown(socket.SHUT_RDWR)
        self.pairs.clear()

    def close(self) -> None:
        """Ends everything."""
        self.set("open")
        self.listener.close()
        self.end_pairs()


@attack("bus-outage", "bus outage of 15 s: told by a status within; recovered after its return")
def bus_outage(ground: Range) -> list[Figure]:
    """Traffic between capture and the others stops without a word, then by closed connections; the worse counts."""
    [bus] = free_ports(1)
    link = Link(bus)
    settings = {"bus": {"listen": [f"tcp/127.0.0.1:{bus}"], "connect": [f"tcp/127.0.0.1:{link.port}"]}}
    told, back = 0.0, 0.0
    with ground.box(Setup([Camera("front", "synth:still", 15.0)], settings, is_apart=True)) as box:
        viewer = Viewer(ground, box, "person", garments=("tshirt",))
        for mode in ("silent", "closed"):
            viewer.wait_live()
            cut = time.monotonic()
            link.set(mode)
            told = max(told, viewer.wait(lambda s: s.state == "DEGRADED" and s.service == "capture", 10.0, cut) - cut)
            time.sleep(ground.pick(5, 15))
            returned = time.monotonic()
            link.set("open")
            back = max(back, viewer.wait(is_fresh, 30.0, returned) - returned)
        viewer.close()
        link.close()
    return [Figure("told", told, 1, 0.3, " s"), Figure("recovered", back, 5, 2, " s")]


@attack("camera-gone", "a camera that stops and returns: told by a status within; pictures after its return")
def camera_gone(ground: Range) -> list[Figure]:
    """Capture stops the camera; 45 s later it starts it again under a new epoch."""
    with ground.box(Setup([Camera("front", "synth:still", 15.0)])) as box:
        viewer = Viewer(ground, box, "person", garments=("tshirt",))
        viewer.wait_live()
        channel = grpc.insecure_channel(box.of("capture"))
        rpc, pb = ground.api.capture_rpc.CaptureServiceStub(channel), ground.api.capture
        rpc.StopCamera(pb.StopCameraRequest(camera="front"), timeout=5, metadata=box.metadata)
        gone = time.monotonic()
        told = viewer.wait(lambda s: s.state == "DEGRADED" and s.service == "capture", 10.0, gone) - gone
        time.sleep(ground.pick(5, 45))
        rpc.StartCamera(pb.StartCameraRequest(camera="front"), timeout=5, metadata=box.metadata)
        returned = time.monotonic()
        back = viewer.wait(is_fresh, 30.0, returned) - returned
        viewer.close()
        channel.close()
    return [Figure("told", told, 1, 0.3, " s"), Figure("pictures", back, 3, 1, " s")]


def faketime() -> str:
    """Library that gives programs another clock."""
    found = sorted(pathlib.Path("/usr/lib").glob("*/faketime/libfaketime.so.1"))
    if not found:
        raise NotBuilt("libfaketime is not installed (apt-get install libfaketime)")
    return str(found[-1])


@attack("clock-steps", "wall clock stepped by +5, -10, +5 s under four processes: longest time without a picture, share not live")
def clock_steps(ground: Range) -> list[Figure]:
    """The clock that only moves forwards is left alone, as it is when somebody sets the time."""
    clock = ground.folder / "clock"
    clock.write_text("+0s\n")
    variables = {"LD_PRELOAD": faketime(), "FAKETIME_TIMESTAMP_FILE": clock, "FAKETIME_CACHE_DURATION": 1,
                 "FAKETIME_DONT_FAKE_MONOTONIC": 1, "DONT_FAKE_MONOTONIC": 1}
    prefix = ("env", *(f"{k}={v}" for k, v in variables.items()))
    gap, other, pictures, step = 0.0, 0, 0, 0.0
    with ground.box(Setup([Camera("front", "synth:still", 15.0)], is_apart=True, prefix=prefix)) as box:
        viewer = Viewer(ground, box, "person", garments=("tshirt",))
        viewer.wait_live()
        # The size settles in the first seconds, which cost a debug build pictures; they are not this attack's.
        time.sleep(5)
        for offset in ("+5s", "-5s", "+0s"):
            stepped = time.monotonic()
            clock.write_text(f"{offset}\n")
            time.sleep(ground.pick(4, 20))
            with viewer.arrived:
                since = [s for s in viewer.seen if s.at >= stepped]
            times = [stepped, *(s.at for s in since if s.is_picture), time.monotonic()]
            gap = max(gap, *(b - a for a, b in zip(times, times[1:])))
            other += sum(s.is_picture and s.state != "LIVE" for s in since)
            pictures += sum(s.is_picture for s in since)
            # Proof that the clock was stepped: the capture process stamps what it receives.
            step = max(step, *(abs(s.age) for s in since if s.is_picture))
        viewer.close()
    if step < 4.0:
        raise NotBuilt(f"the clock was stepped by {step:.1f} s only")
    return [Figure("gap", gap, 1, 0.3, " s"), Figure("not live", 100 * other / max(1, pictures), 5, 0, " %")]


@attack("sigterm", "SIGTERM with stuck readers: ended within")
def sigterm(ground: Range) -> list[Figure]:
    """The deadline is `process.grace_ms`, 3 s, and half a second for the bus."""
    with ground.box(noise_setup(ground)) as box:
        Client(ground, box).open_patiently(SHARED)
        stuck = stuck_readers(ground, box, 8)
        time.sleep(2.0)
        took = box.stop()
        for s in stuck:
            s.close()
    return [Figure("ended within", took, 5, 4, " s")]
