"""Checks the push itself: start, rest, contact, direction, finite numbers."""

from __future__ import annotations

import math

from robot_io.messages import BodyTwist
from robot_io.tick import ControlState, Phase, TickInput
from safety.finding import NS_PER_MS, Finding

START_NS = 5_000_000_000
REST_TIMEOUT_NS = 5_000_000_000
"""A stopped base comes to rest within 1 s; motion still measured after this is false or not caused by us."""
AT_REST_PHASES = (Phase.REST, Phase.CHECK, Phase.LOST_HOLD)
BACKWARD_TICKS = 20
SIDEWAYS_M = 0.3
"""As much as a lost contact has by default; pushes that the law saves need less than half of it (docs/laws.md)."""
RESIDUAL_N = 5.0
"""The smallest meaningful force according to the sensor's product sheet."""

_REFUSALS = {1: "R02", 2: "R03", 3: "R02-dead", 4: "R02-contact"}


def check(inp: TickInput, control: ControlState, wanted: BodyTwist, first_ns: int) -> list[str]:
    """Return the active faults of the task; `first_ns` is when the run began."""
    faults: list[str] = []
    phase = control.phase
    if phase == Phase.SETTLE and inp.now_ns - first_ns > START_NS:
        faults.append(Finding("R01", (inp.now_ns - first_ns) / NS_PER_MS))
    if phase == Phase.TARE and control.refusal:
        faults.append(_REFUSALS[control.refusal])
    if not control.rest_since_ns and inp.now_ns - control.phase_since_ns > REST_TIMEOUT_NS:
        if phase == Phase.TARE:
            faults.append("R05")
        elif phase in AT_REST_PHASES:
            faults.append("F39")
    if phase == Phase.LOST:
        faults.append("F52")
    if phase == Phase.LOST_HOLD:
        faults.append("F52-hold" if control.contact_seen else Finding("F53", control.felt_N))
    if control.resume_refused:
        faults.append(Finding("F52-refused", control.resumes))
    if control.law_error:
        faults.append("F57")
    if control.backward_ticks >= BACKWARD_TICKS:
        faults.append(Finding("F56", control.backward_ticks))
    if control.sideways_m >= SIDEWAYS_M:
        faults.append(Finding("F56-way", control.sideways_m))
    if not (math.isfinite(wanted.vx) and math.isfinite(wanted.vy) and math.isfinite(wanted.omega)):
        faults.append("F58")
    if control.residual_N > RESIDUAL_N:
        faults.append(Finding("F09", control.residual_N))
    return faults
