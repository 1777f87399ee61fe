import math
import random

import pytest

from robot_io.clock import NS_PER_MS as MS
from robot_io.messages import BodyTwist, Pose2D
from sim_backend.world.base_plant import BasePlant, clamp

START_NS = 7_000_000_123


def plant(**knobs: float) -> BasePlant:
    return BasePlant(Pose2D(), START_NS, **knobs)


def speeds(base: BasePlant, until_ms: int) -> list[float]:
    """Forward speed during each millisecond from the plant's time on."""
    first = (base.now_ns - START_NS) // MS
    out = []
    for ms in range(first, until_ms):
        base.step_to(START_NS + (ms + 1) * MS)
        out.append(base.velocity.vx)
    return out


def keep_commanding(base: BasePlant, twist: BodyTwist, until_ms: int, every_ms: int = 20) -> None:
    first = (base.now_ns - START_NS) // MS
    for ms in range(first, until_ms):
        if ms % every_ms == 0:
            base.command(twist, START_NS + ms * MS)
        base.step_to(START_NS + (ms + 1) * MS)


def test_velocity_changes_only_at_the_25_hz_tick_and_by_at_most_a_tenth():
    base = plant()
    base.command(BodyTwist(0.35, 0.0, 0.0), START_NS)
    during = speeds(base, 200)
    assert during[:40] == [0.1] * 40
    assert during[40:80] == pytest.approx([0.2] * 40, abs=1e-15)
    assert during[80:120] == pytest.approx([0.3] * 40, abs=1e-15)
    assert during[120:200] == [0.35] * 80


def test_phase_moves_the_tick_and_rounds_it_up_to_the_grid():
    base = plant(tick_phase=0.53)  # 21.2 ms
    base.command(BodyTwist(0.1, 0.0, 0.0), START_NS)
    during = speeds(base, 30)
    assert during.index(0.1) == 22


def test_rate_error_makes_ticks_come_early():
    base = plant(rate_error=0.01)
    ticks = []
    for ms in range(10_000):
        base.command(BodyTwist(0.05 + 1e-6 * (ms % 1000), 0.0, 0.0), START_NS + ms * MS)  # another value every tick
        before = base.velocity
        base.step_to(START_NS + (ms + 1) * MS)
        if base.velocity != before:
            ticks.append(ms)
    assert len(ticks) == 253  # 25.25 Hz for 10 s, the one at 0 included
    assert ticks[1] == 40  # 39.6 ms, on the next millisecond
    assert ticks[-1] == 9981  # 252 periods are 9980.2 ms


def test_command_counts_from_the_first_tick_not_before_its_arrival():
    on_the_tick = plant()
    on_the_tick.step_to(START_NS + 40 * MS)
    on_the_tick.command(BodyTwist(0.1, 0.0, 0.0), START_NS + 40 * MS)
    assert speeds(on_the_tick, 50) == [0.1] * 10
    just_after = plant()
    just_after.step_to(START_NS + 40 * MS)
    just_after.command(BodyTwist(0.1, 0.0, 0.0), START_NS + 40 * MS + 1)
    assert speeds(just_after, 82) == [0.0] * 40 + [0.1] * 2


def test_limits_are_clamped_axis_by_axis():
    base = plant()
    keep_commanding(base, BodyTwist(5.0, -5.0, 9.0), 3000)
    assert base.velocity == BodyTwist(1.1, -1.1, 2.0)


def test_yaw_acceleration_is_one_rad_per_s2():
    base = plant()
    keep_commanding(base, BodyTwist(0.0, 0.0, 2.0), 400)
    assert base.velocity.omega == pytest.approx(0.4, abs=1e-12)


def test_nan_drives_backwards_at_full_speed():
    assert clamp(math.nan, -1.1, 1.1) == -1.1
    base = plant()
    keep_commanding(base, BodyTwist(math.nan, 0.0, math.nan), 3000)
    assert base.velocity == BodyTwist(-1.1, 0.0, -2.0)


def test_infinity_drives_forwards_at_full_speed():
    base = plant()
    keep_commanding(base, BodyTwist(math.inf, -math.inf, 0.0), 1000)
    assert base.velocity == BodyTwist(1.1, -1.1, 0.0)


def test_command_times_out_a_quarter_second_after_arrival_and_brakes_with_the_limit():
    base = plant()
    base.command(BodyTwist(0.2, 0.0, 0.0), START_NS)
    during = speeds(base, 400)
    # ticks at 0, 40, ... 240 still hold the command (age 240 ms); at 280 ms it is too old
    assert during[279] == 0.2
    assert during[280] == pytest.approx(0.1)
    assert during[319] == pytest.approx(0.1)
    assert during[320] == 0.0
    assert set(during[320:]) == {0.0}


def test_a_command_exactly_a_quarter_second_old_still_holds():
    base = plant()
    base.step_to(START_NS + 30 * MS)
    base.command(BodyTwist(0.1, 0.0, 0.0), START_NS + 30 * MS)  # 250 ms old at the tick at 280 ms
    assert speeds(base, 321)[-42:] == [0.1] * 41 + [0.0]


def test_without_drivers_the_wheels_stand_and_start_from_rest_afterwards():
    base = plant()
    keep_commanding(base, BodyTwist(0.5, 0.0, 0.0), 400)
    assert base.velocity.vx == 0.5
    base.set_drivers(False, START_NS + 400 * MS)
    keep_commanding(base, BodyTwist(0.5, 0.0, 0.0), 480)
    assert base.velocity == BodyTwist()
    assert not base.drivers_active
    at = base.pose
    base.set_drivers(True, START_NS + 480 * MS)
    keep_commanding(base, BodyTwist(0.5, 0.0, 0.0), 520)
    assert base.velocity.vx == pytest.approx(0.1)
    assert base.pose.x == pytest.approx(at.x + 0.1 * 0.040)


def test_straight_and_sideways_motion_in_the_world():
    base = BasePlant(Pose2D(1.0, 2.0, math.pi / 2), START_NS)
    keep_commanding(base, BodyTwist(0.1, 0.05, 0.0), 1000)
    assert base.pose.x == pytest.approx(1.0 - 0.05)
    assert base.pose.y == pytest.approx(2.0 + 0.1)


def test_a_full_circle_comes_back():
    base = plant()
    rate, speed = 0.5, 0.1
    keep_commanding(base, BodyTwist(speed, 0.0, rate), 40_000)
    # after the spin-up of 0.48 s the path is a circle of radius 0.2 m: its far side is 0.4 m away at most
    centre_distance = math.hypot(base.pose.x, base.pose.y)
    assert centre_distance < 0.5
    ticks = 13  # 0.04, 0.08 ... 0.48, 0.5
    turned = 0.040 * sum(min(0.04 * n, rate) for n in range(1, ticks + 1)) + rate * (40.0 - 0.040 * ticks)
    assert math.remainder(base.pose.yaw - turned, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert -math.pi < base.pose.yaw <= math.pi


def test_bit_equal_however_the_way_is_split():
    rng = random.Random(5)
    commands = []
    t = START_NS
    while t < START_NS + 5000 * MS:
        t += rng.randrange(1, 60 * MS)
        commands.append((t, BodyTwist(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1))))
    end = START_NS + 5200 * MS

    def run(seed: int, split: bool) -> tuple[Pose2D, BodyTwist, Pose2D]:
        cuts = random.Random(seed)
        base = plant(tick_phase=0.31, rate_error=0.0003)
        base_ns = START_NS
        for arrival, twist in commands:
            while split and base_ns < arrival:
                base_ns = min(arrival, base_ns + cuts.randrange(1, 7 * MS))
                base.step_to(base_ns)
            base.command(twist, arrival)
        base.step_to(end)
        return base.pose, base.velocity, base.place

    whole = run(0, split=False)
    assert whole[0] != Pose2D()
    assert run(1, split=True) == whole
    assert run(2, split=True) == whole


def test_the_past_stays_and_late_arrivals_count_as_now():
    base = plant()
    base.step_to(START_NS + 100 * MS)
    assert base.command(BodyTwist(0.1, 0.0, 0.0), START_NS + 5 * MS) == START_NS + 100 * MS
    base.step_to(START_NS + 50 * MS)
    assert base.now_ns == START_NS + 100 * MS


def test_arrivals_going_back_are_refused():
    base = plant()
    base.command(BodyTwist(), START_NS + 9 * MS)
    with pytest.raises(ValueError, match="before"):
        base.command(BodyTwist(), START_NS + 8 * MS)


def test_slip_loses_a_share_of_the_way_and_nothing_of_the_turn():
    start = Pose2D(2.0, -1.0, 0.5)
    slips, grips = BasePlant(start, START_NS, slip=0.1), BasePlant(start, START_NS)
    for base in (slips, grips):
        keep_commanding(base, BodyTwist(0.1, -0.05, 0.05), 2_000)
    assert slips.velocity == grips.velocity  # what the wheels do
    assert slips.pose.yaw == grips.pose.yaw
    assert slips.pose.x - 2.0 == pytest.approx(0.9 * (grips.pose.x - 2.0), abs=1e-12)
    assert slips.pose.y + 1.0 == pytest.approx(0.9 * (grips.pose.y + 1.0), abs=1e-12)
    rolled, without = slips.rolled, grips.pose
    assert (rolled.x, rolled.y, rolled.yaw) == pytest.approx((without.x, without.y, without.yaw), abs=1e-12)
    assert grips.rolled == grips.pose
