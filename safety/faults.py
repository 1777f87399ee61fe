"""The fault table, as data: what can go wrong, how the run reacts, and what clears it.

The reaction is a `Mode`; the strongest active fault decides. Bounds are in ticks of 10 ms, from the first
tick at which the fault can be seen to the first reduced or zero command that leaves the envelope.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import msgspec

from robot_io.tick import Mode
from safety.settings import SafetySettings
from safety.table.fault_advice import advice_of
from safety.table.fault_measures import measure_of


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
    measured: str = ""
    """What the value of a finding is; "" where nothing is measured."""
    limit: float | str | None = None
    """Beyond it the row is found: a number in `unit`, or the field of SafetySettings that holds it."""
    unit: str = ""
    cause: str = ""
    """Likely causes, for people."""
    next_step: str = ""
    """What to do."""


def _row(id_: str, text: str, mode: Mode, clears: Clears, bound: int, exit_code: int = 5) -> tuple[str, Fault]:
    return id_, Fault(id_, text, mode, clears, bound, exit_code, *measure_of(id_), *advice_of(id_))


_A, _L = Clears.AUTO, Clears.LATCHED
_WARN = Mode.SILENT
"""A reaction of SILENT has no effect on the run: the fault is only counted and logged."""

FAULTS: dict[str, Fault] = dict(
    (
        _row("R01", "a device sent no data within 5 s of the start", Mode.STOP, _L, 1, 4),
        _row("R02", "the force sensor was not settled while taring", Mode.STOP, _L, 1, 4),
        _row(
            "R02-dead",
            "an axis of the force sensor measures nothing: it hardly changes while taring",
            Mode.STOP,
            _L,
            1,
            4,
        ),
        _row(
            "R02-contact",
            "the force at a start in contact is none that an object on the path can give",
            Mode.STOP,
            _L,
            1,
            4,
        ),
        _row("R03", "the force sensor's bias leaves too little range", Mode.STOP, _L, 1, 4),
        _row("R04", "the arm is not at the rig's held pose, for which its frames are given", Mode.STOP, _L, 1, 4),
        _row("R05", "the base was not at rest for the tare: its odometry showed motion for 5 s", Mode.STOP, _L, 1, 4),
        _row("R06", "this push does not fit into the rig's workspace from where the base stands", Mode.STOP, _L, 1, 2),
        _row("R07", "the first pose is not a place in a room", Mode.STOP, _L, 1, 4),
        _row("F01-slow", "no force packet for 50 ms", Mode.SLOW, _A, 5),
        _row("F01-hold", "no force packet for 80 ms", Mode.HOLD, _A, 8),
        _row("F01-stop", "no force packet for 160 ms", Mode.STOP, _L, 16),
        _row("F02", "the force sensor's link is gone", Mode.STOP, _L, 2),
        _row("F04", "one in four packets of the force sensor arrives damaged", Mode.STOP, _L, 20),
        _row("F06", "an axis of the force sensor repeats the same reading while the base moves", Mode.STOP, _L, 30),
        _row("F07", "a force or torque axis is at the end of the sensor's range", Mode.STOP, _L, 1),
        _row("F08", "a single force reading was far from those before and after it: not used by the law", _WARN, _A, 0),
        _row("F09", "the force sensor does not read zero after the run", _WARN, _A, 0),
        _row("F09-before", "the force sensor did not read zero just before the first contact", _WARN, _A, 0),
        _row("F10", "the force is not a finite number", Mode.STOP, _L, 1),
        _row(
            "F11",
            "the force does not point along the push: the sensor's sign, axes or frame are wrong",
            Mode.STOP,
            _L,
            20,
        ),
        _row("F12-low", "the force sensor sends too few packets", _WARN, _A, 0),
        _row("F12-hold", "the force sensor sends far too few packets", Mode.HOLD, _A, 100),
        _row("F15", "the force sensor's bias jumped: it was zeroed, or its payload was changed", Mode.STOP, _L, 1),
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
        _row("F32-slow", "the bridge lags: odometry arrives later than when the run began", Mode.SLOW, _A, 6),
        _row("F32-stop", "the bridge lags by more than a tenth of a second", Mode.STOP, _L, 12),
        _row("F33", "the base ignores the command", Mode.STOP, _L, 30),
        _row("F34", "the base moves although it was told to stop", Mode.DEAD, _L, 34),
        _row("F35", "the base is faster than the envelope", Mode.STOP, _L, 3),
        _row("F36", "the commanded velocity was beyond the envelope and was clamped", _WARN, _A, 0),
        _row("F33-way", "odometry does not go the way that is sent to the base", Mode.STOP, _L, 300),
        _row("F37", "pose and odometry disagree on how the base moves", Mode.STOP, _L, 300),
        _row("F38", "the base is stopped by its emergency stop or its motors are off", Mode.STOP, _L, 2),
        _row("F38-late", "the base no longer reports its emergency stop and motors", _WARN, _A, 0),
        _row("F39", "the base did not come to rest within 5 s: its odometry still shows motion", Mode.STOP, _L, 1),
        _row("F40-slow", "the base pose is late", Mode.SLOW, _A, 5),
        _row("F40-stop", "the base pose is lost", Mode.STOP, _L, 12),
        _row("F41", "the base pose jumps", Mode.STOP, _L, 3),
        _row("F42", "the base pose is not a valid number", Mode.STOP, _L, 1),
        _row("F43", "the pose stands still while odometry moves", Mode.STOP, _L, 150),
        _row("F44", "the base has turned away from its heading", Mode.STOP, _L, 1),
        _row("F45-approach", "the search for contact has travelled further than it can need", Mode.STOP, _L, 1),
        _row("F45-push", "the push has travelled further than it can need", Mode.STOP, _L, 1),
        _row("F45-retreat", "the retreat has travelled further than it can need", Mode.STOP, _L, 1),
        _row("F46-approach", "the search for contact takes longer than it can need", Mode.STOP, _L, 1),
        _row("F46-push", "the push takes longer than it can need", Mode.STOP, _L, 1),
        _row("F46-retreat", "the retreat takes longer than it can need", Mode.STOP, _L, 1),
        _row("F47", "the base has travelled further than this push can need", Mode.STOP, _L, 1),
        _row("F48", "the base has moved for longer than this push can need", Mode.STOP, _L, 1),
        _row("F49", "the base's odometry is not a number", Mode.STOP, _L, 3),
        _row("F50-slow", "the force is above the slow limit", Mode.SLOW, _A, 1),
        _row("F50-stop", "the force is above the limit", Mode.STOP, _L, 1),
        _row("F51", "the torque is above the limit", Mode.STOP, _L, 1),
        _row("F52", "the contact force is lost: turning back", _WARN, _A, 0, 6),
        _row("F52-hold", "the contact force stays lost", Mode.HOLD, _A, 1, 6),
        _row(
            "F52-refused", "a further resume was refused: look for the cause and start a new push", Mode.HOLD, _A, 1, 6
        ),
        _row("F53", "no contact within 0.5 m of where it was expected", Mode.HOLD, _A, 1, 6),
        _row("F53-early", "contact came long before it was expected", _WARN, _A, 0),
        _row("F54-stop", "the object is stuck: a large force moves nothing", Mode.STOP, _L, 100),
        _row("F54-hold", "the force has been much too high for 10 s in all", Mode.HOLD, _L, 1),
        _row("F55-slow", "the base or the object comes near the edge of the workspace", Mode.SLOW, _A, 1),
        _row("F55-stop", "the base or the object is about to leave the workspace", Mode.STOP, _L, 1),
        _row("F56", "the law pushes backward (beyond 90 degrees)", Mode.STOP, _L, 20),
        _row("F57", "the law failed: it raised an exception, or what it returned cannot be used", Mode.STOP, _L, 1),
        _row("F57-slow", "a step of the law took too long", Mode.STOP, _L, 1),
        _row("F58", "the law returned a direction that is not a number", Mode.STOP, _L, 1),
        _row("F59", "the base does not move in the direction that was asked for", Mode.STOP, _L, 100),
        _row("F60-late", "ticks of the loop were skipped", _WARN, _A, 0),
        _row("F60-slow", "the loop overran by 30 ms, or in three ticks in a row", Mode.SLOW, _A, 3),
        _row("F61", "this machine was suspended, or its clock stood still", Mode.STOP, _L, 1),
        _row(
            "F63", "the log is not complete: its recorder is gone or frozen, or the disk too slow", Mode.HOLD, _L, 100
        ),
        _row("F64", "the operator asked for a stop", Mode.STOP, _L, 1, 130),
        _row("F65", "control died while the base was moving", Mode.STOP, _L, 5),
        _row("F66", "control was silent for 50 ms", Mode.STOP, _L, 5),
        _row("F67", "the gate is gone or has latched", Mode.STOP, _L, 1),
        _row("F67-late", "no record from the gate for 100 ms", Mode.STOP, _L, 10),
        _row("F68", "an exception in the loop", Mode.STOP, _L, 0, 1),
        _row("F69", "the arm's process is gone", Mode.STOP, _L, 1),
        _row("F73-hold", "the launcher, which has the operator's keys, was silent for 0.5 s", Mode.HOLD, _A, 50),
        _row("F73-stop", "the launcher, which has the operator's keys, was silent for 2 s", Mode.STOP, _L, 200),
    )
)


def limit_of(fault: Fault, settings: SafetySettings) -> float | None:
    """Return the limit of a row in its unit, None where it has none or it depends on the moment."""
    if not isinstance(fault.limit, str):
        return fault.limit
    value: Any = settings
    for name in fault.limit.split("."):
        value = getattr(value, name)
    return float(value)


def strongest(ids: tuple[str, ...]) -> Mode:
    """Return the strongest reaction among active faults, SILENT (no reaction) when there is none."""
    return max([FAULTS[i].mode for i in ids]) if ids else Mode.SILENT
