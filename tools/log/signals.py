"""Derive `/control/signals` from ticks."""

from __future__ import annotations

import math
from typing import Any

from robot_io.clock import NS_PER_MS
from robot_io.geometry import StraightPath, wrap_angle
from robot_io.log.ros_messages import Header
from robot_io.log.signals import Contact, Signals, fault_code
from robot_io.messages import BodyTwist
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlState, ControlTick, Phase
from safety.faults import FAULTS
from safety.stopping import BASE_TICK_S, TICK_S, WIRE_S, distance_m

_NS_PER_US = 1000
_LARGEST = 3.4e38
"""About the largest float32."""
_CONTACT: dict[int, Contact] = {
    Phase.PUSH: Contact.TOUCHING,
    Phase.REST: Contact.TOUCHING,
    Phase.LOST: Contact.LOST,
    Phase.LOST_HOLD: Contact.LOST,
}


class SignalsOf:
    """Derives the signals of ticks given in order; remembers when the sensor's newest reading arrived."""

    def __init__(self, rig: RigConfig) -> None:
        self._path = StraightPath.of(rig.path.origin_m, rig.path.direction_deg)
        self._corridor_m = rig.goal.corridor_m
        self._ft_ns = 0

    def of(self, tick: ControlTick, header: Header) -> Signals:
        """Return the signals of a tick."""
        inp, out, control = tick.input, tick.output, tick.after.control
        base, host, now_ns = inp.base, inp.host, inp.now_ns
        if inp.ft.readings:
            self._ft_ns = inp.ft.readings[-1].received_ns
        force = control.force_world
        along, across = self._path.vector_to_path(force[0], force[1])
        measured = base.odometry if base.odometry_seq else _NOTHING
        speeds = _speed(out.wanted_body), _speed(base.sent), _speed(measured)
        values = (
            control.progress_m,
            control.lateral_m,
            control.theta_f if control.contact_seen else math.nan,
            control.theta_p,
            math.hypot(force[0], force[1]),
            along,
            across,
            *speeds,
            base.sent.omega,
            measured.omega,
            _heading_error(base.pose.yaw, control),
            _stop_distance(speeds[1], speeds[2]),
            self._corridor_m - abs(control.lateral_m),
            _age_ms(now_ns, self._ft_ns),
            _age_ms(now_ns, base.pose_received_ns),
            _age_ms(now_ns, base.odometry_received_ns),
            _age_ms(now_ns, inp.arm.changed_ns),
            host.late_ns / _NS_PER_US,
            host.last_tick_ns / _NS_PER_US,
        )
        phase = control.phase
        contact = _CONTACT.get(phase, Contact.NONE)
        # A NaN is no sum either: then each is looked at.
        numbers = values if sum(map(abs, values)) < _LARGEST else tuple(map(_float32, values))
        fields: tuple[Any, ...] = (header, *numbers, phase, out.mode, int(contact), strongest(out.faults))
        return Signals(*fields)


_NOTHING = BodyTwist(math.nan, math.nan, math.nan)


def strongest(faults: tuple[str, ...]) -> int:
    """Return the code of the fault with the strongest reaction, the first of several; 0 without any."""
    if not faults:
        return 0
    return fault_code(max(faults, key=lambda one: FAULTS[one].mode if one in FAULTS else 0))


def _speed(twist: BodyTwist) -> float:
    return math.hypot(twist.vx, twist.vy)


def _heading_error(yaw: float, control: ControlState) -> float:
    turned = yaw - control.held_yaw
    return wrap_angle(turned) if control.tared and math.isfinite(turned) else math.nan


def _stop_distance(sent: float, measured: float) -> float:
    speed = sent if math.isnan(measured) else max(sent, measured)
    return distance_m(speed, TICK_S + WIRE_S + BASE_TICK_S)


def _age_ms(now_ns: int, arrived_ns: int) -> float:
    return (now_ns - arrived_ns) / NS_PER_MS if arrived_ns else math.nan


def _float32(value: float) -> float:
    """Return the number, or infinity where a float32 cannot hold it."""
    return value if abs(value) <= _LARGEST or math.isnan(value) else math.copysign(math.inf, value)
