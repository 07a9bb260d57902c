"""Figures of an attack, their bars, and the line that is printed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable


class NotBuilt(Exception):
    """The interface under attack does not exist. A miss, with the reason and what could be measured without it."""

    def __init__(self, reason: str, figures: list[Figure] | None = None):
        super().__init__(reason)
        self.figures = figures or []


@dataclasses.dataclass(frozen=True)
class Figure:
    """One measurement; smaller is better."""

    label: str
    value: float
    bar: float
    goal: float
    unit: str = ""

    @property
    def is_met(self) -> bool:
        """The value is a number and at most the bar."""
        return not math.isnan(self.value) and self.value <= self.bar

    def __str__(self) -> str:
        unit = self.unit if math.isfinite(self.value) else ""
        return f"{self.label} {text(self.value)}{unit} (bar {text(self.bar)}, goal {text(self.goal)})"


@dataclasses.dataclass
class Row:
    """Outcome of one attack."""

    name: str
    figures: list[Figure]
    reason: str = ""
    is_built: bool = True
    panics: int = 0
    seconds: float = 0.0

    @property
    def verdict(self) -> str:
        """PASS, MISS or NOT BUILT; only PASS is good."""
        if not self.is_built:
            return "NOT BUILT"
        is_met = bool(self.figures) and all(f.is_met for f in self.figures)
        return "PASS" if is_met and not self.reason and not self.panics else "MISS"

    def __str__(self) -> str:
        figures = "; ".join(map(str, self.figures)) or "nothing measured"
        notes = [self.reason] if self.reason else []
        if self.panics:
            notes.append(f"{self.panics} panics in the log")
        note = f" [{'; '.join(notes)}]" if notes else ""
        return f"{self.verdict:9} {self.name:16} {figures}{note}"

    def as_markdown(self) -> str:
        """The row for `--markdown`."""
        figures = "; ".join(str(f).replace("bar ", "").replace("goal ", "") for f in self.figures) or "nothing measured"
        note = f"; {self.reason}" if self.reason else ""
        return f"| `{self.name}` | {figures}{note.replace('|', '/')} | {self.verdict} |\n"

    def as_json(self) -> dict[str, object]:
        """The row for `--json`; infinities and NaN become text."""
        figures = [dataclasses.asdict(f) | {"met": f.is_met} for f in self.figures]
        for f in figures:
            f["value"] = f["value"] if math.isfinite(f["value"]) else str(f["value"])
        return {
            "name": self.name,
            "verdict": self.verdict,
            "reason": self.reason,
            "panics": self.panics,
            "seconds": round(self.seconds, 1),
            "figures": figures,
        }


@dataclasses.dataclass(frozen=True)
class Attack:
    """A named attack; `line` is its line in the table of docs/attack.md."""

    name: str
    line: str
    run: Callable[..., list[Figure]]


ATTACKS: dict[str, Attack] = {}


def attack(name: str, line: str) -> Callable[[Callable[..., list[Figure]]], Callable[..., list[Figure]]]:
    """Registers a function that takes a `Range` and returns its figures."""

    def register(run: Callable[..., list[Figure]]) -> Callable[..., list[Figure]]:
        assert name not in ATTACKS, name
        ATTACKS[name] = Attack(name, line, run)
        return run

    return register


def text(x: float) -> str:
    """Three significant digits."""
    if not math.isfinite(x):
        return "never" if math.isinf(x) else "unknown"
    return f"{x:.0f}" if x == int(x) or abs(x) >= 100 else f"{x:.3g}"


def percentile(values: list[float], share: float) -> float:
    """The value below which `share` of all lie; infinite when there are none."""
    if not values:
        return math.inf
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]
