"""The moves of ur_rtde's control script, and what it writes about those that its client does not wait for."""

from __future__ import annotations

from sim_backend.ur10.motion.commands import MoveCommand
from sim_backend.ur10.motion.kinematics import tool_pose
from sim_backend.ur10.motion.moves import Way, joint_move, joint_move_to_pose, tool_move
from sim_backend.ur10.programs.control_commands import Command
from sim_backend.ur10.programs.program import Robot
from sim_backend.ur10.programs.script import Script
from sim_backend.ur10.registers import Registers

_RUNNING = 1 << 15
_COUNT_SHIFT, _OPERATION_SHIFT, _SEVEN_BITS = 16, 24, 127


class Move:
    """A move or a path that is under way."""

    def __init__(self, command: MoveCommand | None, path: Script | None) -> None:
        self._command = command
        self._path = path

    @property
    def progress(self) -> int:
        """Return the point of the path that it is on the way to."""
        return self._path.progress if self._path is not None else 0

    def step(self, robot: Robot, now_ns: int) -> bool:
        """Go on for a control cycle; return False at its end."""
        if self._path is not None:
            return self._path.step(robot, now_ns)
        command = self._command
        if command is None or not command.moving:
            return False
        if robot.motion.command is not command:  # it begins, or the program was paused meanwhile
            robot.motion.follow(command)
        return True


class AsyncProgress:
    """Output integer 2: bits 0 to 14 progress, 15 running, 16 to 22 writes, 24 to 30 operations."""

    def __init__(self) -> None:
        self._writes = 0
        self._operations = 0
        self._reported: int | None = None

    def started(self, registers: Registers, offset: int) -> None:
        """Report the start of a move."""
        self._operations = (self._operations + 1) & _SEVEN_BITS
        self._write(registers, offset, 0)

    def follow(self, registers: Registers, offset: int, move: Move | None) -> None:
        """Report what has changed since the last cycle."""
        if self._reported is None:
            return
        if move is None:
            self.finished(registers, offset)
        elif move.progress != self._reported:
            self._write(registers, offset, move.progress)

    def finished(self, registers: Registers, offset: int) -> None:
        """Report that nothing is under way."""
        self._write(registers, offset, None)

    def _write(self, registers: Registers, offset: int, progress: int | None) -> None:
        self._reported = progress
        self._writes = (self._writes + 1) & _SEVEN_BITS
        value = self._writes << _COUNT_SHIFT | self._operations << _OPERATION_SHIFT
        if progress is not None:
            value |= min(progress, _RUNNING - 1) | _RUNNING
        registers.int_out[offset + 2] = value


def begin_move(command: int, doubles: list[float], robot: Robot, path: Script) -> Move:
    """Return the move that a command asks for; its arguments are in the registers `doubles`."""
    if command == Command.MOVE_PATH:
        return Move(None, path)
    a, b, c, d, e, f, speed, acceleration = doubles[:8]
    target, way = (a, b, c, d, e, f), Way(speed, acceleration)
    model, tcp = robot.model, robot.tcp_offset
    if command == Command.MOVE_J:
        leg = joint_move(target, way, model)
    elif command == Command.MOVE_J_IK:
        leg = joint_move_to_pose(target, way, model, tcp)
    elif command == Command.MOVE_L:
        leg = tool_move(target, way, model, tcp)
    else:
        leg = tool_move(tool_pose(target, model, tcp), way, model, tcp)
    return Move(MoveCommand([leg]), None)
