"""What each kind of fault does to the numbers of a sample: pure functions of numbers, first numbers, value and time.

All take the numbers of a sample, those of the first sample under the fault, the word's value padded with zeros to the
same length, and how long the fault has been present (s). The order of the numbers: see `robot_io.rig.fault_words`.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable

Numbers = tuple[float, ...]
Change = Callable[[Numbers, Numbers, Numbers, float], Numbers]


def frozen(_now: Numbers, first: Numbers, _value: Numbers, _elapsed_s: float) -> Numbers:
    """Return the first numbers."""
    return first


def garbage(now: Numbers, _first: Numbers, value: Numbers, elapsed_s: float) -> Numbers:
    """Return NaN, or random numbers up to the value; the same at the same time in every run."""
    if math.isnan(value[0]):
        return (math.nan,) * len(now)
    source = random.Random(elapsed_s)
    return tuple(source.uniform(-value[0], value[0]) for _ in now)


def wrong(now: Numbers, _first: Numbers, value: Numbers, _elapsed_s: float) -> Numbers:
    """Return the numbers, and the value added."""
    return tuple(a + b for a, b in zip(now, value, strict=True))


def scaled(now: Numbers, _first: Numbers, value: Numbers, _elapsed_s: float) -> Numbers:
    """Return the numbers times the value."""
    return tuple(a * value[0] for a in now)


def mirrored(now: Numbers, _first: Numbers, _value: Numbers, _elapsed_s: float) -> Numbers:
    """Return the numbers with the opposite sign."""
    return tuple(-a for a in now)


def drifting(now: Numbers, _first: Numbers, value: Numbers, elapsed_s: float) -> Numbers:
    """Return the numbers, moved away at a rate."""
    return tuple(a + rate * elapsed_s for a, rate in zip(now, value, strict=True))


def turned_in_plane(now: Numbers, _first: Numbers, value: Numbers, _elapsed_s: float) -> Numbers:
    """Return the numbers, the first two of them turned by the value (degrees); what follows stays."""
    cos, sin = math.cos(math.radians(value[0])), math.sin(math.radians(value[0]))
    return (cos * now[0] - sin * now[1], sin * now[0] + cos * now[1], *now[2:])


def turned_about(axis: Numbers) -> Change:
    """Return the change that turns the vectors of three numbers each about a unit axis by the value (degrees)."""

    def turned(now: Numbers, _first: Numbers, value: Numbers, _elapsed_s: float) -> Numbers:
        angle = math.radians(value[0])
        return tuple(x for i in range(0, len(now), 3) for x in _rodrigues(axis, now[i : i + 3], angle))

    return turned


def from_first(change: Change) -> Change:
    """Return `change` applied to the way from the first numbers, for what has no zero of its own: a place."""

    def changed(now: Numbers, first: Numbers, value: Numbers, elapsed_s: float) -> Numbers:
        way = tuple(a - b for a, b in zip(now, first, strict=True))
        return tuple(a + b for a, b in zip(first, change(way, way, value, elapsed_s), strict=True))

    return changed


def position_only(change: Change) -> Change:
    """Return `change` applied to x and y, not to the yaw behind them."""

    def changed(now: Numbers, first: Numbers, value: Numbers, elapsed_s: float) -> Numbers:
        return (*change(now[:2], first[:2], value[:2], elapsed_s), now[2])

    return changed


def trembling(now: Numbers, first: Numbers, value: Numbers, elapsed_s: float) -> Numbers:
    """Return the first numbers, the first two of them off by up to the value; the same in every run."""
    source = random.Random(elapsed_s)
    by = value[0]
    return (first[0] + source.uniform(-by, by), first[1] + source.uniform(-by, by), *now[2:])


def on_axis(value: Numbers, *, size: int) -> int:
    """Return the axis that a value names, at most the last one."""
    return min(max(int(value[0]), 0), size - 1)


def dead_axis(now: Numbers, first: Numbers, value: Numbers, _elapsed_s: float) -> Numbers:
    """Return the numbers, one axis as it was first."""
    axis = on_axis(value, size=len(now))
    return (*now[:axis], first[axis], *now[axis + 1 :])


def _rodrigues(axis: Numbers, v: Numbers, angle: float) -> Numbers:
    """Return a vector of three turned about a unit axis by an angle (rad)."""
    cos, sin = math.cos(angle), math.sin(angle)
    along = sum(a * b for a, b in zip(axis, v, strict=True)) * (1.0 - cos)
    cross = (axis[1] * v[2] - axis[2] * v[1], axis[2] * v[0] - axis[0] * v[2], axis[0] * v[1] - axis[1] * v[0])
    return tuple(v[i] * cos + cross[i] * sin + axis[i] * along for i in range(3))
