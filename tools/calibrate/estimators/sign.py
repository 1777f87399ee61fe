"""Which way round the sensor is mounted, from the ball pressed by hand along three directions. Pure.

A hand is true to ten degrees or so: enough to tell which of the 24 ways of lying along the axes fits, whether the whole
sensor was turned against the base or only about its own axes; not enough for a yaw, which `frame` measures.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from robot_io.messages import Vector3
from robot_io.rig.types import Matrix3
from tools.calibrate.estimators.estimate import Array, CannotCalibrate, Estimate, angle_between_deg, rows_of
from tools.calibrate.estimators.steady import Steady, was_held

DIRECTIONS: dict[str, Vector3] = {"forward": (1.0, 0.0, 0.0), "left": (0.0, 1.0, 0.0), "up": (0.0, 0.0, 1.0)}
"""What is asked for, in BODY."""
LEAST_N = 5.0
FITS_DEG = 25.0
"""A press this far off its direction still is one in this direction; the next of the 24 ways is 90 degrees away."""
APART_DEG = 30.0
"""Two presses closer together than this are one direction."""


class Fit(NamedTuple):
    """A mounting and how far the presses are off under it, degrees."""

    rotation: Array
    worst_deg: float
    mean_deg: float


def estimate_sign(presses: Mapping[str, Steady], tare: Steady, base_from_sensor: Matrix3) -> Estimate:
    """Return the mounting that fits: the rig's where it does, else another one, which `keys` proposes.

    presses: what the sensor read for each of DIRECTIONS. Value and uncertainty (degrees): angle between the rig's
    mounting and the one that fits, and how far the presses were off.
    Raises CannotCalibrate: a weak press, presses in one direction, none of the mountings fits, all are felt reversed.
    """
    now = np.array(base_from_sensor)
    names = tuple(DIRECTIONS)
    felt = np.array([_direction(name, presses[name], tare) for name in names])
    asked = np.array([DIRECTIONS[name] for name in names])
    for (a, one), (b, other) in itertools.combinations(zip(names, felt, strict=True), 2):
        if abs(float(one @ other)) > np.cos(np.radians(APART_DEG)):
            raise CannotCalibrate(f"{a} and {b} were pressed along one line", do="Press in the direction asked for")
    current = _fit(now, felt, asked)
    if current.worst_deg <= FITS_DEG:
        return _result(current, now, {}, "the rig's mounting fits: nothing to change")
    best = min((_fit(other, felt, asked) for other in mountings(now)), key=lambda fit: fit.mean_deg)
    if best.worst_deg > FITS_DEG:
        if min(_fit(other, -felt, asked).worst_deg for other in mountings(now)) <= FITS_DEG:
            raise CannotCalibrate(
                "all three were felt the other way round, as no mounting can explain",
                do="Push the ball forward, left and up, do not hold against it; then check the sensor's own signs",
            )
        raise CannotCalibrate(
            f"no mounting along the axes fits: the best is {best.worst_deg:.0f} degrees off",
            do="Press along the base's own axes; where the sensor is mounted at a slant, measure `frame --weight`",
        )
    keys = {"frames.base_from_sensor": rows_of(best.rotation)}
    turned = angle_between_deg(now, best.rotation)
    return _result(best, now, keys, f"the sensor is mounted {turned:.0f} degrees away from what the rig says")


def mountings(now: Array) -> Iterator[Array]:
    """Give every rotation that takes axes to axes, applied to the base's side of `now` and to the sensor's."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            if np.linalg.det(turn) > 0.0:
                yield turn @ now
                yield now @ turn


def _fit(rotation: Array, felt: Array, asked: Array) -> Fit:
    cosines = np.clip(((felt @ rotation.T) * asked).sum(axis=1), -1.0, 1.0)
    off = np.degrees(np.arccos(cosines))
    return Fit(rotation, float(off.max()), float(off.mean()))


def _direction(name: str, reading: Steady, tare: Steady) -> Array:
    force = reading.mean[:3] - tare.mean[:3]
    size = float(np.linalg.norm(force))
    if size < LEAST_N:
        raise CannotCalibrate(
            f"pressing {name} gave {size:.1f} N, at least {LEAST_N:g} N are needed",
            do="Press harder, and keep pressing",
        )
    if not was_held(reading, force):
        raise CannotCalibrate(f"{name} was not pressed all the while", do="Keep pressing until told to go on")
    return np.asarray(force / size)


def _result(fit: Fit, now: Array, keys: dict[str, Matrix3], told: str) -> Estimate:
    turned = angle_between_deg(now, fit.rotation) if keys else 0.0
    return Estimate(
        "sign", (turned,), (fit.worst_deg,), "deg", (fit.mean_deg,), "pressed forward, left and up", dict(keys), (told,)
    )
