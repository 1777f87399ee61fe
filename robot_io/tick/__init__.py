"""Everything one tick of the loop consumes and produces: the record that the log holds and replay folds again.

`TickInput` is all the outside world the tick sees. `TickState` is all it remembers. `TickOutput` is all it
says. A run is a fold of (state, input) -> (state, output), and `/control/tick` holds every part of it.
Times are CLOCK_MONOTONIC ns. Angles without a frame in their name are in the PATH frame.
"""

from __future__ import annotations

from robot_io.tick.control_state import REST_M_PER_S, REST_NS, ContactState, ControlState, Phase, TareSums
from robot_io.tick.field_types import Counts6
from robot_io.tick.input import FtInput, FtReading, HostInput, Operator, TickInput, link_number
from robot_io.tick.record import SHORTENED, TICK_CDR, ControlTick, TickOutput, TickState, shortened
from robot_io.tick.safety_state import (
    ClockState,
    EnvelopeState,
    ForceState,
    Mode,
    MotionMark,
    MotionState,
    SafetyState,
    WorkspaceState,
)

__all__ = [
    "REST_M_PER_S",
    "REST_NS",
    "SHORTENED",
    "TICK_CDR",
    "ClockState",
    "ContactState",
    "ControlState",
    "ControlTick",
    "Counts6",
    "EnvelopeState",
    "ForceState",
    "FtInput",
    "FtReading",
    "HostInput",
    "Mode",
    "MotionMark",
    "MotionState",
    "Operator",
    "Phase",
    "SafetyState",
    "TareSums",
    "TickInput",
    "TickOutput",
    "TickState",
    "WorkspaceState",
    "link_number",
    "shortened",
]
