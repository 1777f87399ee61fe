"""The force on the contact ball in the SENSOR, BODY and PATH frames, and its direction in words and as an arrow. Pure.

It is the force that hand or object exerts on the ball, so its arrow points where one presses. The law uses the opposite
force, that of the ball on the object.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec

from control.wrench import force_on_slider_world
from robot_io.geometry import StraightPath
from robot_io.messages import Vector3
from robot_io.rig.types import Matrix3

LEAST_N = 1.5
"""A smaller force has no direction: noise and tare alone give a few tenths of a newton."""


class BallForce(msgspec.Struct, frozen=True):
    """Force on the ball in N: SENSOR frame, BODY frame, and PATH frame where the heading of the base is known."""

    sensor: Vector3
    body: Vector3
    path: Vector3 | None
    theta_f_rad: float | None
    """Direction of the opposite force, that on the object, in the PATH frame; None below LEAST_N."""


class Direction(NamedTuple):
    """Where a force points, seen from above: in words, as axes of BODY, and as an arrow with forward at the top."""

    words: str
    axes: str
    arrow: str
    ascii_arrow: str


_AROUND = (
    Direction("FORWARD", "+x", "↑", "^"),
    Direction("FORWARD-LEFT", "+x +y", "↖", "\\"),
    Direction("LEFT", "+y", "←", "<"),
    Direction("BACKWARD-LEFT", "-x +y", "↙", "/"),
    Direction("BACKWARD", "-x", "↓", "v"),
    Direction("BACKWARD-RIGHT", "-x -y", "↘", "\\"),
    Direction("RIGHT", "-y", "→", ">"),
    Direction("FORWARD-RIGHT", "+x -y", "↗", "/"),
)
_UP, _DOWN = Direction("UP", "+z", "⊙", "o"), Direction("DOWN", "-z", "⊗", "x")
_NONE = Direction("no force", "", "·", ".")
_UNKNOWN = Direction("NOT A NUMBER", "", "?", "?")


def ball_force(
    reading: Vector3, bias: Vector3, base_from_sensor: Matrix3, yaw: float | None, path: StraightPath
) -> BallForce:
    """Return the force on the ball.

    reading, bias: N, SENSOR frame. base_from_sensor: rotation, rows. yaw: heading of the base (rad), None if unknown.
    """
    sensor = (reading[0] - bias[0], reading[1] - bias[1], reading[2] - bias[2])
    body = _opposite(force_on_slider_world(reading, bias, base_from_sensor, 0.0))
    if yaw is None:
        return BallForce(sensor, body, None, None)
    x, y, z = force_on_slider_world(reading, bias, base_from_sensor, yaw)
    along, across = path.vector_to_path(x, y)
    theta_f = math.atan2(across, along) if math.hypot(along, across) >= LEAST_N else None
    return BallForce(sensor, body, (-along, -across, -z), theta_f)


def direction(body: Vector3) -> Direction:
    """Return where a force (N, BODY frame) points: one of eight directions on the floor, up, down, or none."""
    if not all(map(math.isfinite, body)):
        return _UNKNOWN
    level = math.hypot(body[0], body[1])
    if math.hypot(level, body[2]) < LEAST_N:
        return _NONE
    if abs(body[2]) > level:
        return _UP if body[2] > 0.0 else _DOWN
    return _AROUND[round(math.atan2(body[1], body[0]) / (math.pi / 4)) % 8]


def drawing(body: Vector3, *, rows: int = 7, unicode: bool = True) -> list[str]:
    """Return lines that show the force (N, BODY frame) from above, forward at the top, the ball in the middle.

    rows: odd; a line is twice as many characters wide, since characters are twice as high as wide.
    """
    half = rows // 2
    grid = [[" "] * (4 * half + 1) for _ in range(rows)]
    towards = direction(body)
    level = math.hypot(body[0], body[1])
    if towards in _AROUND:
        ahead, left = body[0] / level, body[1] / level
        for step in range(1, half + 1):
            row, column = half - round(step * ahead), 2 * half - round(2 * step * left)
            end = towards.arrow if unicode else towards.ascii_arrow
            grid[row][column] = end if step == half else "*"
        grid[half][2 * half] = "o"
    else:
        grid[half][2 * half] = towards.arrow if unicode else towards.ascii_arrow
    return ["".join(line) for line in grid]


def mean(vectors: list[Vector3]) -> Vector3:
    """Return the mean of at least one force or torque, axis by axis."""
    n = len(vectors)
    return sum(v[0] for v in vectors) / n, sum(v[1] for v in vectors) / n, sum(v[2] for v in vectors) / n


def _opposite(force: Vector3) -> Vector3:
    return -force[0], -force[1], -force[2]
