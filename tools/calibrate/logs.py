"""Measurement from logs: the pushes in them, as the estimator of their ends takes them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from robot_io.errors import UsageError
from robot_io.rig.config import RigConfig
from robot_io.tick import Phase
from tools.calibrate.estimators.end_of_push import EndedPush, estimate_from_pushes
from tools.calibrate.estimators.estimate import CannotCalibrate, Estimate
from tools.places.find_log import find_log
from tools.report.run_data import RunData, read_run

LEAST_N = 5.0


def measure_from_logs(rig: RigConfig, paths: Sequence[Path]) -> Estimate:
    """Return the yaw by the ends of the logs' pushes. Raises UsageError and LogDamaged for logs that hold no pushes."""
    runs = [read_run(find_log(path)) for path in paths]
    frames = {run.rig.frames.base_from_sensor for run in runs}
    if len(frames) > 1:
        raise UsageError("the logs were made with different base_from_sensor", do="Give logs of one calibration")
    if frames != {rig.frames.base_from_sensor}:
        raise UsageError(
            "the logs were made with another base_from_sensor than the rig has now",
            where=str(paths[0]),
            do="Give the rig as it was then, or newer logs",
        )
    halves = (rig.sliders.shortest_m / 2.0, rig.sliders.longest_m / 2.0)
    return estimate_from_pushes([_ended(run) for run in runs], rig.frames.base_from_sensor, halves)


def _ended(run: RunData) -> EndedPush:
    rig, ticks, name = run.rig, run.ticks, str(run.log)
    if rig.control.law != "force":
        raise UsageError("only pushes by force feedback settle", where=name, do="Leave it out")
    pushing = ticks["phase"] == float(Phase.PUSH)
    force = float(np.median(np.hypot(ticks["force_x"], ticks["force_y"])[pushing])) if pushing.any() else 0.0
    if not force >= LEAST_N:
        raise CannotCalibrate(f"{name} holds no push with {LEAST_N:g} N and more", do="Leave it out")
    readings = max(1.0, rig.ft.tare_s * rig.ft.declared.rate_hz)
    tare_n = max(rig.ft.noise[:3]) / math.sqrt(readings)
    off = ticks["theta_f"] - ticks["theta_p"]
    along = ticks["along_m"]
    gains = rig.control
    return EndedPush(name, along[pushing], off[pushing], gains.k_f, gains.k_y_rad_per_m, tare_n / force)
