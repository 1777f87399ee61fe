"""The fault table, as data: what can go wrong, how the run reacts, and what clears it.

The reaction is a `Mode`; the strongest active fault decides. Bounds are in ticks of 10 ms, from the first
tick at which the fault can be seen to the first reduced or zero command that leaves the envelope.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec

from robot_io.tick import Mode


class Clears(StrEnum):
    """How a fault clears."""

    AUTO = "auto"
    """By itself, after one clean second."""
    LATCHED = "latched"
    """Only at the end of the run."""


class Fault(msgspec.Struct, frozen=True):
    """One row: id, text for people, reaction, how it clears, bound in ticks, and exit code."""

    id: str
    text: str
    mode: Mode
    clears: Clears
    bound_ticks: int
    exit_code: int = 5


def _row(id_: str, text: str, mode: Mode, clears: Clears, bound: int, exit_code: int = 5) -> tuple[str, Fault]:
    return id_, Fault(id_, text, mode, clears, bound, exit_code)


_A, _L = Clears.AUTO, Clears.LATCHED
_WARN = Mode.SILENT
"""A reaction of SILENT has no effect on the run: the fault is only counted and logged."""

FAULTS: dict[str, Fault] = dict(
    (
        _row("R01", "a device sent no data within 5 s of the start", Mode.STOP, _L, 1, 4),
        _row("R02", "the force sensor was not settled while taring", Mode.STOP, _L, 1, 4),
        _row("R03", "the force sensor's bias leaves too little range", Mode.STOP, _L, 1, 4),
        _row("R04", "the arm is not at the rig's held pose, for which its frames are given", Mode.STOP, _L, 1, 4),
        _row("R05", "the base was not at rest for the tare: its odometry showed motion for 5 s", Mode.STOP, _L, 1, 4),
        _row("F01-slow", "no force packet for 50 ms", Mode.SLOW, _A, 5),
        _row("F01-hold", "no force packet for 80 ms", Mode.HOLD, _A, 8),
        _row("F01-stop", "no force packet for 160 ms", Mode.STOP, _L, 16),
        _row("F02", "the force sensor's link is gone", Mode.STOP, _L, 2),
        _row("F06", "the force sensor repeats the same reading while the base moves", Mode.STOP, _L, 30),
        _row("F07", "a force or torque axis is at the end of the sensor's range", Mode.STOP, _L, 1),
        _row("F09", "the force sensor does not read zero after the run", _WARN, _A, 0),
        _row("F10", "the force is not a finite number", Mode.STOP, _L, 1),
        _row("F20-hold", "the arm drifts from its held joints", Mode.HOLD, _L, 1),
        _row("F20-stop", "the arm has left its held joints: tare again", Mode.STOP, _L, 1),
        _row("F21", "an arm joint is moving", Mode.STOP, _L, 3),
        _row("F22", "the arm is in a protective or safeguard stop", Mode.STOP, _L, 2),
        _row("F23", "the arm is in an emergency stop", Mode.DEAD, _L, 2),
        _row("F24-hold", "no arm record for 40 ms", Mode.HOLD, _A, 4),
        _row("F24-stop", "no arm record for 100 ms", Mode.STOP, _L, 10),
        _row("F25-hold", "the arm controller's clock has stopped for 40 ms", Mode.HOLD, _A, 4),
        _row("F25-stop", "the arm controller's clock has stopped for 100 ms", Mode.STOP, _L, 10),
        _row("F27", "the arm is not running (powered off, brakes on or teach mode)", Mode.STOP, _L, 2),
        _row("F28", "another program is running on the arm", Mode.STOP, _L, 2),
        _row("F29", "the arm's joints are not finite numbers", Mode.STOP, _L, 1),
        _row("F30", "the base link is gone", Mode.STOP, _L, 1),
        _row("F31-hold", "no odometry from the base for 100 ms", Mode.HOLD, _A, 10),
        _row("F31-stop", "no odometry from the base for 250 ms", Mode.STOP, _L, 25),
        _row("F33", "the base ignores the command", Mode.STOP, _L, 30),
        _row("F34", "the base moves although it was told to stop", Mode.DEAD, _L, 34),
        _row("F35", "the base is faster than the envelope", Mode.STOP, _L, 3),
        _row("F36", "the commanded velocity was beyond the envelope and was clamped", _WARN, _A, 0),
        _row("F38", "the base is stopped by its emergency stop or its motors are off", Mode.STOP, _L, 2),
        _row("F39", "the base did not come to rest within 5 s: its odometry still shows motion", Mode.STOP, _L, 1),
        _row("F40-slow", "the base pose is late", Mode.SLOW, _A, 5),
        _row("F40-stop", "the base pose is lost", Mode.STOP, _L, 12),
        _row("F41", "the base pose jumps", Mode.STOP, _L, 3),
        _row("F42", "the base pose is not a valid number", Mode.STOP, _L, 1),
        _row("F44", "the base has turned away from its heading", Mode.STOP, _L, 1),
        _row("F50-slow", "the force is above the slow limit", Mode.SLOW, _A, 1),
        _row("F50-stop", "the force is above the limit", Mode.STOP, _L, 1),
        _row("F51", "the torque is above the limit", Mode.STOP, _L, 1),
        _row("F52", "the contact force is lost: turning back", _WARN, _A, 0, 6),
        _row("F52-hold", "the contact force stays lost", Mode.HOLD, _A, 1, 6),
        _row("F53", "no contact within 0.5 m of where it was expected", Mode.HOLD, _A, 1, 6),
        _row("F56", "the law pushes backward (beyond 90 degrees)", Mode.STOP, _L, 20),
        _row("F58", "the law returned a direction that is not a number", Mode.STOP, _L, 1),
        _row("F60-late", "ticks of the loop were skipped", _WARN, _A, 0),
        _row("F60-slow", "the loop overran by 30 ms, or in three ticks in a row", Mode.SLOW, _A, 3),
        _row("F63", "the recorder is gone", Mode.HOLD, _L, 100),
        _row("F64", "the operator asked for a stop", Mode.STOP, _L, 1, 130),
        _row("F65", "control died while the base was moving", Mode.STOP, _L, 5),
        _row("F66", "control was silent for 50 ms", Mode.STOP, _L, 5),
        _row("F67", "the gate is gone or has latched", Mode.STOP, _L, 1),
        _row("F67-late", "no record from the gate for 100 ms", Mode.STOP, _L, 10),
        _row("F68", "an exception in the loop", Mode.STOP, _L, 0, 1),
        _row("F69", "the arm's process is gone", Mode.STOP, _L, 1),
    )
)


def strongest(ids: tuple[str, ...]) -> Mode:
    """Return the strongest reaction among active faults, SILENT (no reaction) when there is none."""
    return max((FAULTS[i].mode for i in ids), default=Mode.SILENT)
