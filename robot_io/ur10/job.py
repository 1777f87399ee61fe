"""What the arm's process is told when it starts."""

from __future__ import annotations

from typing import Literal

import msgspec

from robot_io.messages import Joints

Hold = Literal["monitor", "servo"]

DEFAULT_PRIORITY = 81
"""SCHED_FIFO priority of the arm's publishing thread, where the system allows it."""


class ArmJob(msgspec.Struct, frozen=True):
    """How to hold which arm (angles in rad), and where to write."""

    host: str
    hold: Hold
    record_fd: int
    """Of a `TypedRecord` of `ARM_RECORD`."""
    parent_pid: int
    """The process ends when the thread that started it does."""
    model: str = ""
    """Which arm it must be (`UR10e`); empty: any."""
    held_pose_rad: Joints | None = None
    """Where the arm must be for active holding; None: wherever it is."""
    held_pose_tolerance_rad: float = 0.05
    status_fd: int = -1
    realtime_priority: int = DEFAULT_PRIORITY
    run_fd: int = -1
    """The process also ends when this pipe has no writer any more; -1: no pipe."""
