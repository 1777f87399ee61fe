"""The limits of gains against a push on support points with Coulomb friction, linearised by differences of one step.

Nothing of the simulation is used: each point's friction is its load along its own velocity, the pressure leans as a
stiff body's does, and the ball sticks to the face or slides along it without friction. Leaning takes the square of
the shift from d^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from sim_backend.physics.gain_limits import PushedBody, fast_loop_k_f, frictionless_limit, sticking_limit

RHO, BALL, SHIFT, K_F = 0.2, 0.05, 0.045, 0.3
"""A box of 0.4 m, a ball of 5 cm at 0.15 m above a floor of 0.3."""
STEP_M = 2e-4
CORNERS = [(RHO * i, RHO * j) for i in (-1.0, 1.0) for j in (-1.0, 1.0)]
EVEN = [((2 * i + 1 - 24) / 24 * RHO, (2 * j + 1 - 24) / 24 * RHO) for i in range(24) for j in range(24)]
FRAME = [
    p for u in ((2 * i + 1 - 48) / 48 * RHO for i in range(48)) for p in ((u, RHO), (u, -RHO), (RHO, u), (-RHO, u))
]


class Push:
    """One step of a push: state (heading, place on the face, ball's offset, force angle) to the next, per STEP_M."""

    def __init__(self, points: list[tuple[float, float]], k_f: float, k_y: float, *, sticks: bool) -> None:
        self.x, self.y = np.array(points).T
        self.k_f, self.k_y, self.sticks = k_f, k_y, sticks

    def step(self, state: np.ndarray) -> np.ndarray:
        heading, place, offset, theta_f = state
        theta_p = (self.k_f + 1) * theta_f + self.k_y * offset
        c, s = math.cos(heading), math.sin(heading)
        push = np.array([math.cos(theta_f - heading), math.sin(theta_f - heading)])  # the last force, BODY
        lean = SHIFT * push / np.array([np.mean(self.x**2), np.mean(self.y**2)])
        load = (1 + lean[0] * self.x + lean[1] * self.y) / len(self.x)
        ball = np.array([math.cos(theta_p - heading), math.sin(theta_p - heading)])  # velocity, BODY
        rx, ry = self.x + RHO, self.y - place  # from the contact

        def friction(unknown: np.ndarray) -> tuple[float, float, float]:
            """Return the friction that the floor takes: along, across, and its torque about the contact."""
            turn, across = unknown
            vx, vy = ball[0] - turn * ry, across + turn * rx
            size = np.hypot(vx, vy)
            fx, fy = load * vx / size, load * vy / size
            return fx.sum(), fy.sum(), (rx * fy - ry * fx).sum()

        if self.sticks:
            turn, across = _root(lambda u: np.array([friction(np.array([u[0], ball[1]]))[2]]), np.zeros(1))[0], ball[1]
        else:
            turn, across = _root(lambda u: np.array(friction(u)[1:]), np.array([0.0, ball[1]]))
        fx, fy, _ = friction(np.array([turn, across]))
        slip = ball[1] - across
        return np.array([
            heading + turn * STEP_M,
            place + (slip + BALL * turn) * STEP_M,
            offset + (ball[0] * s + ball[1] * c) * STEP_M,
            math.atan2(fx * s + fy * c, fx * c - fy * s),
        ])  # fmt: skip

    def growth(self) -> float:
        """Return how much a small disturbance grows in a step at most."""
        small = 1e-5
        columns = [(self.step(small * e) - self.step(-small * e)) / (2 * small) for e in np.eye(4)]
        matrix = np.array(columns).T
        if self.sticks:  # the place goes with the heading: one coordinate less
            basis = np.array([[1.0, BALL, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]).T
            matrix = np.linalg.pinv(basis) @ matrix @ basis
        return max(abs(np.linalg.eigvals(matrix)))


def _root(of: Callable[[np.ndarray], np.ndarray], guess: np.ndarray) -> np.ndarray:
    for _ in range(20):
        value = of(guess)
        if np.max(np.abs(value)) < 1e-14:
            break
        slopes = [(of(guess + 1e-6 * e) - of(guess - 1e-6 * e)) / 2e-6 for e in np.eye(len(guess))]
        guess = guess - np.linalg.solve(np.array(slopes).T, value)
    return guess


def limit_of(grows: Callable[[float], bool], low: float, high: float) -> float:
    """Return where a push begins to grow, by halving."""
    assert not grows(low)
    assert grows(high)
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


LEANING = {"corners": RHO**2 - SHIFT**2, "frame": 2 / 3 * RHO**2 - SHIFT**2, "even": RHO**2 / 3 - SHIFT**2}
"""d^2 (m^2) of the leaning pressure about its centre."""
POINTS = {"corners": CORNERS, "frame": FRAME, "even": EVEN}


def box(square_m2: float) -> PushedBody:
    return PushedBody(False, RHO, math.sqrt(square_m2), BALL, SHIFT)


@pytest.mark.parametrize(
    ("pressure", "sticking", "frictionless"),
    [("corners", 0.5174, 0.6877), ("frame", 0.6111, 0.7805), ("even", 0.7462, 0.8963)],
)
def test_the_linearised_push_begins_to_weave_where_the_closed_form_says(pressure, sticking, frictionless):
    """By hand for the corners: 0.3 x 0.15 / (0.04 - 0.045^2 + 0.2 x 0.245)."""
    for sticks, form, expected in ((True, sticking_limit, sticking), (False, frictionless_limit, frictionless)):
        found = limit_of(lambda k_y, s=sticks: Push(POINTS[pressure], K_F, k_y, sticks=s).growth() > 1.0, 0.1, 2.0)
        assert found == pytest.approx(expected, rel=0.005)
        assert form(box(LEANING[pressure]), K_F) == pytest.approx(expected, rel=0.001)


@pytest.mark.parametrize(("pressure", "expected"), [("corners", 1.290), ("frame", 1.989), ("even", 4.333)])
def test_the_force_angle_runs_away_where_the_closed_form_says(pressure, expected):
    """On its corners a box is stable at k_f 1.2, as a rigid-body engine finds it; the ellipsoid has it at 0.61."""
    found = limit_of(lambda k_f: Push(POINTS[pressure], k_f, 1e-3, sticks=True).growth() > 1.0, 0.5, 8.0)
    assert found == pytest.approx(expected, rel=0.005)
    assert fast_loop_k_f([box(LEANING[pressure])]) == pytest.approx(expected, rel=0.001)
    if pressure == "corners":
        assert fast_loop_k_f([box(2 * RHO**2)]) == pytest.approx(0.6125)
