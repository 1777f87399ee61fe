"""Model of an FT 300 between arm and ball: the reaction on the tool, its moment, the tool's weight, sensor errors.

Derived from the geometry, independently of the driver: Newton's third law gives the force on the tool, the
lever arm from the sensor's origin to the contact gives the moment, gravity gives the tool's weight.
"""

from __future__ import annotations

import math
import random

from robot_io.messages import Vector3
from robot_io.rig.config import RigConfig
from robot_io.rig.types import Matrix3
from sim_backend.world.truth import true_frames

GRAVITY_M_PER_S2 = 9.81

Wrench6 = tuple[float, float, float, float, float, float]


class SensorModel:
    """An FT 300 mounted on the rig: forces in, readings in the SENSOR frame out (N, N*m)."""

    def __init__(self, rig: RigConfig, seed: int) -> None:
        self._config = sensor = rig.world.sensor
        frames = true_frames(rig)
        self._origin = frames.sensor_in_base_m
        self._contact_height_m = frames.contact_in_base_m[2]
        self.turn_to(frames.base_from_sensor)
        x, y, z = frames.contact_in_base_m
        # The ball is on the tool: seen from the sensor it stays where it is, whatever the arm does.
        self._ball = self._in_sensor((x - self._origin[0], y - self._origin[1], z - self._origin[2]))
        self._noise_force, self._noise_torque = sensor.noise_force_N, sensor.noise_torque_Nm
        self._gauss = random.Random(f"ft-{seed}").gauss

    def turn_to(self, base_from_sensor: Matrix3) -> None:
        """Be held turned like this (rows): the tool weighs along other axes of the sensor."""
        # The columns of base_from_sensor are the sensor's axes, seen from the base.
        rows = base_from_sensor
        self._axes = tuple((rows[0][i], rows[1][i], rows[2][i]) for i in range(3))
        weight = self._in_sensor((0.0, 0.0, -self._config.tool_mass_kg * GRAVITY_M_PER_S2))
        torque = _cross(self._config.tool_com_in_sensor_m, weight)
        self._offset: Wrench6 = _sum6((*weight, *torque), self._config.bias)

    def true_reading(
        self, force_on_slider_world: tuple[float, float], contact_in_base: tuple[float, float], yaw: float
    ) -> Wrench6:
        """Return the reading without noise.

        force_on_slider_world: N. contact_in_base: where the force acts, m, BODY frame. yaw: heading of the base.
        """
        fx, fy = force_on_slider_world
        if fx == 0.0 and fy == 0.0:
            return self._offset
        cos, sin = math.cos(yaw), math.sin(yaw)
        reaction = (-(cos * fx + sin * fy), -(cos * fy - sin * fx), 0.0)
        lever = (
            contact_in_base[0] - self._origin[0],
            contact_in_base[1] - self._origin[1],
            self._contact_height_m - self._origin[2],
        )
        force = self._in_sensor(reaction)
        moment = self._in_sensor(_cross(lever, reaction))
        return _sum6((*force, *moment), self._offset)

    def with_hand(self, reading: Wrench6, force_body: Vector3) -> Wrench6:
        """Return a reading with a force on the ball besides (N, BODY frame): it acts on the tool, as it is."""
        if not any(force_body):
            return reading
        force = self._in_sensor(force_body)
        return _sum6(reading, (*force, *_cross(self._ball, force)))

    def with_noise(self, reading: Wrench6) -> Wrench6:
        """Return the reading with fresh noise on each axis."""
        g, f, m = self._gauss, self._noise_force, self._noise_torque
        a, b, c, d, e, h = reading
        return (
            a + g(0.0, f),
            b + g(0.0, f),
            c + g(0.0, f),
            d + g(0.0, m),
            e + g(0.0, m),
            h + g(0.0, m),
        )

    def _in_sensor(self, vector_in_base: Vector3) -> Vector3:
        x, y, z = vector_in_base
        a, b, c = self._axes
        return (
            a[0] * x + a[1] * y + a[2] * z,
            b[0] * x + b[1] * y + b[2] * z,
            c[0] * x + c[1] * y + c[2] * z,
        )


def _cross(a: Vector3, b: Vector3) -> Vector3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _sum6(a: Wrench6, b: Wrench6) -> Wrench6:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])
