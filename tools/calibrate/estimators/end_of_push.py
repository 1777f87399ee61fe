"""Yaw of the sensor from the angle that long pushes settle at. Pure.

A push that has settled moves straight with the force along the motion, whatever the object: what the sensor reads
beside the motion then is its own yaw (and what was left of the tare). The start is no such thing: it rings out over
metres, and its mean may be of the wrong sign. So the angle is fitted together with the ringing, whose length and
damping follow from the gains and from the object (sticking contact at distance rho from the centre of friction, ratio
d of greatest torque to greatest force):

    d/dx (psi, y) = ((-r k_f / rho, -r k_y / rho), ((1 + k_f) (1 - g) / D, k_y / D)) (psi, y)
    g = d^2 / (d^2 + rho^2),  D = 1 - (1 + k_f) g,  r = (1 - g) / D
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robot_io.rig.types import Matrix3
from tools.calibrate.estimators.estimate import Array, CannotCalibrate, Estimate, K, rows_of, turned_about_vertical

LEAST_TOTAL_M = 15.0
LEAST_EACH_M = 3.0
SKIPPED_M = 1.0
"""The first metre slips and is not linear."""
BIN_M = 0.05
BLOCK_BINS = 10
RATIOS = (0.1, 0.4, 0.6, 0.77, 1.0)
"""d over rho: weight in the middle, ..., even, at the rim."""
ALMOST_AS_GOOD = 1.1
MOST_DEG = 20.0


class EndedPush(NamedTuple):
    """A push of a log: distance along the path (m) and force less motion (rad, by the log's frames), tick by tick."""

    name: str
    along_m: Array
    off_rad: Array
    k_f: float
    k_y_rad_per_m: float
    tare_rad: float
    """1 sigma of the angle that the noise of its tare leaves."""


def estimate_from_pushes(
    pushes: Sequence[EndedPush], base_from_sensor: Matrix3, half_lengths_m: tuple[float, float]
) -> Estimate:
    """Return by how much `base_from_sensor`, by which the logs were made, must be turned about the vertical, degrees.

    half_lengths_m: shortest and longest distance from the contact to the object's middle.
    Raises CannotCalibrate: pushes too short, less than 15 m in all, no ringing that fits, a yaw beyond 20 degrees.
    """
    binned = [_binned(push) for push in pushes]
    total = sum(float(np.ptp(push.along_m)) for push in pushes)
    if total < LEAST_TOTAL_M:
        raise CannotCalibrate(
            f"the logs hold {total:.1f} m of pushing, at least {LEAST_TOTAL_M:g} m are needed",
            do="Push on, or give more logs; `push calibrate frame --cord` needs none",
        )
    fits = list(_fits(pushes, binned, half_lengths_m))
    if not fits:
        raise CannotCalibrate(
            "with these gains no object of the rig's [sliders] settles", do="Push with gains that `push tune` finds"
        )
    best = min(fits, key=lambda fit: fit.rms)
    near = [fit.angle for fit in fits if fit.rms <= ALMOST_AS_GOOD * best.rms]
    floor = math.sqrt(sum(push.tare_rad**2 for push in pushes)) / len(pushes)
    error = math.sqrt(best.error**2 + float(np.var(near)) + floor**2)
    yaw = -best.angle
    if abs(math.degrees(yaw)) > MOST_DEG:
        raise CannotCalibrate(
            f"the pushes settled {math.degrees(yaw):.0f} degrees off", do="`push calibrate sign` comes first"
        )
    least = K * math.degrees(floor)
    return Estimate(
        "frame",
        (math.degrees(yaw),),
        (K * math.degrees(error),),
        "deg",
        (math.degrees(best.rms),),
        f"{len(pushes)} pushes, {total:.1f} m in all",
        {"frames.base_from_sensor": rows_of(turned_about_vertical(yaw) @ np.array(base_from_sensor))},
        (
            f"the tares alone leave +- {least:.2f} degrees, at any length: more pushes lower that",
            "the first 3 m of each say little: what they show beside the angle was fitted as a transient",
        ),
    )


class _Fit(NamedTuple):
    angle: float
    error: float
    rms: float


def _binned(push: EndedPush) -> tuple[Array, Array]:
    """Return distance after the first metre and mean angle in bins of 5 cm. Raises CannotCalibrate where too short."""
    finite = np.isfinite(push.off_rad) & np.isfinite(push.along_m)
    along, off = push.along_m[finite], push.off_rad[finite]
    length = float(np.ptp(along)) if len(along) else 0.0
    if length < LEAST_EACH_M:
        raise CannotCalibrate(
            f"{push.name} pushed {length:.1f} m, each push must be {LEAST_EACH_M:g} m long to have settled",
            do="Leave it out",
        )
    beyond = along - along.min() - SKIPPED_M
    bins = np.floor(beyond / BIN_M).astype(int)
    used = sorted(set(bins[bins >= 0].tolist()))
    places = np.array([(index + 0.5) * BIN_M for index in used])
    return places, np.array([off[bins == index].mean() for index in used])


def _fits(
    pushes: Sequence[EndedPush], binned: Sequence[tuple[Array, Array]], half_lengths_m: tuple[float, float]
) -> list[_Fit]:
    found = []
    for rho, ratio in itertools.product(np.linspace(*half_lengths_m, 5).tolist(), RATIOS):
        modes = [ringing(push.k_f, push.k_y_rad_per_m, rho, ratio * rho) for push in pushes]
        if all(mode is not None for mode in modes):
            found.append(_fit(binned, [mode for mode in modes if mode is not None]))
    return found


def ringing(k_f: float, k_y: float, rho: float, d: float) -> tuple[complex, complex] | None:
    """Return the two rates (1/m) at which a push dies away, None where it does not."""
    g = d * d / (d * d + rho * rho)
    slack = 1.0 - (1.0 + k_f) * g
    if slack <= 0.0:
        return None
    r = (1.0 - g) / slack
    trace = -r * k_f / rho + k_y / slack
    determinant = (-r * k_f / rho) * (k_y / slack) + (r * k_y / rho) * (1.0 + k_f) * (1.0 - g) / slack
    root = cmath.sqrt(trace * trace / 4.0 - determinant)
    rates = (trace / 2.0 + root, trace / 2.0 - root)
    return rates if max(rate.real for rate in rates) < -0.05 else None


def _fit(binned: Sequence[tuple[Array, Array]], modes: Sequence[tuple[complex, complex]]) -> _Fit:
    """Fit one angle to all pushes, and two amplitudes of ringing to each."""
    parts = []
    for i, ((places, _), (fast, slow)) in enumerate(zip(binned, modes, strict=True)):
        part = np.zeros((len(places), 1 + 2 * len(binned)))
        part[:, 0] = 1.0
        if fast.imag:
            part[:, 1 + 2 * i] = np.exp(fast.real * places) * np.cos(fast.imag * places)
            part[:, 2 + 2 * i] = np.exp(fast.real * places) * np.sin(fast.imag * places)
        else:
            part[:, 1 + 2 * i], part[:, 2 + 2 * i] = np.exp(fast.real * places), np.exp(slow.real * places)
        parts.append(part)
    design, target = np.vstack(parts), np.concatenate([off for _, off in binned])
    solution, *_ = np.linalg.lstsq(design, target, rcond=None)
    rest = target - design @ solution
    rms = float(np.sqrt((rest**2).mean()))
    blocks = len(rest) // BLOCK_BINS
    means = rest[: blocks * BLOCK_BINS].reshape(blocks, BLOCK_BINS).mean(axis=1)
    shared = max(1.0, float(means.var()) * BLOCK_BINS / max(rms**2, 1e-18))
    error = rms * math.sqrt(float(np.linalg.pinv(design.T @ design)[0, 0]) * shared)
    return _Fit(float(solution[0]), error, rms)
