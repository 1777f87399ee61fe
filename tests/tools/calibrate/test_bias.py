"""The bias of a minute at rest: its promise over 30 draws, filtered noise, and what it refuses."""

import numpy as np
import pytest

from tests.tools.calibrate.feeds import BIAS, NOISE6, SEEDS, keeps_its_promise, wrench
from tools.calibrate.estimators.bias import estimate_bias
from tools.calibrate.estimators.estimate import CannotCalibrate

NOISE = tuple(NOISE6)


def test_thirty_minutes_at_rest_lie_within_their_uncertainty():
    found = [estimate_bias(*wrench(np.random.default_rng(seed), 60), NOISE) for seed in SEEDS]
    errors = [np.array(one.value) - BIAS for one in found]
    keeps_its_promise(errors, [one.uncertainty for one in found], [0.1] * 3 + [0.01] * 3)


def test_noise_that_neighbours_share_makes_it_less_certain_and_no_less_honest():
    errors, uncertainties = [], []
    for seed in SEEDS:
        dice = np.random.default_rng(seed)
        slow = np.repeat(dice.normal(size=(600, 6)), 10, axis=0) * NOISE6  # each value stays for a tenth of a second
        one = estimate_bias(np.arange(6000) / 100.0, BIAS + slow, NOISE)
        errors.append(one.value[:3] - BIAS[:3])
        uncertainties.append(one.uncertainty[:3])
    # The mean of 600 independent values of 1.2 N: 0.049 N, twice that with k = 2.
    assert np.array(uncertainties).mean() == pytest.approx(2 * 1.2 / np.sqrt(600), rel=0.15)
    shares = np.array(errors) / np.array(uncertainties)
    assert 2.0 * np.sqrt((shares**2).mean()) == pytest.approx(1.0, abs=0.2)


def test_a_touch_of_a_second_is_noticed():
    times, values = wrench(np.random.default_rng(1), 60)
    values[2000:2100, 1] += 5.0
    with pytest.raises(CannotCalibrate, match="fy changed for a moment"):
        estimate_bias(times, values, NOISE)


def test_a_drift_is_told_and_a_large_one_refused():
    times, values = wrench(np.random.default_rng(2), 60)
    ramp = np.zeros_like(values)
    ramp[:, 2] = times / 60.0
    told = estimate_bias(times, values + 0.3 * ramp, NOISE)
    assert "drift in a minute: +0." in told.told[0]
    assert told.uncertainty[2] >= 2 * 0.3 / np.sqrt(12) * 0.6  # it is uncertain by where in the minute one asks
    with pytest.raises(CannotCalibrate, match=r"fz drifts by \+2"):
        estimate_bias(times, values + 2.0 * ramp, NOISE)


def test_too_few_readings_a_shaking_arm_and_no_number_are_refused():
    dice = np.random.default_rng(3)
    with pytest.raises(CannotCalibrate, match="only 100 readings"):
        estimate_bias(*wrench(dice, 1), NOISE)
    times, values = wrench(dice, 20)
    with pytest.raises(CannotCalibrate, match="varies by"):
        estimate_bias(times, BIAS + 3.0 * (values - BIAS), NOISE)
    values[5, 0] = np.nan
    with pytest.raises(CannotCalibrate, match="not a number"):
        estimate_bias(times, values, NOISE)
