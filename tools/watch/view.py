"""Everything that one picture of `push watch` shows, as plain values: for the screen, a line, and JSON. Pure."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from control.base_velocity import contact_point_world
from control.settings import Settings
from control.wrench import force_on_slider_world
from robot_io.clock import NS_PER_MS
from robot_io.messages import ArmState, BasePose, Vector3
from robot_io.rig.config import RigConfig
from tools.verdict.arm_pose import JOINTS
from tools.watch.ball_force import BallForce, ball_force, mean
from tools.watch.seen import Link, Seen, Stage

SCHEMA = 1
LATE_MS = {"ft": 150.0, "arm": 150.0, "pose": 250.0, "odometry": 250.0, "status": 4000.0}
"""Data older than this are marked: several periods of each, and the 50 ms between two reports."""


class Feed(msgspec.Struct, frozen=True):
    """How often something comes and how old the newest is; None where that is not known."""

    rate_hz: float | None
    age_ms: float | None
    late: bool
    """Older than it should be, or never seen."""


class ArmView(msgspec.Struct, frozen=True):
    """The arm: an `ArmState` in words, joints in rad, and the joint that is furthest off the rig's held pose."""

    state: str
    joints_rad: tuple[float, ...]
    worst_joint: str
    off_held_rad: float
    held: bool
    """Whether it is within the rig's tolerance."""


class BaseView(msgspec.Struct, frozen=True):
    """The base: pose in WORLD (m, m, rad), velocity in BODY (m/s, m/s, rad/s), stop, motors and battery."""

    pose: tuple[float, float, float] | None
    pose_flaw: str
    twist: tuple[float, float, float] | None
    stop_engaged: bool | None
    drivers_active: bool | None
    battery_v: float | None


class View(msgspec.Struct, frozen=True):
    """One picture."""

    rig: str
    source: str
    """What it shows, in words."""
    tare: str
    force: BallForce | None
    """Of the last 0.2 s; None before a tare and without readings."""
    torque_on_object: Vector3 | None
    """Of the same time: N*m, about the sensor's origin, axes of WORLD; None also without a heading of the base."""
    lateral_m: float | None
    """y_c: how far the ball's centre is left of the path."""
    links: dict[str, Link]
    feeds: dict[str, Feed]
    arm: ArmView | None
    base: BaseView
    stage: Stage | None
    """Where the run is that is watched; None for devices of our own."""


def view_of(seen: Seen, source: str, now_ns: int) -> View:
    """Return the picture of what was seen; now_ns: CLOCK_MONOTONIC, not used where a run's own time is known."""
    at_ns = seen.now_ns if seen.now_ns is not None else now_ns
    settings = Settings.of(seen.rig)
    pose = seen.pose.pose if seen.pose is not None and seen.pose.valid else None
    lateral_m = None
    if pose is not None:
        contact = contact_point_world(pose.x, pose.y, pose.yaw, settings.contact_x, settings.contact_y)
        lateral_m = finite(settings.path.lateral(*contact))
    feeds = {name: _feed(seen, name, at_ns) for name in seen.rates}
    force = torque = None
    if seen.bias is not None and feeds["ft"].rate_hz is not None and (recent := seen.recent()):
        yaw, mounted = pose.yaw if pose is not None else None, settings.base_from_sensor
        force = ball_force(mean([one.force for one in recent]), seen.bias, mounted, yaw, settings.path)
        if yaw is not None and seen.bias_torque is not None:
            torque = force_on_slider_world(mean([one.torque for one in recent]), seen.bias_torque, mounted, yaw)
    return View(
        seen.rig.name,
        source,
        seen.tare_words,
        force,
        torque,
        lateral_m,
        dict(seen.links),
        feeds,
        _arm(seen.rig, seen),
        _base(seen, seen.pose),
        seen.stage,
    )


def as_json(view: View) -> dict[str, Any]:
    """Return the picture as the object of one line of JSON; what is not known is null."""
    force = view.force
    return {
        "schema": SCHEMA,
        "rig": view.rig,
        "source": view.source,
        "tare": view.tare,
        "force_on_ball_sensor_N": None if force is None else [finite(value) for value in force.sensor],
        "force_on_ball_body_N": None if force is None else [finite(value) for value in force.body],
        "force_on_ball_path_N": None if force is None or force.path is None else [finite(v) for v in force.path],
        "theta_f_rad": None if force is None else force.theta_f_rad,
        "lateral_m": view.lateral_m,
        "ft": _device(view, "ft", "ft"),
        "arm": {**_device(view, "arm", "arm"), **_fields(view.arm)},
        "base": {**_device(view, "base", "pose", "odometry", "status"), **_fields(view.base)},
        "run": _fields(view.stage) or None,
    }


def finite(value: float | None) -> float | None:
    """Return a number, None for one that is not finite."""
    return value if value is not None and math.isfinite(value) else None


def _device(view: View, device: str, *feeds: str) -> dict[str, Any]:
    link = view.links[device]
    told: dict[str, Any] = {"state": link.state, "cause": link.cause}
    for name in feeds:
        prefix = "" if name == device else f"{name}_"
        feed = view.feeds[name]
        told |= {f"{prefix}rate_hz": feed.rate_hz, f"{prefix}age_ms": feed.age_ms, f"{prefix}late": feed.late}
    return told


def _fields(part: msgspec.Struct | None) -> dict[str, Any]:
    if part is None:
        return {}
    told: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(part))  # NaN becomes null
    if isinstance(part, ArmView):
        told["arm_state"] = told.pop("state")
    return told


def _feed(seen: Seen, name: str, at_ns: int) -> Feed:
    rate, newest_ns = seen.rates[name], seen.rates[name].newest_ns
    age_ms = None if newest_ns is None else max(0.0, (at_ns - newest_ns) / NS_PER_MS)
    hz = rate.hz(at_ns) if name != "status" else None
    return Feed(hz, age_ms, age_ms is None or age_ms > LATE_MS[name])


def _arm(rig: RigConfig, seen: Seen) -> ArmView | None:
    arm = seen.arm
    if arm is None:
        return None
    off = [at - wanted for at, wanted in zip(arm.position, rig.arm.held_pose_rad, strict=True)]
    worst = max(range(len(off)), key=lambda i: abs(off[i]))
    held = all(abs(by) <= rig.arm.held_pose_tolerance_rad for by in off)
    state = ArmState(arm.state).name.lower().replace("_", " ")
    return ArmView(state, arm.position, JOINTS[worst], off[worst], held)


def _base(seen: Seen, pose: BasePose | None) -> BaseView:
    twist, status = seen.twist, seen.status
    return BaseView(
        None if pose is None else (pose.pose.x, pose.pose.y, pose.pose.yaw),
        "" if pose is None else pose.flaw,
        None if twist is None else (twist.vx, twist.vy, twist.omega),
        None if status is None else status.stop_engaged,
        None if status is None else status.drivers_active,
        None if status is None else status.battery_v,
    )
