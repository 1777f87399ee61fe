"""Where base and object may be, in numbers by hand.

A Ridgeback of 0.960 x 0.793 m at 0.1 m/s stops within 32 mm when this computer dies, and slows 64 mm before an edge.
"""

from __future__ import annotations

import math

import pytest
from msgspec.structs import replace

from robot_io.errors import ConfigError
from robot_io.messages import BodyTwist, Pose2D
from robot_io.tick import ControlState, Phase, SafetyState, WorkspaceState
from safety.checks import (
    workspace_checks,
)
from safety.settings import SafetySettings
from safety.workspace import WorkspaceSettings, room_for_push, start_box
from tests.safety.fold_bench import FoldBench
from tools.rig import resolve_rig

NOW = 9_000_000_000
APPROACH = ControlState(phase=int(Phase.APPROACH))
BEGUN = WorkspaceState(True)


def settings_of(*overrides):
    return SafetySettings.of(resolve_rig("sim", overrides))


def found_at(
    settings, pose, *, sent=(0.0, 0.0, 0.0), odometry=None, age_ns=0, slider=None, control=APPROACH, begun=BEGUN
):
    """Return what is found with the base at `pose`, moving so."""
    good = FoldBench().good_input()
    measured = BodyTwist(*(sent if odometry is None else odometry))
    base = replace(good.base, sent=BodyTwist(*sent), odometry=measured)
    if slider is not None:
        base = replace(base, object_pose=slider, object_received_ns=NOW)
    inp = replace(good, now_ns=NOW, base=base)
    state = SafetyState(pose_seq=9, pose_x=pose[0], pose_y=pose[1], pose_ns=NOW - age_ns, workspace=begun)
    return workspace_checks.check(settings, state, inp, control)


def faults_at(settings, pose, **motion):
    return found_at(settings, pose, **motion)[1]


BOX = settings_of("workspace.x_m=[-1.49, 3.0]", "workspace.y_m=[-2.0, 2.0]")
FORWARD = (0.1, 0.0, 0.0)


@pytest.mark.parametrize(
    ("x", "wanted"),
    [
        (3.0 - 0.48 - 0.0641, []),
        (3.0 - 0.48 - 0.0639, ["F55-slow"]),
        (3.0 - 0.48 - 0.0321, ["F55-slow"]),
        (3.0 - 0.48 - 0.0319, ["F55-stop"]),
        (9.0, ["F55-stop"]),
    ],
)
def test_forward_to_the_edge(x, wanted):
    assert faults_at(BOX, (x, 0.0), sent=FORWARD) == wanted
    assert faults_at(BOX, (x, 0.0), sent=(0.0, 0.0, 0.0), odometry=FORWARD) == wanted, "rolled or pushed by somebody"
    assert faults_at(BOX, (x, 0.0), sent=FORWARD, odometry=(math.nan, 0.0, 0.0)) == wanted, "odometry is no number"


@pytest.mark.parametrize("speed", [1e3, 1e155, 1.7e308])
def test_a_speed_whose_square_is_no_number_leaves_the_workspace(speed):
    assert faults_at(BOX, (0.0, 0.0), odometry=(speed, 0.0, 0.0)) == ["F55-stop"]
    assert faults_at(BOX, (0.0, 0.0), odometry=(0.0, -speed, 0.0)) == ["F55-stop"]


def test_what_is_measured_is_the_room_beyond_the_stopping_distance():
    (slow,) = faults_at(BOX, (3.0 - 0.48 - 0.05, 0.0), sent=FORWARD)
    assert slow.value == pytest.approx(0.05 - 0.064)
    (stop,) = faults_at(BOX, (3.0 - 0.48 - 0.02, 0.0), sent=FORWARD)
    assert stop.value == pytest.approx(0.02 - 0.032)


def test_away_from_an_edge_and_along_it_it_may_move():
    assert faults_at(BOX, (-1.49 + 0.481, 0.0), sent=FORWARD) == []
    assert faults_at(BOX, (0.0, 2.0 - 0.3966), sent=FORWARD) == []
    assert faults_at(BOX, (-1.49 + 0.479, 0.0), sent=FORWARD) == ["F55-stop"]
    assert faults_at(BOX, (3.0 - 0.481, 0.0)) == [], "at rest"


def test_an_old_pose_adds_what_was_rolled_since():
    x = 3.0 - 0.48 - 0.035
    assert faults_at(BOX, (x, 0.0), sent=FORWARD) == ["F55-slow"]
    assert faults_at(BOX, (x, 0.0), sent=FORWARD, age_ns=40_000_000) == ["F55-stop"]


def test_the_band_does_not_end_because_it_is_slow_there():
    assert faults_at(BOX, (3.0 - 0.48 - 0.063, 0.0), sent=(0.05, 0.0, 0.0)) == ["F55-slow"]


def test_a_turning_corner_counts():
    """0.25 rad/s for 0.3 s: the corner 0.48 m ahead and 0.3965 m aside comes 35 mm further to the left."""
    y = 2.0 - 0.3965 - 0.034
    assert faults_at(BOX, (0.0, y), sent=(0.1, 0.0, 0.25)) == ["F55-stop"]
    assert faults_at(BOX, (0.0, y), sent=(0.1, 0.0, 0.0)) == []


def test_before_the_first_motion_nothing_is_judged():
    assert faults_at(BOX, (9.0, 0.0), control=ControlState(phase=int(Phase.TARE)), begun=WorkspaceState()) == []


OBJECT_M = 0.5 / math.sqrt(2.0)
"""Half of the diagonal of the longest object that this rig is meant to push."""


def test_the_object_counts_where_it_is_seen():
    near = Pose2D(3.0 - OBJECT_M - 0.031, 0.0, 0.0)
    assert faults_at(BOX, (0.0, 0.0), sent=FORWARD, slider=near) == ["F55-stop"]
    assert faults_at(BOX, (0.0, 0.0), sent=FORWARD, slider=replace(near, x=near.x - 0.002)) == ["F55-slow"]
    assert faults_at(BOX, (0.0, 0.0), sent=FORWARD, slider=replace(near, x=near.x - 0.034)) == []
    unseen = settings_of("workspace.x_m=[-1.49, 3.0]", "workspace.y_m=[-2.0, 2.0]", 'base.topics.slider_pose=""')
    assert faults_at(unseen, (0.0, 0.0), sent=FORWARD, slider=near) == []
    odometry = settings_of("workspace.x_m=[-1.49, 3.0]", "workspace.y_m=[-2.0, 2.0]", "base.pose_source=odometry")
    assert faults_at(odometry, (0.0, 0.0), sent=FORWARD, slider=near) == [], "it is seen in another frame"


def test_without_a_workspace_it_is_a_box_about_the_path_from_the_start():
    """Approach 0.05 m, 0.5 m to spare, distance 2 m; 1 m on every side; the ball starts 0.2 m left of the path."""
    state, faults = found_at(settings_of(), (-1.0, 0.2), begun=WorkspaceState())
    assert faults == []
    assert state.workspace.known
    left, right = -1.0 - 0.48 - 1.0, -1.0 + 2.55 + 0.48 + 1.0
    low, high = 0.0 - 0.3965 - 1.0, 0.2 + 0.3965 + 1.0
    assert state.workspace.corners_x == pytest.approx((left, right, right, left))
    assert state.workspace.corners_y == pytest.approx((low, low, high, high))
    later = found_at(settings_of(), (0.0, 0.0), begun=state.workspace)[0]
    assert later.workspace == state.workspace, "it stays where it was"


def test_the_box_lies_along_the_path_and_holds_a_base_that_stands_across():
    settings = WorkspaceSettings.of(resolve_rig("sim", ["path.direction_deg=90", "frames.contact_in_base_m=[0, 0, 0]"]))
    xs, ys = zip(*start_box(settings, Pose2D(0.0, 0.0, 0.0)), strict=True)
    assert (min(ys), max(ys)) == pytest.approx((-0.3965 - 1.0, 2.55 + 0.3965 + 1.0))
    assert (min(xs), max(xs)) == pytest.approx((-0.48 - 1.0, 0.48 + 1.0))


def test_a_push_that_does_not_fit_from_where_the_base_stands_is_refused_before_it_moves():
    """It needs 2.05 m ahead, 0.48 m of its outline, and 0.064 m of the band in which it would slow down."""
    start, fits = WorkspaceState(), 3.0 - 2.05 - 0.48 - 0.064
    assert faults_at(BOX, (fits - 0.001, 0.0), begun=start) == []
    (refused,) = faults_at(BOX, (fits + 0.01, 0.0), begun=start)
    assert refused == "R06"
    assert refused.value == pytest.approx(-0.01)
    assert faults_at(BOX, (fits + 0.01, 0.0)) == [], "it is judged at the start only"


def test_the_object_has_to_fit_too():
    settings = BOX.workspace
    assert room_for_push(settings, Pose2D(-1.0, 0.0, 0.0), None) == pytest.approx(0.01)
    slider = Pose2D(3.0 - 2.0 - OBJECT_M + 0.1, 0.0, 0.0)
    assert room_for_push(settings, Pose2D(-1.0, 0.0, 0.0), slider) == pytest.approx(-0.1)


@pytest.mark.parametrize(
    ("overrides", "word"),
    [
        (["workspace.x_m=[0, 1]"], "needs `y_m`"),
        (["workspace.y_m=[0, 1]"], "needs `x_m`"),
        (["workspace.x_m=[1, 0]", "workspace.y_m=[0, 1]"], "from the smaller to the larger"),
        (["workspace.x_m=[0, 1]", "workspace.y_m=[1, 1]"], "from the smaller to the larger"),
        (["workspace.x_m=[0, 1]", "workspace.polygon_m=[[0,0],[1,0],[0,1]]"], "one of the two forms"),
        (["workspace.polygon_m=[[0,0],[1,0]]"], "three corners"),
        (["workspace.polygon_m=[[0,0],[4,0],[4,4],[2,-1]]"], "crosses"),
        (["workspace.x_m=[0, 2000]", "workspace.y_m=[0, 1]"], "1000"),
        (["workspace.x_m=[0]", "workspace.y_m=[0, 1]"], "workspace.x_m"),
        (["workspace.polygon_m=[[0,0],[1,inf],[0,1]]"], "polygon_m"),
    ],
)
def test_a_workspace_that_is_none_is_one_sentence(overrides, word):
    with pytest.raises(ConfigError, match=word.replace("[", r"\[")):
        resolve_rig("sim", overrides)
