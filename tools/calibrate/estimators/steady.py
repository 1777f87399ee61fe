"""Mean of readings at rest and how far it can be trusted: neighbouring readings may share their noise, and drift.

The readings are cut into blocks. Means of blocks that scatter more than independent readings would make them show that
the noise is filtered: the standard error grows accordingly. A block that stands out was moved or touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robot_io.clock import NS_PER_S
from robot_io.messages import SensorWrench, Stamped
from tools.calibrate.estimators.estimate import Array, CannotCalibrate

BLOCKS = 20
SMALLEST_COUNT = 10 * BLOCKS
LET_GO = 0.5
"""A force that changes by this share of itself was not held."""
STANDS_OUT = 6.0
"""A block further from the trend than this many standard deviations of a block was touched."""


class Steady(NamedTuple):
    """Mean, standard error (1 sigma), drift a second and standard deviation of each column, with its own error."""

    mean: Array
    error: Array
    drift_per_s: Array
    drift_error: Array
    sd: Array
    blocks: Array
    """Means of the blocks after the trend was taken out, in rows."""
    readings: int
    span_s: float


def table(samples: Sequence[Stamped[SensorWrench]]) -> tuple[Array, Array]:
    """Return the time (s since the first) and the six numbers (N, N*m) of each reading."""
    first_ns = samples[0].received_ns if samples else 0
    times = np.array([(sample.received_ns - first_ns) / NS_PER_S for sample in samples])
    values = [(s.value.fx, s.value.fy, s.value.fz, s.value.mx, s.value.my, s.value.mz) for s in samples]
    return times, np.array(values, dtype=np.float64).reshape(-1, 6)


def steady(times_s: Array, values: Array, least: int = SMALLEST_COUNT) -> Steady:
    """Return what `values` (readings in rows, taken at `times_s`) say of their mean.

    Raises CannotCalibrate for fewer than `least` readings, and for one that is not a number.
    """
    count = len(values)
    if count < max(least, 2 * BLOCKS):
        raise CannotCalibrate(f"only {count} readings came, at least {least} are needed", do="Measure for longer")
    if not np.isfinite(values).all():
        raise CannotCalibrate("a reading is not a number", do="Check the sensor")
    mean = values.mean(axis=0)
    centred_s = times_s - times_s.mean()
    spread = float(centred_s @ centred_s)
    slope = centred_s @ values / spread
    rest = values - mean - np.outer(centred_s, slope)
    sd = rest.std(axis=0, ddof=2)
    size = count // BLOCKS
    blocks = rest[: size * BLOCKS].reshape(BLOCKS, size, -1).mean(axis=1)
    # One filter makes the noise of all columns: they share one factor, which their ratios together tell better.
    alone = np.where(sd > 0.0, sd, 1.0) ** 2 / size
    factor = max(1.0, float(np.mean(blocks.var(axis=0, ddof=2) / alone)))
    error = sd * np.sqrt(factor / count)
    return Steady(mean, error, slope, sd * np.sqrt(factor / spread), sd, blocks, count, float(times_s[-1] - times_s[0]))


def was_held(found: Steady, force: Array) -> bool:
    """Return whether a force (N, beside the tare) lasted: a hand may tremble, but not let go or come late."""
    size = float(np.linalg.norm(force))
    trend = float(np.linalg.norm(found.drift_per_s[:3])) * found.span_s
    return max(trend, float(np.linalg.norm(found.blocks[:, :3], axis=1).max())) < LET_GO * size


def stands_out(found: Steady, floor: Array) -> int | None:
    """Return the column in which one block lies off the others by more than noise and `floor`, None where none does."""
    away = np.abs(found.blocks - np.median(found.blocks, axis=0))
    alone = found.sd / np.sqrt(found.readings / BLOCKS)
    # How much more blocks scatter than independent readings would; one that was touched hardly changes that.
    factor = max(1.0, 1.4826 * float(np.median(away / np.where(alone > 0.0, alone, 1.0))))
    over = (away / np.maximum(STANDS_OUT * factor * alone, floor)).max(axis=0)
    return int(over.argmax()) if over.max() > 1.0 else None
