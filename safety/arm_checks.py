"""Is the arm held, and does it still say so? Any program that is not ours, any drift, any stop is a fault."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.messages import LinkState
from robot_io.tick import ControlState, SafetyState, TickInput
from safety.settings import SafetySettings

STALE_HOLD_NS = 40_000_000
"""Five packets of the controller; 25 ms were seen on a loaded loopback."""
STALE_STOP_NS = 100_000_000
MAX_JOINT_SPEED_RAD_PER_S = 0.02
JOINT_SPEED_PACKETS = 2

ROBOT_MODE_RUNNING = 7
"""UR RTDE guide: robot_mode."""
RUNTIME_STOPPED = 1
"""UR RTDE guide: runtime_state."""
JOINT_MODE_RUNNING = 253
NORMAL_OR_REDUCED = 0b11
SAFETY_NORMAL, SAFETY_REDUCED = 1, 2
SAFETY_EMERGENCY = (6, 7)
"""UR RTDE guide: safety_mode, which says the same as the bits and is believed as well."""
EMERGENCY = (1 << 5) | (1 << 6) | (1 << 7)
ANY_STOP = 0b11111111100
"""UR RTDE guide: safety_status_bits, bits 2 to 10."""
TEACH_BUTTON = 1 << 2
POWER_ON = 1
"""UR RTDE guide: robot_status_bits."""


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of the arm."""
    arm, joints = inp.arm, inp.arm.joints
    faults: list[str] = []
    if not inp.host.arm_alive:
        faults.append("F69")
    age_ns = inp.now_ns - arm.published_ns
    if age_ns > STALE_STOP_NS or arm.link == LinkState.LOST:
        faults.append("F24-stop")
    elif age_ns > STALE_HOLD_NS:
        faults.append("F24-hold")
    else:
        still_ns = inp.now_ns - arm.changed_ns
        if still_ns > STALE_STOP_NS:
            faults.append("F25-stop")
        elif still_ns > STALE_HOLD_NS:
            faults.append("F25-hold")
    if not all(math.isfinite(v) for v in (*joints.position, *joints.velocity)):
        return state, [*faults, "F29"]
    drift = max(abs(q - held) for q, held in zip(joints.position, control.held_joints, strict=True))
    if drift > settings.drift_stop:
        faults.append("F20-stop")
    elif drift > settings.drift_hold:
        faults.append("F20-hold")
    if any(abs(q - p) > settings.held_pose_tolerance for q, p in zip(joints.position, settings.held_pose, strict=True)):
        faults.append("R04")
    run = state.arm_velocity_run
    if arm.packets != state.arm_packets:
        run = run + 1 if max(map(abs, joints.velocity)) > MAX_JOINT_SPEED_RAD_PER_S else 0
    if run >= JOINT_SPEED_PACKETS:
        faults.append("F21")
    faults += _of_modes(settings, inp)
    return replace(state, arm_packets=arm.packets, arm_velocity_run=run), faults


def _of_modes(settings: SafetySettings, inp: TickInput) -> list[str]:
    joints = inp.arm.joints
    bits = joints.safety_bits
    if bits & EMERGENCY or joints.safety_mode in SAFETY_EMERGENCY:
        return ["F23"]
    if bits & ANY_STOP or not bits & NORMAL_OR_REDUCED or joints.safety_mode not in (SAFETY_NORMAL, SAFETY_REDUCED):
        return ["F22"]
    status = joints.robot_status_bits
    running = joints.robot_mode == ROBOT_MODE_RUNNING and status & POWER_ON and not status & TEACH_BUTTON
    if not running or any(mode != JOINT_MODE_RUNNING for mode in inp.arm.joint_modes):
        return ["F27"]
    if joints.runtime_state != RUNTIME_STOPPED and not settings.servo:
        return ["F28"]
    if settings.servo and not inp.arm.servo:
        return ["F20-stop"]
    return []
