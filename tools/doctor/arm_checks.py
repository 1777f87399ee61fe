"""The rows of the arm: questions to the dashboard and packets received; nothing is uploaded, moved or written."""

from __future__ import annotations

import math
import time

from robot_io.errors import DeviceError, PushError
from robot_io.messages import ArmState
from robot_io.rig.config import RigConfig
from robot_io.ur10.generation import Generation, Version, generation_of, model_of, wanted_model
from robot_io.ur10.look import (
    INPUTS,
    LOOK_WITHIN_S,
    ArmPacket,
    DashboardWords,
    accepts_scripts,
    ask_dashboard,
    inputs_in_use,
    receive,
)
from robot_io.ur10.preflight import read_version
from safety.checks.arm_checks import MAX_JOINT_SPEED_RAD_PER_S
from tools.doctor.check import Check, Rows
from tools.verdict.arm_pose import JOINTS, whole_turns

PENDANT = "at the teach pendant"
PROGRAM_FIX = f"Stop the program {PENDANT}: whatever moves the arm spoils the push"
STOP_FIX = f"Clear the stop {PENDANT}, look at why it happened, and try again"


def arm_checks(rig: RigConfig) -> list[Check]:
    """Return the rows of the UR at the rig's host; at most 12 s."""
    rows, host = Rows("arm"), rig.arm.host
    try:
        version = read_version(host, time.monotonic() + LOOK_WITHIN_S)
        try:
            generation = generation_of(host, version)
        except DeviceError as error:
            rows.ok("ports", f"RTDE answers at {host}")
            rows.error("version", error)
            return rows.all("this controller is not known")
        words = ask_dashboard(host, generation)
        packets = receive(host)
        if rig.arm.hold == "servo":
            accepts_scripts(host)
    except DeviceError as error:
        rows.error("ports", error)
        return rows.all("the controller was not reached")
    ports = "dashboard, RTDE and scripts" if rig.arm.hold == "servo" else "dashboard and RTDE"
    rows.ok("ports", f"{ports} answer at {host}; {len(packets)} packets in a row")
    _version(rows, rig, version, generation, words)
    state = ArmState(packets[-1].modes.state(own_program=False))
    _safety(rows, state, words)
    _mode(rows, state, words, packets[-1])
    _pose(rows, rig, packets)
    _inputs(rows, rig)
    return rows.all("the controller did not say")


def _version(rows: Rows, rig: RigConfig, version: Version, generation: Generation, words: DashboardWords) -> None:
    number = ".".join(map(str, version))
    try:
        model = model_of(rig.arm.host, generation, words.model, wanted_model(rig.arm.options))
    except PushError as error:
        rows.error("version", error)
    else:
        rows.ok("version", f"{model} {words.serial[:40]}, {generation.name}, PolyScope {number}", number)


def _safety(rows: Rows, state: ArmState, words: DashboardWords) -> None:
    stopped = state in (ArmState.PROTECTIVE_STOP, ArmState.EMERGENCY_STOP)
    told = f"safety mode {words.safety_mode[:40]}"
    if stopped or words.safety_mode not in ("NORMAL", "REDUCED"):
        rows.bad("safety", "failed", f"stopped by safety: {told}", STOP_FIX, words.safety_mode[:40])
    else:
        rows.ok("safety", told, words.safety_mode)


def _mode(rows: Rows, state: ArmState, words: DashboardWords, packet: ArmPacket) -> None:
    mode = words.robot_mode[:40]
    told = f"robot mode {mode}"
    if mode != "RUNNING" or state == ArmState.OFF:
        fix = f"Switch the arm on and release the brakes {PENDANT}"
        rows.bad("mode", "failed", f"not running: {told}, joint modes {packet.modes.joint_modes}", fix, mode)
    elif state == ArmState.MOVING:
        rows.bad("mode", "failed", f"{told}, and its teach button is pressed", "Let go of the teach button", mode)
    elif words.program_running or state == ArmState.FOREIGN_PROGRAM:
        rows.bad("mode", "failed", f"{told}, and a program is on", PROGRAM_FIX, mode)
    else:
        rows.ok("mode", f"{told}, no program", mode)


def _pose(rows: Rows, rig: RigConfig, packets: list[ArmPacket]) -> None:
    newest, held, tolerance = packets[-1], rig.arm.held_pose_rad, rig.arm.held_pose_tolerance_rad
    if not all(math.isfinite(value) for packet in packets for value in (*packet.position, *packet.velocity)):
        rows.bad("pose", "failed", "a joint's position is not a number", "Restart the controller")
        return
    turns = [whole_turns(at - wanted) for at, wanted in zip(newest.position, held, strict=True)]
    off = [at - wanted - n * math.tau for at, wanted, n in zip(newest.position, held, turns, strict=True)]
    worst = max(off, key=abs)
    told = ", ".join(f"{name} {by:+.4f}" for name, by in zip(JOINTS, off, strict=True))
    speed = max(abs(v) for packet in packets for v in packet.velocity)
    moved = max(abs(a - b) for a, b in zip(newest.position, packets[0].position, strict=True))
    if newest.controller_s <= packets[0].controller_s:
        rows.bad("pose", "failed", "the controller's clock stands still or runs back", "Restart the controller")
    elif speed > MAX_JOINT_SPEED_RAD_PER_S or moved > rig.limits.drift_hold_rad / 4:
        what = f"the arm moves: {speed:.3f} rad/s, {moved:.4f} rad meanwhile"
        rows.bad("pose", "failed", what, f"Find out {PENDANT} what moves it", speed, MAX_JOINT_SPEED_RAD_PER_S, "rad/s")
    elif abs(worst) > tolerance:
        fix = f"Move the arm to the rig's held_pose_rad {PENDANT}, or correct the rig (and its frames)"
        rows.bad("pose", "failed", f"off the held pose, rad: {told}", fix, worst, tolerance, "rad")
    else:
        rows.ok("pose", f"off the held pose, rad: {told}", worst, tolerance, "rad")
    wound = [f"{name} {n:+d}" for name, n in zip(JOINTS, turns, strict=True) if n]
    if wound:
        fix = f"Turn these joints back {PENDANT}: their cables are wound up"
        rows.bad("turns", "failed", f"whole turns away: {', '.join(wound)}", fix, float(max(map(abs, turns))), 0.0)
    else:
        rows.ok("turns", "no joint is a whole turn away", 0.0, 0.0)


def _inputs(rows: Rows, rig: RigConfig) -> None:
    if rig.arm.hold != "servo":
        rows.skip("inputs", 'hold = "monitor" needs none')
        return
    try:
        taken = inputs_in_use(rig.arm.host)
    except DeviceError as error:
        rows.error("inputs", error)
        return
    if taken:
        told = f"{len(taken)} of {len(INPUTS)} inputs are held by somebody else, the first {taken[0]}"
        fix = 'Disable fieldbuses (EtherNet/IP, PROFINET) and end other RTDE clients, or use hold = "monitor"'
        rows.bad("inputs", "failed", told, fix, float(len(taken)), 0.0)
    else:
        rows.ok("inputs", f"all {len(INPUTS)} inputs of active holding are free", 0.0, 0.0)
