"""The URScript functions that the emulated controller has. What a function lacks here, a program is refused for.

Source: Universal Robots script manual, CB3. A function that takes time returns a `Wait`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from robot_io.clock import NS_PER_S
from sim_backend.ur10.motion.commands import Command, MoveCommand, ServoCommand, SpeedCommand, ToolSpeedCommand
from sim_backend.ur10.motion.kinematics import joints_at, tool_pose
from sim_backend.ur10.motion.moves import LegFrom, Way, joint_move, joint_move_to_pose, tool_move, within_range
from sim_backend.ur10.motion.transforms import chained, frame_of, inverse, pose_of
from sim_backend.ur10.outputs import CONFIGURABLE, STANDARD, TOOL
from sim_backend.ur10.programs.expressions import Function, Pose, number, six
from sim_backend.ur10.programs.program import Robot
from sim_backend.ur10.reports import TextReport

Wait = Callable[[int], bool]
"""Whether a function still takes time at `now_ns`."""


class Halted(Exception):
    """The program ended itself."""


class Functions:
    """One program's access to the robot."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.now_ns = 0
        self.table: dict[str, Function] = _table_of(self)

    # Motion

    def movej(self, target: object, a: float = 1.4, v: float = 1.05, t: float = 0.0, r: float = 0.0) -> Wait:
        """Go straight in joint space."""
        robot, way = self._robot, Way(v, a, t)
        if isinstance(target, Pose):
            return self._move(joint_move_to_pose(target.six, way, robot.model, robot.tcp_offset))
        return self._move(joint_move(six(target), way, robot.model))

    def movel(self, target: object, a: float = 1.2, v: float = 0.25, t: float = 0.0, r: float = 0.0) -> Wait:
        """Go with the tool straight."""
        robot = self._robot
        pose = target.six if isinstance(target, Pose) else tool_pose(six(target), robot.model, robot.tcp_offset)
        return self._move(tool_move(pose, Way(v, a, t), robot.model, robot.tcp_offset))

    def servoj(
        self, q: object, a: float = 0, v: float = 0, t: float = 0.008, lookahead_time: float = 0.1, gain: float = 300
    ) -> Wait:  # fmt: skip
        """Follow a joint target for a time."""
        target = within_range(six(q), self._robot.model)
        return self._follow_for(ServoCommand(target, lookahead_time), t)

    def speedj(self, qd: object, a: float = 0.5, t: float = 0.0) -> Wait:
        """Turn the joints for a time."""
        return self._follow_for(SpeedCommand(six(qd), t), t)

    def speedl(self, xd: object, a: float = 0.5, t: float = 0.0) -> Wait:
        """Move the tool at a velocity for a time."""
        return self._follow_for(ToolSpeedCommand(six(xd), self._robot.model, self._robot.tcp_offset, t), t)

    def stop(self, a: float = 2.0, *_: object) -> None:
        """Stop."""
        self._robot.motion.hold()

    def sleep(self, t: float) -> Wait:
        """Wait for a time (s)."""
        return self._until(number(t))

    def sync(self) -> Wait:
        """Wait for the next control cycle."""
        start_ns = self.now_ns
        return lambda now_ns: now_ns == start_ns

    def _move(self, leg: LegFrom) -> Wait:
        command = MoveCommand([leg])
        motion = self._robot.motion
        motion.follow(command)

        def moves(_now_ns: int) -> bool:
            if command.moving and motion.command is not command:  # the program was paused meanwhile
                motion.follow(command)
            return command.moving

        return moves

    def _follow_for(self, command: Command, t: float) -> Wait:
        self._robot.motion.follow(command)
        return self._until(number(t)) if t > 0.0 else self.sync()

    def _until(self, t_s: float) -> Wait:
        end_ns = self.now_ns + round(max(0.0, min(t_s, 1e9)) * NS_PER_S)
        return lambda now_ns: now_ns < end_ns

    # The robot's state

    def tcp_pose(self) -> Pose:
        """Return where the tool is."""
        return Pose(self._robot.tcp_pose)

    def joint_positions(self) -> list[float]:
        """Return where the joints are."""
        return list(self._robot.motion.actual)

    def joint_speeds(self) -> list[float]:
        """Return how fast the joints turn."""
        return list(self._robot.motion.velocity)

    def get_forward_kin(self, q: object = None, tcp: object = None) -> Pose:
        """Return where the tool would be."""
        joints = self._robot.motion.actual if q is None else six(q)
        return Pose(tool_pose(joints, self._robot.model, self._robot.tcp_offset if tcp is None else six(tcp)))

    def get_inverse_kin(self, x: object, qnear: object = None, *_: object) -> list[float]:
        """Return the joints for a pose of the tool."""
        near = self._robot.motion.actual if qnear is None else six(qnear)
        joints = joints_at(six(x), near, self._robot.model, self._robot.tcp_offset)
        if joints is None:
            raise ValueError("get_inverse_kin: unable to find an inverse kinematics solution")
        return list(joints)

    def set_tcp(self, pose: object) -> None:
        """Set the tool's centre point."""
        self._robot.tcp_offset = six(pose)

    def get_tcp_offset(self) -> Pose:
        """Return the tool's centre point."""
        return Pose(self._robot.tcp_offset)

    def set_payload(self, m: float, cog: object = None) -> None:
        """Set what the arm carries."""
        self._robot.payload_kg = number(m)
        if isinstance(cog, list) and len(cog) == 3:
            x, y, z = map(number, cog)
            self._robot.payload_cog_m = (x, y, z)

    def set_gravity(self, d: object) -> None:
        """Take the direction of gravity, which nothing here feels."""

    # Inputs, outputs, messages

    def digital(self, first: int, count: int) -> Function:
        """Return a function that sets one kind of digital output."""

        def set_out(n: float, b: object) -> None:
            if not 0 <= int(number(n)) < count:
                raise ValueError(f"digital output {n} does not exist")
            self._robot.io.set_digital(first, 1 << int(n), int(bool(b)) << int(n))

        return set_out

    def set_analog_out(self, n: float, f: float) -> None:
        """Set an analogue output, 0..1."""
        if number(n) not in (0, 1):
            raise ValueError(f"analog output {n} does not exist")
        index = int(n)
        self._robot.io.set_analog(index, self._robot.io.analog_domain[index], number(f))

    def textmsg(self, s1: object, s2: object = "") -> None:
        """Write to the log."""
        self._robot.reports.append(TextReport(as_text(s1) + as_text(s2)))

    def popup(self, s: object, title: object = "", warning: object = False, error: object = False, *_: object) -> None:
        """Show a text on the pendant, which there is not."""

    def write_bit(self, n: float, value: object) -> None:
        """Write an output bit."""
        self._robot.registers.bits_out[int(number(n))] = bool(value)

    def write_int(self, n: float, value: object) -> None:
        """Write an output register."""
        self._robot.registers.int_out[int(number(n))] = int(number(value))

    def write_double(self, n: float, value: object) -> None:
        """Write an output register."""
        self._robot.registers.double_out[int(number(n))] = number(value)

    def read_bit(self, n: float) -> bool:
        """Read an input bit."""
        return self._robot.registers.bits_in[int(number(n))]

    def read_int(self, n: float) -> int:
        """Read an input register."""
        return self._robot.registers.int_in[int(number(n))]

    def read_double(self, n: float) -> float:
        """Read an input register."""
        return self._robot.registers.double_in[int(number(n))]

    def protective_stop(self) -> None:
        """Stop as for a collision."""
        self._robot.trip_protective_stop()

    def zero_ftsensor(self) -> None:
        """Make the force on the tool zero."""
        self._robot.zero_force_sensor()

    def halt(self) -> None:
        """End the program."""
        raise Halted


def as_text(value: object) -> str:
    """Return a value as the controller writes it: six digits, p in front of a pose."""
    match value:
        case bool() | str():
            return str(value)
        case float() | int():
            return f"{value:g}"
        case Pose():
            return "p[" + ", ".join(map(as_text, value)) + "]"
        case list():
            return "[" + ", ".join(map(as_text, value)) + "]"
    return str(value)


def pose_trans(p_from: object, p_from_to: object) -> Pose:
    """Return a pose given in another pose."""
    return Pose(pose_of(chained(frame_of(six(p_from)), frame_of(six(p_from_to)))))


def pose_inv(p_from: object) -> Pose:
    """Return the pose that undoes one."""
    return Pose(pose_of(inverse(frame_of(six(p_from)))))


def _table_of(program: Functions) -> dict[str, Function]:
    nothing: Function = lambda *_: None  # noqa: E731 - a function of a table
    return {
        "movej": program.movej, "movel": program.movel, "servoj": program.servoj, "speedj": program.speedj,
        "speedl": program.speedl, "stopj": program.stop, "stopl": program.stop, "sleep": program.sleep,
        "sync": program.sync, "halt": program.halt, "protective_stop": program.protective_stop,
        "zero_ftsensor": program.zero_ftsensor,
        "textmsg": program.textmsg, "popup": program.popup, "to_str": as_text,
        "set_tcp": program.set_tcp, "get_tcp_offset": program.get_tcp_offset, "set_gravity": program.set_gravity,
        "set_payload": program.set_payload, "set_payload_mass": program.set_payload,
        "get_actual_tcp_pose": program.tcp_pose, "get_target_tcp_pose": program.tcp_pose,
        "get_actual_joint_positions": program.joint_positions, "get_target_joint_positions": program.joint_positions,
        "get_actual_joint_speeds": program.joint_speeds, "get_target_joint_speeds": program.joint_speeds,
        "get_forward_kin": program.get_forward_kin, "get_inverse_kin": program.get_inverse_kin,
        "is_steady": lambda: program._robot.motion.steady,
        "pose_trans": pose_trans, "pose_inv": pose_inv,
        "d2r": lambda d: math.radians(number(d)), "r2d": lambda r: math.degrees(number(r)),
        "set_digital_out": program.digital(STANDARD, 8), "set_standard_digital_out": program.digital(STANDARD, 8),
        "set_configurable_digital_out": program.digital(CONFIGURABLE, 8),
        "set_tool_digital_out": program.digital(TOOL, 2),
        "set_analog_out": program.set_analog_out, "set_standard_analog_out": program.set_analog_out,
        "set_tool_voltage": nothing,
        "write_output_boolean_register": program.write_bit, "write_output_integer_register": program.write_int,
        "write_output_float_register": program.write_double,
        "read_input_boolean_register": program.read_bit, "read_input_integer_register": program.read_int,
        "read_input_float_register": program.read_double,
    }  # fmt: skip


NAMES = frozenset(_table_of(Functions.__new__(Functions)))
"""What a program can call."""
