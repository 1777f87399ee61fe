"""Measurements by motion capture: contact point, marker frame and path. The operator drives, this only looks."""

from __future__ import annotations

import math

import numpy as np

from robot_io.messages import BodyTwist
from tools.calibrate.devices import BaseHeard, direction_driven, hear_base
from tools.calibrate.estimators.contact import Sight, estimate_from_marker, estimate_from_plumb
from tools.calibrate.estimators.estimate import Array, Estimate
from tools.calibrate.estimators.line import estimate_line
from tools.calibrate.estimators.marker import Straight, estimate_marker
from tools.calibrate.estimators.mean_pose import MeanPose, mean_pose
from tools.calibrate.people import Done, Drive, Rest, ask
from tools.calibrate.session import Session

STAND_S = 3.0
STILL = "Let the base stand still"
AHEAD = ((BodyTwist(0.2, 0.0, 0.0), 8.0), (BodyTwist(), 1.0))
BACK = ((BodyTwist(-0.2, 0.0, 0.0), 8.0), (BodyTwist(), 1.0))
ROUND = ((BodyTwist(0.0, 0.0, 0.4), 16.0), (BodyTwist(), 1.0))
QUARTER = ((BodyTwist(0.0, 0.0, 0.4), 4.5), (BodyTwist(), 1.0))


def measure_contact_by_marker(session: Session) -> Estimate:
    """Return the ball's centre by the marker on it that `base.topics.ball_pose` tells of."""
    ask(session.operator, Rest(f"{STILL}, with the marker on the ball in sight"))
    heard = _heard(session, STAND_S, other=session.rig.base.topics.ball_pose)
    ball = mean_pose(heard.other, "the ball")
    sight = Sight(mean_pose(heard.base), (ball.pose.x, ball.pose.y), ball.place_error_m)
    return estimate_from_marker([sight], session.rig.frames.contact_in_base_m)


def measure_contact_by_plumb(session: Session, marking_m: float) -> Estimate:
    """Return the ball's centre by plumb lines at two headings; marking_m: 1 sigma of a coordinate typed in."""
    sights = [_plumbed(session, marking_m)]
    ask(session.operator, Drive("Turn the base by 90 to 180 degrees with the joystick, and let it stand", QUARTER))
    sights.append(_plumbed(session, marking_m))
    return estimate_from_plumb(sights, session.rig.frames.contact_in_base_m)


def _plumbed(session: Session, marking_m: float) -> Sight:
    ask(session.operator, Rest(STILL))
    base = _stood(session)
    point = session.operator.plumb("Plumb the ball's centre to the floor and measure the point", base.pose)
    return Sight(base, point, marking_m)


def measure_marker(session: Session) -> Estimate:
    """Return base_from_marker from a straight drive and a turn on the spot, both with the joystick."""
    ask(session.operator, Rest(STILL))
    before = _stood(session, markers=True)
    straight = Drive("Drive straight ahead or straight back by 1.5 m with the joystick, and let it stand", BACK)
    driven = _heard(session, 0.5, markers=True, until=session.operator.begin(straight))
    direction, error = direction_driven(driven)
    after = _stood(session, markers=True)
    turn = Drive("Turn the base once around on the spot with the joystick, and let it stand", ROUND)
    turned = _heard(session, 0.5, markers=True, until=session.operator.begin(turn))
    return estimate_marker(
        Straight(before, after, direction, error), while_turning(turned.base), session.rig.frames.base_from_marker
    )


def while_turning(poses: Array) -> Array:
    """Return the poses without those at rest before and after the turn, which would weigh two places most."""
    headings = np.unwrap(poses[:, 2])
    turned = np.abs(headings - headings[:1]), np.abs(headings - headings[-1:])
    moving = np.flatnonzero((turned[0] > math.radians(2.0)) & (turned[1] > math.radians(2.0)))
    return poses[moving[0] : moving[-1] + 1] if len(moving) else poses


def measure_path(session: Session, *, two_places: bool) -> Estimate:
    """Return origin and direction of the path from where the base stands, or from there and farther along it."""
    ask(session.operator, Rest("Drive the base to the start of the path, the ball on the line, and let it stand"))
    first, second = _stood(session), None
    if two_places:
        ask(session.operator, Drive("Drive it on along the path, the ball on the line again, and let it stand", AHEAD))
        second = _stood(session)
    return estimate_line(first, second, session.rig.frames.contact_in_base_m)


def _stood(session: Session, *, markers: bool = False) -> MeanPose:
    return mean_pose(_heard(session, STAND_S, markers=markers).base)


def _heard(
    session: Session, seconds: float, *, markers: bool = False, other: str = "", until: Done | None = None
) -> BaseHeard:
    heard = hear_base(session.rig, seconds, markers=markers, other=other, until=until)
    for poses in (heard.base, heard.other):
        if len(poses):
            session.raw.poses(poses)
    return heard
