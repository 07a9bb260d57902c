"""What `deploy/` ships, as lists of processes: compose, each overlay of Kubernetes, systemd's target, `tryon up`."""

from __future__ import annotations

import dataclasses
import pathlib
import re
import shlex
import subprocess

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
# The secret of the store's authority, made as components/identity says.
AUTHORITY = "tryon-identity"


@dataclasses.dataclass
class Process:
    """A program as it is shipped. `files` maps paths that it reads to their contents, or to a folder of tokens; `volumes`
    maps folders to the names of volumes, which processes share. One that `is_once` ends before those behind it start."""

    name: str
    command: list[str]
    environment: dict[str, str] = dataclasses.field(default_factory=dict)
    files: dict[str, str | None] = dataclasses.field(default_factory=dict)
    volumes: dict[str, str] = dataclasses.field(default_factory=dict)
    is_once: bool = False

    @property
    def is_router(self) -> bool:
        """It is the router of zenoh and none of ours."""
        return self.name == "router"


@dataclasses.dataclass
class Topology:
    """Processes that make one mirror. Names are hosts where each has an address of its own."""

    name: str
    processes: list[Process]
    has_hosts: bool = True

    @property
    def lasting(self) -> list[Process]:
        """Processes that run until they are stopped."""
        return [p for p in self.processes if not p.is_once]


def compose() -> Topology:
    """`deploy/compose.yaml` without the profiles."""
    file = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    services = {name: s for name, s in file["services"].items() if "profiles" not in s}
    conditions = [d for s in services.values() for d in s.get("depends_on", {}).items()]
    once = {name for name, d in conditions if d["condition"] == "service_completed_successfully"}
    processes = []
    for name, service in services.items():
        process = Process(name, service["command"], dict(service.get("environment", {})), is_once=name in once)
        for volume in service.get("volumes", []):
            source, target, *_ = volume.split(":")
            if source in file["volumes"]:
                process.volumes[target] = source
            else:
                process.files |= contents(DEPLOY / source, target)
        processes.append(process)
    return Topology("compose", processes)


def contents(source: pathlib.Path, target: str) -> dict[str, str | None]:
    """A file that is mounted; a folder that isn't in the repository holds secrets."""
    return {target: source.read_text() if source.is_file() else None}


def kustomize(overlay: str) -> Topology:
    """Deployments of an overlay, as kubectl renders it."""
    command = ["kubectl", "kustomize", str(DEPLOY / "kustomize" / overlay)]
    rendered = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    resources = [r for r in yaml.safe_load_all(rendered) if r]
    maps = {r["metadata"]["name"]: r["data"] for r in resources if r["kind"] == "ConfigMap"}
    processes = []
    for resource in resources:
        if resource["kind"] != "Deployment":
            continue
        pod = resource["spec"]["template"]["spec"]
        volumes = {v["name"]: v for v in pod.get("volumes", [])}
        name = resource["metadata"]["name"]
        for container in pod.get("initContainers", []):
            process = containerised(f"{name}-{container['name']}", container, volumes, maps)
            process.is_once = True
            processes.append(process)
        (container,) = pod["containers"]
        processes.append(containerised(name, container, volumes, maps))
    return Topology(pathlib.Path(overlay).name, processes)


def containerised(name: str, container: dict, volumes: dict[str, dict], maps: dict[str, dict]) -> Process:
    """A container of a pod."""
    command = container.get("command", []) + container.get("args", [])
    process = Process(name, command, {e["name"]: e["value"] for e in container.get("env", [])})
    for mount in container.get("volumeMounts", []):
        volume, at = volumes[mount["name"]], mount["mountPath"]
        if "configMap" in volume:
            data = maps[volume["configMap"]["name"]]
            process.files |= {f"{at}/{name}": text for name, text in data.items()}
        elif "emptyDir" in volume:
            process.volumes[at] = f"{name.split('-')[0]}-{volume['name']}"
        elif volume["secret"]["secretName"] == AUTHORITY:
            process.volumes[at] = AUTHORITY
        else:
            process.files[at] = None
    return process


def systemd() -> Topology:
    """Services that `tryon.target` wants."""
    target = (DEPLOY / "systemd/tryon.target").read_text()
    units = re.search(r"^Wants=(.*)$", target, re.M).group(1).split()
    state = "/var/lib/private"
    processes = []
    for unit in ["tryon-identity.service", *units]:
        text = (DEPLOY / "systemd" / unit).read_text().replace("\\\n", " ").replace("%S", state)
        credentials = dict(c.split(":") for c in re.findall(r"^LoadCredential=(.*)$", text, re.M))
        for credential, path in credentials.items():
            text = text.replace(f"%d/{credential}", path)
        command = shlex.split(re.search(r"^ExecStart=(.*)$", text, re.M).group(1))
        command[0] = pathlib.Path(command[0]).name
        pairs = [pair for line in re.findall(r"^Environment=(.*)$", text, re.M) for pair in shlex.split(line)]
        name = unit.removeprefix("tryon-").removesuffix(".service")
        files = {"/etc/tryon/tryon.toml": (DEPLOY / "tryon.toml").read_text()}
        process = Process(name, command, dict(p.split("=", 1) for p in pairs), files)
        process.is_once = "Type=oneshot" in text
        process.volumes = {f"{state}/{AUTHORITY}": "state"}
        processes.append(process)
    return Topology("systemd", processes, has_hosts=False)


def up() -> Topology:
    """`tryon up` with the commented default file."""
    files = {"/etc/tryon/tryon.toml": (DEPLOY / "tryon.toml").read_text()}
    process = Process("box", ["tryon", "up", "--config", "/etc/tryon/tryon.toml"], {}, files)
    return Topology("up", [process], has_hosts=False)


TOPOLOGIES = {
    "compose": compose,
    "store": lambda: kustomize("overlays/store"),
    "kiosk-edge": lambda: kustomize("overlays/kiosk-edge"),
    "base": lambda: kustomize("base"),
    "systemd": systemd,
    "up": up,
}
