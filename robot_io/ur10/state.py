"""What a UR controller's modes and bits mean to a push. Pure; no UR bit leaves this package but packed, for the log.

The numbers mean the same in both generations; the e-Series has more of them, and each of those is a stop or off.
Source: UR RTDE guide (CB3 3.15, e-Series 5.12): robot_mode, joint_mode, safety_mode, safety_status_bits,
robot_status_bits and runtime_state.
"""

from __future__ import annotations

from typing import NamedTuple

from robot_io.messages import ArmState

ROBOT_RUNNING = 7
RUNTIME_STOPPED = 1
RUNTIME_PLAYING = 2
JOINT_RUNNING = 253
SAFETY_NORMAL, SAFETY_REDUCED = 1, 2
SAFETY_EMERGENCY = (6, 7)
"""safety_mode says the same as the bits, and is believed as well."""
NORMAL_OR_REDUCED = 0b11
EMERGENCY = (1 << 5) | (1 << 6) | (1 << 7)
ANY_STOP = 0b11111111100
"""safety_status_bits, bits 2 to 10."""
POWER_ON = 1
TEACH_BUTTON = 1 << 2
"""robot_status_bits."""


class UrModes(NamedTuple):
    """The controller's own numbers."""

    robot_mode: int = -1
    safety_mode: int = 0
    safety_bits: int = 0
    status_bits: int = 0
    runtime_state: int = 0
    joint_modes: tuple[int, ...] = (0,) * 6

    @property
    def playing(self) -> bool:
        """Return whether a program runs on a robot that is running and not stopped by safety."""
        allowed = self.safety_mode in (SAFETY_NORMAL, SAFETY_REDUCED)
        return self.runtime_state == RUNTIME_PLAYING and self.robot_mode == ROBOT_RUNNING and allowed

    def state(self, *, own_program: bool) -> ArmState:
        """Return what they mean; `own_program`: a program that runs is ours. The gravest comes first."""
        bits = self.safety_bits
        if bits & EMERGENCY or self.safety_mode in SAFETY_EMERGENCY:
            return ArmState.EMERGENCY_STOP
        allowed = bits & NORMAL_OR_REDUCED and self.safety_mode in (SAFETY_NORMAL, SAFETY_REDUCED)
        if bits & ANY_STOP or not allowed:
            return ArmState.PROTECTIVE_STOP
        if self.robot_mode != ROBOT_RUNNING or not self.status_bits & POWER_ON:
            return ArmState.OFF
        if any(mode != JOINT_RUNNING for mode in self.joint_modes):
            return ArmState.OFF
        if self.status_bits & TEACH_BUTTON:
            return ArmState.MOVING
        if self.runtime_state != RUNTIME_STOPPED and not own_program:
            return ArmState.FOREIGN_PROGRAM
        return ArmState.HOLDING

    def packed(self) -> int:
        """Return them in one number, from the lowest byte: robot, safety, runtime, status (1 each), safety bits (2)."""
        low = (self.robot_mode, self.safety_mode, self.runtime_state, self.status_bits)
        return sum((value & 0xFF) << 8 * i for i, value in enumerate(low)) | (self.safety_bits & 0xFFFF) << 32
