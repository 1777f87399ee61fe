"""Kinematics of a UR arm both ways, in closed form, by the published Denavit-Hartenberg parameters.

The inverse goes from the wrist's centre: it fixes joint 1 (two ways), the flange's offset from it joint 5 (two ways),
then the flange's turn joint 6, and what is left is a planar arm of two links (two ways): at most eight answers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from robot_io.messages import Joints, Vector3
from robot_io.rig.types import Matrix3
from sim_backend.ur10.models import ALPHA_RAD, UrModel
from sim_backend.ur10.motion.limits import within_positions
from sim_backend.ur10.motion.transforms import Frame, Pose6, chained, frame_of, inverse, pose_of
from sim_backend.world.arm_geometry import flange

NO_OFFSET: Pose6 = (0.0,) * 6
_TURN = 2.0 * math.pi
_SINGULAR = 1e-9


def tool_pose(q: Joints, model: UrModel, tcp: Pose6 = NO_OFFSET) -> Pose6:
    """Return the pose of the tool's centre point in the arm's base frame, from joints (rad) and its offset."""
    return pose_of(chained(flange(q, model.d_m, model.a_m), frame_of(tcp)))


def tool_speed(q: Joints, qd: Joints, model: UrModel, tcp: Pose6 = NO_OFFSET) -> Pose6:
    """Return the tool's speed: m/s, and rad/s about the base frame's axes. By difference over a hundredth of a ms."""
    h = 1e-5
    ahead = _frame(_sum(q, qd, h / 2), model, tcp)
    behind = _frame(_sum(q, qd, -h / 2), model, tcp)
    turn, _ = chained((ahead[0], (0.0, 0.0, 0.0)), inverse((behind[0], (0.0, 0.0, 0.0))))
    *_, rx, ry, rz = pose_of((turn, (0.0, 0.0, 0.0)))
    x, y, z = ((a - b) / h for a, b in zip(ahead[1], behind[1], strict=True))
    return (x, y, z, rx / h, ry / h, rz / h)


def joints_at(pose: Pose6, near: Joints, model: UrModel, tcp: Pose6 = NO_OFFSET) -> Joints | None:
    """Return the joints (rad) nearest to `near` that bring the tool to `pose`, or None where the arm cannot."""
    if not all(map(math.isfinite, pose)):
        return None
    best: Joints | None = None
    least = math.inf
    target = chained(frame_of(pose), inverse(frame_of(tcp)))
    for known in _outer_joints(target, near, model):
        if _apart(known, (near[0], near[4], near[5])) >= least:
            continue
        for q2, q3, q4 in _planar(target, known, model):
            inner = [_nearest(angle, at) for angle, at in zip((q2, q3, q4), near[1:4], strict=True)]
            q: Joints = (known[0], inner[0], inner[1], inner[2], known[1], known[2])
            if (far := _apart(q, near)) < least and within_positions(q, model):
                best, least = q, far
    return best


def _frame(q: Joints, model: UrModel, tcp: Pose6) -> Frame:
    return chained(flange(q, model.d_m, model.a_m), frame_of(tcp))


def _sum(q: Joints, qd: Joints, t_s: float) -> Joints:
    a, b, c, d, e, f = (x + v * t_s for x, v in zip(q, qd, strict=True))
    return (a, b, c, d, e, f)


def _outer_joints(target: Frame, near: Joints, model: UrModel) -> list[Vector3]:
    """Return what joints 1, 5 and 6 can be, each near to where it is, the nearest first."""
    rotation, place = target
    d4, d6 = model.d_m[3], model.d_m[5]
    wx, wy = place[0] - d6 * rotation[0][2], place[1] - d6 * rotation[1][2]
    away = math.hypot(wx, wy)
    if away < abs(d4):
        return []
    half = math.asin(d4 / away)
    heading = math.atan2(wy, wx)
    found: list[Vector3] = []
    for q1 in (heading + half, heading + math.pi - half):
        z1 = (math.sin(q1), -math.cos(q1), 0.0)  # the axis of joints 2, 3 and 4
        cosine = (_dot(place, z1) - d4) / d6
        if abs(cosine) > 1.0 + 1e-9:
            continue
        for q5 in _both_ways(cosine):
            q6 = _wrist_turn(rotation, z1, q5, near[5])
            found.append((_nearest(q1, near[0]), _nearest(q5, near[4]), _nearest(q6, near[5])))
    return sorted(found, key=lambda known: _apart(known, (near[0], near[4], near[5])))


def _both_ways(cosine: float) -> tuple[float, float]:
    angle = math.acos(max(-1.0, min(1.0, cosine)))
    return angle, -angle


def _wrist_turn(rotation: Matrix3, z1: Vector3, q5: float, near: float) -> float:
    """Return joint 6; where its axis is that of joints 2 to 4 any would do, and it stays as it is."""
    sine = math.sin(q5)
    if abs(sine) < _SINGULAR:
        return near
    along_x = rotation[0][0] * z1[0] + rotation[1][0] * z1[1]
    along_y = rotation[0][1] * z1[0] + rotation[1][1] * z1[1]
    return math.atan2(-along_y / sine, along_x / sine)


def _planar(target: Frame, known: Vector3, model: UrModel) -> Iterator[Vector3]:
    """Yield joints 2, 3 and 4 of the arm between joint 1 and the wrist."""
    q1, q5, q6 = known
    d, a2, a3 = model.d_m, model.a_m[1], model.a_m[2]
    wrist = chained(_link(q5, d[4], ALPHA_RAD[4]), _link(q6, d[5], ALPHA_RAD[5]))
    rotation, place = chained(chained(inverse(_link(q1, d[0], ALPHA_RAD[0])), target), inverse(wrist))
    x, y = place[0], place[1]
    cosine = (x * x + y * y - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
    if abs(cosine) > 1.0 + 1e-9:
        return
    for q3 in _both_ways(cosine):
        q2 = math.atan2(y, x) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
        yield q2, q3, math.atan2(rotation[1][0], rotation[0][0]) - q2 - q3


def _link(q: float, d_m: float, alpha: float) -> Frame:
    c, s, ca, sa = math.cos(q), math.sin(q), math.cos(alpha), math.sin(alpha)
    return ((c, -s * ca, s * sa), (s, c * ca, -c * sa), (0.0, sa, ca)), (0.0, 0.0, d_m)


def _nearest(q: float, to: float) -> float:
    return q + _TURN * round((to - q) / _TURN)


def _apart(one: Sequence[float], other: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def _dot(a: Vector3, b: Vector3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
