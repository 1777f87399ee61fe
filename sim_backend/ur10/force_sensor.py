"""The force sensor at the flange of an emulated e-Series arm: what it reads, and what the controller makes of it.

Readings are forces on the tool, as the world gives them: in the flange's axes, with bias, tool weight and noise. The
controller turns them into the axes of the arm's base, at the flange, and takes the payload's weight and the last
zeroing off. Source: RTDE guide (`ft_raw_wrench`, `actual_TCP_force`), script manual (`zero_ftsensor`).
"""

from __future__ import annotations

from robot_io.messages import Joints, Vector3
from robot_io.rig.types import Matrix3
from sim_backend.world.arm_geometry import flange
from sim_backend.world.plant import FtSource

GRAVITY_M_PER_S2 = 9.82
"""As the controller has it by default."""


class ForceSensor:
    """One sensor, or none. Wrenches are fx, fy, fz (N) and mx, my, mz (N*m)."""

    def __init__(self, source: FtSource | None) -> None:
        self.source = source
        self.jump: Joints = (0.0,) * 6
        """Added to every reading, for fault injection."""
        self.broken = False
        """Reads NaN, for fault injection."""
        self._zero: Joints = (0.0,) * 6
        self._read_ns = -1
        self._reading: Joints = (0.0,) * 6

    @property
    def fitted(self) -> bool:
        """Return whether there is a sensor."""
        return self.source is not None

    def raw(self, now_ns: int) -> Joints:
        """Return the reading of the control cycle at `now_ns`, in the flange's axes."""
        if self.source is not None and now_ns != self._read_ns:
            self._read_ns = now_ns
            self._reading = self.source.read_ft(now_ns)
        if self.broken:
            return (float("nan"),) * 6
        return _sum(self._reading, self.jump)

    def compensated(self, now_ns: int, q: Joints, payload_kg: float, cog_m: Vector3) -> Joints:
        """Return the wrench in the axes of the arm's base, without payload and zero. Joints in rad."""
        wrench = self._without_payload(now_ns, q, payload_kg, cog_m)
        return _sum(wrench, _negative(self._zero))

    def zero(self, now_ns: int, q: Joints, payload_kg: float, cog_m: Vector3) -> None:
        """Take what is measured now for zero."""
        self._zero = self._without_payload(now_ns, q, payload_kg, cog_m)

    def _without_payload(self, now_ns: int, q: Joints, payload_kg: float, cog_m: Vector3) -> Joints:
        rotation, _ = flange(q)
        reading = self.raw(now_ns)
        force, torque = _turned(rotation, reading[:3]), _turned(rotation, reading[3:])
        weight = payload_kg * GRAVITY_M_PER_S2
        x, y, _z = _turned(rotation, cog_m)
        # The weight pulls the tool down: (0, 0, -weight) at (x, y, z) has the moment (-y weight, x weight, 0).
        return (*force[:2], force[2] + weight, torque[0] + y * weight, torque[1] - x * weight, torque[2])


def _turned(r: Matrix3, v: Vector3) -> Vector3:
    (a, b, c), (d, e, f), (g, h, i) = r
    x, y, z = v
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def _sum(left: Joints, right: Joints) -> Joints:
    a, b, c, d, e, f = (p + q for p, q in zip(left, right, strict=True))
    return (a, b, c, d, e, f)


def _negative(wrench: Joints) -> Joints:
    a, b, c, d, e, f = (-value for value in wrench)
    return (a, b, c, d, e, f)
