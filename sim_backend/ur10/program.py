"""The programs of the emulated controller: another program, or ur_rtde's control script as a register machine.

URScript is not interpreted. ur_rtde's script is recognised by its header and replaced by its protocol on the
registers (register numbers below are relative to its offset, 0 or 24): input integer 0 holds the command, output
integer 0 is 1 (ready) or 2 (done). A command that is not modelled is only `done`: a query among them (joint
torques, inverse kinematics) reads what the last answer left in the output registers.
"""

from __future__ import annotations

import re
from typing import Protocol

from robot_io.messages import Joints
from sim_backend.ur10.kinematics import flange_pose
from sim_backend.ur10.models import UrModel
from sim_backend.ur10.motion import ArmMotion
from sim_backend.ur10.registers import Registers, Watchdog

CONTROL_SCRIPT_MARK = "RTDE Control Script"
_OFFSET = re.compile(r"# float register offset\s*\n\s*(0|24)\b")

READY = 1
DONE = 2

MOVE_J = 1
SPEED_J = 9
SERVO_J = 11
SPEED_STOP = 15
SERVO_STOP = 16
SET_PAYLOAD = 17
GET_STEP_TIME = 26
GET_JOINT_HISTORY = 27
SET_TCP = 29
PROTECTIVE_STOP = 31
STOP_L = 33
STOP_J = 34
SET_WATCHDOG = 35
POSE_WITHIN_LIMITS = 36
JOINTS_WITHIN_LIMITS = 37
GET_TCP_OFFSET = 40
FORWARD_KINEMATICS = 43
IS_STEADY = 47
STOP_SCRIPT = 255
REALTIME = frozenset({6, SPEED_J, 10, SERVO_J, 24, 25, GET_STEP_TIME, GET_JOINT_HISTORY, 38, 58, *range(66, 72)})
"""Commands executed every cycle while they are in the register; all others once, until the register is 0."""


class Robot(Protocol):
    """The part of the controller that a program can access."""

    model: UrModel
    registers: Registers
    motion: ArmMotion
    watchdog: Watchdog | None
    payload_kg: float
    payload_cog_m: tuple[float, float, float]
    tcp_offset: tuple[float, float, float, float, float, float]

    def trip_protective_stop(self) -> None:
        """Stop as for a collision."""
        ...


class Program(Protocol):
    """Something that runs once per controller cycle."""

    name: str

    def step(self, robot: Robot, now_ns: int) -> bool:
        """Run one cycle; return False when the program has ended."""
        ...


class OtherProgram:
    """Any program other than ur_rtde's: it runs, does not move, and ends after `cycles` (0: when stopped)."""

    def __init__(self, name: str, cycles: int = 0) -> None:
        self.name = name
        self._left = cycles

    def step(self, robot: Robot, now_ns: int) -> bool:
        """See `Program.step`."""
        self._left -= 1
        return self._left != 0


class ControlScript:
    """ur_rtde's control script."""

    name = "rtde_control"

    def __init__(self, text: str) -> None:
        offset = _OFFSET.search(text)
        self.offset = int(offset.group(1)) if offset else 0
        self._started = False
        self._executing = False
        self._answered = False

    def step(self, robot: Robot, now_ns: int) -> bool:
        """See `Program.step`."""
        registers = robot.registers
        if not self._started:
            self._started = True
            registers.int_out[self.offset] = READY
            return True
        command = registers.int_in[self.offset]
        if command == STOP_SCRIPT:
            robot.motion.hold()
            return False
        if command == 0:
            self._executing = self._answered = False
            registers.int_out[self.offset] = READY
        elif command in REALTIME:
            self._run_realtime(command, robot)
            registers.int_out[self.offset] = READY
        else:
            self._run_once(command, robot, now_ns)
        return True

    def _run_realtime(self, command: int, robot: Robot) -> None:
        if command == SERVO_J:
            robot.motion.servo(self._joints(robot))
        elif command == SPEED_J:
            robot.motion.speed(self._joints(robot))
        elif command == GET_STEP_TIME:
            self._answer(robot, (robot.model.cycle_s,))
        elif command == GET_JOINT_HISTORY:
            self._answer(robot, robot.motion.actual)

    def _run_once(self, command: int, robot: Robot, now_ns: int) -> None:
        if not self._executing:
            self._executing = True
            self._answered = False
            self._begin(command, robot, now_ns)
        blocking_move = command == MOVE_J and robot.motion.moving and not robot.registers.int_in[self.offset + 1]
        if not self._answered and not blocking_move:
            self._answered = True
            robot.registers.int_out[self.offset] = DONE

    def _begin(self, command: int, robot: Robot, now_ns: int) -> None:
        doubles = robot.registers.double_in[self.offset :]
        if command == MOVE_J:
            robot.motion.move(self._joints(robot), doubles[6])
        elif command in (SERVO_STOP, SPEED_STOP, STOP_J, STOP_L):
            robot.motion.hold()
        elif command == SET_WATCHDOG and doubles[0] > 0:
            robot.watchdog = Watchdog(robot.registers, self.offset, doubles[0], now_ns)
        elif command == SET_PAYLOAD:
            robot.payload_kg = doubles[0]
            robot.payload_cog_m = (doubles[1], doubles[2], doubles[3])
        elif command == SET_TCP:
            robot.tcp_offset = self._joints(robot)
        elif command == GET_TCP_OFFSET:
            self._answer(robot, robot.tcp_offset)
        elif command == FORWARD_KINEMATICS:
            self._answer(robot, flange_pose(robot.motion.actual, robot.model))
        elif command == IS_STEADY:
            robot.registers.int_out[self.offset + 1] = int(robot.motion.steady)
        elif command in (POSE_WITHIN_LIMITS, JOINTS_WITHIN_LIMITS):
            robot.registers.int_out[self.offset + 1] = 1
        elif command == PROTECTIVE_STOP:
            robot.trip_protective_stop()

    def _joints(self, robot: Robot) -> Joints:
        a, b, c, d, e, f = robot.registers.double_in[self.offset : self.offset + 6]
        return (a, b, c, d, e, f)

    def _answer(self, robot: Robot, values: tuple[float, ...]) -> None:
        for i, value in enumerate(values):
            robot.registers.double_out[self.offset + i] = value


def program_of(text: str) -> Program:
    """Return the program for an uploaded script text."""
    if CONTROL_SCRIPT_MARK in text:
        return ControlScript(text)
    name = re.match(r"\s*def\s+(\w+)", text)
    return OtherProgram(name.group(1)) if name else OtherProgram("line", cycles=2)
