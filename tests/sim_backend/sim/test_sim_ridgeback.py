import itertools
import math

import pytest
from msgspec.structs import replace

from robot_io.clock import NS_PER_MS as MS
from robot_io.clock import VirtualClock
from robot_io.messages import BaseOdometry, BasePose, BaseReport, BodyTwist, CommandEcho, LinkState, Pose2D, SliderPose
from robot_io.rig.topics import TopicsConfig
from sim_backend.ridgeback.settings import RidgebackSettings
from sim_backend.ridgeback.standalone import StandaloneBase
from sim_backend.sim.ridgeback import SimRidgeback
from sim_backend.world.base_plant import BasePlant

SETTINGS = RidgebackSettings(topics=TopicsConfig(slider_pose="/vicon/ThingBox/ThingBox"))


def run(settings=SETTINGS, ticks=100, start=Pose2D(), every=1, **options):  # noqa: B008 - frozen
    clock = VirtualClock(1_000 * MS)
    source = StandaloneBase(settings, clock(), start)
    samples = []
    with SimRidgeback(source, clock, settings=settings, **options) as base:
        for tick in range(1, ticks + 1):
            clock.advance_to((1_000 + 10 * tick) * MS)
            if tick % every == 0:
                samples += base.drain()
            base.command(BodyTwist(0.1, 0.0, 0.0))
        samples += base.drain()
    return samples


def of(samples, kind):
    return [sample for sample in samples if isinstance(sample.value, kind)]


def test_feeds_come_at_their_rates_in_order():
    samples = run()
    assert [len(of(samples, kind)) for kind in (BasePose, SliderPose, BaseOdometry, CommandEcho, BaseReport)] == [
        100,
        100,
        50,
        100,
        1,
    ]
    assert all(b.received_ns >= a.received_ns for a, b in itertools.pairwise(samples))
    poses = of(samples, BasePose)
    assert [b.seq - a.seq for a, b in itertools.pairwise(poses)] == [1] * 99
    assert poses[0].received_ns - round(poses[0].device_time_s * 1e9) == pytest.approx(4 * MS, abs=1000)


def test_commands_move_the_base():
    poses = of(run(), BasePose)
    assert poses[-1].value.pose.x == pytest.approx(0.095, abs=0.006)
    assert of(run(), BaseOdometry)[-1].value.twist == BodyTwist(0.1, 0.0, 0.0)


def test_two_runs_are_equal_however_often_they_drain():
    assert run() == run()
    assert of(run(every=3), BasePose) == of(run(), BasePose)


def test_pose_from_odometry_starts_at_the_origin():
    samples = run(start=Pose2D(3.0, 4.0, math.pi / 2), pose_source="odometry")
    first, last = of(samples, BasePose)[0].value.pose, of(samples, BasePose)[-1].value.pose
    assert first == Pose2D(0.0, 0.0, 0.0)
    assert last.x > 0.09
    assert abs(last.y) < 1e-9


def test_refuses_what_is_not_finite_and_stays_quiet_when_closed():
    clock = VirtualClock()
    base = SimRidgeback(StandaloneBase(SETTINGS, 0), clock, settings=SETTINGS)
    assert base.command(BodyTwist(0.1, 0.0, 0.0)) == BodyTwist()
    with base:
        with pytest.raises(ValueError, match="finite"):
            base.command(BodyTwist(math.nan, 0.0, 0.0))
        assert base.health().state == LinkState.UP
    assert base.drain() == ()
    assert base.health().state == LinkState.CLOSED


def test_odometry_counts_the_wheels_and_motion_capture_sees_the_floor():
    class Slipping(StandaloneBase):
        def __init__(self, settings, start_ns, start):
            super().__init__(settings, start_ns, start)
            self.plant = BasePlant(start, start_ns, slip=0.1)

    ways = {}
    for pose_source in ("mocap", "odometry"):
        clock = VirtualClock(1_000 * MS)
        source = Slipping(SETTINGS, clock(), Pose2D(0.0, 0.0, 0.0))
        with SimRidgeback(source, clock, settings=SETTINGS, pose_source=pose_source) as base:
            for tick in range(1, 201):
                clock.advance_to((1_000 + 10 * tick) * MS)
                samples = base.drain()
                base.command(BodyTwist(0.1, 0.0, 0.0))
                ways[pose_source] = next((s.value.pose.x for s in of(samples, BasePose)), ways.get(pose_source))
    assert ways["mocap"] == pytest.approx(0.9 * ways["odometry"], abs=0.0015)  # motion capture is 4 ms late


def test_noise_is_on_every_feed_and_the_same_for_the_same_seed():
    noisy = replace(SETTINGS, mocap_noise_m=0.0005, mocap_noise_rad=0.0035, odometry_noise_m_per_s=0.01)
    assert run(noisy) == run(noisy) == run(noisy, every=3)
    assert of(run(noisy), BasePose) != of(run(replace(noisy, seed=1)), BasePose)
    assert len({sample.value.pose.y for sample in of(run(noisy), SliderPose)}) == 100
    assert len({sample.value.twist.vy for sample in of(run(noisy), BaseOdometry)}) > 40
