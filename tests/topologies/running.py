"""A shipped topology as real processes on this machine: each host has a loopback address of its own, ports stay."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import pathlib
import re
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator

from attacks.credentials import Authority, Metadata, bearer
from shipped import AUTHORITY, Process, Topology

# A block of loopback addresses for each topology that this run starts.
BLOCKS = itertools.count(1)
START_S = 60.0
STOP_S = 15.0
# The zenoh of others, in a process of its own.
ROUTER = "import signal, sys, zenoh; s = zenoh.open(zenoh.Config.from_file(sys.argv[1])); signal.pause()"


@dataclasses.dataclass
class Camera:
    """What stands in for the camera: a standing person, as fast as the build under test follows."""

    source: str = "synth:still"
    rate: float = 15.0

    def variable(self) -> str:
        """Value of TRYON_CAPTURE__CAMERAS."""
        return f'[{{name="front",source="{self.source}",rate={self.rate}}}]'


class Running:
    """Processes of a topology, under its own files with other addresses."""

    def __init__(self, topology: Topology, binaries: pathlib.Path, folder: pathlib.Path, camera: Camera):
        self.topology, self.binaries, self.folder, self.camera = topology, binaries, folder, camera
        self.block = block = f"127.{os.getpid() % 200 + 20}.{next(BLOCKS)}"
        hosts = topology.lasting if topology.has_hosts else topology.lasting[:1]
        self.hosts = {p.name: f"{block}.{k}" for k, p in enumerate(hosts, 1)}
        self.authority = Authority(folder / "authority")
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def host(self, name: str) -> str:
        """Address of a process."""
        return self.hosts.get(name) or next(iter(self.hosts.values()))

    def here(self, text: str, name: str) -> str:
        """A shipped text with this machine's addresses, as the process of that name reads it."""
        text = re.sub(r"\b(0\.0\.0\.0|127\.0\.0\.1)(?=:\d)", self.host(name), text)
        if self.topology.has_hosts:
            names = "|".join(map(re.escape, self.hosts))
            text = re.sub(rf"(?<=/)({names})(?=:\d)", lambda m: self.hosts[m.group(1)], text)
        return text

    @property
    def mirror(self) -> str:
        """Address of the compositor."""
        return f"{self.host('compositor')}:8080"

    @property
    def has_tokens(self) -> bool:
        """The shipped files ask for tokens."""
        return any("TRYON_AUTH__KEYS" in p.environment for p in self.topology.processes)

    @property
    def has_identity(self) -> bool:
        """The shipped files give the services an identity to each other."""
        return self.topology.name == "up" or any("TRYON_IDENTITY__AUTHORITY" in p.environment for p in self.topology.lasting)

    @property
    def address(self) -> str:
        """As the viewers of `attacks` ask for it."""
        return self.mirror

    @property
    def metadata(self) -> Metadata:
        """Credentials of a shopper: of the box's own page, or issued where the shipped files ask for tokens."""
        if "box" in self.processes:
            shown = re.findall(r"#token=(\S+)", self.log("box"))
            return bearer(shown[-1] if shown else None)
        return bearer(self.authority.token()) if self.has_tokens else ()

    def place(self, process: Process) -> dict[str, str]:
        """Writes the files of a process; their paths by the shipped ones."""
        own = self.folder / process.name
        placed = {at: str(self.volume(name)) for at, name in process.volumes.items()}
        for at, text in process.files.items():
            path = own / at.lstrip("/")
            path.parent.mkdir(parents=True, exist_ok=True)
            if text is None:
                self.place_secrets(path)
            else:
                path.write_text(self.here(replaced(text, placed), process.name))
            placed[at] = str(path)
        return placed

    def volume(self, name: str) -> pathlib.Path:
        """Folder of a volume; the secret of the authority holds what deploy/ says that it does."""
        folder = self.folder / "volumes" / name
        if not folder.exists():
            folder.mkdir(parents=True)
            if name == AUTHORITY:
                subprocess.run([self.binaries / "tryon", "identity", "make", folder / "authority.pem"], check=True)
        return folder

    def place_secrets(self, folder: pathlib.Path) -> None:
        """The keys and tokens of deploy/README.md under both names of the public key."""
        folder.mkdir(exist_ok=True)
        for name in ("issuer.pub.pem", "public.pem"):
            (folder / name).write_bytes(self.authority.public)
        (folder / "revoked").write_text("")
        (folder / "service.token").write_text(self.authority.token())

    def start(self, name: str) -> None:
        """Starts one process, and waits for the end of one that has one."""
        process = next(p for p in self.topology.processes if p.name == name)
        placed = self.place(process)

        def rewritten(text: str) -> str:
            return self.here(replaced(text, placed), name)

        command = [rewritten(c) for c in process.command]
        environment = {k: rewritten(v) for k, v in process.environment.items()}
        if process.is_router:
            command = [sys.executable, "-c", ROUTER, command[-1]]
        else:
            command[0] = str(self.binaries / command[0])
        if command[1:4] == ["identity", "issue", "router"]:
            command.append(f"--name={self.host('router')}")
        if name in ("capture", "box"):
            environment["TRYON_CAPTURE__CAMERAS"] = self.camera.variable()
        inherited = {k: v for k, v in os.environ.items() if not k.startswith("TRYON_")}
        with (self.folder / f"{name}.log").open("ab") as log:
            started = subprocess.Popen(command, stdout=log, stderr=log, env=inherited | environment)
        if process.is_once:
            assert started.wait(START_S) == 0, f"{name} ended with {started.returncode}: {self.log(name)}"
        else:
            self.processes[name] = started

    def kill(self, name: str) -> None:
        """SIGKILL."""
        self.processes[name].kill()
        self.processes[name].wait()

    def destroy(self) -> None:
        """SIGKILL to all."""
        for p in self.processes.values():
            p.kill()
        for p in self.processes.values():
            p.wait()

    def probe(self, path: str, name: str = "compositor") -> tuple[int, str]:
        """Answer of an admin port; 0 when there is none."""
        port = {"capture": 9101, "tracking": 9102, "cloth": 9103, "compositor": 9104}[name]
        url = f"http://{self.host(name)}:{port}{path}"
        try:
            with urllib.request.urlopen(url, timeout=2) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as e:
            return e.code, e.read().decode()
        except OSError as e:
            return 0, str(e)

    def wait_ready(self, limit: float, is_ready: bool = True) -> str:
        """Text of the compositor's /readyz/all once all is well, or no longer."""
        end = time.monotonic() + limit
        while True:
            status, text = self.probe("/readyz/all")
            if (status == 200) == is_ready:
                return text
            for process, p in self.processes.items():
                assert p.poll() is None or p.returncode < 0, f"{process} ended with {p.returncode}: {self.log(process)}"
            assert time.monotonic() < end, f"/readyz/all is {status} after {limit} s: {text}"
            time.sleep(0.1)

    def log(self, name: str) -> str:
        """End of a process's log."""
        return (self.folder / f"{name}.log").read_text(errors="replace")[-1500:]


def replaced(text: str, placed: dict[str, str]) -> str:
    """A text with other paths."""
    for at, path in placed.items():
        text = text.replace(at, path)
    return text


@contextlib.contextmanager
def running(topology: Topology, binaries: pathlib.Path, folder: pathlib.Path, camera: Camera) -> Iterator[Running]:
    """A topology whose processes are started, and of which none stays."""
    folder.mkdir(parents=True, exist_ok=True)
    box = Running(topology, binaries, folder, camera)
    try:
        for process in topology.processes:
            box.start(process.name)
        yield box
    finally:
        box.destroy()
