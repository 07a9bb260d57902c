"""Modules of the contracts, generated when they are imported."""

import pathlib
import sys

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "proto"))


def capture():
    """Messages and services of capture.proto."""
    return grpc.protos_and_services("tryon/v1/capture.proto")
