"""Whole pushes in lockstep with an error of the frames and of the tare, whose signs the seed draws: law against law."""

from __future__ import annotations

import math
import random
from typing import Any, NamedTuple

from msgspec.structs import replace

from tools.rig import resolve_rig
from tools.run.lockstep import Lockstep

TURNED_DEG = 1.0
BIAS_N = 0.12
AFTER_TARE_S = 0.6
"""The error of the tare comes this long after it would have ended at the earliest, before the contact."""


class Course(NamedTuple):
    """How a push went: offset of the ball at 6 m and at its end, and the worst from first contact on (m)."""

    exit_code: int
    at_6_m: float
    end_m: float
    worst_m: float
    lost: int
    faults: tuple[str, ...]


def push(law: str, seed: int, distance_m: float = 20.0, settings: tuple[str, ...] = ()) -> Course:
    """Push the default object with an error of 1 degree and of 0.12 N."""
    draw = random.Random(f"signs-{seed}")
    turned, bias = (draw.choice((-1.0, 1.0)) * size for size in (TURNED_DEG, BIAS_N))
    error = f"world.truth.sensor_yaw_deg={turned}"
    rig = resolve_rig("sim", [f"control.law={law}", f"control.distance_m={distance_m}", error, *settings])
    rows = rig.frames.base_from_sensor
    lateral = tuple(rows[1][i] * bias for i in range(3))  # along BODY y, in the SENSOR frame
    word = f"ft.wrong={','.join(f'{value:.4f}' for value in lateral)} at {rig.ft.tare_s + AFTER_TARE_S:.1f} s"
    rig = replace(rig, faults=replace(rig.faults, inject=(word,)))
    run = Lockstep(rig, seed, None)
    at_6_m = [math.nan]

    def look(inp: Any, state: Any, output: Any) -> None:
        if state.control.progress_m < 6.0:
            at_6_m[0] = state.control.lateral_m

    figures = run.run(look)
    worst = figures["worst_lateral_m"]
    faults = tuple(sorted(figures["fault_counts"]))
    return Course(
        figures["exit_code"], at_6_m[0], figures["lateral_error_m"], math.nan if worst is None else abs(worst),
        figures["lost_times"], faults,
    )  # fmt: skip
