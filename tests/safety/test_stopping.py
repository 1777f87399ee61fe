"""Stopping distances by hand: bound, way to the base and its tick at full speed, then braking at 2.5 m/s^2."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from safety.faults import FAULTS
from safety.stopping import alone_m, distance_m, of_row, stopping
from tools.rig import resolve_rig


def test_reaction_at_full_speed_and_then_braking():
    assert distance_m(0.5, 0.0) == pytest.approx(0.05)
    assert distance_m(0.5, 0.2) == pytest.approx(0.15)
    assert distance_m(0.5, 0.2, 1.0) == pytest.approx(0.225)
    assert distance_m(0.0, 9.0) == 0.0


@pytest.mark.parametrize(("speed", "wanted"), [(0.1, 0.032), (0.3, 0.108), (0.5, 0.2)])
def test_without_this_computer_the_bases_own_timeout_counts(speed, wanted):
    """10 ms since the last command, 250 ms timeout, 40 ms tick of the base."""
    assert alone_m(speed) == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("row", "wanted"),
    [
        ("F64", 0.5 * 0.07 + 0.05),  # 1 tick, 20 ms, 40 ms
        ("F50-stop", 0.5 * 0.07 + 0.05),
        ("F66", 0.5 * 0.11 + 0.05),  # 5 ticks
        ("F33", 0.5 * 0.36 + 0.05),  # 30 ticks
        ("F67", 0.5 * 0.30 + 0.05),  # no zero comes: the timeout
        ("F30", 0.5 * 0.30 + 0.05),
        ("F31-stop", 0.5 * 0.31 + 0.05),  # 25 ticks are later than the timeout
        ("F63", 0.5 * 1.06 + 0.125),  # HOLD ramps at 1 m/s^2
        ("F20-hold", 0.5 * 0.07 + 0.125),
    ],
)
def test_of_each_kind_of_row(row, wanted):
    assert of_row(FAULTS[row], 0.5, 1.0) == pytest.approx(wanted)


@pytest.mark.parametrize("row", ["F50-slow", "F36", "R01", "R06", "F34", "F39"])
def test_rows_without_a_way_to_rest(row):
    """They slow or warn, come before the first motion, or say that the base does not do what it is told."""
    assert of_row(FAULTS[row], 0.5, 1.0) is None


def test_a_ramp_steeper_than_the_base_brakes_is_not_counted():
    assert of_row(FAULTS["F20-hold"], 0.5, 9.0) == pytest.approx(0.5 * 0.07 + 0.05)


def test_of_a_rig():
    found = stopping(resolve_rig("sim", ["control.push_speed_m_per_s=0.3"]), (FAULTS["F64"], FAULTS["F63"]))
    assert found.speed_m_per_s == 0.3
    assert found.stop_m == pytest.approx(0.3 * 0.07 + 0.018)
    assert found.alone_m == pytest.approx(0.108)
    assert (found.slowest_row, found.slowest_m) == ("F63", pytest.approx(0.3 * 1.06 + 0.045))
    slow = stopping(resolve_rig("sim", ["control.push_speed_m_per_s=0.04"]), FAULTS.values())
    assert slow.speed_m_per_s == 0.05, "the approach is faster"


@pytest.mark.parametrize(
    ("family", "counts"),
    [("F73", "F73-hold"), ("F31", "F31-stop")],  # where no zero comes through, a hold does not brake either
)
def test_a_base_that_was_held_first_rolls_no_further_until_it_is_stopped(family, counts):
    rows = (FAULTS[f"{family}-hold"], FAULTS[f"{family}-stop"])
    found = stopping(resolve_rig("sim", ["control.push_speed_m_per_s=0.3"]), rows)
    assert found.slowest_m == of_row(FAULTS[counts], 0.3, 1.0)
    assert of_row(rows[0], 0.3, 1.0) < of_row(rows[1], 0.3, 1.0)


def test_a_hold_that_takes_longer_than_the_stop_counts_as_the_stop():
    held, stopped = (replace(FAULTS["F73-hold"], bound_ticks=500), FAULTS["F73-stop"])
    found = stopping(resolve_rig("sim"), (held, stopped))
    assert (found.slowest_row, found.slowest_m) == ("F73-hold", of_row(held, 0.1, 1.0))
    assert stopping(resolve_rig("sim"), (stopped,)).slowest_m == of_row(stopped, 0.1, 1.0)
