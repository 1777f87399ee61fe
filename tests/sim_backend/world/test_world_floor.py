"""The rig's `[world.floor]` reaches the world: seeds differ on patches, repeat to the bit; nothing is on by default."""

from robot_io.messages import BodyTwist
from robot_io.rig.config import load_rig
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


def test_the_shipped_floor_is_even():
    assert floor_of(load_rig("sim"), 3) is None
    assert end_of_push(seed=1) == end_of_push(seed=2)


def test_patches_make_seeds_differ_and_repeat():
    patches = "world.floor.patch_strength=0.3"
    assert end_of_push(patches, seed=1) == end_of_push(patches, seed=1)
    assert end_of_push(patches, seed=1) != end_of_push(patches, seed=2)


def test_each_effect_changes_the_push():
    even = end_of_push()
    for setting in ("push_height_m=0.15", 'turning="along-push"', "along_over_across=1.2"):
        assert end_of_push(f"world.floor.{setting}") != even
    # pressure that runs ahead steadies the push: the same open-loop push turns the slider less
    assert abs(end_of_push("world.floor.push_height_m=0.3").yaw) < abs(even.yaw)


def test_a_load_to_the_left_turns_the_slider_left():
    centred = ("world.start.edge_offset_m=0.0", "world.start.heading_deg=0.0", "world.start.lateral_offset_m=0.0")
    assert end_of_push(*centred).yaw == 0.0
    assert end_of_push(*centred, "world.slider.cof_m=[0.0, 0.02]").yaw > 0.01
    assert end_of_push(*centred, "world.slider.cof_m=[0.0, -0.02]").yaw < -0.01
