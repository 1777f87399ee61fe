"""Deadlines on a fixed grid, the histogram of lateness, and the speed along the way."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from control.pace.pacer import spin_until, wake
from control.pace.timing import LoopTiming
from control.speed_profile import CREEP_M_PER_S, approach_speed, push_speed

MS = 1_000_000


@pytest.mark.parametrize(
    ("now_ms", "late_ms", "skipped", "next_ms"),
    [
        (100, 0, 0, 110),
        (103, 3, 0, 110),
        (109, 9, 0, 110),
        (110, 0, 1, 120),  # exactly one period late: that tick is lost, the next one is on time
        (134, 4, 3, 140),
        (99, -1, 0, 110),  # woken early
        (80, -20, 0, 110),
    ],
)
def test_a_wake_up_is_judged_on_the_grid(now_ms, late_ms, skipped, next_ms):
    found = wake(100 * MS, 10 * MS, now_ms * MS)
    assert (found.late_ns, found.skipped, found.next_deadline_ns) == (late_ms * MS, skipped, next_ms * MS)
    assert found.deadline_ns == (100 + 10 * skipped) * MS


@given(st.integers(1, 10**12), st.integers(1, 10**9), st.lists(st.integers(0, 10**8), min_size=1, max_size=30))
def test_the_pacer_never_bursts_and_keeps_its_phase(first_ns, period_ns, delays):
    deadline, now, ticks = first_ns, first_ns, 0
    for delay in delays:
        now = max(now, deadline) + delay
        found = wake(deadline, period_ns, now)
        assert found.next_deadline_ns > now  # the next one lies ahead: two ticks never follow at once
        assert (found.deadline_ns - first_ns) % period_ns == 0
        assert (found.next_deadline_ns - first_ns) % period_ns == 0
        assert 0 <= found.late_ns < period_ns
        ticks += 1 + found.skipped
        assert first_ns + (ticks - 1) * period_ns == found.deadline_ns  # skipped ones are counted, none twice
        deadline = found.next_deadline_ns


def test_the_histogram_counts_ticks_and_percentiles():
    timing = LoopTiming()
    assert timing.late_percentile_ms(99.0) == 0.0
    for _ in range(98):
        timing.note(50_000, 0, 300_000)
    timing.note(2_000_000, 1, 900_000)
    timing.note(10**12, 7, 100)  # beyond the last bucket
    assert (timing.ticks, timing.skipped) == (100, 8)
    assert timing.late_percentile_ms(50.0) == pytest.approx(0.051)  # in steps of 1 us, rounded up
    assert timing.late_percentile_ms(99.0) == pytest.approx(2.001)
    assert timing.late_percentile_ms(100.0) == pytest.approx(50.0)
    found = timing.summary(100.0, 0, 990_000_000)
    assert (found["measured_hz"], found["late_worst_ms"], found["compute_worst_ms"]) == (100.0, 1e6, 0.9)
    assert LoopTiming().summary(100.0, 5, 5)["measured_hz"] == 0.0


def test_the_stages_of_a_tick_add_up_to_its_time():
    timing = LoopTiming()
    for wake_ns in (40_000, 60_000):
        timing.note_stages(0, wake_ns, wake_ns + 30_000, wake_ns + 130_000, wake_ns + 150_000)
        timing.note_record(70_000)
    found = timing.summary(100.0, 0, 1)
    assert found["stages_us"] == {"wake": 50.0, "input": 30.0, "fold": 100.0, "send": 20.0, "record": 70.0}
    assert found["to_gate_p50_ms"] == 0.191  # from the deadline to the frame's departure
    assert found["to_gate_p99_ms"] == 0.211


@pytest.mark.parametrize(("times", "woken_at", "asked"), [((7, 8, 9, 10, 11), 10, 4), ((12,), 12, 1)])
def test_waiting_awake_ends_at_the_deadline_or_at_once(times, woken_at, asked):
    clock = iter(times)
    assert spin_until(10, lambda: next(clock)) == woken_at
    assert len(list(clock)) == len(times) - asked


@pytest.mark.parametrize(
    ("elapsed_s", "start", "remaining_m", "speed"),
    [
        (0.0, 0.0, 2.0, 0.0),
        (0.5, 0.0, 2.0, 0.05),
        (1.0, 0.0, 2.0, 0.1),
        (9.0, 0.0, 2.0, 0.1),
        (0.5, 0.05, 2.0, 0.075),  # from the speed of the approach
        (9.0, 0.0, 0.05, 0.1),  # braking at 0.1 m/s^2 needs 0.05 m from 0.1 m/s
        (9.0, 0.0, 0.0125, 0.05),
        (9.0, 0.0, 1e-6, CREEP_M_PER_S),  # the last of it is crept
        (9.0, 0.0, 0.0, 0.0),
        (9.0, 0.0, -0.1, 0.0),
    ],
)
def test_ramp_up_plateau_and_ramp_down(elapsed_s, start, remaining_m, speed):
    assert push_speed(elapsed_s, start, 0.1, 1.0, remaining_m) == pytest.approx(speed, abs=1e-12)


def test_a_push_slower_than_creeping_is_not_hurried():
    assert push_speed(9.0, 0.0, 0.004, 1.0, 1e-6) == pytest.approx(0.004)
    assert push_speed(0.0, 0.05, 0.004, 1.0, 1e-6) == pytest.approx(0.004)  # nor where it comes in faster


@pytest.mark.parametrize(
    ("speed", "ramp_s", "remaining_m", "braked"),
    [(0.2, 1.0, 0.025, 0.1), (0.2, 2.0, 0.05, 0.1), (0.1, 0.5, 0.00625, 0.05), (0.3, 3.0, 0.2, 0.2)],
)
def test_braking_is_the_ramp_up_the_other_way_round(speed, ramp_s, remaining_m, braked):
    """v^2 = 2 a s with a = speed / ramp: 0.1 m/s needs 2.5 cm at 0.2 m/s^2, and 5 cm at 0.1 m/s^2."""
    assert push_speed(9.0, 0.0, speed, ramp_s, remaining_m) == pytest.approx(braked, rel=1e-12)


def test_the_last_millimetres_are_gone_at_a_centimetre_a_second():
    assert push_speed(9.0, 0.0, 0.1, 1.0, 1e-6) == 0.01


@given(st.floats(0.0, 20.0), st.floats(0.0, 0.5), st.floats(0.001, 0.5), st.floats(0.1, 10.0), st.floats(-1.0, 10.0))
def test_the_speed_stays_between_zero_and_the_faster_of_start_and_plateau(elapsed, start, speed, ramp, remaining):
    assert 0.0 <= push_speed(elapsed, start, speed, ramp, remaining) <= max(start, speed) * (1 + 1e-12)


def test_the_approach_ramps_up_to_its_speed():
    assert [approach_speed(t, 0.05, 1.0) for t in (0.0, 0.5, 1.0, 5.0)] == pytest.approx([0.0, 0.025, 0.05, 0.05])
