"""The rig's `[world.floor]` reaches the world: seeds differ on patches, and repeat to the bit."""

import pytest

from robot_io.messages import BodyTwist
from robot_io.rig.config import load_rig, rig_to_toml
from robot_io.rig.logged import rig_of_log
from sim_backend.world.scene import floor_of
from sim_backend.world.world import World

PUSH = BodyTwist(0.1, 0.0, 0.0)
SECOND = 1_000_000_000


def end_of_push(*settings, seed=0):
    """Push straight for ten seconds on an exactly placed slider; return where it ends."""
    world = World(load_rig("sim", ["world.start.spread=0.0", *settings]), seed, 0)
    for tenth in range(100):
        world.command_base(PUSH, tenth * SECOND // 10)
        world.advance_to((tenth + 1) * SECOND // 10)
    return world.read_slider(10 * SECOND)


PAPERS_WORLD = ("world.floor.turning=ellipsoid", "world.floor.push_height_m=0")


def test_a_shipped_rig_pushes_at_the_height_of_its_ball():
    """0.3 of friction 0.15 m below the push move the pressure 0.045 m ahead; a uniform box of 0.4 m resists turning by
    its spread about there, d^2 = 0.2^2/3 - 0.045^2."""
    rig = load_rig("sim")
    cof_x, _, d, _, grain = floor_of(rig, 3).grip(0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
    assert (cof_x, d, grain) == (pytest.approx(0.045), pytest.approx((0.04 / 3 - 0.045**2) ** 0.5), None)
    assert end_of_push(seed=1) == end_of_push(seed=2)


def test_the_push_height_follows_the_frames_unless_it_is_given():
    higher = ("frames.contact_in_base_m=[1.0, 0.0, 0.25]",)
    assert load_rig("sim", higher).push_height_m == 0.25
    assert load_rig("sim", [*higher, "world.floor.push_height_m=0.1"]).push_height_m == 0.1
    assert load_rig("sim", [*higher, "world.floor.push_height_m=0"]).push_height_m == 0.0
    assert load_rig("sim", ["frames.contact_in_base_m=[1.0, 0.0, -0.1]"]).push_height_m == 0.0


def test_the_papers_world_is_a_setting():
    assert floor_of(load_rig("sim", PAPERS_WORLD), 3) is None


@pytest.mark.parametrize("log_format", [1, 2, 3, 4])
def test_a_log_without_the_keys_is_of_the_papers_world(log_format):
    rig = load_rig("sim")
    lines = rig_to_toml(rig).splitlines()
    assert "push_height_m = 0.15" in lines  # every new log says both
    old = "\n".join(line for line in lines if not line.startswith(("push_height_m", "turning")))
    assert floor_of(rig_of_log(old, log_format).rig, 3) is None


def test_coulomb_friction_is_a_setting():
    coulomb = load_rig("sim", ["world.floor.turning=coulomb", "world.floor.support_points=9"])
    assert len(floor_of(coulomb, 3).coulomb.contact.points) == 9
    straight = ("world.start.edge_offset_m=0.0", "world.start.heading_deg=0.0", "world.floor.turning=coulomb")
    assert end_of_push(*straight).yaw == pytest.approx(0.0, abs=1e-12)


def test_patches_make_seeds_differ_and_repeat():
    patches = "world.floor.patch_strength=0.3"
    assert end_of_push(patches, seed=1) == end_of_push(patches, seed=1)
    assert end_of_push(patches, seed=1) != end_of_push(patches, seed=2)


def test_each_effect_changes_the_push():
    even = end_of_push(*PAPERS_WORLD)
    for setting in ("push_height_m=0.15", 'turning="along-push"', "along_over_across=1.2", 'turning="coulomb"'):
        assert end_of_push(*PAPERS_WORLD, f"world.floor.{setting}") != even
    # pressure that runs ahead steadies the push: the same open-loop push turns the slider less
    assert abs(end_of_push(*PAPERS_WORLD, "world.floor.push_height_m=0.3").yaw) < abs(even.yaw)


def test_a_load_to_the_left_turns_the_slider_left():
    centred = ("world.start.edge_offset_m=0.0", "world.start.heading_deg=0.0", "world.start.lateral_offset_m=0.0")
    assert end_of_push(*centred).yaw == 0.0
    assert end_of_push(*centred, "world.slider.cof_m=[0.0, 0.02]").yaw > 0.01
    assert end_of_push(*centred, "world.slider.cof_m=[0.0, -0.02]").yaw < -0.01
