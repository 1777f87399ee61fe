"""Measurements by the force-torque sensor: bias, sign, and frame by a cord or by the tool's weight."""

from __future__ import annotations

import math
from collections.abc import Sequence

from robot_io.messages import Joints, Vector3
from tools.calibrate.devices import SensorFeed, arm_joints, open_sensor
from tools.calibrate.estimators.bias import estimate_bias
from tools.calibrate.estimators.cord import Pull, check_directions, estimate_yaw
from tools.calibrate.estimators.estimate import Array, Estimate
from tools.calibrate.estimators.sign import DIRECTIONS, estimate_sign
from tools.calibrate.estimators.steady import Steady, steady
from tools.calibrate.estimators.weight import FEWEST, Pose, estimate_mounting
from tools.calibrate.people import PoseArm, Press, Rest, ask, tell
from tools.calibrate.session import Session
from tools.places import saved_tare

TARE_S = 5.0
HOLD_S = 3.0
WEIGH_S = 10.0
SPARE_S = 1.5
"""A press is held this much longer than it is measured."""
PRESS_N = 15.0
PULL_N = 25.0
POSES = 4
FREE = "Let go of the ball: nothing touches arm, tool or base"
TURNS_RAD: tuple[Joints, ...] = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0, 1.2, 0.0),
    (0.0, 0.0, 0.0, 0.0, 0.0, 1.5),
    (0.0, 0.0, 0.0, -0.8, 0.0, -1.3),
)
"""How far each pose of the arm is from the held one: wrists only, so that the tool stays clear of the base."""


def measure_bias(session: Session, seconds: float) -> Estimate:
    """Return the bias over `seconds` at rest; it is saved as the tare for `--start-in-contact`."""
    rig = session.rig
    with open_sensor(rig, session.folder) as sensor:
        ask(session.operator, Rest(FREE), sensor.idle)
        found = estimate_bias(*_collected(session, sensor, seconds, "keep everything still"), rig.ft.noise)
    a, b, c, d, e, f = found.value
    saved_tare.save(rig, (a, b, c, d, e, f), arm_joints(rig, session.folder))
    return found


def measure_sign(session: Session) -> Estimate:
    """Return the mounting that fits three presses by hand."""
    with open_sensor(session.rig, session.folder) as sensor:
        tare = _tare(session, sensor)
        presses = {}
        for name, axis in DIRECTIONS.items():
            text = f"Press the ball {name} with about {PRESS_N:g} N and keep pressing"
            presses[name] = _held(session, sensor, text, _times(axis, PRESS_N))
        return estimate_sign(presses, tare, session.rig.frames.base_from_sensor)


def measure_cord(session: Session, angles_deg: Sequence[float], marking_deg: float) -> Estimate:
    """Return the yaw by a cord pulled along each of `angles_deg` (BODY, counter-clockwise from ahead)."""
    check_directions(angles_deg)
    with open_sensor(session.rig, session.folder) as sensor:
        before = _tare(session, sensor)
        pulls = []
        for angle in angles_deg:
            text = (
                f"Hold the cord taut from the ball along the mark at {angle:g} degrees, level, with about {PULL_N:g} N"
            )
            along = (math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0.0)
            pulls.append(Pull(angle, _held(session, sensor, text, _times(along, PULL_N))))
        after = _tare(session, sensor)
    return estimate_yaw(pulls, before, after, session.rig.frames.base_from_sensor, marking_deg)


def measure_weight(session: Session) -> Estimate:
    """Return the tilt of the mounting by the tool's weight in four poses; the arm is moved by hand, never by us."""
    held = session.rig.arm.held_pose_rad
    poses = []
    with open_sensor(session.rig, session.folder) as sensor:
        for number, turn in enumerate(TURNS_RAD, 1):
            where = (
                "to the held pose" if not any(turn) else "by hand to another pose: turn its last joints by 60 degrees"
            )
            text = f"Pose {number} of {POSES} (at least {FEWEST}): move the arm {where}, let go of it"
            a, b, c, d, e, f = (q + by for q, by in zip(held, turn, strict=True))
            ask(session.operator, PoseArm(text, (a, b, c, d, e, f)), sensor.idle)
            reading = steady(*_collected(session, sensor, WEIGH_S, "do not touch the arm"))
            poses.append(Pose(arm_joints(session.rig, session.folder), reading))
            sensor.idle()
        ask(session.operator, PoseArm("Move the arm back to the held pose", held), sensor.idle)
    return estimate_mounting(poses, held, session.rig.frames.base_from_sensor)


def _tare(session: Session, sensor: SensorFeed) -> Steady:
    ask(session.operator, Rest(FREE), sensor.idle)
    return steady(*_collected(session, sensor, TARE_S, "keep everything still"))


def _held(session: Session, sensor: SensorFeed, text: str, force_body_N: Vector3) -> Steady:
    ask(session.operator, Press(text, force_body_N, HOLD_S + SPARE_S), sensor.idle)
    return steady(*_collected(session, sensor, HOLD_S, "keep the force"))


def _collected(session: Session, sensor: SensorFeed, seconds: float, meanwhile: str) -> tuple[Array, Array]:
    tell(f"measuring for {seconds:g} s: {meanwhile}")
    times_s, values = sensor.collect(seconds)
    session.raw.forces(times_s, values)
    return times_s, values


def _times(axis: Vector3, size: float) -> Vector3:
    return axis[0] * size, axis[1] * size, axis[2] * size
