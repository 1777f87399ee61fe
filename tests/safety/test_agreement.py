"""Pose, odometry and command must tell of the same motion: what is claimed is caught in time, what is allowed is not.

The numbers are those of docs/safety.md: a frozen or mirrored pose within 0.15 m of way, the others within 0.3 m or 3 s.
"""

import math
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from robot_io.messages import BaseRecord, BodyTwist, Pose2D
from robot_io.tick import MotionMark, Phase
from safety.checks import agreement_checks
from tests.how_many import mostly_long
from tests.safety.fault_scenarios import base, shifted_pose, then
from tests.safety.fold_bench import FoldBench, without_contact
from tests.safety.normal_pushes import Nothing
from tools.rig import resolve_rig, with_faults
from tools.run.lockstep import Lockstep

FAST = ("control.push_speed_m_per_s=0.5", "control.distance_m=6")
SLOW = ("control.push_speed_m_per_s=0.02", "control.approach_speed_m_per_s=0.02")
SPEEDS = {"approach at 0.05": (), "push at 0.1": (), "push at 0.5": FAST, "push at 0.02": SLOW}
NAMES = {"F37", "F43", "F33-way"}


def moving(name: str) -> tuple[FoldBench, object]:
    """Return a bench at full speed, some way after the speed was reached, and how it goes on."""
    bench, goes_on = _moving(name)
    return bench.copy(), goes_on


@cache
def _moving(name: str) -> tuple[FoldBench, object]:
    bench = FoldBench(SPEEDS[name])
    if name.startswith("approach"):
        bench.run_to(Phase.APPROACH)
        for _ in range(150):
            bench.fold(without_contact)
        return bench, without_contact
    control = bench.core.control.control
    full = control.push_speed_m_per_s
    bench.run_until(lambda b: b.state.control.phase == Phase.PUSH and b.state.control.speed >= full)
    for _ in range(37):
        bench.fold()
    return bench, None


def until_stop(name, wrong, most_m=0.3, most_s=3.0):
    """Spoil the pose from now on; return the fault, and the way sent (m) and the time (s) until then."""
    bench, goes_on = moving(name)
    begin, way = bench.pose, 0.0
    for n in range(1, 2000):
        good = goes_on or (lambda inp, _: inp)

        def spoilt(inp, since, n=n, good=good):
            inp = good(inp, since)
            return replace(inp, base=replace(inp.base, pose=wrong(begin, inp.base.pose, n * 0.01)))

        way += math.hypot(bench.sent.vx, bench.sent.vy) * 0.01
        output = bench.fold(spoilt, n)
        if found := NAMES & set(output.faults):
            return found.pop(), way, n * 0.01
        if way > most_m and n * 0.01 > most_s:
            break
    return None, way, n * 0.01


def scaled(share):
    return lambda p0, p, t: Pose2D(p0.x + share * (p.x - p0.x), p0.y + share * (p.y - p0.y), p.yaw)


def turned(degrees):
    angle = math.radians(degrees)

    def wrong(p0, p, t):
        dx, dy = p.x - p0.x, p.y - p0.y
        return Pose2D(
            p0.x + math.cos(angle) * dx - math.sin(angle) * dy,
            p0.y + math.sin(angle) * dx + math.cos(angle) * dy,
            p.yaw,
        )

    return wrong


def drifting(vx, vy):
    return lambda p0, p, t: Pose2D(p.x + vx * t, p.y + vy * t, p.yaw)


@pytest.mark.parametrize("name", SPEEDS)
def test_a_frozen_or_mirrored_pose_is_caught_within_15_centimetres(name):
    fault, way_m, _ = until_stop(name, lambda p0, p, t: p0)
    assert fault == "F43"
    assert way_m <= 0.15
    fault, way_m, _ = until_stop(name, scaled(-1.0))
    assert fault == "F37"
    assert way_m <= 0.15


@pytest.mark.parametrize("name", SPEEDS)
@pytest.mark.parametrize("wrong", [scaled(0.75), scaled(1.33), turned(15.0), turned(-15.0), drifting(0.0, 0.05),
                                   drifting(0.0, -0.05), drifting(0.05, 0.0)],
                         ids=["0.75", "1.33", "left", "right", "drifts left", "drifts right", "drifts on"])  # fmt: skip
def test_the_larger_errors_are_caught_within_30_centimetres_or_3_seconds(name, wrong):
    fault, way_m, time_s = until_stop(name, wrong)
    assert fault == "F37"
    assert way_m <= 0.3 or time_s <= 3.0


@pytest.mark.parametrize("name", ["approach at 0.05", "push at 0.1", "push at 0.02"])
def test_a_pose_that_drifts_back_is_caught_where_slip_cannot_explain_it(name):
    fault, way_m, time_s = until_stop(name, drifting(-0.05, 0.0))
    assert fault == ("F43" if name.startswith("approach") else "F37")  # a drift back at its own speed stands
    assert way_m <= 0.3 or time_s <= 3.0


@pytest.mark.parametrize("name", SPEEDS)
@pytest.mark.parametrize("wrong", [scaled(0.9), scaled(1.0), scaled(1.02), turned(2.8)],
                         ids=["slip", "none", "wheels", "marker"])  # fmt: skip
def test_slip_and_small_errors_of_the_rig_are_none(name, wrong):
    assert until_stop(name, wrong, most_m=1.0, most_s=10.0)[0] is None


def test_two_flawed_poses_in_a_row_are_none_and_three_are():
    """2.5 cm off: less than a jump (F41), and more than 1.2 cm."""
    for flawed, found in ((2, set()), (3, {"F37"})):
        bench, _ = moving("push at 0.1")
        for _ in range(flawed):
            bench.fold(shifted_pose(y=0.025))
        for _ in range(20):
            bench.fold()
        assert NAMES & set(bench.output.faults) == found


def test_a_pose_counted_by_the_wheels_is_not_compared_with_them():
    bench = FoldBench(('base.pose_source="odometry"',)).at_full_speed()
    for n in range(100):
        bench.fold(shifted_pose(x=-0.0005 * n))
    assert bench.output.faults == ()
    too_slow = then(base(odometry=BodyTwist(0.06, 0.0, 0.0)), shifted_pose(x=-0.05))
    ticks = bench.run_until(lambda b: b.output.faults != (), too_slow, most=300)
    assert bench.output.faults == ("F33-way",)
    assert ticks <= 300


WAYS = {"0.75": (0.75, 0.0), "1.33": (1.33, 0.0), "left": (1.0, 15.0), "right": (1.0, -15.0)}


def goes(share, degrees):
    """Let the base go this share of what is sent, turned by so much, by odometry and pose alike."""
    angle, gone = math.radians(degrees), [0.0, 0.0]

    def alter(inp, _):
        sent = inp.base.sent
        x = share * (math.cos(angle) * sent.vx - math.sin(angle) * sent.vy)
        y = share * (math.sin(angle) * sent.vx + math.cos(angle) * sent.vy)
        gone[0] += (x - sent.vx) * 0.01
        gone[1] += (y - sent.vy) * 0.01
        inp = replace(inp, base=replace(inp.base, odometry=BodyTwist(x, y, 0.0)))
        return shifted_pose(*gone)(inp, 0)

    return alter


@pytest.mark.parametrize("name", SPEEDS)
@pytest.mark.parametrize("way", WAYS)
def test_a_base_that_goes_another_way_than_sent_is_caught_within_30_centimetres_or_3_seconds(name, way):
    bench, goes_on = moving(name)
    alter = then(goes_on, goes(*WAYS[way])) if goes_on else goes(*WAYS[way])
    way_m, time_s = 0.0, 0.0
    while "F33-way" not in bench.output.faults:
        assert not NAMES & set(bench.output.faults)
        assert way_m <= 0.3 or time_s <= 3.0
        way_m, time_s = way_m + math.hypot(bench.sent.vx, bench.sent.vy) * 0.01, time_s + 0.01
        bench.fold(alter)
    assert way_m <= 0.3 or time_s <= 3.0


@pytest.mark.parametrize("seed", mostly_long(range(4), 0))
def test_a_quarter_too_slow_is_caught_within_3_seconds_in_spite_of_noise(seed):
    rig = with_faults(
        resolve_rig("sim", ("control.distance_m=1.5", "ft.tare_s=1")), ("base.command.scaled=0.75 at 6 s",)
    )
    found = []
    Lockstep(rig, seed, Nothing()).run(lambda inp, _state, output: found.append((inp.tick, output.faults)))
    first = next(tick for tick, faults in found if "F33-way" in faults)
    assert 600 < first <= 900


def quiet(seed, *overrides):
    """Run a push at level sim; return the faults of motion that it met, and its exit code."""
    ended = Lockstep(resolve_rig("sim", overrides), seed, Nothing()).run(lambda *_: None)
    ours = ("F37", "F43", "F33", "F45", "F46", "F59", "R07")
    return [row for row in ended["fault_counts"] if row.startswith(ours)], ended["exit_code"]


@pytest.mark.long
@pytest.mark.parametrize("slip", [0, 0.03, 0.1])
def test_a_normal_push_meets_none_of_these(slip):
    found = quiet(5, f"world.slip={slip}", "world.floor.patch_strength=0.3", "control.distance_m=0.8")
    assert found == ([], 0)


OFF = st.floats(-0.03, 0.03)
WAY = st.floats(-0.4, 0.4)


@given(
    way=st.tuples(WAY, WAY, st.floats(-0.5, 0.5)),
    off=st.tuples(OFF, OFF, st.floats(-0.1, 0.1)),
    command_off=st.tuples(OFF, OFF),
    time_ns=st.integers(0, 6_000_000_000),
    sent=st.floats(0.0, 0.2),
)
def test_what_is_left_out_unseen_is_never_too_far_off(way, off, command_off, time_ns, sent):
    """A moment that needs no second look would not have been a fault with one, whatever its direction and time."""
    then = MotionMark(0, 1.0, -2.0, 3.1, 0.5, 0.25, 0.1, 0.4, 0.3)
    now = MotionMark(
        time_ns,
        then.x + way[0] + off[0],
        then.y + way[1] + off[1],
        then.yaw + way[2] + off[2],
        then.way_x + way[0],
        then.way_y + way[1],
        then.way_yaw + way[2],
        then.sent_x + way[0] + command_off[0],
        then.sent_y + way[1] + command_off[1],
    )
    inp = replace(FoldBench().good_input(), base=BaseRecord(sent=BodyTwist(sent, 0.0, 0.0)))
    for looked, found in (
        (agreement_checks._of_pose(then, now, inp), agreement_checks._off_by_pose((then,), now, inp)),
        (agreement_checks._of_command(then, now, inp), agreement_checks._off_by_command((then,), now, inp)),
    ):
        assert found in (0.0, looked)
        assert found == looked or looked <= 1.0
