"""Attacks on a running box by clients that share nothing with this project but its protos; `attack.py` runs them."""

from __future__ import annotations

import importlib

from .report import ATTACKS, Attack

# In the order in which they run: cheap ones first, the soak last.
MODULES = ("contract", "strangers", "tokens", "consent", "sockets", "floods", "readers", "faults", "capacity")


def all_attacks() -> dict[str, Attack]:
    """Every attack by name."""
    for name in MODULES:
        importlib.import_module(f"{__name__}.{name}")
    return ATTACKS
