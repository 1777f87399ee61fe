"""What a person does to the emulated robot by hand, as JSON lines that an emulator reads: pressing, moving the arm.

{"hand": {"force_body_N": [-10, 0, 0], "for_s": 3}}   press on the ball from now on (N, BODY frame)
{"arm_rad": [1.6, -0.2, 1.6, -1.4, 1.6, 1.3]}         move the arm to these joints; with "in_s": 5 in 5 s (1 s)

A line that cannot be read is told and changes nothing. The end of the lines ends nothing.
"""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from robot_io.clock import monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import Vector3
from robot_io.rig.types import Joints
from sim_backend.world.world import World

LONGEST_LINE = 4096
READ_BYTES = 1 << 16


class Press(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A force on the ball, in N (BODY frame)."""

    force_body_N: Vector3
    for_s: Annotated[float, Meta(gt=0, le=3600)]


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One line: a press or a move of the arm, or both at once."""

    hand: Press | None = None
    arm_rad: Joints | None = None
    in_s: Annotated[float, Meta(ge=0, le=3600)] = 1.0


class Hands:
    """Reads lines from a descriptor and does to the world what they say; tells `complain` of those that say nothing."""

    def __init__(self, loop: EventLoop, fd: int, world: World, complain: Callable[[str], None]) -> None:
        self._loop, self._fd, self._world, self._complain = loop, fd, world, complain
        self._rest = b""
        self._number = 0
        # In the background of a terminal, reading then fails instead of stopping the whole program.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        try:
            loop.add_fd(fd, self._on_ready)
        except PermissionError:  # a file, which is always ready: epoll does not take it
            while self._read():
                pass

    def _on_ready(self, _events: int) -> None:
        if not self._read():
            self._loop.remove_fd(self._fd)

    def _read(self) -> bool:
        """Take what there is; return False at the end of the lines."""
        try:
            data = os.read(self._fd, READ_BYTES)
        except OSError:  # a terminal that has gone, or that is another program's
            data = b""
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self._take(line)
        self._rest = self._rest[: LONGEST_LINE + 1]  # of a line that is too long, no more is kept
        return bool(data)

    def _take(self, line: bytes) -> None:
        self._number += 1
        if line.strip():
            try:
                self._do(_parsed(line))
            except (msgspec.DecodeError, ValueError) as error:
                self._complain(f"line {self._number} of stdin is not understood and does nothing: {error}")

    def _do(self, line: Line) -> None:
        now_ns = monotonic_ns()
        if line.arm_rad is not None:
            self._world.move_arm(line.arm_rad, line.in_s, now_ns)
        if line.hand is not None:
            self._world.press(line.hand.force_body_N, line.hand.for_s, now_ns)


def _parsed(line: bytes) -> Line:
    """Return a line. Raises msgspec.DecodeError, or ValueError for one that is too long or says nothing."""
    if len(line) > LONGEST_LINE:
        raise ValueError(f"it is longer than {LONGEST_LINE} bytes")
    parsed = msgspec.json.decode(line, type=Line)
    if parsed.hand is None and parsed.arm_rad is None:
        raise ValueError("it has neither `hand` nor `arm_rad`")
    if parsed.hand is not None and not all(math.isfinite(newton) for newton in parsed.hand.force_body_N):
        raise ValueError("the force is not finite")
    return parsed
