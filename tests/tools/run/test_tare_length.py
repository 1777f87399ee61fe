"""The tare of the shipped rigs is long enough: a rig without any other error ends within 0.1 m of its path."""

import pytest

from robot_io.rig.config import load_rig
from tests.safety.normal_pushes import Nothing
from tools.run.lockstep import Lockstep

SEEDS = range(12)
DISTANCES_M = (2.0, 6.0)
NEAR_M = 0.1


def ends_m(seed, distance_m, *settings):
    """Return how far from the path a push by the shipped rig ends."""
    rig = load_rig("sim", [f"control.distance_m={distance_m}", *settings])
    ended = Lockstep(rig, seed, Nothing()).run(lambda *_: None)
    assert ended["exit_code"] == 0
    return abs(ended["lateral_error_m"])


@pytest.mark.parametrize("name", ["emulated", "sim", "barrel", "paper-gains", "thing"])
def test_the_shipped_rigs_tare_for_5_s(name):
    assert load_rig(name).ft.tare_s == 5.0


@pytest.mark.long
@pytest.mark.parametrize("distance_m", DISTANCES_M)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_perfect_rig_ends_near_its_path(seed, distance_m):
    assert ends_m(seed, distance_m) <= NEAR_M


@pytest.mark.long
@pytest.mark.timeout(600)
def test_with_a_second_it_would_not():
    """What the longer tare is for: otherwise 5 s could be 1 s again and nothing would tell."""
    far = [ends_m(seed, distance_m, "ft.tare_s=1") > NEAR_M for seed in SEEDS for distance_m in DISTANCES_M]
    assert sum(far) >= 3
