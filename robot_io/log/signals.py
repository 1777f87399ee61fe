"""`/control/signals`: what one plots of a push, one flat message for each tick, derived from it."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec

from robot_io.cdr.cdr_type import CdrType
from robot_io.log.ros_messages import Header
from robot_io.tick import Mode, Phase

Float32 = Annotated[float, "float32"]


class Contact(IntEnum):
    """Whether the ball touches the object, as control sees it."""

    NONE = 0
    """Not found yet, or left on purpose."""
    TOUCHING = 1
    LOST = 2


FAULT_IDS: tuple[str, ...] = (
    *("R01", "R02", "R02-dead", "R02-contact", "R03", "R04", "R05", "R06", "R07"),
    *("F01-slow", "F01-hold", "F01-stop", "F02", "F04", "F06", "F07", "F08", "F09", "F09-before"),
    *("F10", "F11", "F12-low", "F12-hold", "F15", "F20-hold", "F20-stop", "F21", "F22", "F23", "F24-hold", "F24-stop"),
    *("F25-hold", "F25-stop", "F27", "F28", "F29", "F30", "F31-hold", "F31-stop", "F32-slow", "F32-stop"),
    *("F33", "F33-way", "F34", "F35", "F36", "F37", "F38", "F38-late", "F39", "F40-slow", "F40-stop", "F41", "F42"),
    *("F43", "F44", "F45-approach", "F45-push", "F45-retreat", "F46-approach", "F46-push", "F46-retreat"),
    *("F47", "F48", "F49", "F50-slow", "F50-stop", "F51", "F52", "F52-hold", "F52-refused", "F53", "F53-early"),
    *(
        "F54-stop",
        "F54-hold",
        "F55-slow",
        "F55-stop",
        "F56",
        "F57",
        "F57-slow",
        "F58",
        "F59",
        "F60-late",
        "F60-slow",
        "F61",
        "F63",
    ),
    *("F64", "F65", "F66", "F67", "F67-late", "F68", "F69", "F73-hold", "F73-stop"),
)
"""Rows of the fault table that have a name in the definition."""
_KINDS = (
    *("", "slow", "hold", "stop", "low", "late", "before", "way", "approach", "push", "retreat", "refused"),
    *("early", "dead", "contact"),
)
"""What follows the dash of an id. A new one goes to the end: numbers in logs never change."""
_START_ROWS = 50_000


def fault_code(fault_id: str) -> int:
    """Return the number of a row in `fault`: F20-stop is 2003, R02 is 50200; 65535 for one that has none."""
    row, _, kind = fault_id.partition("-")
    if kind not in _KINDS or not row[1:].isdigit() or len(row) > 4 or row[0] not in "FR":
        return 65_535
    return (_START_ROWS if row[0] == "R" else 0) + 100 * int(row[1:]) + _KINDS.index(kind)


def fault_id_of(code: int) -> str:
    """Return the row of a number, "" for 0 and for one that has no name."""
    return _BY_CODE.get(code, "")


_BY_CODE = {fault_code(one): one for one in FAULT_IDS}


class Signals(msgspec.Struct, frozen=True, gc=False):
    """One tick in plain numbers; NaN where there is nothing to say yet. "Along" and "across" are the path's frame."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/Signals"
    __ros_constants__: ClassVar[tuple[str, ...]] = (
        "uint16 FAULT_NONE=0",
        *(f"uint16 FAULT_{name.replace('-', '_').upper()}={code}" for code, name in _BY_CODE.items()),
    )
    header: Header
    """`stamp` is the log time."""
    progress_m: Float32
    """Along the path since the first contact."""
    lateral_m: Float32
    """Offset of the contact ball from the path, left positive."""
    theta_f_rad: Float32
    """Direction of the force against the path, once there was contact."""
    theta_p_rad: Float32
    """Direction in which the ball is to move, against the path."""
    force_n: Float32
    """Size of the filtered horizontal force on the object."""
    force_along_n: Float32
    force_across_n: Float32
    speed_wanted: Float32
    """m/s, by control."""
    speed_sent: Float32
    """m/s, the newest that had really gone to the base when the tick began."""
    speed_measured: Float32
    """m/s, by odometry."""
    turn_sent: Float32
    """rad/s, counter-clockwise."""
    turn_measured: Float32
    heading_error_rad: Float32
    """Measured heading minus the one that is held, once tared."""
    stop_distance_m: Float32
    """How far the base would still go if it were stopped now."""
    corridor_left_m: Float32
    """From the ball to the nearer side of the rig's `goal.corridor_m`; negative outside."""
    ft_age_ms: Float32
    """Since the newest reading of the sensor arrived."""
    pose_age_ms: Float32
    odom_age_ms: Float32
    arm_age_ms: Float32
    wake_late_us: Float32
    """How late this tick woke."""
    tick_us: Float32
    """How long the tick before it took."""
    phase: Annotated[int, "uint8", Phase]
    mode: Annotated[int, "uint8", Mode]
    contact: Annotated[int, "uint8", Contact]
    fault: Annotated[int, "uint16"]
    """The active fault with the strongest reaction, `fault_code`; 0: none."""


SIGNALS = CdrType(Signals, "push_msgs/msg/Signals")
