"""What somebody does to the simulated robot by hand: presses on the ball, and moves the arm.

Both are functions of time (ns), so that reading at any time, in any order, changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from robot_io.clock import NS_PER_S
from robot_io.messages import Joints, Vector3
from robot_io.rig.world import HandConfig
from sim_backend.world.plant import ArmTruth

AT_REST: Joints = (0.0,) * 6


class _Press(NamedTuple):
    from_ns: int
    until_ns: int
    force: Vector3


class _Move(NamedTuple):
    from_ns: int
    until_ns: int
    start: Joints
    end: Joints


class Human:
    """One pair of hands; the arm is held at `held` (rad) until it is moved."""

    def __init__(self, held: Joints, presses: Sequence[HandConfig], start_ns: int) -> None:
        self._presses: list[_Press] = []
        self._arm = ArmTruth(held, AT_REST)
        self._move: _Move | None = None
        for press in presses:  # not by `press`, which drops those that are over by then: all of these are still to come
            at_ns = start_ns + round(press.at_s * NS_PER_S)
            self._presses.append(_Press(at_ns, at_ns + round(press.for_s * NS_PER_S), press.force_body_N))

    def press(self, force: Vector3, for_s: float, at_ns: int) -> None:
        """Press on the ball with a force (N, BODY frame) from `at_ns` on; it adds to other presses."""
        self._presses = [press for press in self._presses if press.until_ns > at_ns or press.from_ns >= at_ns]
        self._presses.append(_Press(at_ns, at_ns + round(for_s * NS_PER_S), force))

    def force(self, t_ns: int) -> Vector3:
        """Return the force on the ball (N, BODY frame)."""
        x = y = z = 0.0
        for press in self._presses:
            if press.from_ns <= t_ns < press.until_ns:
                x, y, z = x + press.force[0], y + press.force[1], z + press.force[2]
        return x, y, z

    def move_arm(self, end: Joints, in_s: float, at_ns: int) -> None:
        """Move the arm at constant speed from where it is at `at_ns` to `end` (rad), and hold it there."""
        self._move = _Move(at_ns, at_ns + max(1, round(in_s * NS_PER_S)), self.arm(at_ns).position, end)
        self._arm = ArmTruth(end, AT_REST)

    def arm(self, t_ns: int) -> ArmTruth:
        """Return the joints (rad) and their rates (rad/s)."""
        move = self._move
        if move is None or t_ns >= move.until_ns:
            return self._arm
        span_ns = move.until_ns - move.from_ns
        done = max(0.0, (t_ns - move.from_ns) / span_ns)
        pairs = list(zip(move.start, move.end, strict=True))
        a, b, c, d, e, f = (start + done * (end - start) for start, end in pairs)
        u, v, w, x, y, z = ((end - start) / (span_ns / NS_PER_S) if done else 0.0 for start, end in pairs)
        return ArmTruth((a, b, c, d, e, f), (u, v, w, x, y, z))
