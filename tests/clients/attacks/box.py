"""The program under attack: its configuration, its processes, their logs, memory and processor time."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import os
import pathlib
import re
import resource
import socket
import subprocess
import time
import urllib.request
from collections.abc import Iterator

import psutil
from separate_processes import free_ports

from .credentials import Authority, Metadata, bearer
from .report import NotBuilt

SERVICES = ("capture", "tracking", "cloth", "compositor")
START_S = 60.0
STOP_S = 15.0


@dataclasses.dataclass(frozen=True)
class Camera:
    """A camera of the configuration; rate 0 means the source's own."""

    name: str = "front"
    source: str = "pattern"
    rate: float = 30.0


@dataclasses.dataclass
class Setup:
    """Arguments of a box. `settings` are added to the sections of the configuration."""

    cameras: list[Camera] = dataclasses.field(default_factory=lambda: [Camera()])
    settings: dict[str, dict[str, object]] = dataclasses.field(default_factory=dict)
    # Four processes instead of one.
    is_apart: bool = False
    # Soft limit on descriptors: 1024 is what a login shell and systemd give.
    descriptors: int = 1024
    # Command before the program, such as strace.
    prefix: tuple[str, ...] = ()
    # Whose tokens the box takes.
    authority: Authority | None = None
    # Processors that the program may use; 0 means all.
    cores: int = 0


def toml(value: object) -> str:
    """A scalar or a list of scalars as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml, value))}]"
    return str(value) if isinstance(value, (int, float)) else f'"{value}"'


class Box:
    """Processes on ports of their own."""

    def __init__(self, binaries: pathlib.Path, folder: pathlib.Path, setup: Setup):
        self.binaries, self.folder, self.setup = binaries, folder, setup
        folder.mkdir(parents=True, exist_ok=True)
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.bus, *ports = free_ports(9)
        self.ports = dict(zip(SERVICES, ports[:4]))
        self.admin_ports = dict(zip(SERVICES, ports[4:]))
        for name in SERVICES:
            if address := setup.settings.get(name, {}).get("address"):
                self.ports[name] = int(str(address).rsplit(":", 1)[1])
        self.config = folder / "box.toml"
        self.config.write_text(self.configuration())

    @property
    def metadata(self) -> Metadata:
        """Credentials of a client that may do everything."""
        return bearer(self.setup.authority.token()) if self.setup.authority else ()

    @property
    def address(self) -> str:
        """Address of the compositor."""
        return self.of("compositor")

    def of(self, service: str) -> str:
        """gRPC address of a service."""
        return f"127.0.0.1:{self.ports[service]}"

    def configuration(self) -> str:
        """The TOML file: ports, cameras and what the setup adds."""
        is_encrypted = "authority" in self.setup.settings.get("identity", {})
        url = {name: f"{'https' if is_encrypted else 'http'}://{self.of(name)}" for name in SERVICES}
        sections: dict[str, dict[str, object]] = {
            # Attackers are inside already: `no-identity` tries to get there.
            "identity": {"off": not is_encrypted},
            "bus": {"listen": [f"tcp/127.0.0.1:{self.bus}"], "connect": [f"tcp/127.0.0.1:{self.bus}"]},
            **{n: {"address": self.of(n), "admin": f"127.0.0.1:{self.admin_ports[n]}"} for n in SERVICES},
        }
        sections["cloth"]["tracking"] = sections["compositor"]["tracking"] = url["tracking"]
        sections["compositor"]["cloth"] = url["cloth"]
        sections["compositor"]["capture"] = url["capture"]
        # Whatever else runs on the machine of the attack must neither refuse its try-ons nor thin their cloth.
        sections["compositor"]["by_capacity"] = sections["cloth"]["adapts_detail"] = False
        if self.setup.authority:
            sections["auth"] = self.setup.authority.settings()
        for name, values in self.setup.settings.items():
            sections.setdefault(name, {}).update(values)
        lines = []
        for name, values in sections.items():
            lines += [f"[{name}]", *(f"{k} = {toml(v)}" for k, v in values.items())]
        for c in self.setup.cameras:
            lines += ["[[capture.cameras]]", *(f"{k} = {toml(v)}" for k, v in dataclasses.asdict(c).items())]
        return "\n".join(lines) + "\n"

    def start(self, name: str = "") -> None:
        """Starts one service, or all of them; does not wait."""
        if not self.setup.is_apart:
            return self.spawn("box", [str(self.binaries / "tryon"), "--log", "info", "up", "--config", str(self.config)])
        for service in [name] if name else SERVICES:
            program = self.binaries / f"tryon-{service}"
            if not program.exists():
                raise FileNotFoundError(f"{program} is missing: build with --workspace --bins")
            self.spawn(service, [str(program), "--config", str(self.config)])
        return None

    def spawn(self, name: str, command: list[str]) -> None:
        """Starts one process with the setup's limits; its output goes to `NAME.log`."""
        soft, hard = self.setup.descriptors, resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        cores = sorted(os.sched_getaffinity(0))[: self.setup.cores or None]
        # Programs of util-linux instead of `preexec_fn`: grpcio's threads do not survive a fork.
        limits = ["prlimit", f"--nofile={soft}:{hard}", "taskset", "-c", ",".join(map(str, cores))]
        with (self.folder / f"{name}.log").open("ab") as log:
            self.processes[name] = subprocess.Popen(
                [*limits, *self.setup.prefix, *command], stdout=log, stderr=log, cwd=self.folder
            )

    def wait_ready(self) -> None:
        """Waits until the compositor takes work.

        Raises `NotBuilt` when the program refuses the configuration, `TimeoutError` when it does not come up.
        """
        end = time.monotonic() + START_S
        while time.monotonic() < end:
            for name, p in self.processes.items():
                if p.poll() == 64:
                    raise NotBuilt(f"{name} refuses the configuration: {self.log()[-200:].strip()}")
                if p.poll() is not None:
                    raise RuntimeError(f"{name} ended with {p.poll()}: {self.log()[-200:].strip()}")
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.ports["compositor"]), 1):
                return
            time.sleep(0.05)
        raise TimeoutError(f"the compositor is not up within {START_S} s")

    def kill(self, name: str) -> None:
        """SIGKILL to one service."""
        self.processes[name].kill()
        self.processes[name].wait()

    def stop(self) -> float:
        """SIGTERM to all, SIGKILL after a while; the seconds that it took."""
        begun = time.monotonic()
        for p in self.tree():
            with contextlib.suppress(psutil.Error):
                p.terminate()
        for p in self.processes.values():
            try:
                p.wait(timeout=max(0.1, STOP_S - (time.monotonic() - begun)))
            except subprocess.TimeoutExpired:
                self.destroy()
        return time.monotonic() - begun

    def destroy(self) -> None:
        """SIGKILL to all with their children."""
        for p in [*self.tree(), *self.processes.values()]:
            with contextlib.suppress(psutil.Error, OSError):
                p.kill()
        for p in self.processes.values():
            p.wait()

    def tree(self, *services: str) -> list[psutil.Process]:
        """Processes of the given services, or of all, with their children."""
        found = []
        for name, p in self.processes.items():
            with contextlib.suppress(psutil.Error):
                if not services or name in services:
                    root = psutil.Process(p.pid)
                    found += [root, *root.children(recursive=True)]
        return found

    def cpu_seconds(self, *services: str) -> float:
        """Processor time used so far."""
        return sum(sum(p.cpu_times()[:2]) for p in self.tree(*services))

    def memory_mib(self) -> float:
        """Resident memory."""
        return sum(p.memory_info().rss for p in self.tree()) / 2**20

    def descriptors(self) -> int:
        """Open descriptors."""
        return sum(p.num_fds() for p in self.tree())

    def threads(self) -> int:
        """Threads."""
        return sum(p.num_threads() for p in self.tree())

    def seconds_until_closed(self, s: socket.socket, limit: float) -> float:
        """Time until the program drops its end of a client's socket; infinite when it keeps it.

        A client that takes nothing cannot see the end: it queues behind the data that nobody takes.
        """
        begun, port = time.monotonic(), s.getsockname()[1]
        while time.monotonic() - begun < limit:
            held = [c for p in self.tree() for c in p.net_connections("tcp") if c.raddr and c.raddr.port == port]
            if not any(c.status == psutil.CONN_ESTABLISHED for c in held):
                return time.monotonic() - begun
            time.sleep(0.2)
        return math.inf

    def log(self) -> str:
        """All that was written to standard output and error, without colours."""
        text = "".join(p.read_text(errors="replace") for p in sorted(self.folder.glob("*.log")))
        return re.sub(r"\x1b\[[0-9;]*m", "", text)

    def panics(self) -> int:
        """Panics in the log."""
        return self.log().count("panicked at")

    def metrics(self) -> str:
        """The metrics pages of all services."""
        pages = []
        for port in self.admin_ports.values():
            with contextlib.suppress(OSError), urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=5) as r:
                pages.append(r.read().decode())
        return "".join(pages)


@contextlib.contextmanager
def running(binaries: pathlib.Path, folder: pathlib.Path, setup: Setup) -> Iterator[Box]:
    """A box that is up, and that leaves no process behind."""
    box = Box(binaries, folder, setup)
    try:
        box.start()
        box.wait_ready()
        yield box
    finally:
        box.destroy()
