"""Checks that the base's messages are as young as they were when the run began."""

from __future__ import annotations

from robot_io.tick import ControlState, SafetyState, TickInput
from safety.finding import NS_PER_MS, Finding
from safety.settings import SafetySettings

LAG_SLOW_NS = 60_000_000
LAG_STOP_NS = 120_000_000


def check(
    _settings: SafetySettings, state: SafetyState, inp: TickInput, _control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and F32 where the bridge lags: what it delivers is fresh by arrival and old by its stamp."""
    lag_ns = inp.base.lag_ns
    if lag_ns > LAG_STOP_NS:
        return state, [Finding("F32-stop", lag_ns / NS_PER_MS)]
    if lag_ns > LAG_SLOW_NS:
        return state, [Finding("F32-slow", lag_ns / NS_PER_MS)]
    return state, []
