"""What the controller asks of a program, what a program may touch, and how it fails."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from sim_backend.ur10.models import Six, UrModel, Version
from sim_backend.ur10.motion.arm_motion import ArmMotion
from sim_backend.ur10.outputs import Outputs
from sim_backend.ur10.registers import Registers, Watchdog
from sim_backend.ur10.reports import Report


class Robot(Protocol):
    """The part of the controller that a program can access."""

    model: UrModel
    version: Version
    registers: Registers
    motion: ArmMotion
    io: Outputs
    watchdog: Watchdog | None
    payload_kg: float
    payload_cog_m: tuple[float, float, float]
    tcp_offset: Six
    reports: deque[Report]

    @property
    def tcp_pose(self) -> Six:
        """Pose of the tool's centre point."""
        ...

    def zero_force_sensor(self) -> None:
        """Make the force on the tool zero as it is now."""
        ...

    def trip_protective_stop(self) -> None:
        """Stop as for a collision."""
        ...


class Program(Protocol):
    """Something that runs once per controller cycle."""

    name: str

    def step(self, robot: Robot, now_ns: int) -> bool:
        """Run one cycle; return False when the program has ended. Raises ScriptError."""
        ...


class ScriptError(Exception):
    """An error in a program: where, as the controller reports it (`text`), and in plain words."""

    def __init__(self, line: int, column: int, text: str, words: str) -> None:
        super().__init__(words)
        self.line = line
        self.column = column
        self.text = text
        self.words = words


class ProgramRefused(Exception):
    """A program that does not start."""

    def __init__(self, name: str, error: ScriptError) -> None:
        super().__init__(str(error))
        self.name = name
        self.error = error
