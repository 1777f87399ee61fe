"""Checks that the force-torque sensor is alive, plausible and inside its limits, on raw packets before any filter."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.messages import LinkState
from robot_io.tick import ControlState, SafetyState, TickInput
from safety.finding import NS_PER_MS, Finding
from safety.settings import SATURATED, SafetySettings

STALE_SLOW_NS = 50_000_000
STALE_HOLD_NS = 80_000_000
STALE_STOP_NS = 160_000_000
"""Robotiq's own driver calls a link bad after 160 ms without a valid packet."""


def note(state: SafetyState, inp: TickInput) -> SafetyState:
    """Record when the newest packet arrived, without judging anything yet."""
    return replace(state, last_ft_ns=inp.ft.readings[-1].received_ns) if inp.ft.readings else state


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of the sensor."""
    faults: list[str] = []
    last_ns, force, torque = state.last_ft_ns, state.last_ft_force, state.last_ft_torque
    for reading in inp.ft.readings:
        last_ns = max(last_ns, reading.received_ns)
        force, torque = reading.force, reading.torque
        faults += _of_reading(settings, force, torque, control)
    if inp.ft.link == LinkState.LOST:
        faults.append("F02")
    if inp.ft.bias_jumps:
        faults.append("F15")
    age_ns = inp.now_ns - last_ns
    if age_ns > STALE_STOP_NS:
        faults.append(Finding("F01-stop", age_ns / NS_PER_MS))
    elif age_ns > STALE_HOLD_NS:
        faults.append(Finding("F01-hold", age_ns / NS_PER_MS))
    elif age_ns > STALE_SLOW_NS:
        faults.append(Finding("F01-slow", age_ns / NS_PER_MS))
    return replace(state, last_ft_ns=last_ns, last_ft_force=force, last_ft_torque=torque), faults


def _of_reading(
    settings: SafetySettings,
    force: tuple[float, float, float],
    torque: tuple[float, float, float],
    control: ControlState,
) -> list[str]:
    if not all(map(math.isfinite, (*force, *torque))):
        return ["F10"]
    faults: list[str] = []
    most = settings.saturated
    if (
        abs(force[0]) >= most[0]
        or abs(force[1]) >= most[1]
        or abs(force[2]) >= most[2]
        or abs(torque[0]) >= most[3]
        or abs(torque[1]) >= most[4]
        or abs(torque[2]) >= most[5]
    ):
        axes = zip((*force, *torque), most, strict=True)
        faults.append(Finding("F07", max(abs(value) / limit for value, limit in axes) * SATURATED))
    if not control.tared:
        return faults
    bias, bias_torque = control.bias_force, control.bias_torque
    size = math.hypot(force[0] - bias[0], force[1] - bias[1], force[2] - bias[2])
    if size > settings.max_force:
        faults.append(Finding("F50-stop", size))
    elif size > settings.slow_force:
        faults.append(Finding("F50-slow", size))
    twisting = math.hypot(torque[0] - bias_torque[0], torque[1] - bias_torque[1], torque[2] - bias_torque[2])
    if twisting > settings.max_torque:
        faults.append(Finding("F51", twisting))
    return faults
