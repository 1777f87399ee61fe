"""What logs of format 1 say of the arm, in today's terms. Frozen: those logs do not change any more.

They hold the modes of a UR controller (RTDE guide, CB3 3.15), which safety judged itself then.
"""

from __future__ import annotations

from typing import Any

from robot_io.messages import ArmState

_RUNNING, _STOPPED, _JOINT_RUNNING = 7, 1, 253
_ALLOWED, _EMERGENCY_MODES = (1, 2), (6, 7)
_ALLOWED_BITS, _EMERGENCY_BITS, _STOP_BITS = 0b11, 0b11100000, 0b11111111100
_POWER_ON, _TEACH_BUTTON = 1, 1 << 2


def arm_state(arm: Any) -> int:
    """Return the `ArmState` of an arm's record of format 1; a program that ran while it was held actively was ours."""
    joints = arm.joints
    bits, mode = joints.safety_bits, joints.safety_mode
    if bits & _EMERGENCY_BITS or mode in _EMERGENCY_MODES:
        return int(ArmState.EMERGENCY_STOP)
    if bits & _STOP_BITS or not bits & _ALLOWED_BITS or mode not in _ALLOWED:
        return int(ArmState.PROTECTIVE_STOP)
    running = joints.robot_mode == _RUNNING and joints.robot_status_bits & _POWER_ON
    if not running or any(one != _JOINT_RUNNING for one in arm.joint_modes):
        return int(ArmState.OFF)
    if joints.robot_status_bits & _TEACH_BUTTON:
        return int(ArmState.MOVING)
    if joints.runtime_state != _STOPPED and not arm.servo:
        return int(ArmState.FOREIGN_PROGRAM)
    return int(ArmState.HOLDING)
