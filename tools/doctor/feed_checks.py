"""The rows of what the base says of itself: pose, odometry, status, and what is in them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

from robot_io.messages import BaseOdometry, BasePose, BaseReport, BaseStatus
from robot_io.ridgeback.feeds import with_full_names
from robot_io.ridgeback.look import BATTERY_EMPTY_V, BATTERY_LOW_V, Heard
from robot_io.rig.config import RigConfig
from safety.checks.base_checks import (
    MOVING_M_PER_S,
    POSE_SLOW_FLOOR_NS,
    POSE_SLOW_PERIODS,
    POSE_STOP_FLOOR_NS,
    POSE_STOP_PERIODS,
    STALE_HOLD_NS,
    STALE_STOP_NS,
)
from tools.doctor.check import Result, Rows

PAUSES = 2
"""One pause may be this machine's own."""
PUBLISHER_FIX = "Check that its publisher runs (motion capture: is the base seen?) and its name in the rig file"
WrongTypes = Mapping[str, tuple[str, str] | None]


def judge_feeds(rows: Rows, rig: RigConfig, heard: Heard, wrong: WrongTypes) -> None:
    """Judge what was heard; `wrong` has the topics whose type does not fit."""
    topics = with_full_names(rig.base.topics)
    pose_topic = {
        "mocap": topics.base_pose, "odometry": topics.odometry, "joint_states": topics.joint_states
    }[rig.base.pose_source]  # fmt: skip
    if not _silent(rows, "pose", pose_topic, heard, wrong):
        _pose(rows, rig, heard)
    if not _silent(rows, "odometry", topics.odometry, heard, wrong):
        _odometry(rows, heard)
    if not topics.status:
        rows.skip("status", "the rig names no topic of it")
    elif not _silent(rows, "status", topics.status, heard, wrong):
        _status(rows, topics.status, [s.value.status for s in heard.samples if isinstance(s.value, BaseReport)])


def _silent(rows: Rows, name: str, topic: str, heard: Heard, wrong: WrongTypes) -> bool:
    """Judge a topic that said nothing usable; return whether it did."""
    if topic not in heard.why_silent:
        return False
    if pair := wrong.get(topic):
        told, fix = f"{topic} carries {pair[1]}, the rig file says {pair[0]}", "Correct its type (or ros_version)"
    elif why := heard.why_silent[topic]:
        told, fix = f"messages on {topic} could not be read ({why})", "Check the publisher and the type in the rig file"
    else:
        told, fix = f"no message on {topic} within {heard.span_s:.1f} s", PUBLISHER_FIX
    rows.bad(name, "failed", told, fix)
    return True


def _rate_hz(heard: Heard, kind: type) -> float:
    stamps = [sample.received_ns for sample in heard.samples if isinstance(sample.value, kind)]
    span_s = heard.span_s if len(stamps) < 2 else (stamps[-1] - stamps[0]) * 1e-9
    return max(len(stamps) - 1, 1) / span_s if span_s > 0.0 else 0.0


def _gaps(heard: Heard, kind: type, longer_ns: float) -> int:
    """Return how many pauses between two messages were longer than so."""
    stamps = [sample.received_ns for sample in heard.samples if isinstance(sample.value, kind)]
    return sum(b - a > longer_ns for a, b in itertools.pairwise(stamps))


def _paced(rate_hz: float, slow_ns: float, stop_ns: float) -> Result:
    period_ns = 1e9 / rate_hz
    return "failed" if period_ns > stop_ns else "warning" if period_ns > slow_ns else "ok"


def _pose(rows: Rows, rig: RigConfig, heard: Heard) -> None:
    poses = [sample.value for sample in heard.samples if isinstance(sample.value, BasePose)]
    period_ns = 1e9 / rig.base.pose_rate_hz
    slow_ns = max(POSE_SLOW_PERIODS * period_ns, POSE_SLOW_FLOOR_NS)
    stop_ns = max(POSE_STOP_PERIODS * period_ns, POSE_STOP_FLOOR_NS)
    rate_hz, least_hz = _rate_hz(heard, BasePose), 1e9 / slow_ns
    flawed = [pose.flaw for pose in poses if pose.flaw]
    frames = [flaw for flaw in flawed if "expected" in flaw]
    if frames:
        fix = "Correct base.topics.world_frame, or the frame that motion capture publishes in"
        rows.bad("frame", "failed", frames[0], fix, heard.pose_frame)
    elif heard.pose_frame:
        expected = "as the rig says" if rig.base.topics.world_frame else "the rig names none, so any is taken"
        rows.ok("frame", f"poses come in {heard.pose_frame!r}: {expected}", heard.pose_frame)
    else:
        rows.ok("frame", "poses name no frame")
    unusable = [flaw for flaw in flawed if flaw not in frames]
    told = f"{len(poses)} poses at {rate_hz:.1f} Hz"
    result = _paced(rate_hz, slow_ns, stop_ns)
    if gaps := _gaps(heard, BasePose, stop_ns):
        told += f", {gaps} pauses longer than {stop_ns / 1e6:.0f} ms"
        result = "failed" if gaps >= PAUSES else result
    if unusable:
        told = f"{len(unusable)} of {len(poses)} poses cannot be used: {unusable[0]}"
        rows.bad("pose", "failed", told, PUBLISHER_FIX, rate_hz, least_hz, "Hz")
    elif result != "ok":
        fix = "Check the network and the publisher's rate, or correct base.pose_rate_hz"
        rows.bad("pose", result, told, fix, rate_hz, least_hz, "Hz")
    else:
        x, y, yaw = poses[-1].pose.x, poses[-1].pose.y, math.degrees(poses[-1].pose.yaw)
        rows.ok("pose", f"{told}; at x {x:.3f} m, y {y:.3f} m, {yaw:.1f} degrees", rate_hz, least_hz, "Hz")


def _odometry(rows: Rows, heard: Heard) -> None:
    twists = [sample.value.twist for sample in heard.samples if isinstance(sample.value, BaseOdometry)]
    rate_hz, least_hz = _rate_hz(heard, BaseOdometry), 1e9 / STALE_HOLD_NS
    numbers = all(math.isfinite(v) for t in twists for v in (t.vx, t.vy, t.omega))
    told = f"{len(twists)} messages at {rate_hz:.1f} Hz"
    result = _paced(rate_hz, STALE_HOLD_NS, STALE_STOP_NS)
    if not numbers:
        rows.bad("odometry", "failed", f"{told}, with velocities that are no numbers", "Check the wheel odometry")
        return
    speed = sorted(math.hypot(t.vx, t.vy) for t in twists)[len(twists) // 2]
    if speed > MOVING_M_PER_S:
        what, fix = f"{told}, and the base moves at {speed:.2f} m/s", "Find out who drives it (joystick?)"
        rows.bad("odometry", "failed", what, fix, speed, MOVING_M_PER_S, "m/s")
    elif result != "ok":
        rows.bad("odometry", result, told, "Check the network and the base's software", rate_hz, least_hz, "Hz")
    else:
        rows.ok("odometry", f"{told}, standing still", rate_hz, least_hz, "Hz")


def _status(rows: Rows, topic: str, reports: list[BaseStatus]) -> None:
    newest = reports[-1]
    rows.ok("status", f"{topic} speaks", float(len(reports)))
    if newest.stop_engaged:
        rows.bad("e-stop", "failed", "a stop is pressed", "Release it and press reset")
    elif not newest.drivers_active:
        rows.bad("e-stop", "failed", "the motors are off", "Press reset; if they stay off, look at the base's panel")
    else:
        rows.ok("e-stop", "no stop is pressed, the motors are on")
    volt = newest.battery_v
    told = f"{volt:.1f} V"
    if volt >= BATTERY_LOW_V:
        rows.ok("battery", told, volt, BATTERY_LOW_V, "V")
    else:
        result: Result = "warning" if volt >= BATTERY_EMPTY_V else "failed"
        rows.bad("battery", result, told, "Charge the base", volt, BATTERY_LOW_V, "V")
