"""The questions that ur_rtde's control script answers: kinematics, limits, state."""

from __future__ import annotations

from collections.abc import Sequence

from robot_io.messages import Joints
from sim_backend.ur10.motion.kinematics import joints_at, tool_pose
from sim_backend.ur10.motion.limits import within_positions
from sim_backend.ur10.motion.transforms import Pose6, chained, frame_of, pose_of
from sim_backend.ur10.programs.control_commands import Command
from sim_backend.ur10.programs.program import Robot, ScriptError


def answer(command: int, doubles: Sequence[float], robot: Robot, offset: int) -> bool:
    """Write the answer to a command's question into the output registers; return False for what is no question.

    `doubles` are its arguments. Raises ScriptError for a pose that the arm cannot reach.
    """
    first, second = _six(doubles[0:6]), _six(doubles[6:12])
    yes: bool | None = None
    values: Sequence[float] = ()
    match command:
        case Command.GET_TCP_OFFSET:
            values = robot.tcp_offset
        case Command.FORWARD_KINEMATICS:
            values = robot.tcp_pose
        case Command.FORWARD_KINEMATICS_OF:
            values = tool_pose(first, robot.model, second)
        case Command.INVERSE_KINEMATICS:
            values = _joints_at(first, robot.motion.actual, robot)
        case Command.INVERSE_KINEMATICS_NEAR:
            values = _joints_at(first, second, robot)
        case Command.POSE_TRANS:
            values = pose_of(chained(frame_of(first), frame_of(second)))
        case Command.IS_STEADY:
            yes = robot.motion.steady
        case Command.JOINTS_WITHIN_LIMITS:
            yes = within_positions(first, robot.model)
        case Command.POSE_WITHIN_LIMITS | Command.HAS_SOLUTION:
            yes = _solution(first, robot.motion.actual, robot) is not None
        case Command.HAS_SOLUTION_NEAR:
            yes = _solution(first, second, robot) is not None
        case _:
            return False
    for i, value in enumerate(values):
        robot.registers.double_out[offset + i] = value
    if yes is not None:
        robot.registers.int_out[offset + 1] = int(yes)
    return True


def _joints_at(pose: Pose6, near: Joints, robot: Robot) -> Joints:
    q = _solution(pose, near, robot)
    if q is None:
        words = "get_inverse_kin: unable to find an inverse kinematics solution"
        raise ScriptError(1, 1, words, words)
    return q


def _solution(pose: Pose6, near: Joints, robot: Robot) -> Joints | None:
    return joints_at(pose, near, robot.model, robot.tcp_offset)


def _six(values: Sequence[float]) -> Joints:
    a, b, c, d, e, f = (*values, *(0.0,) * 6)[:6]
    return (a, b, c, d, e, f)
