"""Both engines give the force, its sign and the motion that docs/frames-and-signs.md works out."""

import math

import pytest
from msgspec.structs import replace

from robot_io.errors import ConfigError
from robot_io.log.world_messages import WorldState
from robot_io.messages import BodyTwist
from robot_io.named_values import ContactMode
from sim_backend.world.world import World
from tools.rig import resolve_rig

MS = 1_000_000
ENGINES = ("quasistatic", "mujoco")
WEIGHT_N = 4.5 * 9.80665
AHEAD, BACK, SLOWLY, STOP = BodyTwist(0.1), BodyTwist(-0.1), BodyTwist(0.005), BodyTwist()
BOX = (
    "world.slider.length_m=0.4", "world.slider.width_m=0.6", "world.slider.mass_kg=4.5", "world.start.gap_m=0.005",
    "world.start.spread=0", "world.start.heading_deg=0", "world.start.edge_offset_m=0",
    "world.start.lateral_offset_m=0",
    "world.sensor.noise_force_N=0", "world.sensor.noise_torque_Nm=0", "world.slip=0", "world.floor.push_height_m=0.15",
)  # fmt: skip


def rig_of(engine, *settings):
    return resolve_rig("sim", (*BOX, f"world.engine={engine}", *settings))


class Pushed:
    """A world that is told what to do for a while, and its records."""

    def __init__(self, engine, *settings, seed=0):
        self.records = []
        self.world = World(rig_of(engine, *settings), seed, 0, self.records.append)

    def go(self, twist, for_ms, every_ms=20):
        for _ in range(for_ms // every_ms):
            now_ns = self.world.now_ns
            self.world.command_base(twist, now_ns)
            self.world.advance_to(now_ns + every_ms * MS)
        return self.states[-1]

    @property
    def states(self):
        return [record for record in self.records if isinstance(record, WorldState)]


def force_of(state):
    return math.hypot(state.force_x, state.force_y), math.atan2(state.force_y, state.force_x)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_straight_push_feels_the_friction_of_the_floor_and_the_sensor_its_reaction(engine):
    pushed = Pushed(engine)
    before = pushed.world.read_ft(0)
    state = pushed.go(AHEAD, 500)
    force, angle = force_of(state)
    assert force == pytest.approx(0.3 * WEIGHT_N, rel=0.005)
    assert angle == pytest.approx(0.0, abs=1e-3)
    assert (state.slider.y, state.slider.yaw) == pytest.approx((0.0, 0.0), abs=1e-5)
    # the middle of the object is half a length and a ball's radius ahead of the ball, but for what the contact gives
    assert state.slider.x - (state.base.x + 1.0) == pytest.approx(0.25, abs=1e-3)
    reading = pushed.world.read_ft(pushed.world.now_ns)
    change = [after - old for after, old in zip(reading, before, strict=True)]
    # forward is +z of the sensor, and the force goes through its origin
    assert change[:3] == pytest.approx((0.0, 0.0, -0.3 * WEIGHT_N), abs=0.07)
    assert change[3:] == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("side", [1, -1])
def test_pushed_beside_its_middle_it_turns_away_and_the_force_points_there_too(engine, side):
    pushed = Pushed(engine, f"world.start.edge_offset_m={0.05 * side}", "world.slider.contact_friction=0.5")
    state = pushed.go(AHEAD, 500)
    assert state.slider.yaw * side < -0.01
    assert -0.4 < force_of(state)[1] * side < -0.1
    # the reaction on the tool is to the other side: +y of the base lies along (0, 0.258, -0.966) of the sensor
    quiet, now = pushed.states[0], pushed.world.read_ft(pushed.world.now_ns)
    reading = now[1] - Pushed(engine).world.read_ft(0)[1]
    assert quiet.force_y == 0.0
    assert reading == pytest.approx(0.9661849516 * state.force_y, abs=0.01)


@pytest.mark.parametrize("engine", ENGINES)
def test_without_friction_the_force_is_along_the_normal_and_the_ball_slides(engine):
    pushed = Pushed(engine, "world.slider.contact_friction=0", "world.start.heading_deg=10")
    state = pushed.go(AHEAD, 600)
    assert abs(state.slider.yaw) > 0.1
    assert force_of(state)[1] == pytest.approx(state.slider.yaw, abs=2e-3)
    # the face looks to the left, so the ball that goes straight ahead moves to the right over it
    assert state.contact_mode == ContactMode.SLIDING_RIGHT


@pytest.mark.parametrize("engine", ENGINES)
def test_the_ball_at_rest_keeps_its_force_and_going_back_takes_it(engine):
    pushed = Pushed(engine)
    pushed.go(AHEAD, 300)
    pushed.go(SLOWLY, 600)  # stopped at once from 0.1 m/s an object with inertia slides on, by 1.7 mm
    held = pushed.go(STOP, 200)
    assert held.contact_mode == ContactMode.HOLDING
    assert 0.5 * 0.3 * WEIGHT_N < force_of(held)[0] < 1.01 * 0.3 * WEIGHT_N
    assert force_of(pushed.go(STOP, 200))[0] == pytest.approx(force_of(held)[0], rel=0.01)
    gone = pushed.go(BACK, 200)
    assert (gone.force_x, gone.force_y, gone.contact_mode) == (0.0, 0.0, ContactMode.FREE)
    assert gone.slider.x == pytest.approx(held.slider.x, abs=5e-4)
    later = pushed.go(BACK, 100).slider
    assert (later.x, later.y, later.yaw) == pytest.approx((gone.slider.x, gone.slider.y, gone.slider.yaw), abs=1e-8)


def test_equal_starts_mean_equal_first_touch():
    barrel = ("world.slider.shape=circle", "world.start.edge_offset_m=0.1")
    for settings in ((), barrel, ("world.start.heading_deg=-22.5",)):
        first = []
        for engine in ENGINES:
            pushed = Pushed(engine, "world.start.gap_m=0.02", *settings)
            while not pushed.states[-1].force_x:
                pushed.go(AHEAD, 10, every_ms=10)
                assert pushed.world.now_ns < 2000 * MS
            first.append(pushed.states[-1])
        one, other = first
        assert other.t_ns == one.t_ns
        assert (other.contact_x, other.contact_y) == pytest.approx((one.contact_x, one.contact_y), abs=5e-4)


def test_feet_carry_their_shares():
    """Pushed through the centre of its pressure an object does not turn; to the right of it, it turns left."""
    points = "world.slider.pressure=[[0.15, 0.25, 3.0], [0.15, -0.25, 2.0], [-0.15, 0.25, 3.0], [-0.15, -0.25, 2.0]]"
    assert abs(Pushed("mujoco", points, "world.start.edge_offset_m=0.05").go(AHEAD, 500).slider.yaw) < 1e-3
    assert Pushed("mujoco", points).go(AHEAD, 500).slider.yaw > 0.01


def test_the_same_seed_gives_the_same_states_however_the_way_is_split():
    settings = ("world.start.spread=0.2", "world.start.edge_offset_m=0.03")
    one, other, third = (Pushed("mujoco", *settings, seed=seed) for seed in (3, 3, 4))
    for pushed in (one, other, third):
        for _ in range(20):
            now_ns = pushed.world.now_ns
            pushed.world.command_base(AHEAD, now_ns)
            for part_ms in (20,) if pushed is one else (3, 7, 20):
                pushed.world.advance_to(now_ns + part_ms * MS)
    assert one.states == other.states
    assert one.states[-1].slider != third.states[-1].slider


def test_a_finer_step_changes_little():
    coarse, fine = (
        Pushed("mujoco", "world.start.edge_offset_m=0.05", f"world.mujoco.timestep_s={step}").go(AHEAD, 600)
        for step in (0.001, 0.0005)
    )
    assert fine.slider != coarse.slider
    assert (fine.slider.x, fine.slider.y, fine.slider.yaw) == pytest.approx(
        (coarse.slider.x, coarse.slider.y, coarse.slider.yaw), abs=1e-4
    )


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (("world.floor.patch_strength=0.1",), "floor is even"),
        (("world.floor.along_over_across=1.1",), "floor is even"),
        (("world.solver=osqp",), "solver is its own"),
        (("world.mujoco.timestep_s=0.0003",), "not a multiple of 0.0003 s"),
        (("world.slider.pressure=point",), "tips over"),
    ],
)
def test_what_it_cannot_do_is_said(settings, words):
    with pytest.raises(ConfigError, match=words):
        World(rig_of("mujoco", *settings), 0, 0)


def test_the_ball_pushes_where_it_is():
    """Without a push height of the floor it is the ball's own, from the frames."""
    rig = rig_of("mujoco")
    unset = replace(rig, world=replace(rig.world, floor=replace(rig.world.floor, push_height_m=None)))
    World(unset, 0, 0)
    with pytest.raises(ConfigError, match="tips over"):
        World(replace(unset, frames=replace(rig.frames, contact_in_base_m=(1.0, 0.0, 0.8))), 0, 0)
