"""Columns and tallies of a log stay small and stay true."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tools.report.bounded_series import Series, Tally


def test_a_series_below_its_limit_keeps_every_row():
    series = Series(("t", "x"), limit=100)
    for n in range(99):
        assert series.wants()
        series.add((n, 2.0 * n))
    assert series.stride == 1
    assert series.arrays()["x"].tolist() == [2.0 * n for n in range(99)]


@pytest.mark.parametrize("count", [100, 101, 1000, 12_345])
def test_a_long_series_is_thinned_evenly_and_stays_below_its_limit(count):
    series = Series(("t",), limit=100)
    most = asked = 0
    for n in range(count):
        if series.wants():
            asked += 1
            series.add((n,))
        most = max(most, len(series))
    times = series.arrays()["t"]
    assert most < 100
    assert times[0] == 0.0
    assert set(np.diff(times)) == {series.stride}
    assert count - times[-1] <= series.stride
    assert asked < 100 + 50 * math.log2(count / 50)  # the rows that were made, and not the messages, set the time


def test_numbers_that_no_axis_bears_become_nan():
    series = Series(("x",))
    for value in (1.0, math.nan, math.inf, -math.inf, 1e300, -3.0):
        series.wants()
        series.add((value,))
    np.testing.assert_array_equal(series.arrays()["x"], [1.0, math.nan, math.nan, math.nan, math.nan, -3.0])


def test_a_tally_gives_the_percentiles_of_what_it_counted():
    times = np.random.default_rng(3).gamma(2.0, 0.5, 5000)
    tally = Tally()
    for value in times:
        tally.add(float(value))
    tally.add(math.nan)
    assert tally.total == 5000
    assert tally.worst_ms == times.max()
    for percent in (50, 99, 99.9):
        assert tally.percentile_ms(percent) == pytest.approx(
            float(np.percentile(times, percent, method="inverted_cdf")), abs=0.01
        )
    edges = np.array([0.0, 0.5, 1.0, 100.0])
    assert tally.counts_in(edges).tolist() == np.histogram(times, bins=edges)[0].tolist()


def test_a_tally_of_a_virtual_clock_and_of_nothing():
    tally = Tally()
    assert math.isnan(tally.percentile_ms(50))
    tally.add(0.0)
    assert (tally.percentile_ms(50), tally.percentile_ms(99), tally.worst_ms) == (0.0, 0.0, 0.0)
    tally.add(5000.0)
    assert (tally.percentile_ms(99), tally.worst_ms) == (pytest.approx(1000.01), 5000.0)
