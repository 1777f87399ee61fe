"""ur_rtde's control script as a register machine.

URScript is not interpreted. The script is recognised by its header and replaced by its protocol on the registers
(numbers below are relative to its offset, 0 or 24): input integer 0 holds the command, output integer 0 is 1 (ready)
or 2 (done). A command that is not modelled ends the script with an error, as one does that the controller cannot run.
"""

from __future__ import annotations

import re

from robot_io.messages import Joints
from sim_backend.ur10.motion.commands import ServoCommand, SpeedCommand, ToolSpeedCommand
from sim_backend.ur10.motion.kinematics import joints_at, tool_pose
from sim_backend.ur10.motion.moves import within_range
from sim_backend.ur10.programs.control_commands import BLOCKING_MOVES, NAMES, REALTIME, STOP_SCRIPT, Command
from sim_backend.ur10.programs.control_moves import AsyncProgress, Move, begin_move
from sim_backend.ur10.programs.control_queries import answer
from sim_backend.ur10.programs.program import Robot, ScriptError
from sim_backend.ur10.programs.script import Script
from sim_backend.ur10.registers import Watchdog

CONTROL_SCRIPT_MARK = "RTDE Control Script"
_OFFSET = re.compile(r"# float register offset\s*\n\s*(0|24)\b")
_PATH = re.compile(r"def exec_move_path\(\):\s*\n(.*?)\n\s*end\b", re.DOTALL)

_NOTHING_TO_DO = frozenset({
    Command.END_TEACH_MODE, Command.END_FREEDRIVE_MODE,  # the arm is never compliant
    Command.SET_GRAVITY,  # it feels none
    Command.SET_EXTERNAL_FORCE_TORQUE,  # comes by a register of its own
})  # fmt: skip

READY = 1
DONE = 2


class ControlScript:
    """The script while it runs. Raises ScriptError for a path that is no straight URScript."""

    name = "rtde_control"

    def __init__(self, text: str) -> None:
        offset = _OFFSET.search(text)
        path = _PATH.search(text)
        self.offset = int(offset.group(1)) if offset else 0
        self._path_text = path.group(1) if path else ""
        self._make_path()  # an error in it is one of the whole program
        self._started = False
        self._executing = False
        self._answered = False
        self._move: Move | None = None
        self._progress = AsyncProgress()

    def step(self, robot: Robot, now_ns: int) -> bool:
        """See `Program.step`."""
        registers = robot.registers
        if not self._started:
            self._started = True
            self._progress.finished(registers, self.offset)
            registers.int_out[self.offset] = READY
            return True
        if self._move is not None and not self._move.step(robot, now_ns):
            self._move = None
        self._progress.follow(registers, self.offset, self._move)
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
        doubles = robot.registers.double_in[self.offset :]
        if command in (Command.SERVO_J, Command.SERVO_L):
            target: Joints | None = self._six(robot, 0)
            if command == Command.SERVO_L:
                target = joints_at(self._six(robot, 0), robot.motion.actual, robot.model, robot.tcp_offset)
            if target is None:
                raise self._refused("get_inverse_kin: unable to find an inverse kinematics solution")
            robot.motion.follow(ServoCommand(within_range(target, robot.model), doubles[9]))
        elif command == Command.SPEED_J:
            robot.motion.follow(SpeedCommand(self._six(robot, 0)))
        elif command == Command.SPEED_L:
            self._speed_tool(robot)
        elif command == Command.GET_STEP_TIME:
            self._answer(robot, (robot.model.cycle_s,))
        elif command == Command.GET_JOINT_HISTORY:
            steps = min(max(robot.registers.int_in[self.offset + 1], 0), len(robot.motion.history) - 1)
            self._answer(robot, robot.motion.history[-1 - steps])
        elif command == Command.GET_FLANGE_POSE:
            self._answer(robot, tool_pose(robot.motion.actual, robot.model))
        else:
            raise self._refused(f"`{NAMES.get(command, command)}` is not emulated")

    def _speed_tool(self, robot: Robot) -> None:
        """Go on with the same velocity from where the tool is meant to be: a new start each cycle would drift."""
        velocity = self._six(robot, 0)
        command = robot.motion.command
        if not isinstance(command, ToolSpeedCommand) or command.velocity != velocity:
            robot.motion.follow(ToolSpeedCommand(velocity, robot.model, robot.tcp_offset))

    def _run_once(self, command: int, robot: Robot, now_ns: int) -> None:
        if not self._executing:
            self._executing = True
            self._answered = False
            self._begin(command, robot, now_ns)
        waits = self._move is not None and command in BLOCKING_MOVES and not robot.registers.int_in[self.offset + 1]
        if not self._answered and not waits:
            self._answered = True
            robot.registers.int_out[self.offset] = DONE

    def _begin(self, command: int, robot: Robot, now_ns: int) -> None:
        registers = robot.registers
        doubles = registers.double_in[self.offset :]
        if command in BLOCKING_MOVES:
            self._move = begin_move(command, doubles, robot, self._make_path())
            self._move.step(robot, now_ns)
            if registers.int_in[self.offset + 1]:
                self._progress.started(registers, self.offset)
        elif command in (
            Command.SERVO_STOP, Command.SPEED_STOP, Command.STOP_J, Command.STOP_L, Command.JOG_STOP,
            Command.FORCE_MODE_STOP,
        ):  # fmt: skip
            robot.motion.hold()
            self._move = None
        elif command == Command.SET_WATCHDOG:
            if doubles[0] > 0:
                robot.watchdog = Watchdog(registers, self.offset, doubles[0], now_ns)
        elif command == Command.SET_PAYLOAD:
            robot.payload_kg = doubles[0]
            robot.payload_cog_m = (doubles[1], doubles[2], doubles[3])
        elif command == Command.SET_TCP:
            robot.tcp_offset = self._six(robot, 0)
        elif command == Command.ZERO_FT_SENSOR:
            robot.zero_force_sensor()
        elif command == Command.PROTECTIVE_STOP:
            robot.trip_protective_stop()
        elif command in _NOTHING_TO_DO:
            pass
        elif not answer(command, doubles, robot, self.offset):
            raise self._refused(f"`{NAMES.get(command, command)}` is not emulated")

    def _make_path(self) -> Script:
        return Script("exec_move_path", self._path_text, frozenset({"signal_async_progress"}))

    def _six(self, robot: Robot, first: int) -> Joints:
        a, b, c, d, e, f = robot.registers.double_in[self.offset + first : self.offset + first + 6]
        return (a, b, c, d, e, f)

    def _answer(self, robot: Robot, values: tuple[float, ...]) -> None:
        for i, value in enumerate(values):
            robot.registers.double_out[self.offset + i] = value

    def _refused(self, words: str) -> ScriptError:
        return ScriptError(1, 1, f"compile_error_not_emulated:{words}:", words)
