"""Numbers of a UR controller: robot, safety, runtime and joint modes and the bits derived from them.

Source: Universal Robots RTDE guide and client interface manual, CB3 and e-Series. The bits are those of both.
"""

from __future__ import annotations

from enum import IntEnum


class RobotMode(IntEnum):
    """Output `robot_mode`; the dashboard reports the same by name."""

    NO_CONTROLLER = -1
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7


class SafetyMode(IntEnum):
    """Output `safety_mode`; the dashboard reports the same by name."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9


class SafetyStatus(IntEnum):
    """Output `safety_status` (e-Series): the safety mode, or which safeguard stop it is."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9
    AUTOMATIC_MODE_SAFEGUARD_STOP = 12
    SYSTEM_THREE_POSITION_ENABLING_STOP = 13


class RuntimeState(IntEnum):
    """Output `runtime_state`: what the running program does."""

    STOPPING = 0
    STOPPED = 1
    PLAYING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5


MAY_MOVE = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED})

_STOPPED_BY_SAFETY = 1 << 10
_EMERGENCY_STOPPED = 1 << 7
_SAFETY_BITS = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.REDUCED: 1 << 1,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | _STOPPED_BY_SAFETY,
    SafetyMode.RECOVERY: 1 << 3,
    SafetyMode.SAFEGUARD_STOP: 1 << 4 | _STOPPED_BY_SAFETY,
    SafetyMode.SYSTEM_EMERGENCY_STOP: 1 << 5 | _EMERGENCY_STOPPED | _STOPPED_BY_SAFETY,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | _EMERGENCY_STOPPED | _STOPPED_BY_SAFETY,
    SafetyMode.VIOLATION: 1 << 8 | _STOPPED_BY_SAFETY,
    SafetyMode.FAULT: 1 << 9 | _STOPPED_BY_SAFETY,
}

_JOINT_MODE = {
    RobotMode.BACKDRIVE: 238,
    RobotMode.BOOTING: 247,
    RobotMode.POWER_OFF: 239,
    RobotMode.RUNNING: 253,
}
_JOINT_IDLE = 255
_JOINT_FAULT = 252


def safety_bits(mode: SafetyMode) -> int:
    """Return `safety_status_bits` for a safety mode."""
    return _SAFETY_BITS[mode]


def joint_mode(robot: RobotMode, safety: SafetyMode) -> int:
    """Return the mode number every joint reports."""
    if safety in (SafetyMode.VIOLATION, SafetyMode.FAULT):
        return _JOINT_FAULT
    return _JOINT_MODE.get(robot, _JOINT_IDLE)


def robot_status_bits(robot: RobotMode, runtime: RuntimeState, teach_button: bool) -> int:
    """Return `robot_status_bits`: power on, program running, teach button pressed."""
    power = robot >= RobotMode.POWER_ON
    return power | (runtime == RuntimeState.PLAYING) << 1 | teach_button << 2
