"""What a calibration found, and how it refuses data that cannot carry a result."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from robot_io.errors import DeviceNotReady
from robot_io.rig.types import Matrix3

Array = NDArray[np.float64]
K = 2.0
"""Uncertainties are given with this coverage factor: about 95 %."""


class Estimate(msgspec.Struct, frozen=True):
    """One quantity: `value`, `uncertainty` (k = 2) and `residual` in `unit`; a number, or one for each part of it."""

    what: str
    value: tuple[float, ...]
    uncertainty: tuple[float, ...]
    unit: str
    residual: tuple[float, ...]
    source: str
    """How it was measured."""
    keys: dict[str, Any]
    """The rig's keys that it sets, by dotted name; empty where the rig is right as it is."""
    told: tuple[str, ...] = ()
    """What else the operator should know, a sentence each."""
    unseen: str | None = None
    """What of the quantity stays unmeasured."""


class CannotCalibrate(DeviceNotReady):
    """The data cannot carry a result: too few, not steady, contradictory, or blind to what is sought."""


def rows_of(matrix: Array) -> Matrix3:
    """Return a 3x3 rotation as the rig writes it: orthonormal to the nine digits that are kept."""
    u, _, v = np.linalg.svd(matrix)
    a, b, c = (np.round(u @ v, 9) + 0.0).tolist()  # + 0.0: no minus before a zero
    return (tuple(a), tuple(b), tuple(c))


def turned_about_vertical(angle_rad: float) -> Array:
    """Return the rotation by `angle_rad` about z, counter-clockwise."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def angle_between_deg(one: Array, other: Array) -> float:
    """Return the angle (degrees) of the rotation that takes one 3x3 rotation to the other."""
    cosine = (float(np.trace(one.T @ other)) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
