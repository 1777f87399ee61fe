"""A bridge whose queue grows: its messages are fresh by arrival and old by their stamps.

Above 60 ms more than in the run's first second: SLOW, above 120 ms: STOP.
"""

import contextlib
import math

import pytest
from msgspec.structs import replace

from robot_io.messages import BaseOdometry, BodyTwist, Stamped
from robot_io.tick import ControlState, SafetyState
from safety.bridge_lag import Lag
from safety.checks import (
    link_checks,
)
from safety.envelope import EnvelopeLimits
from safety.gate_shell import GateShell
from safety.motion_bounds import TravelLimits
from safety.settings import SafetySettings
from tests.host_watch import repeated_when_the_host_stalls
from tests.safety.fold_bench import FoldBench
from tests.safety.test_gate_alone import Gate
from tests.wire.bridge_process import running_bridge
from tools.rig import resolve_rig

MS = 1_000_000
EPOCH_S = 1.76e9
"""The robot's clock: seconds since 1970, and this machine's counts from its start."""


NEW = Lag()


def heard(lag_ms_at, until_ms: int, lag: Lag = NEW, since_ms: int = 0) -> Lag:
    """Return the lag after odometry at 50 Hz, each message `lag_ms_at(sent at ms)` on its way."""
    for sent_ms in range(since_ms, until_ms, 20):
        lag = lag.on_stamp(round((5_000 + sent_ms + lag_ms_at(sent_ms)) * MS), EPOCH_S + sent_ms * 1e-3)
    return lag


def first_above(limit_ms: float, lag_ms_at) -> int:
    """Return the time (ms) of the first message at which the lag is above a limit."""
    lag = Lag()
    for sent_ms in range(0, 20_000, 20):
        lag = heard(lag_ms_at, sent_ms + 20, lag, sent_ms)
        if lag.growth_ns > limit_ms * MS:
            return sent_ms
    raise AssertionError("never")


def test_a_steady_bridge_does_not_lag_however_far_the_clocks_are_apart():
    assert heard(lambda _: 35.0, 60_000).growth_ns < MS
    assert heard(lambda _: -9e6, 60_000).growth_ns < MS


def after(*messages):
    """Return the lag after messages, each (received ms, age on its way ms); the run's first came at 1000 ms."""
    lag = NEW
    for received_ms, age_ms in messages:
        lag = lag.on_stamp(received_ms * MS, (received_ms - age_ms) * 1e-3)
    return lag


THREE = ((1000, 30), (1020, 30), (1040, 30))


def test_in_the_first_second_nothing_is_growth_and_from_then_on_it_is():
    late = [(ms, 80) for ms in (1960, 1980, 2000)]
    assert after(*THREE, *late).growth_ns == 0
    assert after(*THREE, *late, (2001, 80)).growth_ns == pytest.approx(50 * MS, abs=0.02 * MS)


def test_the_baseline_grows_by_half_a_millisecond_a_second():
    late = after(*THREE, *[(ms, 80) for ms in (2000, 2020, 2040)])
    then = late.on_stamp(12_040 * MS, (12_040 - 80) * 1e-3)
    assert late.growth_ns - then.growth_ns == pytest.approx(5 * MS, abs=0.001 * MS)
    back = then.on_stamp(12_000 * MS, (12_000 - 80) * 1e-3)  # received earlier: no time has passed
    assert back.growth_ns == pytest.approx(then.growth_ns, abs=1000)


def test_the_youngest_of_three_messages_counts():
    assert after(*THREE, *[(3000 + n, 30) for n in range(3)], (3100, 500), (3101, 500)).growth_ns < MS
    three_late = after(*THREE, *[(3000 + n, 30) for n in range(3)], *[(3100 + n, 500) for n in range(3)])
    assert three_late.growth_ns == pytest.approx(470 * MS, abs=2 * MS)


def test_a_robot_whose_clock_began_at_zero_is_heard_from_its_first_second():
    assert NEW.on_stamp(5 * MS, 0.5).first_ns == 5 * MS
    assert Lag() == Lag(first_ns=0, newest_ns=0, recent=(), baseline=0, growth_ns=0)


@pytest.mark.parametrize("stamp_s", [0.0, -1.0, math.nan, math.inf, 2.0**32, 1e19, 1.7e308])
def test_a_stamp_that_no_clock_of_ros_can_give_is_left_out(stamp_s):
    """Its seconds have 32 bits; beyond 64 bits of nanoseconds the record could not be published."""
    assert NEW.on_stamp(5_000 * MS, stamp_s) == NEW


def test_a_lag_that_grows_by_30_ms_a_second_is_seen():
    """From 1 s on, when the baseline stands: 60 ms after 2 s more, 120 ms after 4 s."""

    def grows(ms: int) -> float:
        return 5.0 + 0.03 * max(ms - 1_000, 0)

    assert 3_000 <= first_above(60.0, grows) <= 3_200
    assert 5_000 <= first_above(120.0, grows) <= 5_250


@pytest.mark.parametrize("limit_ms", [60.0, 120.0])
def test_a_lag_that_begins_at_once_is_seen_with_the_third_message(limit_ms):
    """The first two may be late for other reasons; at 50 Hz that is within the rows' 6 and 12 ticks."""
    assert first_above(limit_ms, lambda ms: 5.0 if ms < 3_000 else 6.0 + limit_ms) == 3_040


def test_two_late_messages_are_no_lag():
    late = heard(lambda ms: 200.0 if ms in (3_000, 3_020) else 5.0, 3_040)
    assert late.growth_ns < MS


def test_what_a_pause_of_this_machine_delayed_is_no_lag():
    """90 ms: five messages are read at once when it goes on, the newest of them hardly old."""
    lag = heard(lambda ms: 5.0 if not 3_000 <= ms < 3_090 else 3_095.0 - ms, 3_090)
    assert lag.growth_ns < 60 * MS


def test_in_the_first_second_nothing_is_judged():
    assert heard(lambda ms: 5.0 if ms < 500 else 300.0, 700).growth_ns == 0  # the last arrives at 0.98 s


def test_a_slow_first_message_is_not_the_baseline():
    assert heard(lambda ms: 300.0 if ms < 200 else 5.0, 3_000).growth_ns < MS
    assert heard(lambda ms: 300.0 if ms < 200 else 5.0 if ms < 2_000 else 70.0, 3_000).growth_ns > 60 * MS


def test_clocks_that_drift_by_500_ppm_are_no_lag():
    assert heard(lambda ms: 5.0 + 490e-6 * ms, 600_000).growth_ns < 2 * MS
    assert heard(lambda ms: 5.0 - 490e-6 * ms, 600_000).growth_ns < 2 * MS


def stepped(back_ms: float, at_ms: int = 3_000):
    """Return ages on the way of 5 ms, by a robot's clock that is set back at a moment (a negative time: forward)."""
    return lambda ms: 5.0 if ms < at_ms else 5.0 + back_ms


@pytest.mark.parametrize(("back_ms", "limit_ms"), [(70.0, 60.0), (130.0, 120.0), (3_600_000.0, 120.0)])
def test_a_robots_clock_that_is_set_back_looks_like_a_lag_and_slows_or_stops(back_ms, limit_ms):
    """Its stamps say that all messages are old: whether they are cannot be known any more."""
    assert first_above(limit_ms, stepped(back_ms)) == 3_040


def test_a_robots_clock_that_is_set_forward_is_no_lag_and_a_lag_behind_it_is_still_seen():
    assert heard(stepped(-5_000.0), 20_000).growth_ns < MS
    assert heard(lambda ms: stepped(-5_000.0)(ms) + (130.0 if ms >= 10_000 else 0.0), 10_100).growth_ns > 120 * MS


def test_a_clock_that_is_set_forward_and_back_again_stops():
    there_and_back = heard(lambda ms: 5.0 - (5_000.0 if 3_000 <= ms < 4_000 else 0.0), 4_100)
    assert there_and_back.growth_ns > 120 * MS


@pytest.mark.parametrize("stamp_s", [math.nan, math.inf, 0.0, -1.0])
def test_a_message_without_a_stamp_is_left_out(stamp_s):
    lag = heard(lambda _: 5.0, 2_000)
    assert lag.on_stamp(99_000 * MS, stamp_s) == lag


@pytest.mark.parametrize(
    ("lag_ns", "found"),
    [(60 * MS, []), (60 * MS + 1, ["F32-slow"]), (120 * MS, ["F32-slow"]), (120 * MS + 1, ["F32-stop"])],
)
def test_the_limits(lag_ns, found):
    settings, inp = SafetySettings.of(resolve_rig("sim")), FoldBench().good_input()
    lagging = replace(inp, base=replace(inp.base, lag_ns=lag_ns))
    _, faults = link_checks.check(settings, SafetyState(), lagging, ControlState())
    assert faults == found
    assert [fault.value for fault in faults] == [lag_ns / MS] * len(found)


def test_the_gate_puts_it_into_its_record():
    shell = GateShell(EnvelopeLimits(0.15, 0.25, 0.5, 1.0, 10 * MS, 0.0, 0.0), TravelLimits(2.0, 30.0), 0)
    for ms in range(0, 3_000, 20):
        late = 0 if ms < 2_000 else 80
        sample = Stamped(BaseOdometry(BodyTwist()), 0, (5_000 + ms + late) * MS, EPOCH_S + ms * 1e-3)
        shell = shell.on_samples([sample])
    assert shell.record.lag_ns == pytest.approx(80 * MS, abs=MS)


@pytest.mark.long
@repeated_when_the_host_stalls
def test_on_the_wire(tmp_path):
    """An emulated bridge that holds everything back by 90 ms, after a second without."""
    with running_bridge() as bridge, contextlib.closing(Gate(bridge.url)) as gate:
        gate.wait_ready()
        gate.tell_for(BodyTwist(), 1_300)
        assert gate.link.read().lag_ns < 40 * MS
        bridge.do("lag", 0.09)
        gate.tell_until(BodyTwist(), lambda: gate.link.read().lag_ns > 60 * MS)
        gate.tell_for(BodyTwist(), 100)
        assert 60 * MS < gate.link.read().lag_ns < 130 * MS


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_robots_clock_set_back_by_a_quarter_of_a_second_is_told_to_control_on_the_wire(tmp_path):
    """As a time server does that steps instead of slewing; F32-stop is above 120 ms."""
    with running_bridge() as bridge, contextlib.closing(Gate(bridge.url)) as gate:
        gate.wait_ready()
        gate.tell_for(BodyTwist(), 1_300)
        assert gate.link.read().lag_ns < 40 * MS
        bridge.do("set_clock", -0.25)
        gate.tell_until(BodyTwist(), lambda: gate.link.read().lag_ns > 120 * MS)
        gate.tell_for(BodyTwist(), 100)
        assert 220 * MS < gate.link.read().lag_ns < 330 * MS
