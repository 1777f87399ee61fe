"""Bias of the force-torque sensor: the mean of a minute at rest, its spread, and how far it drifts. Pure."""

from __future__ import annotations

import numpy as np

from control.tare import AXES, UNITS
from robot_io.messages import Vector6
from tools.calibrate.estimators.estimate import Array, CannotCalibrate, Estimate, K
from tools.calibrate.estimators.steady import stands_out, steady

MINUTE_S = 60.0
MOST_DRIFT = (0.5, 0.5, 0.5, 0.05, 0.05, 0.05)
"""More than this in a minute (N, N*m) spoils the tare of a push before it ends."""
TOUCH_FLOOR = np.array([0.1, 0.1, 0.1, 0.005, 0.005, 0.005])
NOISE_FACTOR = 2.0
SURE = 3.0
"""Standard errors from which on a drift is one."""


def estimate_bias(times_s: Array, values: Array, noise: Vector6) -> Estimate:
    """Return the bias of readings at rest.

    values: readings (N, N*m, SENSOR frame) in rows, taken at `times_s`. noise: the sensor's own standard deviations.
    Raises CannotCalibrate: too few readings, noise above twice the sensor's, a touch, a drift.
    """
    found = steady(times_s, values)
    still = "Keep arm, base and tool still and free of contact, and measure again"
    for i, (sd, own) in enumerate(zip(found.sd, noise, strict=True)):
        if sd > NOISE_FACTOR * own > 0.0:
            raise CannotCalibrate(
                f"{AXES[i]} varies by {sd:.3g} {UNITS[i]}, the sensor's own noise is {own:.3g}", do=still
            )
    if (axis := stands_out(found, TOUCH_FLOOR)) is not None:
        raise CannotCalibrate(f"{AXES[axis]} changed for a moment: the tool was touched or moved", do=still)
    drift = found.drift_per_s * MINUTE_S
    drift_error = found.drift_error * MINUTE_S
    for i, most in enumerate(MOST_DRIFT):
        if abs(drift[i]) > most + K * drift_error[i]:
            raise CannotCalibrate(
                f"{AXES[i]} drifts by {drift[i]:+.2g} {UNITS[i]} a minute, at most {most:g} is fit for a push",
                do="Leave the sensor switched on for half an hour, then measure again",
            )
    seen = np.abs(found.drift_per_s) > SURE * found.drift_error
    within = np.where(seen, found.drift_per_s * found.span_s, 0.0) / np.sqrt(12.0)
    uncertainty = K * np.hypot(found.error, within)
    worst = int(np.abs(drift[:3]).argmax())
    return Estimate(
        "bias",
        tuple(found.mean.tolist()),
        tuple(uncertainty.tolist()),
        ", ".join(UNITS),
        tuple(found.sd.tolist()),
        f"mean of {found.readings} readings at rest",
        {},
        (f"drift in a minute: {drift[worst]:+.3f} N on {AXES[worst]} (+- {K * drift_error[worst]:.3f})",),
    )
