"""Latency, admission and the cost of an idle mirror."""

from __future__ import annotations

import math
import threading
import time

import grpc

from .box import Box, Camera, Setup
from .range import Range
from .report import Figure, attack, percentile
from .viewer import Client, Viewer, lost_percent, rates

GARMENTS = ("tshirt",)
# Try-ons that the bars' machine, two cores, runs at their rate.
CAPACITY = 2


@attack("latency", "capture to client, 640×480, two cores: p99")
def latency(ground: Range) -> list[Figure]:
    """Reception by capture to arrival at the client, live pictures, synthetic camera of 30 Hz on the same cores."""
    with ground.box(Setup([Camera("front", "synth", 30.0)], cores=2)) as box:
        viewer = Viewer(ground, box, "shopper", garments=GARMENTS, width=640, height=480)
        viewer.wait_live()
        time.sleep(5.0)
        start = time.monotonic()
        time.sleep(ground.pick(8, 30))
        ages = [1e3 * s.age for s in viewer.pictures(start) if s.state == "LIVE"]
        viewer.close()
    return [Figure("p99", percentile(ages, 0.99), 60, 45, " ms"), Figure("p50", percentile(ages, 0.5), 60, 45, " ms")]


@attack("overload", "twice the capacity offered: refused within; rate that running sessions lose")
def overload(ground: Range) -> list[Figure]:
    """Two people in garments run on two cores; two more are offered, and six places are configured."""
    cameras = [Camera(f"c{i}", "synth:still", 15.0) for i in range(2 * CAPACITY)]
    places = {name: {key: 6} for name, key in
              (("compositor", "max_try_ons"), ("tracking", "max_sessions"), ("cloth", "max_sessions"))}
    places["compositor"]["by_capacity"] = True
    with ground.box(Setup(cameras, places, cores=2)) as box:
        running = [Viewer(ground, box, f"r{i}", f"c{i}", GARMENTS) for i in range(CAPACITY)]
        for v in running:
            v.wait_live()
        seconds = ground.pick(5, 15)
        time.sleep(3.0)
        before = rates(running, seconds)
        refusals, accepted = offer(ground, box)
        time.sleep(ground.pick(8, 15))
        after = rates(running, seconds)
        for v in [*running, *accepted]:
            v.close()
    return [
        Figure("not refused", len(accepted), 0, 0),
        Figure("refused within", 1e3 * max(refusals, default=math.inf), 50, 10, " ms"),
        Figure("rate lost", lost_percent(before, after), 5, 1, " %"),
    ]


def offer(ground: Range, box: Box) -> tuple[list[float], list[Viewer]]:
    """Time of each refusal (s) by RESOURCE_EXHAUSTED with RetryInfo, and viewers of what was accepted."""
    client = Client(ground, box)
    client.list()
    refusals, accepted = [], []
    for i in range(CAPACITY, 2 * CAPACITY):
        begun = time.monotonic()
        try:
            client.open(f"r{i}", f"c{i}", GARMENTS)
            accepted.append(Viewer(ground, box, f"r{i}", f"c{i}", GARMENTS))
        except grpc.RpcError as e:
            has_delay = any("grpc-status-details-bin" == k and b"RetryInfo" in v for k, v in e.trailing_metadata() or ())
            is_typed = e.code() == grpc.StatusCode.RESOURCE_EXHAUSTED and has_delay
            refusals.append(time.monotonic() - begun if is_typed else math.inf)
    client.close()
    return refusals, accepted


@attack("idle", "idle, of a core: no try-on (all services, test picture); nobody in view (without capture)")
def idle(ground: Range) -> list[Figure]:
    """Processor time of four processes; the synthetic camera of an empty room is left out with its process."""
    seconds = ground.pick(5, 30)
    with ground.box(Setup([Camera("front", "pattern", 30.0)], is_apart=True)) as box:
        time.sleep(5.0)
        alone = percent_of_core(box, seconds)
    with ground.box(Setup([Camera("front", "synth:empty", 30.0)], is_apart=True)) as box:
        viewer = Viewer(ground, box, "nobody", garments=GARMENTS)
        viewer.wait_picture()
        time.sleep(5.0)
        nobody = percent_of_core(box, seconds, "tracking", "cloth", "compositor")
        viewer.close()
    return [Figure("no try-on", alone, 3, 1, " %"), Figure("nobody in view", nobody, 10, 4, " %")]


def percent_of_core(box: Box, seconds: float, *services: str) -> float:
    """Processor time over wall time (%)."""
    begun, used = time.monotonic(), box.cpu_seconds(*services)
    time.sleep(seconds)
    return 100.0 * (box.cpu_seconds(*services) - used) / (time.monotonic() - begun)


@attack("soak", "soak under load: growth of memory, descriptors, threads")
def soak(ground: Range) -> list[Figure]:
    """A person in garments, readers that come and go; MiB an hour over 30 minutes, MiB in all with `--short`."""
    seconds = ground.pick(60, 1800)
    with ground.box(Setup([Camera("front", "synth", 15.0)])) as box:
        viewer = Viewer(ground, box, "shopper", garments=GARMENTS)
        viewer.wait_live()
        stop = threading.Event()
        guests = threading.Thread(target=come_and_go, args=(ground, box, stop), daemon=True)
        guests.start()
        # Pools, caches and the allocator fill first.
        time.sleep(seconds / 4)
        samples = sample(box, seconds)
        stop.set()
        guests.join()
        viewer.close()
    half = len(samples) // 2
    first, last = samples[:half], samples[half:]
    # Between the medians of two halves lies half the time.
    growth = median(s[0] for s in last) - median(s[0] for s in first)
    memory = growth if ground.is_short else growth * 3600.0 / (seconds / 2)
    rise = lambda k: max(s[k] for s in last) - max(s[k] for s in first)
    return [
        Figure("memory", memory, 4, 1, " MiB" if ground.is_short else " MiB/h"),
        Figure("descriptors", rise(1), 3, 0),
        Figure("threads", rise(2), 0, 0),
    ]


def median(values: object) -> float:
    """The middle value."""
    return percentile(list(values), 0.5)


def sample(box: Box, seconds: float) -> list[tuple[float, int, int]]:
    """Memory (MiB), descriptors and threads, once a second."""
    samples, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        samples.append((box.memory_mib(), box.descriptors(), box.threads()))
        time.sleep(1.0)
    return samples


def come_and_go(ground: Range, box: Box, stop: threading.Event) -> None:
    """Readers of one second, snapshots and try-ons that open and close."""
    n = 0
    while not stop.is_set():
        n += 1
        guest = Viewer(ground, box, f"guest-{n % 3}", width=320, height=240)
        stop.wait(1.0)
        guest.client.end(guest.name)
        guest.close()
