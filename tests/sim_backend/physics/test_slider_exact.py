"""The closed form of program (2): optimality conditions, hand-computed cases, degenerate answers by type."""

import math
import random

import pytest

from sim_backend.physics.slider_exact import AtRest, Moving, Separating, Sliding, solve_exact

D_SMALL = 0.0382598


def random_case(rng):
    """A contact on a convex slider with the pusher moving towards it; a third of the cases with v_n near 0."""
    d = math.exp(rng.uniform(math.log(0.02), math.log(2.0)))
    angle = rng.uniform(-math.pi, math.pi)
    n = (math.cos(angle), math.sin(angle))
    inward, along = rng.uniform(-0.6, -0.05), rng.uniform(-0.6, 0.6)
    c = (inward * n[0] - along * n[1], inward * n[1] + along * n[0])
    widest = math.pi / 2 * rng.choice((0.9, 0.999, 1 - 1e-7))
    push = angle + rng.uniform(-widest, widest)
    speed = 10 ** rng.uniform(-4, 0)
    v = (speed * math.cos(push), speed * math.sin(push))
    return (*c, *n, *v, d, rng.choice((1.0, 5.0)), rng.choice((0.0, 0.1, 0.5, 1.0, 2.0, rng.uniform(0, 2))))


def kkt_residual(case, solution):
    """Greatest violation of the optimality conditions of (2), relative to the pusher's speed.

    Stationarity with a multiplier m >= 0 of the active cone edge: m = |slip| det A / g, so its sign is g's.
    """
    cx, cy, nx, ny, vx, vy, d, _, mu = case
    speed = math.hypot(vx, vy)
    vn, vt = vx * nx + vy * ny, vy * nx - vx * ny
    jn, jt = cx * ny - cy * nx, cx * nx + cy * ny
    hn, ht = solution.vx * nx + solution.vy * ny, solution.vy * nx - solution.vx * ny
    wn = hn + jn * solution.omega
    wt = ht + jt * solution.omega
    terms = [
        abs(solution.omega - (jn * hn + jt * ht) / d**2) * d,
        abs(wn - vn),
        abs(wt + solution.slip - vt),
        max(abs(ht) - mu * hn, 0.0),
        max(-hn, 0.0),
    ]
    if solution.mode is not Sliding.STICKING:
        sign = 1.0 if solution.mode is Sliding.LEFT else -1.0
        g = 1 + jn * jn / d**2 + sign * mu * jn * jt / d**2
        assert g > 0
        terms += [abs(ht - sign * mu * hn), max(-sign * solution.slip, 0.0)]
    else:
        terms.append(abs(solution.slip))
    # h grows with the lever arm over d: errors are measured against the greatest term, not against what is left of it
    scale = speed * (1 + (jn * jn + jt * jt) / d**2)
    return max(terms) / scale


def test_optimality_on_twenty_thousand_random_cases():
    rng = random.Random(11)
    counts = dict.fromkeys(Sliding, 0)
    wide = 0
    for _ in range(20_000):
        case = random_case(rng)
        cx, cy, nx, ny, _, _, d, f_max, mu = case
        solution = solve_exact(*case)
        assert isinstance(solution, Moving)
        assert kkt_residual(case, solution) < 1e-12
        jn, jt = cx * ny - cy * nx, cx * nx + cy * ny
        wide += mu * abs(jn * jt) > d * d + jn * jn
        counts[solution.mode] += 1
        # on the limit surface, in the friction cone, parallel to h
        torque = cx * solution.fy - cy * solution.fx
        assert math.hypot(solution.fx, solution.fy, torque / d) == pytest.approx(f_max, rel=1e-12)
        assert solution.fx * solution.vy == pytest.approx(solution.fy * solution.vx, abs=1e-12)
    assert min(counts.values()) > 3000
    assert wide > 1500


@pytest.mark.parametrize("angle_deg", [-60, -20, 0, 35, 80])
def test_frictionless_push_is_hand_computable(angle_deg):
    # s = 0.4 on the left face of the unit square: jn = -0.4, so hn = v_n / (1 + 0.16 / d^2) and omega = -0.4 hn / d^2
    d = 0.38
    v = (0.1 * math.cos(math.radians(angle_deg)), 0.1 * math.sin(math.radians(angle_deg)))
    s = solve_exact(-0.5, 0.4, 1, 0, *v, d, 1.0, 0.0)
    hn = v[0] / (1 + 0.16 / d**2)
    assert (s.vx, s.vy, s.omega) == pytest.approx((hn, 0, -0.4 * hn / d**2))
    assert s.slip == pytest.approx(v[1] - 0.5 * 0.4 * hn / d**2)
    assert (s.fx, s.fy) == pytest.approx((1 / math.hypot(1, 0.4 / d), 0))


def test_push_through_the_centre_of_friction_translates():
    s = solve_exact(-0.5, 0, 1, 0, 0.1, 0, 0.3, 7.0, 0.2)
    assert s == Moving(Sliding.STICKING, 0.1, 0.0, 0.0, 0.0, 7.0, 0.0)


def test_left_is_left_along_the_normal():
    s = solve_exact(-0.5, 0, 1, 0, 0.01, 0.1, 0.3, 1.0, 0.0)
    assert s.mode is Sliding.LEFT
    assert s.slip == pytest.approx(0.1)
    assert solve_exact(-0.5, 0, 1, 0, 0.01, -0.1, 0.3, 1.0, 0.0).mode is Sliding.RIGHT


def test_friction_points_along_the_slip():
    s = solve_exact(-0.5, 0.1, 1, 0, 0.02, 0.1, 0.3, 1.0, 0.25)
    assert s.mode is Sliding.LEFT
    assert s.fy == pytest.approx(0.25 * s.fx)
    assert s.slip > 0


def test_pulling_away_is_a_separation_with_any_friction():
    for mu in (0.0, 0.5, 2.0):
        assert solve_exact(-0.5, 0.25, 1, 0, -1e-12, 0.1, 0.3, 1.0, mu) == Separating()


def test_wide_cone_below_normal_velocity_zero_separates():
    # the QP is feasible here (sticking, tension-free), separation is the other consistent answer and the one taken
    assert solve_exact(-0.5, 0.25, 1, 0, -0.005, -0.1, D_SMALL, 1.0, 1.0) == Separating()


def test_normal_velocity_zero_leaves_the_slider_at_rest():
    assert solve_exact(-0.5, 0.25, 1, 0, 0.0, 0.1, 0.4, 1.0, 1.0) == AtRest(0.1)
    assert solve_exact(-0.5, 0.25, 1, 0, 0.0, -0.1, 0.4, 1.0, 1.0) == AtRest(-0.1)
    assert solve_exact(-0.5, 0.25, 1, 0, 0.0, 0.1, 0.4, 1.0, 0.0) == AtRest(0.1)
    assert solve_exact(-0.5, 0.25, 1, 0, 0.0, 0.0, 0.4, 1.0, 0.5) == AtRest(0.0)


def test_wide_cone_at_normal_velocity_zero_drags_the_slider_to_one_side_only():
    dragged = solve_exact(-0.5, 0.25, 1, 0, 0.0, -0.1, D_SMALL, 1.0, 1.0)
    assert isinstance(dragged, Moving)
    assert dragged.mode is Sliding.STICKING
    assert math.hypot(dragged.vx, dragged.vy) > 0.01
    assert solve_exact(-0.5, 0.25, 1, 0, 0.0, 0.1, D_SMALL, 1.0, 1.0) == AtRest(0.1)


def test_a_velocity_too_small_to_square_is_rest_not_a_division_by_zero():
    assert solve_exact(-0.5, 0.1, 1, 0, 1e-300, 0.0, 0.3, 1.0, 0.5) == AtRest(0.0)
    tiny = solve_exact(-0.5, 0.1, 1, 0, 1e-100, 0.0, 0.3, 1.0, 0.5)
    assert isinstance(tiny, Moving)
    assert math.isfinite(tiny.fx)


def test_mirrored_contact_gives_the_mirrored_bits():
    rng = random.Random(5)
    for _ in range(2000):
        cx, cy, nx, ny, vx, vy, d, f_max, mu = random_case(rng)
        a = solve_exact(cx, cy, nx, ny, vx, vy, d, f_max, mu)
        b = solve_exact(cx, -cy, nx, -ny, vx, -vy, d, f_max, mu)
        assert (b.vx, b.vy, b.omega, b.slip, b.fx, b.fy) == (a.vx, -a.vy, -a.omega, -a.slip, a.fx, -a.fy)
        swapped = {Sliding.STICKING: Sliding.STICKING, Sliding.LEFT: Sliding.RIGHT, Sliding.RIGHT: Sliding.LEFT}
        assert b.mode is swapped[a.mode]


def test_force_scale_leaves_the_motion_alone():
    rng = random.Random(6)
    for _ in range(500):
        *rest, d, _, mu = random_case(rng)
        a, b = solve_exact(*rest, d, 1.0, mu), solve_exact(*rest, d, 8.0, mu)
        assert (a.vx, a.vy, a.omega, a.slip) == (b.vx, b.vy, b.omega, b.slip)
        assert (b.fx, b.fy) == (8 * a.fx, 8 * a.fy)
