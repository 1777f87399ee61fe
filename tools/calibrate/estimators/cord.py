"""Yaw of the sensor from a cord at the ball, pulled by hand along directions marked on the floor. Pure.

Each pull says by which angle the reading is turned against the mark. Directions all round let what is left of the tare
cancel. The cord is taut from the ball outwards, so that the force on the tool points along the mark.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robot_io.geometry import wrap_angle
from robot_io.rig.types import Matrix3
from tools.calibrate.estimators.estimate import Array, CannotCalibrate, Estimate, K, rows_of, turned_about_vertical
from tools.calibrate.estimators.steady import Steady, was_held

FEWEST = 3
LEAST_N = 8.0
STEEPEST = 0.35
"""Vertical over horizontal force of a cord that is still level (19 degrees)."""
MOST_ONE_SIDED = 0.8
"""Length of the mean of the unit vectors: 1 where all directions are one."""
MOST_TURNED_DEG = 20.0
MOST_SPREAD_DEG = 3.0
UNLIKELY = 6.0
"""Scatter over what was expected, squared, from which on the marks are worse than they were said to be."""


class Pull(NamedTuple):
    """One pull: direction of its mark in BODY (degrees, counter-clockwise from ahead) and what the sensor read."""

    angle_deg: float
    reading: Steady


def check_directions(angles_deg: Sequence[float]) -> None:
    """Raise CannotCalibrate for fewer than three directions, or for directions that all lie on one side."""
    if len(angles_deg) < FEWEST:
        raise CannotCalibrate(f"{len(angles_deg)} directions are too few, {FEWEST} are needed", do="Mark more")
    marks = np.radians(np.asarray(angles_deg))
    if math.hypot(np.cos(marks).mean(), np.sin(marks).mean()) > MOST_ONE_SIDED:
        raise CannotCalibrate(
            "the directions lie close together, so that an error of the tare would pass for a yaw",
            do="Spread them around the ball: 0, 120 and 240 degrees",
        )


def estimate_yaw(
    pulls: Sequence[Pull], before: Steady, after: Steady, base_from_sensor: Matrix3, marking_deg: float
) -> Estimate:
    """Return by how much `base_from_sensor` must be turned about the vertical, in degrees.

    before, after: the tare before the first pull and after the last. marking_deg: 1 sigma of the marks' directions.
    Raises CannotCalibrate: too few or one-sided directions, a weak, steep or reversed pull, pulls that contradict each
    other, a yaw beyond 20 degrees.
    """
    check_directions([pull.angle_deg for pull in pulls])
    rotation = np.array(base_from_sensor)
    forces = [_force(pull, i, len(pulls), before, after, rotation) for i, pull in enumerate(pulls)]
    sizes = np.array([math.hypot(force[0], force[1]) for force in forces])
    marks = np.radians([pull.angle_deg for pull in pulls])
    off = np.array([wrap_angle(m - math.atan2(f[1], f[0])) for m, f in zip(marks, forces, strict=True)])
    _check_turned(pulls, off)
    errors = np.array([float(np.linalg.norm(pull.reading.error[:3])) / math.sqrt(3.0) for pull in pulls])
    variances = math.radians(marking_deg) ** 2 + (errors / sizes) ** 2
    weights = (1.0 / variances) / (1.0 / variances).sum()
    yaw = float(weights @ off)
    rest = off - yaw
    spread = math.degrees(float(np.abs(rest).max()))
    if spread > MOST_SPREAD_DEG:
        raise CannotCalibrate(
            f"the pulls contradict each other by {spread:.1f} degrees",
            do="Check the marks and the order of the directions, keep the cord free of the robot, and pull again",
        )
    scatter = float((rest**2 / variances).sum()) / (len(pulls) - 1)
    own = (1.0 if scatter < UNLIKELY else scatter) / float((1.0 / variances).sum())
    common = _tare_error(before, after) * float(
        np.linalg.norm((weights / sizes) @ np.column_stack([-np.sin(marks), np.cos(marks)]))
    )
    uncertainty = K * math.degrees(math.sqrt(own + common**2))
    return Estimate(
        "frame",
        (math.degrees(yaw),),
        (uncertainty,),
        "deg",
        (math.degrees(float(np.sqrt((rest**2).mean()))),),
        f"cord along {', '.join(f'{pull.angle_deg:g}' for pull in pulls)} degrees, marks to {marking_deg:g} degrees",
        {"frames.base_from_sensor": rows_of(turned_about_vertical(yaw) @ rotation)},
        (f"pulled with {sizes.min():.0f} to {sizes.max():.0f} N; the tare moved by {_moved(before, after):.2f} N",),
    )


def _force(pull: Pull, i: int, count: int, before: Steady, after: Steady, rotation: Array) -> Array:
    """Return the force of a pull in BODY as the rig sees it (N). Raises CannotCalibrate for one that says nothing."""
    later = (i + 1) / (count + 1)
    tare = (1.0 - later) * before.mean[:3] + later * after.mean[:3]
    force = np.asarray(rotation @ (pull.reading.mean[:3] - tare))
    level, where = math.hypot(force[0], force[1]), f"the pull at {pull.angle_deg:g} degrees"
    if level < LEAST_N:
        raise CannotCalibrate(f"{where} gave {level:.1f} N, at least {LEAST_N:g} N are needed", do="Pull harder")
    if not was_held(pull.reading, force):
        raise CannotCalibrate(f"{where} was not held while measured", do="Keep the cord taut until told to go on")
    if abs(force[2]) > STEEPEST * level:
        raise CannotCalibrate(
            f"{where} is not level: {force[2]:+.1f} N upwards beside {level:.1f} N", do="Pull at the ball's height"
        )
    return force


def _check_turned(pulls: Sequence[Pull], off: Array) -> None:
    for pull, angle in zip(pulls, np.degrees(off), strict=True):
        if abs(angle) > 180.0 - MOST_TURNED_DEG:
            raise CannotCalibrate(
                f"the pull at {pull.angle_deg:g} degrees was felt the other way round",
                do="Pull away from the ball; where you did, `push calibrate sign` comes first",
            )
        if abs(angle) > MOST_TURNED_DEG:
            raise CannotCalibrate(
                f"the pull at {pull.angle_deg:g} degrees was felt {angle:+.0f} degrees off: no mere yaw",
                do="Check the marks; `push calibrate sign` tells whether the sensor is mounted as the rig says",
            )


def _moved(before: Steady, after: Steady) -> float:
    return float(np.linalg.norm(after.mean[:3] - before.mean[:3]))


def _tare_error(before: Steady, after: Steady) -> float:
    """Return 1 sigma (N) of what is left of the tare on an axis: its noise, and where between the two it moved."""
    noise = math.sqrt(float((before.error[:3] ** 2 + after.error[:3] ** 2).mean())) / 2.0
    return math.hypot(noise, _moved(before, after) / math.sqrt(3.0) / math.sqrt(12.0))
