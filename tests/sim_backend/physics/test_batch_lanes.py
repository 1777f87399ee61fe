"""The compiled batch against the readable lane, OSQP, the study's known outcomes, and the formulas of stability."""

import itertools
import math

import numpy as np
import pytest

from control.laws.force_integral import ForceIntegral, IntegralSettings
from control.laws.law import Seen
from robot_io.rig.config import ControlConfig
from sim_backend.physics.batch import run_batch
from sim_backend.physics.lanes import Lane, LaneEnd, Timing, simulate_lane
from sim_backend.physics.slider_qp import QpSolver

SQUARE_UNIFORM = (math.sqrt(2) + math.asinh(1)) / 6


def table_one(**changes):
    """The paper's 486 lanes in the order of its study."""
    lanes = []
    for is_round, uniform, rim in ((False, SQUARE_UNIFORM, math.sqrt(0.5)), (True, 1 / 3, 0.5)):
        for d, mu, y0, phi0, s0 in itertools.product(
            (0.1 * uniform, uniform, rim), (0, 0.5, 1), (-0.4, 0, 0.4), (-math.pi / 8, 0, math.pi / 8), (-0.4, 0, 0.4)
        ):
            lanes.append(Lane(is_round, 0.5, 0.5, d, mu, y0, phi0, s0, **changes))
    return lanes


def largest_difference(states, records):
    return max(np.abs(np.array(r) - s[: len(r)]).max() for s, r in zip(states, records, strict=True))


def test_batch_equals_the_plain_lane():
    lanes = table_one()[::23] + table_one(law="open-loop")[5::61] + table_one(k_f=0.3, k_y_rad_per_m=0.5)[8::61]
    lanes += table_one(law="line", k_y_rad_per_m=0.3)[3::61]
    lanes += table_one(law="force-integral", k_f=0.3, k_y_rad_per_m=0.2, k_i_rad_per_m2=0.06)[2::61]
    timing = Timing(steps=1500, record_every=100)
    results, states = run_batch(lanes, timing)
    plain = [simulate_lane(lane, timing) for lane in lanes]
    assert largest_difference(states, [records for _, records in plain]) < 1e-11
    assert {r.end for r in results} == {LaneEnd.OK, LaneEnd.EDGE, LaneEnd.PULL}
    for one, (other, records) in zip(results, plain, strict=True):
        assert one.end is other.end
        assert one.steps == other.steps
        assert (one.steps_sticking, one.steps_left, one.steps_right) == (
            other.steps_sticking,
            other.steps_left,
            other.steps_right,
        )
        assert one.final == pytest.approx(other.final, abs=1e-11)
        assert (
            one.max_abs_y_m,
            one.max_abs_y_c_m,
            one.max_abs_theta_p_rad,
            one.min_normal_speed_ratio,
        ) == pytest.approx(
            (other.max_abs_y_m, other.max_abs_y_c_m, other.max_abs_theta_p_rad, other.min_normal_speed_ratio), abs=1e-11
        )
        assert len(records) == one.steps // 100 + 1
    for result, kept in zip(results, states, strict=True):
        assert np.isnan(kept[result.steps // 100 + 1 :]).all()
        assert not np.isnan(kept[: result.steps // 100 + 1]).any()


def test_the_law_with_integral_of_a_lane_is_the_one_that_pushes():
    """From 0.5 m beside the path its offset is cut, and the push turned by more than is added up."""
    lane = Lane(False, 0.5, 0.5, 0.38, 0.5, 0.2, -0.3, 0.2, k_f=0.3, k_y_rad_per_m=0.3, law="force-integral",
                k_i_rad_per_m2=0.5)  # fmt: skip
    law = ForceIntegral(ControlConfig(k_f=0.3, k_y_rad_per_m=0.3), IntegralSettings(k_i_rad_per_m2=0.5))
    for steps in (1, 40, 400, 1500, 8000):
        result, records = simulate_lane(lane, Timing(steps=steps, record_every=1))
        state, widest, thetas = law.initial(), 0.0, []
        for step, (_, y, phi, s, fx, fy) in enumerate(records[: result.steps]):
            y_c = y - math.sin(phi) * 0.5 + math.cos(phi) * s
            seen = Seen(fx, fy, True, math.atan2(fy, fx), y_c, step * 0.001, 0.1, 0.01)
            theta_p, state = law.step(state, seen)
            thetas.append(abs(theta_p))
            widest = max(widest, thetas[-1])
        assert result.max_abs_theta_p_rad == pytest.approx(widest, abs=1e-12)
    assert max(thetas) > 0.4
    assert min(thetas) < 0.2


@pytest.mark.parametrize(
    ("steps", "lanes"), [(400, slice(None, None, 81)), pytest.param(60_000, [60, 300, 461], marks=pytest.mark.long)]
)
@pytest.mark.timeout(600)
def test_batch_agrees_with_osqp_on_the_same_lanes(steps, lanes):
    chosen = table_one()[lanes] if isinstance(lanes, slice) else [table_one()[i] for i in lanes]
    timing = Timing(steps=steps, record_every=100)
    _, states = run_batch(chosen, timing)
    records = [simulate_lane(lane, timing, QpSolver())[1] for lane in chosen]
    assert largest_difference(states, records) < 1e-6


def test_the_first_step_by_hand():
    # left face, s = -0.4, frictionless, heading 0, force measurement (1, 0): theta_p = k_y y_c, y_c = 0.4 - 0.4 = 0
    lane = Lane(False, 0.5, 0.5, 0.38, 0.0, 0.4, 0.0, -0.4)
    _, states = run_batch([lane], Timing(steps=1, record_every=1))
    hn = 0.1 / (1 + 0.16 / 0.38**2)
    omega = 0.4 * hn / 0.38**2
    slip = 0.0 - (-0.5) * omega
    force = 1 / math.hypot(1, 0.4 / 0.38)
    assert states[0, 0] == pytest.approx((0, 0.4, 0, -0.4, 1, 0))
    assert states[0, 1] == pytest.approx((hn * 0.01, 0.4, omega * 0.01, -0.4 + slip * 0.01, force, 0.0))


def test_a_circles_contact_lies_at_pi_minus_s_over_radius():
    # frictionless: the force is along the inward normal at that place, here -s/radius from the heading
    lane = Lane(True, 0.5, 0.5, 1 / 3, 0.0, 0.0, 0.2, 0.3)
    _, states = run_batch([lane], Timing(steps=1, record_every=1))
    assert math.atan2(states[0, 1, 5], states[0, 1, 4]) == pytest.approx(0.2 - 0.3 / 0.5)
    assert math.hypot(states[0, 1, 4], states[0, 1, 5]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "square", "circle"),
    [
        ({"law": "open-loop"}, (27, 216, 0), (27, 0, 216)),
        pytest.param({"k_y_rad_per_m": 0.3}, (87, 154, 2), (243, 0, 0), marks=pytest.mark.long),
        pytest.param({"k_f": 0.3, "k_y_rad_per_m": 0.5}, (87, 126, 30), (225, 0, 18), marks=pytest.mark.long),
    ],
)
def test_how_many_lanes_other_controllers_lose(changes, square, circle):
    # counts found with an independent program; limit cycles are sensitive to rounding, ends are not
    results, _ = run_batch(table_one(**changes), Timing())
    for part, expected in ((results[:243], square), (results[243:], circle)):
        assert tuple(sum(r.end is end for r in part) for end in (LaneEnd.OK, LaneEnd.EDGE, LaneEnd.PULL)) == expected


def test_open_loop_loses_the_slider_within_five_metres_or_never():
    results, _ = run_batch(table_one(law="open-loop"), Timing())
    survivors = [lane for lane, r in zip(table_one(), results, strict=True) if r.end is LaneEnd.OK]
    assert {(lane.s0_m, lane.phi0_rad) for lane in survivors} == {(0, 0.0)}  # balanced on the unstable equilibrium
    lost = [r.steps * 0.001 for r in results if r.end is not LaneEnd.OK]
    assert 0.15 < min(lost) < max(lost) < 5


def test_mirrored_start_and_halved_speed_keep_every_bit():
    lanes = table_one()[::7]
    timing = Timing(steps=5000, record_every=250)
    _, states = run_batch(lanes, timing)
    mirrored = [
        Lane(lane.round, 0.5, 0.5, lane.d_m, lane.contact_friction, -lane.y0_m, -lane.phi0_rad, -lane.s0_m)
        for lane in lanes
    ]
    _, other = run_batch(mirrored, timing)
    assert np.array_equal(other, states * np.array([1, -1, -1, -1, 1, -1]))
    _, slow = run_batch(table_one(speed_m_per_s=0.05)[::7], Timing(0.02, 5000, 250))
    assert np.array_equal(slow, states)


def test_error_falls_in_first_order_with_the_step():
    lanes = table_one()[::50]
    ends = {}
    for n in (1, 2, 4, 8, 64):
        _, states = run_batch(lanes, Timing(0.04 / n, 2500 * n, 2500 * n))
        ends[n] = states[:, -1, :2]
    errors = [np.abs(ends[n] - ends[64]).max() for n in (1, 2, 4, 8)]
    assert errors[0] < 0.05
    for coarse, fine in itertools.pairwise(errors):
        assert 1.7 < coarse / fine < 2.5


def grows(lane):
    """Whether a small offset of a lane grows: |y| later against |y| earlier, both over whole swings."""
    _, states = run_batch([lane], Timing(0.01, 120_000, 100))
    y = np.abs(states[0, :, 1])
    return y[800:].max() > y[400:800].max()


@pytest.mark.long
@pytest.mark.parametrize(
    ("is_round", "d", "mu", "k_f", "limit"),
    [
        (True, 1 / 3, 1.0, 0.1, 0.1 * 0.5 / (0.25 + 1 / 9)),
        (True, 0.5, 1.0, 0.1, 0.1),
        (True, 1 / 3, 0.0, 0.1, 0.2),
        (False, SQUARE_UNIFORM, 1.0, 0.1, 0.1 * 0.5 / (0.25 + SQUARE_UNIFORM**2)),
        (False, SQUARE_UNIFORM, 0.0, 0.1, 0.1244),
        (False, math.sqrt(0.5), 0.0, 0.1, 0.0638),
        (True, 1 / 3, 1.0, 0.3, 0.3 * 0.5 / (0.25 + 1 / 9)),
    ],
)
def test_growth_changes_sign_at_the_closed_form_limit(is_round, d, mu, k_f, limit):
    low, high = 0.9 * limit, 1.1 * limit
    for _ in range(6):
        middle = (low + high) / 2
        lane = Lane(is_round, 0.5, 0.5, d, mu, 1e-4, 0.0, 0.0, k_f=k_f, k_y_rad_per_m=middle)
        low, high = (low, middle) if grows(lane) else (middle, high)
    assert (low + high) / 2 == pytest.approx(limit, rel=0.01)
