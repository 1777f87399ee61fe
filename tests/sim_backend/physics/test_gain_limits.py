"""The closed-form gain limits against reference values, their special cases, and the simulated world."""

import math

import numpy as np
import pytest

from sim_backend.physics.gain_limits import (
    PushedBody,
    decay_per_m,
    fast_loop_k_f,
    frictionless_integral_limit,
    frictionless_limit,
    integral_limit,
    limit,
    offset_per_degree_m,
    offset_per_newton_m,
    sticking_integral_limit,
    sticking_limit,
)
from tools.sweep.gain_check import growth_rate, simulated_integral_limit, simulated_limit

SQUARE_D = (math.sqrt(2) + math.asinh(1)) / 6
BOX = PushedBody(round=False, rho_m=0.2, d_m=0.153, ball_radius_m=0.05, shift_m=0.045)
BARREL = PushedBody(round=True, rho_m=0.25, d_m=0.125, ball_radius_m=0.05, shift_m=0.045)


@pytest.mark.parametrize(
    ("body", "sticking", "frictionless"),
    [
        (PushedBody(round=False, rho_m=0.5, d_m=SQUARE_D), 0.1261, 0.1244),
        (PushedBody(round=False, rho_m=0.5, d_m=math.sqrt(0.5)), 0.0667, 0.0638),
        (PushedBody(round=True, rho_m=0.5, d_m=1 / 3), 0.1385, 0.2000),
        (PushedBody(round=True, rho_m=0.5, d_m=0.5), 0.1000, 0.2000),
    ],
)
def test_limits_of_the_papers_sliders(body, sticking, frictionless):
    assert sticking_limit(body, 0.1) == pytest.approx(sticking, abs=6e-5)
    assert frictionless_limit(body, 0.1) == pytest.approx(frictionless, abs=6e-5)
    assert limit([body], 0.1) == pytest.approx(min(sticking, frictionless), abs=6e-5)


def test_frictionless_box_limit_solves_its_condition():
    for body in (BOX, PushedBody(round=False, rho_m=0.3, d_m=0.2, shift_m=0.02, along_over_across=1.08)):
        a2 = body.along_over_across**2
        reach, kappa = body.rho_m + body.shift_m + body.ball_radius_m, 0.3 + 1 - a2
        k_y = frictionless_limit(body, 0.3)
        assert (reach / body.d_m**2 - k_y) * (kappa - reach * k_y) == pytest.approx(a2 * k_y)


def test_a_floor_that_resists_along_the_path_needs_k_f():
    # k_f 0.1 tolerates 4.9 %, 0.3 tolerates 14 %
    for k_f, tolerated in ((0.1, 1.0488), (0.3, 1.1402)):
        for factor, stable in ((0.999, True), (1.001, False)):
            body = PushedBody(round=False, rho_m=0.2, d_m=0.15, along_over_across=tolerated * factor)
            assert (sticking_limit(body, k_f) > 0) is stable
            assert (frictionless_limit(body, k_f) > 0) is stable


@pytest.mark.parametrize("body", [BOX, BARREL, PushedBody(round=False, rho_m=0.3, d_m=0.2, along_over_across=1.03)])
def test_the_integral_s_limit_is_where_its_polynomial_has_roots_on_the_axis(body):
    """The polynomials of docs/laws.md, with numbers, not solved but looked at."""
    a2, k_f, k_y = body.along_over_across**2, 0.3, 0.2
    kappa = k_f + 1 - a2
    slope = a2 + body.rho_m * (body.rho_m + body.shift_m) / body.d_m**2
    p = slope / (slope - k_f - 1)
    m = p * sticking_limit(body, k_f)
    k_i = sticking_integral_limit(body, k_f, k_y)
    assert k_i > 0
    assert _real_part([1, m - p * k_y, a2 * m / kappa * k_y - p * k_i, a2 * m / kappa * k_i]) == pytest.approx(
        0, abs=1e-9
    )
    k_i = frictionless_integral_limit(body, k_f, k_y)
    reach = body.rho_m + body.ball_radius_m
    if body.round:
        polynomial = [1, kappa / reach - k_y, a2 / reach * k_y - k_i, a2 / reach * k_i]
    else:
        h, e, n = (reach + body.shift_m) / body.d_m**2, a2 / body.d_m**2, kappa / body.d_m**2
        polynomial = [1, h - k_y, n - k_y * h - k_i, k_y * e - k_i * h, k_i * e]
    assert _real_part(polynomial) == pytest.approx(0, abs=1e-9)


def _real_part(polynomial):
    """Return the largest real part of a polynomial's roots."""
    return max(root.real for root in np.roots(polynomial))


def test_no_integral_is_stable_where_the_paper_s_law_is_not():
    highest = limit([BOX, BARREL], 0.3)
    assert integral_limit([BOX, BARREL], 0.3, 1.01 * highest) == 0.0
    assert 0.0 < integral_limit([BOX, BARREL], 0.3, 0.9 * highest) < integral_limit([BOX, BARREL], 0.3, 0.5 * highest)


@pytest.mark.long
@pytest.mark.parametrize("body", [BOX, BARREL])
@pytest.mark.parametrize("frictionless", [False, True])
def test_the_world_agrees_on_the_integral_s_limit_to_a_percent(body, frictionless):
    formula = frictionless_integral_limit if frictionless else sticking_integral_limit
    expected = formula(body, 0.3, 0.2)
    found = simulated_integral_limit(body, 0.3, 0.2, frictionless=frictionless, near=expected)
    assert found == pytest.approx(expected, rel=0.01)


def test_fast_loop_and_offsets():
    assert fast_loop_k_f([PushedBody(round=False, rho_m=0.5, d_m=0.5)]) == pytest.approx(1.0)
    # by hand: 1.3 / 0.1 times an angle of 0.01745, or of 1 / 13.7
    assert offset_per_degree_m(0.3, 0.1) == pytest.approx(0.2269, abs=1e-4)
    assert offset_per_newton_m(0.3, 0.1, 13.7) == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("body", [BOX, pytest.param(BARREL, marks=pytest.mark.long)])
@pytest.mark.parametrize("k_y", [0.2, 0.5])
def test_a_disturbance_decays_in_the_simulated_world_as_fast_as_the_closed_form_says(body, k_y):
    simulated_per_s = -growth_rate(body, 0.3, k_y, frictionless=False)
    assert decay_per_m([body], 0.3, k_y) == pytest.approx(simulated_per_s / 0.1, rel=0.01)


def test_decay_of_known_poles():
    # The paper's barrel and gains without friction: -0.0095 +- 0.0105i per s at 0.1 m/s.
    barrel = PushedBody(round=True, rho_m=0.5, d_m=1 / 3)
    assert decay_per_m([barrel], 0.1, 0.01) == pytest.approx(0.095, abs=1e-4)
    assert decay_per_m([barrel], 0.1, 0.2) == 0.0, "unstable"
    assert decay_per_m([PushedBody(round=False, rho_m=0.5, d_m=0.5)], 1.1, 0.1) == 0.0, "the force angle runs away"


@pytest.mark.parametrize("body", [BOX, pytest.param(BARREL, marks=pytest.mark.long)])
def test_the_weave_grows_beyond_the_limit_and_not_below(body):
    k_y = sticking_limit(body, 0.3)
    assert growth_rate(body, 0.3, 0.97 * k_y, frictionless=False) < 0
    assert growth_rate(body, 0.3, 1.03 * k_y, frictionless=False) > 0


@pytest.mark.long
@pytest.mark.parametrize(("k_f", "ratio"), [(0.1, 1.0), (0.3, 1.0), (0.3, 1.05)])
@pytest.mark.parametrize("frictionless", [False, True])
@pytest.mark.parametrize("body", [BOX, BARREL, PushedBody(round=False, rho_m=0.5, d_m=SQUARE_D)])
def test_simulation_finds_the_same_limit(body, frictionless, k_f, ratio):
    body = PushedBody(body.round, body.rho_m, body.d_m, body.ball_radius_m, body.shift_m, ratio)
    expected = (frictionless_limit if frictionless else sticking_limit)(body, k_f)
    assert simulated_limit(body, k_f, frictionless=frictionless, near=expected) == pytest.approx(expected, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("body", [
    PushedBody(round=False, rho_m=0.1, d_m=0.006, ball_radius_m=0.05, shift_m=0.045, along_over_across=0.8),
    PushedBody(round=True, rho_m=0.1, d_m=0.0067, ball_radius_m=0.01, shift_m=0.045, along_over_across=1.03),
    PushedBody(round=True, rho_m=0.03, d_m=0.02),
])  # fmt: skip
def test_simulation_finds_the_limit_of_small_sliders_too(body):
    expected = frictionless_limit(body, 0.6)
    assert simulated_limit(body, 0.6, frictionless=True, near=expected) == pytest.approx(expected, rel=0.01)
