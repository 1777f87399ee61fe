"""How far the base still goes after something has gone wrong, at most: pure, from speed, bounds and the base's limits.

Three spans at full speed, one after the other, and the braking: until the fault is acted upon (its row's bound), until
zero is at the base, until the base's next control tick. Where no zero can come, the base's own timeout counts instead.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import msgspec

from robot_io.rig.config import RigConfig
from robot_io.tick import Mode

if TYPE_CHECKING:
    from safety.faults import Fault

TICK_S = 0.01
"""In which the bounds of the fault table are given."""
WIRE_S = 0.02
"""What the way to the base may add to a bound."""
BASE_TICK_S = 0.04
"""The Ridgeback's wheel controller acts at 25 Hz."""
BASE_TIMEOUT_S = 0.25
"""It stops by itself this long after the last command."""
BASE_DECELERATION_M_PER_S2 = 2.5
"""The limit in its controller; the steps that it takes each tick are shorter than the straight line."""
ALONE_S = TICK_S + BASE_TIMEOUT_S + BASE_TICK_S
"""The last command may be a tick old when this computer dies."""
NOT_OF_MOTION = ("R", "F34", "F39", "F54")
"""Nothing moves yet, the base does not do what it is told, or it is stuck: no distance follows from a bound."""


class Stopping(msgspec.Struct, frozen=True):
    """Distances to rest at `speed_m_per_s`, in m."""

    speed_m_per_s: float
    stop_m: float
    """After a stop by the operator, or by a fault that is acted upon in its first tick."""
    alone_m: float
    """When this computer, its gate or the link is gone."""
    slowest_m: float
    """After the fault that takes the longest to be sure of."""
    slowest_row: str


def distance_m(speed_m_per_s: float, reaction_s: float, deceleration: float = BASE_DECELERATION_M_PER_S2) -> float:
    """Return the way (m) at full speed for `reaction_s`, and then braking at `deceleration` (m/s^2) to rest."""
    return speed_m_per_s * reaction_s + speed_m_per_s * speed_m_per_s / (2.0 * deceleration)


def alone_m(speed_m_per_s: float) -> float:
    """Return the way to rest (m) when nothing is sent to the base any more."""
    return distance_m(speed_m_per_s, ALONE_S)


def of_row(fault: Fault, speed_m_per_s: float, max_acceleration: float) -> float | None:
    """Return the way to rest (m) from the first tick at which the fault can be seen; None for rows without one.

    max_acceleration: at which a HOLD ramps to zero, m/s^2. The base's timeout counts where it is later than the bound.
    """
    if fault.mode < Mode.HOLD or fault.id.startswith(NOT_OF_MOTION):
        return None
    reaction_s = fault.bound_ticks * TICK_S + WIRE_S + BASE_TICK_S
    if fault.mode == Mode.HOLD:
        return distance_m(speed_m_per_s, reaction_s, min(max_acceleration, BASE_DECELERATION_M_PER_S2))
    return distance_m(speed_m_per_s, max(reaction_s, ALONE_S) if fault.id in _NO_ZERO else reaction_s)


_NO_ZERO = ("F30", "F31-stop", "F67", "F67-late")
"""Rows of a link or gate through which no zero may come any more."""


def stopping(rig: RigConfig, faults: Iterable[Fault]) -> Stopping:
    """Return the distances of a rig's run at the fastest speed that it pushes or approaches with."""
    speed = max(rig.control.push_speed_m_per_s, rig.control.approach_speed_m_per_s)
    rows = {fault.id: of_row(fault, speed, rig.limits.max_acceleration_m_per_s2) or 0.0 for fault in faults}
    for row in rows:
        held = f"{row.split('-')[0]}-hold"
        if row.endswith("-stop") and held in rows and row not in _NO_ZERO:
            rows[row] = min(rows[row], rows[held])  # the base has been held before it is stopped
    slowest = max(rows, key=lambda i: rows[i])
    stop_m = distance_m(speed, TICK_S + WIRE_S + BASE_TICK_S)
    return Stopping(speed, stop_m, alone_m(speed), rows[slowest], slowest)
