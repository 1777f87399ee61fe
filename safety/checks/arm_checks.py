"""Checks that the arm is held: another program, drift, a stop or stale data is a fault."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.messages import ArmState, LinkState
from robot_io.tick import ControlState, SafetyState, TickInput
from safety.finding import NS_PER_MS, Finding
from safety.settings import SafetySettings

STALE_HOLD_NS = 40_000_000
"""Five packets of the controller; up to 25 ms were measured on a loaded loopback."""
STALE_STOP_NS = 100_000_000
MAX_JOINT_SPEED_RAD_PER_S = 0.02
JOINT_SPEED_PACKETS = 2


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
        faults.append(Finding("F24-stop", age_ns / NS_PER_MS))
    elif age_ns > STALE_HOLD_NS:
        faults.append(Finding("F24-hold", age_ns / NS_PER_MS))
    else:
        still_ns = inp.now_ns - arm.changed_ns
        if still_ns > STALE_STOP_NS:
            faults.append(Finding("F25-stop", still_ns / NS_PER_MS))
        elif still_ns > STALE_HOLD_NS:
            faults.append(Finding("F25-hold", still_ns / NS_PER_MS))
    if not all(map(math.isfinite, (*joints.position, *joints.velocity))):
        return state, [*faults, "F29"]
    drift = max([abs(q - held) for q, held in zip(joints.position, control.held_joints, strict=True)])
    if drift > settings.drift_stop:
        faults.append(Finding("F20-stop", drift))
    elif drift > settings.drift_hold:
        faults.append(Finding("F20-hold", drift))
    off = max([abs(q - p) for q, p in zip(joints.position, settings.held_pose, strict=True)])
    if off > settings.held_pose_tolerance:
        faults.append(Finding("R04", off))
    run = state.arm_velocity_run
    if arm.packets != state.arm_packets:
        run = run + 1 if max(map(abs, joints.velocity)) > MAX_JOINT_SPEED_RAD_PER_S else 0
    if run >= JOINT_SPEED_PACKETS:
        faults.append(Finding("F21", max(map(abs, joints.velocity))))
    faults += _of_state(settings, inp)
    return replace(state, arm_packets=arm.packets, arm_velocity_run=run), faults


def _of_state(settings: SafetySettings, inp: TickInput) -> list[str]:
    state = inp.arm.joints.state
    if state == ArmState.EMERGENCY_STOP:
        return ["F23"]
    if state == ArmState.PROTECTIVE_STOP:
        return ["F22"]
    if state == ArmState.FOREIGN_PROGRAM:
        return ["F28"]
    if state != ArmState.HOLDING:  # off, moved by hand, unknown, or a number that is not a valid state
        return ["F27"]
    if settings.servo and not inp.arm.servo:
        return ["F20-stop"]
    return []
