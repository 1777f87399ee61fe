"""The software tare: a mean of a sensor at rest, or a refusal that says which axis and why."""

from __future__ import annotations

import math
import random

import pytest

from control.tare import AXES, add, judge
from robot_io.tick import TareSums

BIAS = (-20.68, 21.95, -48.70, -0.097, 1.172, -0.321)
NOISE = (1.2, 0.03)
RANGE = (300.0, 300.0, 300.0, 30.0, 30.0, 30.0)
RESOLUTION = (0.01, 0.01, 0.01, 0.001, 0.001, 0.001)


class Refused(Exception):
    """The tare was refused."""


def tare(samples, noise_n, noise_nm, scatters=(True,) * 6):
    sums = TareSums()
    for sample in samples:
        sums = add(sums, sample, len(samples), RESOLUTION)
    judged = judge(sums, (noise_n,) * 3 + (noise_nm,) * 3, RANGE, RESOLUTION, scatters)
    if judged.refusal:
        assert judged.do
        raise Refused(judged.what)
    return judged.tare


def at_rest(count=100, bias=BIAS, noise_n=0.3, noise_nm=0.005, seed=1, change=None):
    rng = random.Random(seed)
    sd = (noise_n,) * 3 + (noise_nm,) * 3
    samples = []
    for k in range(count):
        values = [b + rng.gauss(0, s) for b, s in zip(bias, sd, strict=True)]
        if change is not None:
            axis, function = change
            values[axis] += function(k / count)
        samples.append(tuple(values))
    return samples


def test_mean_deviation_and_count():
    samples = [(1.0, 2.0, 3.0, 0.1, 0.2, 0.3), (1.2, 2.0, 3.0, 0.1, 0.2, 0.3)] * 4
    result = tare(samples, *NOISE, scatters=(False,) * 6)
    assert result.bias == pytest.approx((1.1, 2.0, 3.0, 0.1, 0.2, 0.3))
    assert result.sd == pytest.approx((math.sqrt(8 * 0.01 / 7), 0, 0, 0, 0, 0), abs=1e-12)
    assert result.count == 8


def test_the_quarters_of_a_tare_are_its_first_and_its_last_samples():
    """10 samples of 1, 2, 4, 8 ...: quarters of 2 each, so that 1 and 2 are the first and 256 and 512 the last."""
    sums = TareSums()
    for k in range(10):
        sums = add(sums, (0.0, 2.0**k, 0.0, 0.0, 0.0, 0.0), 10, RESOLUTION)
    assert sums.count == 10
    assert sums.origin[1] == 1.0
    assert sums.total[1] == 1023.0 - 10.0
    assert sums.first[1] == (1.0 + 2.0) - 2.0
    assert sums.last[1] == (256.0 + 512.0) - 2.0
    assert sums.first_squares[1] == 0.0**2 + 1.0**2
    assert sums.last_squares[1] == 255.0**2 + 511.0**2


@pytest.mark.parametrize("seed", range(20))
def test_a_sensor_at_rest_is_accepted(seed):
    result = tare(at_rest(seed=seed), *NOISE)
    for axis in range(6):
        assert result.bias[axis] == pytest.approx(BIAS[axis], abs=4 * (0.3 if axis < 3 else 0.005) / 10)
    assert tare(at_rest(seed=seed, noise_n=1.2, noise_nm=0.03), *NOISE).count == 100  # as noisy as the sheet says


def test_a_sensor_as_quiet_as_real_ones_is_accepted():
    """Sensors at rest were seen to read 0.2 N, a sixth of what the sheet says; the dead axis is judged by counts."""
    assert tare(at_rest(noise_n=0.2, noise_nm=0.005), *NOISE).count == 100


def dead(axis, *values):
    """Return samples of which one axis takes these values in turn, and all others scatter."""
    samples = [list(sample) for sample in at_rest()]
    for k, sample in enumerate(samples):
        sample[axis] = values[k % len(values)]
    return [tuple(sample) for sample in samples]


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("counts", [(0,), (5,), (0, 1), (-3, 0, 7)], ids=str)
def test_an_axis_with_three_values_or_fewer_is_dead_and_refused_by_name(axis, counts):
    values = [count * RESOLUTION[axis] for count in counts]
    with pytest.raises(Refused, match=f"{AXES[axis]} shows {len(counts)} distinct values in 100 readings"):
        tare(dead(axis, *values), *NOISE)


@pytest.mark.parametrize("axis", range(6))
def test_an_axis_with_four_values_lives(axis):
    assert tare(dead(axis, *(count * RESOLUTION[axis] for count in (0, 1, 2, 3))), *NOISE).count == 100


def test_values_within_half_a_step_of_the_resolution_are_one():
    values = [count * 0.0049 for count in range(2)]
    with pytest.raises(Refused, match="fx shows 1 distinct value"):
        tare(dead(0, *values), *NOISE)


def test_a_sensor_without_noise_is_accepted_only_where_its_axes_are_exempt():
    assert tare([BIAS] * 100, *NOISE, scatters=(False,) * 6).sd == pytest.approx((0.0,) * 6, abs=1e-12)
    with pytest.raises(Refused, match="mx shows 1 distinct"):
        tare([BIAS] * 100, *NOISE, scatters=(False, False, False, True, True, True))


@pytest.mark.parametrize("axis", range(6))
def test_an_axis_that_shakes_is_refused_by_name(axis):
    amplitude = 4.0 if axis < 3 else 0.1
    samples = at_rest(change=(axis, lambda s: amplitude * math.sin(40 * s)))
    with pytest.raises(Refused, match=f"{AXES[axis]} is not settled: it varies"):
        tare(samples, *NOISE)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [1, -1])
def test_an_axis_that_drifts_is_refused_by_name(axis, sign):
    samples = at_rest(change=(axis, lambda s: sign * s * (1.0 if axis < 3 else 0.02)))
    with pytest.raises(Refused, match=f"{AXES[axis]} is not settled: it drifts"):
        tare(samples, *NOISE)


def test_the_deviation_limit_is_twice_the_noise_given():
    samples = at_rest(noise_n=0.3)
    assert tare(samples, 0.2, 0.03).count == 100
    with pytest.raises(Refused, match="varies"):
        tare(samples, 0.1, 0.03)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [1, -1])
def test_a_bias_that_eats_the_range_is_refused(axis, sign):
    limit = 150.0 if axis < 3 else 15.0
    bias = [0.0] * 6
    bias[axis] = sign * (limit * 1.01)
    with pytest.raises(Refused, match=f"{AXES[axis]} reads .* too little range"):
        tare(at_rest(bias=bias), *NOISE)
    bias[axis] = sign * (limit * 0.99)
    assert tare(at_rest(bias=bias), *NOISE).bias[axis] == pytest.approx(bias[axis], rel=0.01)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_no_number_is_refused(value):
    samples = at_rest()
    samples[50] = (0.0, 0.0, value, 0.0, 0.0, 0.0)
    with pytest.raises(Refused, match="fz is"):
        tare(samples, *NOISE)


@pytest.mark.parametrize(("count", "tares"), [(20, 1000), (30, 1000), (100, 300)])
def test_white_noise_alone_is_not_taken_for_a_drift(count, tares):
    """4 sigma on each of six axes are one refusal in 2,600; the noise of a short tare is itself only estimated."""
    refused = 0
    for seed in range(tares):
        try:
            tare(at_rest(count, noise_n=NOISE[0], noise_nm=NOISE[1], seed=seed), *NOISE)
        except Refused:
            refused += 1
    assert refused <= 3
