import statistics

import pytest

from robot_io.messages import BodyTwist, Pose2D
from robot_io.rig.config import load_rig
from sim_backend.ridgeback.noise import FeedNoise
from sim_backend.ridgeback.settings import RidgebackSettings, ridgeback_settings

NOISY = RidgebackSettings(mocap_noise_m=0.0005, mocap_noise_rad=0.0035, odometry_noise_m_per_s=0.01, seed=3)
AHEAD = BodyTwist(0.1, 0.0, 0.0)


def deviations(samples, of):
    columns = [[getattr(sample, name) - getattr(of, name) for sample in samples] for name in type(of).__struct_fields__]
    assert all(abs(statistics.fmean(column)) < 0.1 * statistics.stdev(column) for column in columns)
    return [statistics.stdev(column) for column in columns]


def test_the_noise_has_the_size_asked_for_and_no_mean():
    noise, pose = FeedNoise(NOISY, "base"), Pose2D(1.0, 2.0, 0.3)
    found = deviations([noise.pose(pose) for _ in range(5000)], pose)
    assert found == pytest.approx([0.0005, 0.0005, 0.0035], rel=0.05)
    found = deviations([noise.twist(AHEAD) for _ in range(5000)], AHEAD)
    assert found == pytest.approx([0.01, 0.01, 0.01 / 0.5945], rel=0.05)


def test_wheels_at_rest_measure_rest():
    assert FeedNoise(NOISY, "odometry").twist(BodyTwist()) == BodyTwist()


def test_without_noise_nothing_is_changed():
    noise = FeedNoise(RidgebackSettings(), "base")
    assert (noise.pose(Pose2D(1.0, 2.0, 0.3)), noise.twist(AHEAD)) == (Pose2D(1.0, 2.0, 0.3), AHEAD)


def test_each_seed_and_each_feed_has_its_own_noise_and_always_the_same():
    def draw(seed, feed):
        settings = ridgeback_settings(load_rig("sim"), seed)
        return FeedNoise(settings, feed).pose(Pose2D())

    assert draw(1, "base") == draw(1, "base")
    assert len({draw(seed, feed) for seed in (1, 2) for feed in ("base", "slider")}) == 4


def test_the_shipped_world_has_the_noise_of_its_documentation():
    settings = ridgeback_settings(load_rig("emulated"), 0)
    assert settings.mocap_noise_m == 0.0005
    assert settings.mocap_noise_rad == pytest.approx(0.2 * 3.14159265 / 180)
    assert settings.odometry_noise_m_per_s == 0.01
    assert load_rig("emulated").world.slip == 0.03
