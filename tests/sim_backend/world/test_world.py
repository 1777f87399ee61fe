"""The world on its grid: time, commands, records, and where things stand at the start."""

import math
import random

import pytest
from msgspec.structs import replace

from robot_io.log.world_messages import WorldCommand, WorldStall, WorldStart, WorldState
from robot_io.messages import BodyTwist
from sim_backend.world.scene import place, slider_model
from sim_backend.world.world import World
from tools.rig import resolve_rig

MS = 1_000_000
START = 7_000_000_123  # no round number: the grid has its own origin
RIG = resolve_rig("sim")
AHEAD = BodyTwist(0.1, 0.0, 0.0)


def states(records):
    return [r for r in records if isinstance(r, WorldState)]


def drive(world, ask=lambda world, t: None):
    """Send a plain schedule of commands for 3 s; `ask` may read in between."""
    for k in range(150):
        t = START + k * 20 * MS
        world.command_base(BodyTwist(0.1, 0.02 * math.sin(k / 20), 0.01 * math.cos(k / 30)), t)
        ask(world, t)
        world.advance_to(t + 20 * MS)


def test_time_lives_on_a_grid_of_a_millisecond():
    world = World(RIG, 0, START)
    assert world.now_ns == START
    for asked, now in ((999_999, 0), (1 * MS, 1 * MS), (1_999_999, 1 * MS), (5 * MS + 1, 5 * MS), (2 * MS, 5 * MS)):
        world.advance_to(START + asked)
        assert world.now_ns == START + now


def test_how_the_way_is_split_into_calls_makes_no_difference():
    dice = random.Random(5)
    whole, split = [], []
    one, other = World(RIG, 3, START, whole.append), World(RIG, 3, START, split.append)
    for world, steps in ((one, lambda: 20 * MS), (other, lambda: dice.randrange(1, 3 * MS))):
        for k in range(150):
            t = START + k * 20 * MS
            world.command_base(AHEAD, t)
            while t < START + (k + 1) * 20 * MS:
                t = min(t + steps(), START + (k + 1) * 20 * MS)
                world.advance_to(t)
    assert one.read_slider(START).x > 0.35  # it was really pushed
    assert states(whole) == states(split)
    assert len(states(whole)) == 301


def test_asking_never_changes_what_happens():
    silent, asked = [], []
    dice = random.Random(1)

    def ask(world, t):
        for _ in range(dice.randrange(4)):
            at = t + dice.randrange(20 * MS)
            dice.choice([world.read_ft, world.read_arm, world.read_base, world.read_slider])(at)

    drive(World(RIG, 2, START, silent.append))
    drive(World(RIG, 2, START, asked.append), ask)
    # A command whose arrival was stamped before somebody asked for a later time counts when it came in; the
    # schedule above sends each command before anybody asks beyond it, so the records are the same.
    assert asked == silent


def test_it_runs_again_bit_for_bit_from_its_own_records():
    records, again = [], []
    dice = random.Random(9)
    world = World(RIG, 4, START, records.append)
    t = START
    for _ in range(300):
        t += dice.randrange(15 * MS)
        # arrivals stamped a little before the world is told, as by a thread that was late
        world.command_base(BodyTwist(dice.uniform(0, 0.15), dice.uniform(-0.1, 0.1), dice.uniform(-0.05, 0.05)), t)
        if dice.random() < 0.02:
            world.set_drivers(dice.random() < 0.5, t)
        world.advance_to(t + dice.randrange(10 * MS))
        t = max(t, world.now_ns - 2 * MS)
    start = records[0]
    assert isinstance(start, WorldStart)
    replayed = World(RIG, start.seed, start.start_ns, again.append)
    for record in records[1:]:
        if isinstance(record, WorldCommand):
            if record.is_switch:
                replayed.set_drivers(record.drivers_active, record.arrival_ns)
            else:
                replayed.command_base(record.twist, record.arrival_ns)
        elif isinstance(record, WorldState):
            replayed.advance_to(record.t_ns)
    replayed.advance_to(world.now_ns)
    assert states(again) == states(records)
    assert replayed.read_slider(t) == world.read_slider(t)
    assert world.read_slider(t).x > place(RIG, 4).slider.x + 0.05  # it was really pushed


def test_a_late_world_catches_up_and_says_so():
    records = []
    world = World(RIG, 0, START, records.append)
    world.advance_to(START + 30 * MS)
    assert world.stalls == 0
    world.advance_to(START + 61 * MS)
    assert world.stalls == 1
    assert [r for r in records if isinstance(r, WorldStall)] == [WorldStall(START + 30 * MS, 31)]
    assert world.now_ns == START + 61 * MS
    assert states(records)[-1].t_ns == START + 60 * MS


def test_a_command_acts_at_the_first_tick_of_the_base_not_before_its_arrival():
    """Base ticks of 40 ms (25 Hz, no rate error, phase 0.5: 20, 60, 100 ms ...) on the grid of 1 ms."""
    rig = replace(RIG, world=replace(RIG.world, base_phase=0.5, base_tick_rate_error=0.0, slip=0.0))
    for arrival_ms, moves_after_ms in ((0.0, 20), (19.9, 20), (20.0, 20), (20.1, 60), (59.0, 60), (60.5, 100)):
        world = World(rig, 0, START)
        world.advance_to(START + int(arrival_ms) * MS)
        world.command_base(AHEAD, START + round(arrival_ms * MS))
        still = world.read_base(START + moves_after_ms * MS)
        assert (still.twist, still.pose) == (BodyTwist(), place(rig, 0).base)
        moved = world.read_base(START + (moves_after_ms + 1) * MS)
        assert moved.twist.vx == pytest.approx(0.1)
        assert moved.pose.x - still.pose.x == pytest.approx(0.0001, abs=1e-12)


def test_a_base_without_drivers_stands():
    world = World(RIG, 0, START)
    world.command_base(AHEAD, START)
    world.advance_to(START + 100 * MS)
    assert world.read_base(START).twist.vx > 0.0
    world.set_drivers(False, START + 100 * MS)
    assert world.read_base(START + 150 * MS).twist == BodyTwist()


def test_the_records_say_what_started_and_what_was_commanded():
    records = []
    world = World(RIG, 11, START, records.append)
    world.command_base(AHEAD, START + 5 * MS)
    world.set_drivers(False, START + 6 * MS)
    world.advance_to(START + 10 * MS)
    assert records[0] == WorldStart(11, START)
    assert [r.t_ns for r in states(records)] == [START, START + 10 * MS]
    assert records[2:4] == [
        WorldCommand(START + 5 * MS, AHEAD, False, True),
        WorldCommand(START + 6 * MS, BodyTwist(), True, False),
    ]


def test_the_arm_is_held_and_the_sensor_reads_its_offset_out_of_contact():
    world = World(replace(RIG, world=replace(RIG.world, sensor=replace(RIG.world.sensor, noise_force_N=0.0))), 0, START)
    assert world.read_arm(START).position == RIG.arm.held_pose_rad
    assert world.read_arm(START).velocity == (0.0,) * 6
    # bias plus 0.6 kg of tool: 5.886 N down, which is 5.686965 N along -X and 1.517705 N along -Y of the sensor
    assert world.read_ft(START)[:3] == pytest.approx((-20.68 - 5.686965, 21.95 - 1.517705, -48.70), abs=1e-5)


def test_noise_is_as_large_as_the_rig_says_and_differs_by_seed():
    world, other = World(RIG, 0, START), World(RIG, 1, START)
    readings = [world.read_ft(START + k * 10 * MS) for k in range(2000)]
    for axis, sigma in enumerate([1.2] * 3 + [0.03] * 3):
        values = [r[axis] for r in readings]
        mean = sum(values) / len(values)
        spread = math.sqrt(sum((v - mean) ** 2 for v in values) / len(values))
        assert spread == pytest.approx(sigma, rel=0.1)
    assert other.read_ft(START) != readings[0]


# --- the scene ---------------------------------------------------------------------------------------------------

BOX = RIG
BARREL = replace(
    RIG, world=replace(RIG.world, slider=replace(RIG.world.slider, shape="circle", radius_m=0.25, mass_kg=5.0))
)
PATHS = [(0.0, (0.0, 0.0)), (90.0, (1.0, 2.0)), (180.0, (-3.0, 0.5)), (-135.0, (0.0, 4.0)), (37.0, (2.0, -1.0))]


@pytest.mark.parametrize("rig", [BOX, BARREL], ids=["box", "barrel"])
@pytest.mark.parametrize(("direction", "origin"), PATHS)
@pytest.mark.parametrize("edge", [0.03, 0.0, -0.08])
def test_the_ball_meets_the_object_after_the_gap_where_the_rig_says(rig, direction, origin, edge):
    start = replace(rig.world.start, edge_offset_m=edge, spread=0.0)
    path = replace(rig.path, direction_deg=direction, origin_m=origin)
    rig = replace(rig, path=path, world=replace(rig.world, start=start))
    scene = place(rig, 0)
    angle = math.radians(direction)
    ahead, left = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    # The ball's centre: 5 cm left of the path's origin, and the base behind it looks along the path.
    ball = [scene.base.x + 1.0 * ahead[0], scene.base.y + 1.0 * ahead[1]]
    assert ball == pytest.approx([origin[i] + 0.05 * left[i] for i in range(2)], abs=1e-12)
    assert math.cos(scene.base.yaw - angle) == pytest.approx(1.0, abs=1e-12)
    assert math.cos(scene.slider.yaw - angle - math.radians(3.0)) == pytest.approx(1.0, abs=1e-12)

    def gap(forward):
        """Distance between ball and object when the ball has gone so far, and where on the face it is nearest."""
        x, y = ball[0] + forward * ahead[0] - scene.slider.x, ball[1] + forward * ahead[1] - scene.slider.y
        cos, sin = math.cos(scene.slider.yaw), math.sin(scene.slider.yaw)
        u, v = cos * x + sin * y, cos * y - sin * x
        if rig.world.slider.shape == "circle":
            return math.hypot(u, v) - 0.25 - 0.05, 0.25 * (math.pi - math.atan2(v, u) % math.tau)
        return -u - 0.2 - 0.05, v

    assert gap(0.05)[0] == pytest.approx(0.0, abs=1e-12)
    assert gap(0.05)[1] == pytest.approx(edge, abs=1e-12)
    assert gap(0.049)[0] > 5e-4
    assert gap(0.0)[0] > 0.03


@pytest.mark.parametrize("rig", [BOX, BARREL], ids=["box", "barrel"])
def test_the_world_feels_the_object_just_there(rig):
    records = []
    world = World(rig, 0, START, records.append)
    scene = place(rig, 0)
    t = START
    contact = None
    while contact is None and t < START + 3000 * MS:
        world.command_base(AHEAD, t)
        t += 10 * MS
        world.advance_to(t)
        contact = next((r for r in states(records) if r.force_x or r.force_y), None)
    assert contact.base.x - scene.base.x == pytest.approx(0.05, abs=0.0011)
    assert math.hypot(contact.force_x, contact.force_y) > 5.0


def test_each_seed_varies_the_start_by_at_most_the_spread():
    starts = [place(RIG, seed) for seed in range(50)]
    assert starts[7] == place(RIG, 7)
    offsets = [s.base.y for s in starts]
    assert len(set(offsets)) == 50
    assert 0.04 <= min(offsets) < 0.045 < 0.055 < max(offsets) <= 0.06
    headings = [math.degrees(s.slider.yaw) for s in starts]
    assert 2.4 <= min(headings) < 2.6 < 3.4 < max(headings) <= 3.6


@pytest.mark.parametrize(("rig", "f_max"), [(BOX, 0.3 * 5.1 * 9.81), (BARREL, 0.3 * 5.0 * 9.81)], ids=["box", "barrel"])
def test_the_objects_of_the_lab_need_about_15_newton(rig, f_max):
    model = slider_model(rig.world.slider)
    assert model.f_max_N == pytest.approx(f_max, rel=1e-3)
    assert 14.0 < model.f_max_N < 16.0
