"""Yaw from the ends of long pushes: the pusher-slider is integrated here from its textbook equations, not by our world.

Sticking contact, ellipsoid of friction: force f (unit), torque arm rho, ratio d. The law sees the force turned by the
error of the sensor and of the tare.
"""

import math

import numpy as np
import pytest

from tests.tools.calibrate.feeds import FORCE_N, SEEDS, keeps_its_promise
from tools.calibrate.estimators.end_of_push import EndedPush, estimate_from_pushes, ringing
from tools.calibrate.estimators.estimate import CannotCalibrate

RIG = ((0.0, 0.0, 1.0), (0.2578500325, -0.9661849516, 0.0), (0.9661849516, 0.2578500325, 0.0))
LENGTHS = (0.15, 0.25)
RHO, D = 0.2, 0.153
"""A box of 0.4 m that rests evenly on the floor: d = 0.765 rho."""
K_F, K_Y = 0.3, 0.2
PUSH_N = 15.0
TARE_S = 5.0


def pushed(dice, yaw_deg, length_m, tare_s=TARE_S):
    """Return one push at 0.1 m/s, 100 readings a second, from a start that is off by decimetres and degrees."""
    tare_rad = FORCE_N / math.sqrt(100 * tare_s) / PUSH_N
    error = -math.radians(yaw_deg) + dice.normal() * tare_rad
    psi, y, theta_f = dice.normal() * 0.1, dice.normal() * 0.05, 0.0
    step, count = 0.001, round(length_m / 0.001)
    # The force is filtered over 0.05 s: 10 readings share their noise.
    noise = np.convolve(dice.normal(size=count + 20) * FORCE_N / PUSH_N, np.ones(10) / 10, "valid")[:count]
    off = np.empty(count)
    g = D * D / (D * D + RHO * RHO)
    for i in range(count):
        read = theta_f + error + noise[i]
        theta_p = (1 + K_F) * read + K_Y * y
        off[i] = read - theta_p
        # The pusher's velocity along and across the face; a contact that sticks turns the object by the moment it has.
        along, across = math.cos(theta_p - psi), math.sin(theta_p - psi)
        theta_f = psi + math.atan2(g * across, along)
        psi -= step * RHO * across / (RHO**2 + D**2)
        y += step * math.sin(theta_p)
    return EndedPush("push", np.arange(count) * step, off, K_F, K_Y, tare_rad)


def test_thirty_times_three_pushes_lie_within_their_uncertainty():
    errors, uncertainties = [], []
    for seed in SEEDS:
        dice = np.random.default_rng(seed)
        yaw = math.remainder(1.7 * seed, 8.0)
        found = estimate_from_pushes([pushed(dice, yaw, 6.0) for _ in range(3)], RIG, LENGTHS)
        errors.append(found.value[0] - yaw)
        uncertainties.append(found.uncertainty[0])
    keeps_its_promise(errors, uncertainties, 0.5)


def test_the_mean_of_three_metres_is_not_the_yaw_but_its_end_tells():
    dice = np.random.default_rng(1)
    pushes = [pushed(dice, 3.0, 5.1) for _ in range(3)]
    means = [-math.degrees(float(push.off_rad[:3000].mean())) for push in pushes]
    assert max(abs(mean - 3.0) for mean in means) > 0.5
    assert estimate_from_pushes(pushes, RIG, LENGTHS).value[0] == pytest.approx(3.0, abs=0.5)


def test_the_tare_is_named_as_the_floor():
    dice = np.random.default_rng(2)
    found = estimate_from_pushes([pushed(dice, 3.0, 8.0, tare_s=1.0) for _ in range(2)], RIG, LENGTHS)
    # 1.2 N over 100 readings beside 15 N is 0.46 degrees; two tares, k = 2.
    floor = 2 * math.degrees(1.2 / 10 / 15) / math.sqrt(2)
    assert f"the tares alone leave +- {floor:.2f} degrees" in found.told[0]
    assert found.uncertainty[0] >= floor


def test_little_pushing_short_pushes_and_gains_that_never_settle_are_refused():
    dice = np.random.default_rng(3)
    long = pushed(dice, 0.0, 16.0)
    with pytest.raises(CannotCalibrate, match=r"12\.0 m of pushing"):
        estimate_from_pushes([pushed(dice, 0.0, 6.0) for _ in range(2)], RIG, LENGTHS)
    with pytest.raises(CannotCalibrate, match=r"each push must be 3 m"):
        estimate_from_pushes([pushed(dice, 0.0, 2.0)], RIG, LENGTHS)
    with pytest.raises(CannotCalibrate, match="push calibrate sign"):
        estimate_from_pushes([long._replace(off_rad=long.off_rad - 0.5)], RIG, LENGTHS)
    wild = long._replace(k_f=0.0, k_y_rad_per_m=1.0)
    with pytest.raises(CannotCalibrate, match="settles"):
        estimate_from_pushes([wild], RIG, LENGTHS)


def test_the_ringing_is_the_one_worked_out_by_hand():
    # rho = 0.2, d = 0.153: g = 0.36918, D = 0.52006, r = 1.21297; trace -1.81946 + 0.38457,
    # determinant -0.69971 + 1.21297 * 1.57687; so -0.71744 +- 0.8358 i per metre.
    fast, slow = ringing(0.3, 0.2, 0.2, 0.153)
    assert fast == pytest.approx(slow.conjugate())
    assert fast.real == pytest.approx(-0.717, abs=0.002)
    assert abs(fast.imag) == pytest.approx(0.836, abs=0.005)
