"""RTDE packets of a UR's own force sensor to readings in the SENSOR frame, which is the flange's. Pure.

`ft_raw_wrench` is in the flange's axes. `actual_TCP_force` is at the flange, too, but in the axes of the arm's base, so
it is turned by the joints of the same packet. Both are what acts on the tool, as with an FT 300.
Sources: RTDE guide e-Series (outputs, packets), UR's kinematics (the same angles alpha for every model), the UR
ROS 2 driver's transformation of `actual_TCP_force`, which its maker checked on a UR3e.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from typing import NamedTuple

from robot_io.messages import SensorWrench, Vector3, Vector6

HEADER = struct.Struct(">HB")
MOST_BYTES = 4096
"""A frame that says it is longer is none of RTDE's answers to this recipe."""
RAW, FORCE = "ft_raw_wrench", "actual_TCP_force"
WITH_RAW = f"timestamp,actual_q,{FORCE},{RAW}"
WITHOUT_RAW = f"timestamp,actual_q,{FORCE}"
TYPES_WITH_RAW = "DOUBLE,VECTOR6D,VECTOR6D,VECTOR6D"
TYPES_WITHOUT_RAW = "DOUBLE,VECTOR6D,VECTOR6D"
_SIN_ALPHA = (1.0, 0.0, 0.0, 1.0, -1.0, 0.0)
_COS_ALPHA = (0.0, 1.0, 1.0, 0.0, 0.0, 1.0)

JUMP_N, JUMP_Nm = 3.0, 0.3
"""What raw and compensated readings differ by is weight and zeroing: constant while the arm is held."""
JUMP_PACKETS = 50
"""A tenth of a second: the controller may filter one of them, and for a moment they then differ in any motion."""
ZERO_N, ZERO_Nm = 1.0, 0.1
_AROUND = 5


class Packet(NamedTuple):
    """One packet: the controller's clock in s, and wrenches in the SENSOR frame (N, N*m)."""

    controller_s: float
    raw: Vector6 | None
    force: Vector6
    """The same by `actual_TCP_force`: without the payload's weight, and zeroed."""

    @property
    def wrench(self) -> SensorWrench:
        """Return the reading: raw where the controller gives it."""
        return SensorWrench(*(self.force if self.raw is None else self.raw))


class PacketParser:
    """Takes bytes as they come; ValueError once they cannot be RTDE."""

    def __init__(self, with_raw: bool) -> None:
        self._layout = struct.Struct(">d6d6d6d" if with_raw else ">d6d6d")
        self._with_raw = with_raw
        self._pending = b""

    def feed(self, data: bytes) -> list[Packet]:
        """Return the packets that are now complete, oldest first. Raises ValueError."""
        self._pending += data
        found = []
        while len(self._pending) >= HEADER.size:
            length, kind = HEADER.unpack_from(self._pending)
            if not HEADER.size <= length <= MOST_BYTES or chr(kind) not in "UM":
                raise ValueError(f"bytes {self._pending[:8].hex()} where an RTDE packet was due")
            if len(self._pending) < length:
                break
            body, self._pending = self._pending[HEADER.size : length], self._pending[length:]
            if chr(kind) == "U":
                found.append(self._packet(body))
        return found

    def _packet(self, body: bytes) -> Packet:
        if len(body) != 1 + self._layout.size:
            raise ValueError(f"a packet of {len(body)} bytes instead of {1 + self._layout.size}")
        values = self._layout.unpack_from(body, 1)
        force = in_flange(values[1:7], values[7:13])
        return Packet(values[0], values[13:19] if self._with_raw else None, force)


class BiasWatch:
    """Counts jumps of the bias: the sensor was zeroed, its payload was changed, or it reads differently.

    With the raw wrench: what raw and compensated readings differ by. Without it, only a zeroing can be told from a
    force: all six axes read nothing from one packet to the next.
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._reference: Vector6 | None = None
        self._off = 0
        self._newest: deque[Vector6] = deque(maxlen=2 * _AROUND)

    def take(self, packet: Packet) -> None:
        """Look at the next packet."""
        if packet.raw is None:
            self._take_zeroed(packet.force)
            return
        between = _minus(packet.raw, packet.force)
        if not all(map(math.isfinite, between)):  # F10 is for safety to say
            return
        if self._reference is None:
            self._reference = between
        self._off = self._off + 1 if _beyond(_minus(between, self._reference), JUMP_N, JUMP_Nm) else 0
        if self._off == JUMP_PACKETS:
            self.jumps += 1
            self._off, self._reference = 0, between

    def _take_zeroed(self, force: Vector6) -> None:
        newest = self._newest
        newest.append(force)
        if len(newest) < 2 * _AROUND:
            return
        packets = tuple(newest)
        before, after = packets[:_AROUND], packets[_AROUND:]
        if all(_beyond(wrench, JUMP_N, JUMP_Nm) for wrench in before) and not any(
            _beyond(wrench, ZERO_N, ZERO_Nm) for wrench in after
        ):
            self.jumps += 1


def in_flange(q: Vector6, wrench_base: Vector6) -> Vector6:
    """Return a wrench in the flange's axes, from joints (rad) and a wrench in the axes of the arm's base."""
    fx, fy, fz = wrench_base[:3]
    mx, my, mz = wrench_base[3:]
    for angle, sin_a, cos_a in zip(q, _SIN_ALPHA, _COS_ALPHA, strict=True):
        c, s = math.cos(angle), math.sin(angle)
        fx, fy, fz = _into_next(c, s, sin_a, cos_a, (fx, fy, fz))
        mx, my, mz = _into_next(c, s, sin_a, cos_a, (mx, my, mz))
    return fx, fy, fz, mx, my, mz


def _into_next(c: float, s: float, sin_a: float, cos_a: float, v: Vector3) -> Vector3:
    """Return a vector as the next link sees it: turned back about z by the joint, then about x by alpha."""
    x, y, z = v
    x, y = c * x + s * y, c * y - s * x
    return x, cos_a * y + sin_a * z, cos_a * z - sin_a * y


def _minus(a: Vector6, b: Vector6) -> Vector6:
    p, q, r, s, t, u = (x - y for x, y in zip(a, b, strict=True))
    return p, q, r, s, t, u


def _beyond(wrench: Vector6, force_N: float, torque_Nm: float) -> bool:
    return max(map(abs, wrench[:3])) > force_N or max(map(abs, wrench[3:])) > torque_Nm
