"""Coulomb friction on support points: every response is checked against the points themselves."""

import math
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from robot_io.errors import ConfigError
from sim_backend.physics.contact import PushedSlider
from sim_backend.physics.coulomb.contact import CoulombContact
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.shapes import Circle, Rectangle
from sim_backend.physics.slider import SliderModel
from sim_backend.physics.slider_exact import AtRest, Moving, Separating, Sliding, solve_exact
from sim_backend.physics.support import support_points

BOX, BARREL = Rectangle(0.4, 0.6), Circle(0.25)
SPEED = 0.1
RESTS = 0.01
"""A point slower than this share of the pusher's speed may hold by less than its full friction, in any direction."""


def friction_on(points, motion):
    """Coulomb's law for each point that slides: force x, y and torque; and the load of those that hardly move."""
    fx = fy = torque = resting = 0.0
    for x, y, w in points:
        vx, vy = motion.vx - motion.omega * y, motion.vy + motion.omega * x
        v = math.hypot(vx, vy)
        if v < RESTS * SPEED:
            resting += w
            continue
        fx, fy = fx + w * vx / v, fy + w * vy / v
        torque += w * (x * vy - y * vx) / v
    return fx, fy, torque, resting


@pytest.mark.parametrize("pressure", ["uniform", "centre", "point", "frame", "corners"])
@pytest.mark.parametrize("shape", [BOX, BARREL])
def test_force_motion_and_friction_agree(shape, pressure):
    points, rng, modes = support_points(shape, pressure, 16), random.Random(7), set()
    contact = CoulombContact(points)
    for _ in range(300):
        mu, place, angle = rng.choice((0.0, 0.1, 0.3, 1.0, 2.0)), rng.uniform(-0.3, 0.3), rng.uniform(-1.5, 1.5)
        v = (SPEED * math.cos(angle), SPEED * math.sin(angle))
        motion = contact(-0.2, place, 1.0, 0.0, *v, 0.1, 1.0, mu)
        assert isinstance(motion, Moving)
        modes.add(motion.mode)
        # the contact follows the pusher along the normal, and slips by what is said along t
        assert motion.vx - motion.omega * place == pytest.approx(v[0], abs=1e-9)
        assert v[1] - (motion.vy - motion.omega * 0.2) == pytest.approx(motion.slip, abs=1e-9)
        # the push is all the floor's friction, and its torque
        fx, fy, torque, resting = friction_on(points, motion)
        assert math.hypot(motion.fx - fx, motion.fy - fy) <= resting + 1e-4
        assert abs(-0.2 * motion.fy - place * motion.fx - torque) <= 0.4 * resting + 1e-4
        # Coulomb at the contact, too: inside the cone, or on the edge against the slip
        if motion.mode is Sliding.STICKING:
            assert abs(motion.fy) <= mu * motion.fx + 1e-9
            assert motion.slip == 0.0
        else:
            assert abs(motion.fy) == pytest.approx(mu * motion.fx, abs=1e-8)
            assert mu == 0.0 or motion.slip * motion.fy > 0.0
    assert modes == set(Sliding)


@pytest.mark.parametrize("pressure", ["uniform", "centre", "frame", "corners"])
def test_a_small_turn_is_resisted_by_the_spread_along_the_push(pressure):
    """While sliding straight, d^2 is the mean square distance along the push (physics of small turns, closed form)."""
    points = support_points(BOX, pressure, 16)
    d = math.sqrt(sum(w * x * x for x, _, w in points))
    exact, closed = CoulombContact(points), solve_exact
    for offset in (1e-3, -1e-3):
        case = (-0.2, offset, 1.0, 0.0, SPEED, 0.0, d, 5.0, 10.0)
        one, other = exact(*case), closed(*case)
        assert one.omega == pytest.approx(other.omega, rel=1e-3)
        assert (one.vx, one.vy, one.fx, one.fy) == pytest.approx((other.vx, other.vy, other.fx, other.fy), abs=2e-4)


def test_a_push_through_the_middle_takes_the_whole_friction():
    straight = CoulombContact(support_points(BOX, "uniform"))(-0.2, 0.0, 1.0, 0.0, SPEED, 0.0, 0.1, 15.0, 0.3)
    assert (straight.mode, straight.omega, straight.slip) == (Sliding.STICKING, 0.0, 0.0)
    assert (straight.vx, straight.fx) == (pytest.approx(SPEED), pytest.approx(15.0))


def test_no_force_without_a_push():
    contact = CoulombContact(support_points(BOX, "uniform"))
    assert contact(-0.2, 0.1, 1.0, 0.0, -1e-6, 0.1, 0.1, 15.0, 0.3) == Separating()
    assert contact(-0.2, 0.1, 1.0, 0.0, 0.0, 0.0, 0.1, 15.0, 0.3) == AtRest(0.0)
    assert contact(-0.2, 0.0, 1.0, 0.0, 0.0, 0.1, 0.1, 15.0, 0.3) == AtRest(0.1)  # brushes along the face


def test_a_floor_with_a_grain_resists_less_across_it():
    """Friction along x 1.5 times that across: straight through the middle f_max along, f_max / 1.5 across."""
    contact, grain = CoulombContact(support_points(BOX, "uniform")), (1.0, 0.0, 2.25)
    along = contact(-0.2, 0.0, 1.0, 0.0, SPEED, 0.0, 0.1, 6.0, 0.5, grain)
    across = contact(0.0, -0.3, 0.0, 1.0, 0.0, SPEED, 0.1, 6.0, 0.5, grain)
    assert (along.fx, along.fy, across.fx, across.fy) == pytest.approx((6.0, 0.0, 0.0, 4.0), abs=1e-6)


def test_the_answer_does_not_depend_on_where_the_search_begins():
    rng, warm = random.Random(3), CoulombContact(support_points(BOX, "frame"))
    for _ in range(100):
        angle = rng.uniform(-1.4, 1.4)
        case = (-0.2, rng.uniform(-0.3, 0.3), 1.0, 0.0, math.cos(angle), math.sin(angle), 0.1, 1.0, 0.4)
        one, other = warm(*case), CoulombContact(support_points(BOX, "frame"))(*case)
        assert one.mode is other.mode
        assert (one.vx, one.vy, one.omega, one.fx, one.fy) == pytest.approx(
            (other.vx, other.vy, other.omega, other.fx, other.fy), abs=1e-7
        )


def course():
    """A push that sticks, slides and leans; every digit."""
    model = SliderModel.from_mass(BOX, mass_kg=5, floor_friction=0.3, contact_friction=0.3, pressure="centre")
    floor = Floor(model, "centre", FloorEffects(0.045, "coulomb", patch_strength=0.2), 9)
    slider, x, y, lines = PushedSlider(model, (0.0, 0.0, 0.1), 0.05, floor=floor), -0.26, 0.12, []
    for i in range(60):
        to = (x + 1e-3, y + 1e-3 * math.sin(i / 10))
        touch = slider.step((x, y), to, 0.01)
        (x, y) = to
        lines.append(f"{slider.x_m!r} {slider.y_m!r} {slider.heading_rad!r} {touch.force_x!r} {touch.mode.name}")
    return lines


def test_compiled_and_plain_code_agree_to_the_last_bit():
    pytest.importorskip("numba")
    root = Path(__file__).parents[4]
    code = (
        f"import runpy, sys; sys.path.insert(0, {str(root)!r}); "
        f"print('\\n'.join(runpy.run_path({__file__!r})['course']()))"
    )
    plain = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    compiled = course()
    assert plain.stdout.splitlines() == compiled
    assert len(set(compiled)) > 50


def test_what_coulomb_friction_is_not_for_is_said_in_one_sentence():
    model = SliderModel.from_mass(BOX, mass_kg=5, floor_friction=0.3, contact_friction=0.3)
    floor = Floor(model, "uniform", FloorEffects(turning="coulomb"))
    with pytest.raises(ConfigError, match="ellipsoid of friction"):
        PushedSlider(model, (0.0, 0.0, 0.0), 0.05, "osqp", floor)
    with pytest.raises(ConfigError, match="radius"):
        PushedSlider(model, (0.0, 0.0, 0.0), 0.0, floor=floor)
    with pytest.raises(ConfigError, match="tips over"):
        Floor(model, "point", FloorEffects(0.045, "coulomb"))
