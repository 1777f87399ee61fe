"""The torque on the object, derived from ticks as control computes the force: median of three, bias, rotation, filter.

It is about the origin of the sensor, with the axes of the WORLD frame.
"""

from __future__ import annotations

import math

from control.sensing import MAX_DT_S, VALID_FOR_NS
from control.wrench import force_on_slider_world, low_pass, median_of_three
from robot_io.messages import Vector3
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlState, ControlTick

_ZERO: Vector3 = (0.0, 0.0, 0.0)


class TorqueOf:
    """Filters the torque (N*m) of ticks given in order; zero until the sensor is tared."""

    def __init__(self, rig: RigConfig) -> None:
        self._base_from_sensor = rig.frames.base_from_sensor
        self._tau_s = rig.control.force_filter_tau_s
        self._known: ControlState | None = None
        self._newest: list[Vector3] = []
        """At most the last two readings, oldest first."""
        self._torque = _ZERO
        self._last_ns = 0
        self._valid = False

    def of(self, tick: ControlTick) -> Vector3:
        """Return the torque after a tick."""
        before = tick.before[0].control if tick.before else self._known
        self._known = tick.after.control
        readings, now_ns = tick.input.ft.readings, tick.input.now_ns
        if before is None or not before.tared:
            self._last_ns = readings[-1].received_ns if readings else self._last_ns
            return self._torque
        if not self._valid:
            self._newest = []
        for reading in readings:
            older = self._newest or [reading.torque]
            calm = median_of_three(older[0], older[-1], reading.torque)
            self._newest = [*older[-1:], reading.torque] if self._newest else [reading.torque]
            yaw = tick.input.base.pose.yaw
            yaw = yaw if math.isfinite(yaw) else math.nan  # which has a cosine
            sample = force_on_slider_world(calm, before.bias_torque, self._base_from_sensor, yaw)
            dt_s = min(max((reading.received_ns - self._last_ns) * 1e-9, 0.0), MAX_DT_S)
            self._torque = low_pass(self._torque, sample, dt_s, self._tau_s) if self._valid else sample
            self._valid, self._last_ns = True, reading.received_ns
        self._valid = now_ns - self._last_ns <= VALID_FOR_NS and all(map(math.isfinite, self._torque))
        return self._torque
