"""Readers that are slow, greedy or stuck, and what they cost their neighbours."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable

import grpc

from . import scenes
from .box import Box, Setup
from .range import Range
from .raw import COMPOSITOR, Http1Call, Http2Call, framed
from .report import Figure, attack, percentile
from .viewer import Client, Seen, Viewer, lost_percent, rates

# Interval of a slow reader (s).
SLOW_S = 1.0
# Time in which a reader that takes nothing must be cut off (s), and how long an attack waits for it.
CUT_BAR_S, CUT_GOAL_S, CUT_LIMIT_S = 15.0, 11.0, 25.0
SHARED = "shared"
# The last as browsers have it.
HTTP1 = "HTTP/1.1"
TRANSPORTS = ("grpcio", "h2", HTTP1)


def noise_setup(ground: Range, **compositor: object) -> Setup:
    """One camera with pictures as large as those of a person, and nobody in view."""
    folder = ground.folder / "noise"
    camera = scenes.Camera("front", str(folder / "front"), scenes.RATE) if folder.exists() else scenes.noise(folder)
    return Setup([camera], {"compositor": compositor} if compositor else {})


class Slow:
    """Reads one message a second for `seconds`, then the rest as fast as it can. One that acknowledges says so when it
    has room for the next picture."""

    def __init__(self, name: str, client: Client, next_message: Callable[[float], object | None], acknowledges: bool):
        self.name, self.client, self.next_message, self.acknowledges = name, client, next_message, acknowledges
        self.read: list[tuple[float, Seen]] = []
        self.last: object | None = None

    def run(self, seconds: float) -> None:
        """Collects pictures with the Unix time at which each was taken."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.take(2.0) is None:
                break
            time.sleep(SLOW_S)
        # What waits is read on, until it is younger than the end of the slow part.
        slow_end, limit = time.time(), time.monotonic() + 15.0
        self.slow_count = len(self.read)
        while time.monotonic() < limit:
            seen = self.take(2.0)
            if seen is None or (seen.is_picture and seen.received_unix > slow_end):
                break

    def take(self, limit: float) -> Seen | None:
        """The next message."""
        if self.last and self.acknowledges:
            self.client.acknowledge(SHARED, self.last)
        message = self.next_message(limit)
        if message is None:
            return None
        self.last = message
        seen = self.client.seen(message)
        if seen.is_picture:
            self.read.append((time.time(), seen))
        return seen

    def ages(self) -> list[float]:
        """Ages of the pictures that were read slowly (s)."""
        return [s.age for _, s in self.read[: self.slow_count]]

    def waiting(self) -> int:
        """Most pictures that had been made and not dropped, and were read only later."""
        made = [s.received_unix for _, s in self.read]
        counts = [sum(m <= at for m in made[i + 1 :]) for i, (at, _) in enumerate(self.read[: self.slow_count])]
        return max(counts, default=0)


def slow_readers(
    ground: Range, box: Box, acknowledges: bool, over: tuple[str, ...] = TRANSPORTS
) -> tuple[list[Slow], list[Callable[[], None]]]:
    """One over each transport; and what closes them."""
    client = Client(ground, box)
    client.open_patiently(SHARED)
    window = {"max_unacknowledged": 1} if acknowledges else {}
    request = client.pb.StreamFramesRequest(try_on_id=SHARED, **window).SerializeToString()
    parse = lambda data: data and client.pb.StreamFramesResponse.FromString(data)
    readers, closes = [], [client.close]
    for name in over:
        if name == "grpcio":
            call = client.stream(SHARED, **window)
            next_message, close = lambda _, call=call: next(call, None), call.cancel
        else:
            call = (Http1Call(box.address, "StreamFrames", request, box.metadata) if name == HTTP1
                    else Http2Call(box.address, COMPOSITOR + "StreamFrames", framed(request), box.metadata))
            next_message, close = lambda limit, call=call: parse(call.message(limit)), call.close
        readers.append(Slow(name, client, next_message, acknowledges))
        closes.insert(0, close)
    return readers, closes


@attack("slow-reader", "slow reader (one a second): age of its pictures p99; pictures waiting for it anywhere")
def slow_reader(ground: Range) -> list[Figure]:
    """Readers that acknowledge, over each of three transports."""
    return slow_figures(ground, acknowledges=True)


@attack("slow-plain", "slow reader that acknowledges nothing, over HTTP/2: age of its pictures p99; pictures waiting")
def slow_plain(ground: Range) -> list[Figure]:
    """The windows of its streams show what it has taken."""
    return slow_figures(ground, acknowledges=False, over=("grpcio", "h2"))


@attack("slow-plain-http1", "the same over HTTP/1.1: age of its pictures p99; pictures waiting")
def slow_plain_http1(ground: Range) -> list[Figure]:
    """HTTP/1.1 has no windows: what waits in the reader's kernel is not seen."""
    return slow_figures(ground, acknowledges=False, over=(HTTP1,))


def slow_figures(ground: Range, acknowledges: bool, over: tuple[str, ...] = TRANSPORTS) -> list[Figure]:
    """Age and waiting pictures of each reader of a try-on that has settled: a status is a message too, and nobody's is
    left out unless it acknowledges."""
    with ground.box(noise_setup(ground)) as box:
        first = Viewer(ground, box, SHARED)
        first.wait_picture()
        time.sleep(1.0)
        first.close()
        readers, closes = slow_readers(ground, box, acknowledges, over)
        run_all([lambda r=r: r.run(ground.pick(15, 40)) for r in readers])
        for close in closes:
            close()
    figures = []
    for r in readers:
        figures.append(Figure(f"age {r.name}", percentile(r.ages(), 0.99), 1.5, 0.3, " s"))
        figures.append(Figure(f"waiting {r.name}", r.waiting() if r.ages() else math.inf, 3, 2))
    return figures


@attack("quick-plain", "quick reader that acknowledges nothing, over HTTP/2: rate lost against HTTP/1.1")
def quick_plain(ground: Range) -> list[Figure]:
    """All read the pictures of one format side by side."""
    with ground.box(noise_setup(ground)) as box:
        readers, closes = slow_readers(ground, box, acknowledges=False)
        run_all([lambda r=r: read_quickly(r, ground.pick(8, 20)) for r in readers])
        for close in closes:
            close()
    counts = {r.name: [len(r.read)] for r in readers}
    free = counts.pop(HTTP1)
    return [Figure(name, lost_percent(free, n), 10, 2, " %") for name, n in counts.items()]


def read_quickly(reader: Slow, seconds: float) -> None:
    """Takes messages without a pause."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and reader.take(2.0) is not None:
        pass


def run_all(tasks: list[Callable[[], None]]) -> None:
    """Runs tasks on threads of their own to their ends."""
    threads = [threading.Thread(target=t, daemon=True) for t in tasks]
    for t in threads:
        t.start()
    for t in threads:
        t.join()


def stuck_readers(ground: Range, box: Box, n: int) -> list[Http2Call]:
    """Readers that ask for pictures and never read from their sockets."""
    request = ground.api.compositor.StreamFramesRequest(try_on_id=SHARED).SerializeToString()
    return [Http2Call(box.address, COMPOSITOR + "StreamFrames", framed(request), box.metadata) for _ in range(n)]


@attack("never-read", "readers that never read, over HTTP/2 and HTTP/1.1: cut off after")
def never_read(ground: Range) -> list[Figure]:
    """The other side must close the socket."""
    with ground.box(noise_setup(ground)) as box:
        Client(ground, box).open_patiently(SHARED)
        [http2] = stuck_readers(ground, box, 1)
        request = ground.api.compositor.StreamFramesRequest(try_on_id=SHARED).SerializeToString()
        http1 = Http1Call(box.address, "StreamFrames", request, box.metadata)
        found: dict[str, float] = {}
        wait = lambda name, s: found.update({name: box.seconds_until_closed(s, CUT_LIMIT_S)})
        run_all([lambda: wait("HTTP/2", http2.socket), lambda: wait("HTTP/1.1", http1.socket)])
        http2.close(), http1.close()
    return [Figure(name, s, CUT_BAR_S, CUT_GOAL_S, " s") for name, s in sorted(found.items())]


class Greed:
    """Readers that ask for much, on one connection that reads all of it."""

    def __init__(self, ground: Range, box: Box, formats: list[dict[str, float]]):
        self.client = Client(ground, box)
        self.calls = [self.client.stream(SHARED, **f) for f in formats]
        for call in self.calls:
            threading.Thread(target=self.drain, args=(call,), daemon=True).start()

    def drain(self, call: grpc.Call) -> None:
        """Reads and forgets."""
        with contextlib.suppress(grpc.RpcError):
            for _ in call:
                pass

    def close(self) -> None:
        """Leaves."""
        for call in self.calls:
            call.cancel()
        self.client.close()


MANY_SIZES = [{"width": 320 + 16 * i, "height": 240 + 8 * i} for i in range(50)]
HUGE = [{"width": 4096, "height": 4096}]


def beside(ground: Range, box: Box, start: Callable[[], list[Callable[[], None]]]) -> tuple[float, float]:
    """Rate that two neighbours lose (%) while something runs, and growth of memory (MiB)."""
    neighbours = [Viewer(ground, box, SHARED, width=640, height=480), Viewer(ground, box, "other")]
    for v in neighbours:
        v.wait_picture()
    seconds = ground.pick(4, 8)
    time.sleep(1.0)
    before, memory = rates(neighbours, seconds), box.memory_mib()
    closes = start()
    time.sleep(1.0)
    after, growth = rates(neighbours, seconds), box.memory_mib() - memory
    for close in [*closes, *(v.close for v in neighbours)]:
        close()
    time.sleep(1.0)
    return lost_percent(before, after), growth


@attack("neighbours", "rate lost beside slow, stuck and greedy readers (4096², 50 formats)")
def neighbours(ground: Range) -> list[Figure]:
    """Each kind in turn beside one neighbour in the same try-on and one in another."""
    kinds = {
        "slow": lambda box: start_slow(ground, box),
        "stuck": lambda box: [c.close for c in stuck_readers(ground, box, 8)],
        "4096²": lambda box: [Greed(ground, box, HUGE).close],
        "50 formats": lambda box: [Greed(ground, box, MANY_SIZES).close],
    }
    figures, growths = [], []
    for name, start in kinds.items():
        with ground.box(noise_setup(ground)) as box:
            lost, growth = beside(ground, box, lambda: start(box))
            figures.append(Figure(name, lost, 10, 2, " %"))
            growths.append(growth)
    return [*figures, Figure("memory", max(growths), 256, 64, " MiB")]


def start_slow(ground: Range, box: Box) -> list[Callable[[], None]]:
    """Slow readers that run on while the neighbours are timed."""
    readers, closes = slow_readers(ground, box, acknowledges=False)
    for r in readers:
        threading.Thread(target=quietly, args=(lambda r=r: r.run(20.0),), daemon=True).start()
    return closes


def quietly(task: Callable[[], None]) -> None:
    """Runs a task whose connection may be closed under it."""
    with contextlib.suppress(Exception):
        task()


@attack("control", "control call beside slow, stuck and greedy readers at once: p99")
def control(ground: Range) -> list[Figure]:
    """ListGarmentChoices on a connection of its own."""
    with ground.box(noise_setup(ground)) as box:
        Client(ground, box).open_patiently(SHARED)
        closes = [
            *start_slow(ground, box),
            *(c.close for c in stuck_readers(ground, box, 4)),
            Greed(ground, box, HUGE).close,
            Greed(ground, box, MANY_SIZES).close,
        ]
        time.sleep(2.0)
        times = time_calls(Client(ground, box), ground.pick(5, 15))
        for close in closes:
            close()
    return [Figure("p99", 1e3 * percentile(times, 0.99), 50, 10, " ms")]


def time_calls(client: Client, seconds: float, pause: float = 0.02) -> list[float]:
    """Duration of each control call (s); a failed one lasts for ever."""
    times, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        begun = time.monotonic()
        try:
            client.list()
            times.append(time.monotonic() - begun)
        except grpc.RpcError:
            times.append(math.inf)
        time.sleep(pause)
    client.close()
    return times


@attack("snapshots", "snapshots: longest time without a picture beside three loops; ten at once: not OK or typed")
def snapshots(ground: Range) -> list[Figure]:
    """Three callers loop TakeSnapshot, then ten ask at once."""
    with ground.box(noise_setup(ground)) as box:
        viewer = Viewer(ground, box, SHARED)
        viewer.wait_picture()
        start, seconds = time.monotonic(), ground.pick(6, 20)
        loops = [lambda: loop_snapshots(ground, box, start + seconds) for _ in range(3)]
        run_all(loops)
        gap = viewer.longest_gap(start, start + seconds)
        codes: list[str] = []
        run_all([lambda: codes.append(take_snapshot(Client(ground, box))) for _ in range(10)])
        viewer.close()
    wrong = sum(c not in ("OK", "RESOURCE_EXHAUSTED") for c in codes)
    return [Figure("gap", gap, 1, 0.3, " s"), Figure("of ten", wrong, 0, 0), Figure("refused", 10 - codes.count("OK"), 8, 0)]


def loop_snapshots(ground: Range, box: Box, end: float) -> None:
    """Takes snapshots without a pause."""
    client = Client(ground, box)
    while time.monotonic() < end:
        take_snapshot(client)
    client.close()


def take_snapshot(client: Client) -> str:
    """Status of one snapshot."""
    try:
        client.rpc.TakeSnapshot(client.pb.TakeSnapshotRequest(try_on_id=SHARED), timeout=10, metadata=client.metadata)
        return "OK"
    except grpc.RpcError as e:
        return e.code().name
