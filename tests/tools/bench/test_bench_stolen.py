"""`push bench loop`: what is left out because the host of a virtual machine took the time, and what stays."""

from __future__ import annotations

import contextlib
import sys
import time

import pytest

from robot_io.errors import EnvironmentFault
from tools.bench.clock import stolen
from tools.bench.clock.rounds import run_rounds
from tools.bench.clock.stolen import Reading, Window, joined, sample, steal_of_lines, watching, window_between
from tools.bench.clock.wakeups import Tick, Wakeups, timed

MS = 1_000_000


def test_steal_is_read_of_all_processors_and_of_each():
    stat = "cpu  1 0 1 1 0 0 0 9 0 0\ncpu0 1 0 1 1 0 0 0 4 0 0\ncpu1 1 0 1 1 0 0 0 5 0 0\nintr 7 0\nctxt 5\n"
    assert steal_of_lines(stat) == (9, 4, 5)


def test_a_window_reaches_back_from_the_reading_that_shows_a_tick():
    """To the reading before it, by 10 ms a tick and by 100 ms; never beyond the reading (docs/realtime.md)."""
    last = Reading(1000 * MS, 1001 * MS, (7, 3, 4))
    assert window_between(last, Reading(1050 * MS, 1052 * MS, (7, 3, 4))) is None
    assert window_between(last, Reading(1050 * MS, 1052 * MS, (8, 3, 4))) == (890 * MS, 1052 * MS)
    # Two processors' ticks may be one tick of their sum; what one of them lost in one piece may be 30 ms.
    assert window_between(last, Reading(1050 * MS, 1052 * MS, (7, 4, 4))) == (890 * MS, 1052 * MS)
    assert window_between(last, Reading(1050 * MS, 1052 * MS, (9, 3, 7))) == (870 * MS, 1052 * MS)
    # A sampler that was held up for a second makes the window longer by it.
    assert window_between(last, Reading(2050 * MS, 2052 * MS, (8, 3, 4))) == (890 * MS, 2052 * MS)


def test_windows_are_joined():
    found = joined([Window(50, 60), Window(10, 20), Window(20, 30), Window(12, 15)])
    assert found == [(10, 30), (50, 60)]


def test_what_shows_after_the_end_is_waited_for():
    """The end comes in the second wait; the counter grows only in the reading after that, a whole wait later."""
    readings = iter([(50, 7), (100, 7), (150, 8), (200, 9)])
    ends = iter([False, True, False])

    def read() -> Reading:
        at_ms, ticks = next(readings)
        return Reading(at_ms * MS, at_ms * MS, (ticks,))

    assert sample(Reading(0, 0, (7,)), read, lambda: next(ends)) == [(-10 * MS, 150 * MS)]


def test_the_sampler_of_this_machine_watches_all_along():
    """What it finds is the host's affair; that it reads every 50 ms or so shows in the length of what it finds."""
    before_ns = time.monotonic_ns()
    with watching() as found:
        pass
    assert all(before_ns - 10_000 * MS < window.from_ns < window.to_ns < time.monotonic_ns() for window in found)


def test_a_sampler_that_fails_is_no_quiet_host(monkeypatch):
    monkeypatch.setattr(
        stolen, "fresh_interpreter", lambda _name: ([sys.executable, "-c", "raise SystemExit('x')"], {})
    )
    with pytest.raises(EnvironmentFault, match="sampler"), watching():
        pass
    died = "import sys; print('begun', flush=True); sys.stdin.read(); sys.exit('gone')"
    monkeypatch.setattr(stolen, "fresh_interpreter", lambda _name: ([sys.executable, "-c", died], {}))
    with pytest.raises(EnvironmentFault, match="gone"), watching():
        pass


def ticks_of(count: int, *, period_ms: int = 10, late_us: int = 50) -> list[Tick]:
    """Return wake-ups whose deadlines are 0, 10, 20 ... ms."""
    return [Tick(i * period_ms * MS + late_us * 1000, late_us * 1000, 0) for i in range(count)]


def test_wake_ups_that_touch_stolen_time_are_left_out():
    ticks = ticks_of(200)
    ticks[100] = Tick(1_004 * MS, 4 * MS, 0)  # due at 1000 ms, taken until 1004
    ticks[147:151] = [Tick(1_502 * MS, 2 * MS, 3)]  # due at 1470 ms, three periods gone
    ticks[156:158] = [Tick(1_601 * MS, 1 * MS, 1)]
    all_of = timed(ticks, 10 * MS, 4, {"ticks": 196})
    assert (all_of.max_us, all_of.skipped, all_of.kept_share) == (4000.0, 4, 1.0)
    # One lies before the deadline of tick 100, one within its lateness; the last meets the first period skipped.
    left = all_of.without([Window(999 * MS, 999 * MS), Window(1003 * MS, 1003 * MS), Window(1465 * MS, 1471 * MS)])
    assert (len(left.late_us), left.measured) == (194, 196)
    assert left.kept_share == pytest.approx(194 / 196)
    assert (left.max_us, left.skipped, left.skipped_stolen) == (1000.0, 1, 3)
    assert left.facts == {"ticks": 196}
    assert all_of.without([]).late_us == all_of.late_us
    assert all_of.without([]).kept_share == 1.0


def test_wake_ups_without_times_are_never_left_out():
    assert Wakeups((50.0, 90.0)).without([Window(0, 10**18)]) == Wakeups((50.0, 90.0))


@pytest.mark.parametrize(
    ("count", "gone", "enough"),
    [(1000, 500, True), (1000, 501, False), (150, 50, True), (150, 51, False), (60, 0, True), (60, 1, False)],
)
def test_half_of_the_wake_ups_stand_for_all_and_a_hundred_at_least(count, gone, enough):
    """A hundred, or all of them where a measurement has fewer (docs/realtime.md)."""
    found = timed(ticks_of(count), 10 * MS, 0, {}).without([Window(-1, gone * 10 * MS - 1)])
    assert len(found.late_us) == count - gone
    assert found.enough is enough


def timed_rounds_of(taken: list[list[Window]]):
    """Run rounds of two columns of 200 wake-ups from 0 s and from 10 s on, in which the host takes what is listed."""
    said: list[str] = []
    full = [Tick(tick.woken_ns + 10_000 * MS, tick.late_ns, 0) for tick in ticks_of(200)]
    columns = {
        "bare": lambda: timed(ticks_of(200), 10 * MS, 0, {}),
        "full": lambda: timed(full, 10 * MS, 0, {}),
    }
    found = run_rounds(
        columns, 1e9, steal=iter(range(0, 10_000, 100)).__next__,
        watch=lambda: contextlib.nullcontext(taken.pop(0)), clock=lambda: 0.0, say=said.append,
    )  # fmt: skip
    return found, said


def test_a_round_is_kept_when_each_column_was_left_alone_long_enough():
    some, most = Window(10_000 * MS, 10_500 * MS - 1), Window(10_000 * MS, 11_500 * MS - 1)
    found, said = timed_rounds_of([[some], [most], [], [Window(3_000 * MS, 9_000 * MS)]])
    assert (found.count, found.run, found.too_noisy) == (3, 4, False)
    assert [len(one.late_us) for one in found.kept["full"]] == [150, 200, 200]
    # 75, 25, 100 and 100 % of four rounds.
    assert found.kept_shares == {"bare": 1.0, "full": 0.75}
    assert said[1] == "round 2: dropped, full kept 50 of 200 wake-ups (left alone: bare 100%, full 25%)"


def test_a_host_that_takes_every_second_is_too_noisy_with_its_numbers():
    found, _ = timed_rounds_of([[Window(10_000 * MS, 11_200 * MS - 1)] for _ in range(6)])
    assert (found.count, found.run, found.too_noisy) == (0, 6, True)
    assert found.kept_shares == {"bare": 1.0, "full": pytest.approx(0.4)}
