"""Numbers of ur_rtde's commands, as its control script (release 1.6.5) takes them from the register."""

from __future__ import annotations

from enum import IntEnum


class Command(IntEnum):
    """A command in input integer 0."""

    MOVE_J = 1
    MOVE_J_IK = 2
    MOVE_L = 3
    MOVE_L_FK = 4
    FORCE_MODE = 6
    FORCE_MODE_STOP = 7
    ZERO_FT_SENSOR = 8
    SPEED_J = 9
    SPEED_L = 10
    SERVO_J = 11
    SERVO_C = 12
    SPEED_STOP = 15
    SERVO_STOP = 16
    SET_PAYLOAD = 17
    TEACH_MODE = 18
    END_TEACH_MODE = 19
    FORCE_MODE_SET_DAMPING = 20
    FORCE_MODE_SET_GAIN_SCALING = 21
    SERVO_L = 24
    TOOL_CONTACT = 25
    GET_STEP_TIME = 26
    GET_JOINT_HISTORY = 27
    GET_TARGET_WAYPOINT = 28
    SET_TCP = 29
    INVERSE_KINEMATICS_NEAR = 30
    PROTECTIVE_STOP = 31
    STOP_L = 33
    STOP_J = 34
    SET_WATCHDOG = 35
    POSE_WITHIN_LIMITS = 36
    JOINTS_WITHIN_LIMITS = 37
    GET_JOINT_TORQUES = 38
    POSE_TRANS = 39
    GET_TCP_OFFSET = 40
    JOG_START = 41
    JOG_STOP = 42
    FORWARD_KINEMATICS = 43
    FORWARD_KINEMATICS_OF = 44
    MOVE_PATH = 45
    INVERSE_KINEMATICS = 46
    IS_STEADY = 47
    MOVE_UNTIL_CONTACT = 51
    FREEDRIVE_MODE = 52
    END_FREEDRIVE_MODE = 53
    GET_FREEDRIVE_STATUS = 54
    SET_EXTERNAL_FORCE_TORQUE = 55
    FT_RTDE_INPUT_ENABLE = 56
    ENABLE_EXTERNAL_FT_SENSOR = 57
    GET_FLANGE_POSE = 58
    SET_GRAVITY = 59
    HAS_SOLUTION = 60
    HAS_SOLUTION_NEAR = 61
    START_CONTACT_DETECTION = 62
    STOP_CONTACT_DETECTION = 63
    READ_CONTACT_DETECTION = 64
    SET_TARGET_PAYLOAD = 65
    DIRECT_TORQUE = 66
    GET_MASS_MATRIX = 67
    GET_CORIOLIS_TORQUES = 68
    GET_TARGET_JOINT_ACCELERATIONS = 69
    GET_JACOBIAN = 70
    GET_JACOBIAN_DERIVATIVE = 71


NAMES = {command.value: command.name.lower() for command in Command}
STOP_SCRIPT = 255
REALTIME = frozenset({
    Command.FORCE_MODE, Command.SPEED_J, Command.SPEED_L, Command.SERVO_J, Command.SERVO_L, Command.TOOL_CONTACT,
    Command.GET_STEP_TIME, Command.GET_JOINT_HISTORY, Command.GET_JOINT_TORQUES, Command.GET_FLANGE_POSE,
    *range(Command.DIRECT_TORQUE, Command.GET_JACOBIAN_DERIVATIVE + 1),
})  # fmt: skip
"""Commands executed every cycle while they are in the register; all others once, until the register is 0."""
BLOCKING_MOVES = frozenset({Command.MOVE_J, Command.MOVE_J_IK, Command.MOVE_L, Command.MOVE_L_FK, Command.MOVE_PATH})
