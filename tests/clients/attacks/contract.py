"""The contract as others' tools see it: reflection, health, malformed requests, unknown names, odd numbers."""

from __future__ import annotations

import contextlib
import math
import time

import grpc
from google.protobuf.descriptor_pool import DescriptorPool
from grpc_reflection.v1alpha import reflection_pb2, reflection_pb2_grpc
from grpc_reflection.v1alpha.proto_reflection_descriptor_database import ProtoReflectionDescriptorDatabase

from .box import SERVICES, Box, Setup
from .credentials import Metadata
from .range import Range
from .raw import COMPOSITOR, Http2Call, framed
from .report import Figure, attack
from .viewer import Client

INVALID_ARGUMENT, NOT_FOUND, UNIMPLEMENTED = 3, 5, 12
# HealthCheckResponse with its status.
SERVING, NOT_SERVING = b"\x08\x01", b"\x08\x02"
# A message that no parser accepts: field 1, length 127, no bytes.
UNDECODABLE = b"\x0a\x7f"
ODD_RATES = (1e-30, 1e-38, 1e-45, 1e-10, 3e38, math.inf, -math.inf, math.nan, -1.0)


@attack("tiny-rate", "StreamFrames{max_rate: 1e-30} and other odd numbers: streams that die, places that are gone")
def tiny_rate(ground: Range) -> list[Figure]:
    """An odd number is refused, or its reader has pictures; nobody else and no place suffers."""
    settings = {"compositor": {"max_try_ons": 4, "idle_s": 1}}
    with ground.box(Setup(settings=settings)) as box:
        client = Client(ground, box)
        dead = sum(not survives(client, f"odd-{i}", rate) for i, rate in enumerate(ODD_RATES))
        # Three with the number that is known to kill, then all four places are asked for.
        for i in range(3):
            with contextlib.suppress(grpc.RpcError):
                client.open(f"gone-{i}")
                survives(client, f"gone-{i}", 1e-30, close=False)
        time.sleep(3.0)
        gone = 0
        for i in range(4):
            try:
                client.open(f"fresh-{i}")
            except grpc.RpcError:
                gone += 1
        client.close()
        panics = box.panics()
    return [Figure("streams that die", dead, 0, 0), Figure("places gone", gone, 0, 0), Figure("panics", panics, 0, 0)]


def survives(client: Client, name: str, rate: float, close: bool = True) -> bool:
    """The rate is refused, or its stream and that of a second reader of the same try-on give pictures."""
    client.open(name)
    try:
        first = client.stream(name, 5.0, max_rate=rate)
        has_pictures = next((True for m in first if m.WhichOneof("event") == "picture"), False)
        time.sleep(0.1)
        second = client.stream(name, 5.0)
        has_pictures &= next((True for m in second if m.WhichOneof("event") == "picture"), False)
        first.cancel(), second.cancel()
        return has_pictures
    except grpc.RpcError as e:
        return e.code() == grpc.StatusCode.INVALID_ARGUMENT
    finally:
        if close:
            client.end(name)


@attack("reflection", "grpcio-reflection: services it cannot list, or that the port does not answer")
def reflection(ground: Range) -> list[Figure]:
    """v1alpha, as `grpcio-reflection` asks; every service listed must answer."""
    blind = dead = 0
    with ground.box() as box:
        for service in SERVICES:
            channel = grpc.intercept_channel(grpc.insecure_channel(box.of(service)), Presenting(box.metadata))
            try:
                # `ProtoReflectionDescriptorDatabase.get_services` would do, but hides the status.
                listed = v1alpha_services(channel)
                DescriptorPool(ProtoReflectionDescriptorDatabase(channel)).FindServiceByName(listed[0])
            except (grpc.RpcError, KeyError):
                blind += 1
                listed = tryon_services(ground)
            dead += sum(not answers(box, service, name) for name in listed if name.startswith("tryon."))
            channel.close()
    return [Figure("ports without v1alpha", blind, 0, 0), Figure("listed and unanswered", dead, 0, 0)]


class Presenting(grpc.StreamStreamClientInterceptor):
    """Adds credentials to calls of tools that have no argument for them."""

    def __init__(self, metadata: Metadata):
        self.metadata = metadata

    def intercept_stream_stream(self, call, details, requests):
        """Passes a call on with the credentials."""
        return call(details._replace(metadata=[*(details.metadata or ()), *self.metadata]), requests)


def v1alpha_services(channel: grpc.Channel) -> list[str]:
    """Names that reflection lists; raises `grpc.RpcError`."""
    stub = reflection_pb2_grpc.ServerReflectionStub(channel)
    request = reflection_pb2.ServerReflectionRequest(list_services="")
    [answer] = list(stub.ServerReflectionInfo(iter([request]), timeout=5))
    return [s.name for s in answer.list_services_response.service]


def tryon_services(ground: Range) -> list[str]:
    """All services of the protos: what v1 lists on every port of b0d733b."""
    return [s.full_name for name in SERVICES for s in vars(ground.api)[name].DESCRIPTOR.services_by_name.values()]


def answers(box: Box, port: str, service: str) -> bool:
    """The port of one service answers a method of another (or the same) with anything but UNIMPLEMENTED."""
    method = {
        "tryon.v1.CaptureService": "ListCameras",
        "tryon.v1.TrackingService": "GetBodyTemplate",
        "tryon.v1.ClothService": "ListGarments",
        "tryon.v1.CompositorService": "ListGarmentChoices",
    }.get(service, "Check")
    call = Http2Call(box.of(port), f"/{service}/{method}", framed(b""), box.metadata)
    code = call.status()
    call.close()
    return code != UNIMPLEMENTED and call.headers.get(":status") == "200"


@attack("undecodable", "undecodable messages that are not INVALID_ARGUMENT")
def undecodable(ground: Range) -> list[Figure]:
    """A message that no parser accepts, to every unary method of the compositor."""
    wrong = 0
    with ground.box() as box:
        for method in ground.api.compositor.DESCRIPTOR.services_by_name["CompositorService"].methods:
            if not method.input_type.fields:
                continue
            call = Http2Call(box.address, COMPOSITOR + method.name, framed(UNDECODABLE), box.metadata)
            wrong += call.status() != INVALID_ARGUMENT
            call.close()
    return [Figure("methods", wrong, 0, 0)]


@attack("unknown-camera", "try-ons of a camera that does not exist: accepted, places taken")
def unknown_camera(ground: Range) -> list[Figure]:
    """NOT_FOUND, and all places still free."""
    accepted = taken = 0
    with ground.box() as box:
        client = Client(ground, box)
        # The bus needs a moment to announce the cameras that exist.
        time.sleep(1.0)
        for i in range(4):
            try:
                client.open(f"ghost-{i}", camera="nowhere")
                accepted += 1
            except grpc.RpcError as e:
                accepted += e.code() != grpc.StatusCode.NOT_FOUND
        for i in range(4):
            try:
                client.open(f"real-{i}")
            except grpc.RpcError:
                taken += 1
        client.close()
    return [Figure("accepted", accepted, 0, 0), Figure("places taken", taken, 0, 0)]


@attack("health", "health at the compositor's port of a service behind it that is killed: NOT_SERVING after")
def health(ground: Range) -> list[Figure]:
    """`grpc.health.v1.Health/Check` with the name of the service behind, asked with `h2`."""
    figures = []
    for service, name in (("cloth", "tryon.v1.ClothService"), ("tracking", "tryon.v1.TrackingService")):
        with ground.box(Setup(is_apart=True)) as box:
            is_up = not math.isinf(seconds_until(box, name, SERVING, 10.0))
            box.kill(service)
            after = seconds_until(box, name, NOT_SERVING, 5.0) if is_up else math.inf
            figures.append(Figure(f"{service} dead", after, 2, 1, " s"))
    return figures


def seconds_until(box: Box, name: str, status: bytes, limit: float) -> float:
    """Time until health has a status; infinite when it never has."""
    begun = time.monotonic()
    while time.monotonic() - begun < limit:
        call = Http2Call(box.address, "/grpc.health.v1.Health/Check", framed(b"\x0a" + bytes([len(name)]) + name.encode()))
        answer = call.message(2.0)
        call.close()
        if answer == status:
            return time.monotonic() - begun
        time.sleep(0.1)
    return math.inf
