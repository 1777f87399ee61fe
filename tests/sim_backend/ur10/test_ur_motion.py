"""Kinematics, profiles and limits of the emulated arm, against geometry and closed forms."""

import math
import random

import pytest

from sim_backend.ur10.models import BY_NAME, MODELS, UR10
from sim_backend.ur10.motion.arm_motion import ArmMotion
from sim_backend.ur10.motion.commands import MoveCommand, ServoCommand, SpeedCommand, ToolSpeedCommand
from sim_backend.ur10.motion.kinematics import joints_at, tool_pose, tool_speed
from sim_backend.ur10.motion.moves import Way, joint_move, joint_move_to_pose, tool_move
from sim_backend.ur10.motion.profile import Profile
from sim_backend.ur10.motion.transforms import chained, frame_of, inverse, pose_of
from sim_backend.world.plant import ArmTruth

HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31)
NO_TOOL = (0.0,) * 6
TOOL = (0.01, -0.02, 0.15, 0.1, 0.2, -0.3)
STILL = ArmTruth(HELD, (0.0,) * 6)
CYCLE_S = 0.008


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
@pytest.mark.parametrize("tool", [NO_TOOL, TOOL], ids=["flange", "tool"])
def test_the_inverse_undoes_the_forward_kinematics(model, tool) -> None:
    draw = random.Random(f"{model.name} {tool}")
    for _ in range(40):
        q = tuple(draw.uniform(-3.1, 3.1) for _ in range(6))
        assert joints_at(tool_pose(q, model, tool), q, model, tool) == pytest.approx(q, abs=1e-7)


def test_the_inverse_from_elsewhere_reaches_the_same_pose() -> None:
    draw = random.Random(3)
    for _ in range(40):
        pose = tool_pose(tuple(draw.uniform(-3.1, 3.1) for _ in range(6)), UR10)
        found = joints_at(pose, HELD, UR10)
        assert found is not None
        rotation, place = frame_of(tool_pose(found, UR10))
        wanted, where = frame_of(pose)
        assert place == pytest.approx(where, abs=1e-9)
        for row, wanted_row in zip(rotation, wanted, strict=True):
            assert row == pytest.approx(wanted_row, abs=1e-7)


@pytest.mark.parametrize("pose", [(1.5, 0.0, 0.0, 0.0, 0.0, 0.0), (0.05, 0.0, 0.5, 0.0, 0.0, 0.0), (math.nan,) * 6])
def test_where_the_arm_cannot_be_there_are_no_joints(pose) -> None:
    """Beyond its 1.3 m, on its own axis (the wrist is 0.164 m beside it), nowhere."""
    assert joints_at(pose, HELD, UR10) is None


def test_the_tool_of_a_turning_base_joint_goes_round() -> None:
    """At the outstretched arm: speed is angular speed times distance from the axis."""
    speed = tool_speed(NO_TOOL, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0), UR10)
    assert speed == pytest.approx((0.5 * 0.256141, -0.5 * 1.1843, 0.0, 0.0, 0.0, 0.5), abs=1e-6)


def test_poses_in_poses() -> None:
    turned = (1.0, 2.0, 3.0, 0.0, 0.0, math.pi / 2)
    assert pose_of(chained(frame_of(turned), frame_of((1.0, 0.0, 0.0, 0.0, 0.0, 0.0)))) == pytest.approx(
        (1.0, 3.0, 3.0, 0.0, 0.0, math.pi / 2)
    )
    assert pose_of(chained(frame_of(TOOL), inverse(frame_of(TOOL)))) == pytest.approx(NO_TOOL, abs=1e-12)


@pytest.mark.parametrize(
    ("length", "speed", "acceleration", "time_s", "takes_s"),
    [
        (1.0, 0.5, 1.0, 0.0, 2.5),  # 0.5 s up, 0.5 s down, 1.5 s along
        (0.16, 1.0, 1.0, 0.0, 0.8),  # never up to speed: 2 sqrt(0.16)
        (1.0, 0.5, 1.0, 2.0, 2.0),  # in the time that is given
        (0.0, 0.5, 1.0, 0.0, 0.0),
    ],
)
def test_a_profile_takes_its_time(length, speed, acceleration, time_s, takes_s) -> None:
    profile = Profile(length, speed, acceleration, time_s)
    assert profile.time_s == pytest.approx(takes_s)
    assert profile.at(0.0) == 0.0
    assert profile.at(takes_s / 2) == pytest.approx(length / 2), "it slows down as it sped up"
    assert profile.at(takes_s) == length


def run(motion: ArmMotion, cycles: int, scaling: float = 1.0) -> None:
    for _ in range(cycles):
        motion.step(STILL, CYCLE_S, scaling)


@pytest.fixture
def motion() -> ArmMotion:
    arm = ArmMotion(UR10)
    run(arm, 1)
    return arm


def test_movel_is_straight(motion) -> None:
    start = tool_pose(HELD, UR10)
    end = (start[0] + 0.1, start[1], start[2] - 0.2, *start[3:])
    motion.follow(MoveCommand([tool_move(end, Way(0.25, 1.2), UR10, NO_TOOL)]))
    off = 0.0
    while motion.moving:
        run(motion, 1)
        x, y, z, *turn = tool_pose(motion.actual, UR10)
        off = max(off, abs(y - start[1]), abs((x - start[0]) * 2 + (z - start[2])))
        assert turn == pytest.approx(start[3:], abs=1e-9)
    assert off < 1e-9
    assert tool_pose(motion.actual, UR10) == pytest.approx(end)


def test_the_speed_slider_stretches_a_move(motion) -> None:
    def cycles(scaling: float) -> int:
        motion.follow(MoveCommand([joint_move(tuple(q + 0.2 for q in motion.actual), Way(0.5, 1.0), UR10)]))
        count = 0
        while motion.moving:
            run(motion, 1, scaling)
            count += 1
        return count

    assert cycles(1.0) == 112  # it never gets up to speed: 2 sqrt(0.2 / 1.0) = 0.894 s
    assert cycles(0.25) == 448


def test_a_move_is_not_faster_than_its_slowest_joint(motion) -> None:
    """The base of a UR10 does 120 degrees a second."""
    motion.follow(MoveCommand([joint_move((HELD[0] + 3.0, *HELD[1:]), Way(10.0, 40.0), UR10)]))
    fastest = 0.0
    while motion.moving:
        run(motion, 1)
        fastest = max(fastest, abs(motion.velocity[0]))
    assert fastest == pytest.approx(math.radians(120.0))
    assert motion.tripped is None


@pytest.mark.parametrize(
    ("command", "code"),
    [
        (ServoCommand((HELD[0] + 6.7, *HELD[1:]), 0.2), 204),
        (ServoCommand((HELD[0] + 0.08, *HELD[1:]), 0.03), 204),
        (SpeedCommand((2.3, 0.0, 0.0, 0.0, 0.0, 0.0)), 204),
        (SpeedCommand((math.nan, 0.0, 0.0, 0.0, 0.0, 0.0)), 204),
        (ToolSpeedCommand((9.0, 0.0, 0.0, 0.0, 0.0, 0.0), UR10, NO_TOOL), 204),
        (MoveCommand([tool_move((3.0, 0.0, 0.0, 0.0, 0.0, 0.0), Way(0.5, 1.2), UR10, NO_TOOL)]), 204),
        (MoveCommand([joint_move_to_pose((3.0, 0.0, 0.0, 0.0, 0.0, 0.0), Way(1.0, 1.2), UR10, NO_TOOL)]), 204),
    ],
    ids=["far", "sudden", "speed", "no number", "tool", "out of reach", "no such pose"],
)
def test_what_no_joint_can_do_trips_and_is_not_done(motion, command, code: int) -> None:
    motion.follow(command)
    for _ in range(2000):
        run(motion, 1)
        if motion.tripped is not None:
            break
    assert motion.tripped is not None
    assert motion.tripped.code == code
    assert all(abs(v) <= math.radians(180.0) + 0.2 for v in motion.velocity)
    assert not motion.moving


def test_what_a_joint_can_just_do_does_not_trip(motion) -> None:
    """120 degrees a second is 2.094; the safety settings add 0.2."""
    motion.follow(SpeedCommand((2.29, 0.0, 0.0, 0.0, 0.0, 0.0)))
    run(motion, 20)
    assert motion.tripped is None
    assert motion.actual[0] == pytest.approx(HELD[0] + 20 * CYCLE_S * 2.29)


def test_e_series_wrists_may_be_quicker() -> None:
    arm = ArmMotion(BY_NAME["ur3e"])
    run(arm, 1)
    arm.follow(SpeedCommand((0.0, 0.0, 0.0, 0.0, 0.0, 6.2)))
    run(arm, 10)
    assert arm.tripped is None
