"""What the floor does beyond the ellipsoid: shift, turning resistance, grain, patches."""

import math
import random
import statistics

import pytest

from robot_io.errors import ConfigError
from sim_backend.physics.contact import PushedSlider
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.floor_patches import FrictionField
from sim_backend.physics.slider import Circle, ConvexPolygon, Rectangle, SliderModel
from sim_backend.physics.slider_exact import AtRest, Moving, solve_exact
from sim_backend.physics.slider_qp import QpSolver

BOX = SliderModel.from_mass(Rectangle(0.4, 0.6), mass_kg=5, floor_friction=0.3, contact_friction=0.3)
BARREL = SliderModel.from_mass(Circle(0.25), mass_kg=5, floor_friction=0.3, contact_friction=0.3)


def grip(model, pressure="uniform", push=(1.0, 0.0), heading=0.0, **effects):
    floor = Floor(model, pressure, FloorEffects(**effects))
    return floor.grip(0.0, 0.0, math.cos(heading), math.sin(heading), *push)


def test_without_effects_the_floor_is_the_model():
    assert grip(BOX) == (0.0, 0.0, BOX.d_m, BOX.f_max_N, None)
    straight = [
        PushedSlider(BOX, (0.0, 0.0, 0.1), 0.05, floor=floor) for floor in (None, Floor(BOX, "uniform", FloorEffects()))
    ]
    for slider in straight:
        ball = (-0.26, 0.04)
        for _ in range(500):
            to = (ball[0] + 1e-4, ball[1])
            slider.step(ball, to, 1e-3)
            ball = to
    assert straight[0].pose == straight[1].pose


def test_centre_of_friction_runs_ahead_along_the_push():
    assert grip(BOX, shift_m=0.045)[:2] == pytest.approx((0.045, 0.0))
    assert grip(BOX, push=(0.6, 0.8), shift_m=0.045)[:2] == pytest.approx((0.027, 0.036))


def test_the_centre_of_friction_follows_the_push_within_the_step():
    # without contact friction the push goes through the disc's middle, and so through the shifted centre: no turning
    disc = SliderModel(Circle(0.1), 1.0, 0.005, 0.0)
    slider = PushedSlider(disc, (0.0, 0.0, 0.0), 0.05, floor=Floor(disc, "uniform", FloorEffects(shift_m=0.045)))
    x, y, force_y = -0.15, 0.0, 0.0
    for i in range(2000):
        to = (x + 1e-4, y + 1e-4 * math.sin(i / 500))
        force_y = slider.step((x, y), to, 1e-3).force_y
        x, y = to
    assert abs(force_y) > 0.3  # the push has turned
    assert slider.heading_rad == pytest.approx(0.0, abs=1e-9)


def test_a_push_so_high_that_the_slider_tips_is_refused():
    with pytest.raises(ConfigError, match="tips"):
        Floor(BOX, "uniform", FloorEffects(shift_m=0.2))
    with pytest.raises(ConfigError):
        Floor(BARREL, "uniform", FloorEffects(shift_m=float("nan")))


def test_a_disc_whose_centre_of_friction_is_off_tips_that_much_earlier():
    """A disc of 0.25 m with its load 0.06 m ahead and 0.08 m to the left has 0.15 m left, in that direction."""
    off = SliderModel(Circle(0.25), 1.0, 0.1, 0.3, cof_m=(0.06, 0.08))
    Floor(off, "uniform", FloorEffects(shift_m=0.1499))
    with pytest.raises(ConfigError, match="tips"):
        Floor(off, "uniform", FloorEffects(shift_m=0.1501))


def test_a_wedge_tips_over_its_nearest_side_and_nothing_is_shifted_back():
    """The slanted side runs through (0.4, -0.2) and (-0.2, 0.4): from (0, 0.1) it is 0.1 / sqrt(2) = 0.0707 m away."""
    wedge = SliderModel(ConvexPolygon(((-0.2, -0.2), (0.4, -0.2), (-0.2, 0.4))), 1.0, 0.1, 0.3, cof_m=(0.0, 0.1))
    Floor(wedge, "uniform", FloorEffects(shift_m=0.0706))
    for shift_m in (0.0708, -0.001):
        with pytest.raises(ConfigError, match="tips"):
            Floor(wedge, "uniform", FloorEffects(shift_m=shift_m))


def test_a_box_whose_centre_of_friction_is_off_tips_that_much_earlier():
    """0.4 m long and 0.6 m wide, its load 0.05 m ahead and 0.15 m to the left: 0.15 m to the nearest side."""
    Floor(off := SliderModel(Rectangle(0.4, 0.6), 1.0, 0.1, 0.3, cof_m=(0.05, 0.15)), "uniform", FloorEffects())
    Floor(off, "uniform", FloorEffects(shift_m=0.1499))
    with pytest.raises(ConfigError, match="tips"):
        Floor(off, "uniform", FloorEffects(shift_m=0.1501))


@pytest.mark.parametrize(
    ("model", "pressure", "push", "d"),
    [
        (BOX, "uniform", (1.0, 0.0), 0.2 / math.sqrt(3)),
        (BOX, "uniform", (0.0, 1.0), 0.3 / math.sqrt(3)),
        (BOX, "rim", (1.0, 0.0), 0.2),
        (BOX, "point", (1.0, 0.0), 0.02 / math.sqrt(3)),
        (BARREL, "uniform", (0.6, 0.8), 0.125),
        (BARREL, "rim", (0.6, 0.8), 0.25 / math.sqrt(2)),
    ],
)
def test_turning_while_pushed_straight_is_resisted_by_the_spread_along_the_push(model, pressure, push, d):
    assert grip(model, pressure, push, turning="along-push")[2] == pytest.approx(d)


@pytest.mark.parametrize("pressure", ["uniform", "frame", "corners"])
@pytest.mark.parametrize(("cof", "shift_m"), [((0.0, 0.0), 0.045), ((0.04, 0.0), 0.0), ((0.03, 0.02), 0.02)])
def test_turning_is_resisted_about_where_the_pressure_is(pressure, cof, shift_m):
    """The spread is about the centre of friction, wherever load and push have moved it; Coulomb friction says so."""
    model = SliderModel.from_mass(
        Rectangle(0.4, 0.6), mass_kg=5, floor_friction=0.3, contact_friction=5.0, pressure=pressure, cof_m=cof
    )
    x, y, d, f_max, _ = Floor(model, pressure, FloorEffects(shift_m, "along-push")).grip(0, 0, 1, 0, 1.0, 0.0)
    exact = Floor(model, pressure, FloorEffects(shift_m, "coulomb"), 36)
    exact.grip(0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
    centre = exact.coulomb.centre_m
    # a push straight ahead, one millimetre beside the centre of friction
    one = solve_exact(-0.2 - x, 1e-3, 1.0, 0.0, 0.1, 0.0, d, f_max, 5.0)
    other = exact.coulomb.contact(-0.2 - centre[0], y + 1e-3 - centre[1], 1.0, 0.0, 0.1, 0.0, d, f_max, 5.0)
    assert one.omega == pytest.approx(other.omega, rel=2e-3)


def test_second_moment_of_a_slanted_polygon():
    shape = ConvexPolygon(((0, 0), (0.6, 0.1), (0.5, 0.4), (0.1, 0.5)))
    rng = random.Random(3)
    inside = [p for p in ((rng.uniform(0, 0.6), rng.uniform(0, 0.5)) for _ in range(60_000)) if shape.contains(p)]
    x, y = shape.centroid_m
    offsets = [(p[0] - x, p[1] - y) for p in inside]
    means = [
        statistics.fmean(values)
        for values in ([a * a for a, _ in offsets], [a * b for a, b in offsets], [b * b for _, b in offsets])
    ]
    assert shape.second_moment_m2() == pytest.approx(means, abs=3e-4)


def test_grain_turns_with_the_slider():
    # friction 1.5 times larger along world x: a force along x moves it along x, one along y 2.25 times as easily
    for heading in (0.0, 0.4, math.pi / 2):
        pxx, pxy, pyy = grip(BOX, heading=heading, along_over_across=1.5)[4]
        c, s = math.cos(heading), math.sin(heading)
        for world, gain in (((1, 0), 1.0), ((0, 1), 2.25)):
            bx, by = c * world[0] + s * world[1], c * world[1] - s * world[0]
            moved = (pxx * bx + pxy * by, pxy * bx + pyy * by)
            assert moved == pytest.approx((gain * bx, gain * by))


def test_force_on_a_floor_with_a_grain_depends_on_the_direction():
    # straight through the centre of friction: f_max along, f_max / 1.5 across
    grain = (1.0, 0.0, 2.25)
    along = solve_exact(-0.5, 0, 1, 0, 0.1, 0, 0.3, 6.0, 0.5, grain)
    across = solve_exact(0, -0.5, 0, 1, 0, 0.1, 0.3, 6.0, 0.5, grain)
    assert (along.fx, along.fy, along.vx) == pytest.approx((6.0, 0.0, 0.1))
    assert (across.fx, across.fy, across.vy) == pytest.approx((0.0, 4.0, 0.1))


def test_osqp_agrees_on_a_floor_with_a_grain():
    solve, rng = QpSolver(), random.Random(9)
    for _ in range(200):
        turn, ratio = rng.uniform(-3, 3), rng.uniform(0.7, 1.5)
        c, s, q = math.cos(turn), math.sin(turn), ratio**2
        grain = (c * c + q * s * s, (1 - q) * c * s, s * s + q * c * c)
        a, place, d = rng.uniform(-1.3, 1.3), rng.uniform(-0.5, 0.5), rng.uniform(0.1, 0.7)
        push = (0.1 * math.cos(a), 0.1 * math.sin(a))
        case = (-0.5, place, 1.0, 0.0, *push, d, 2.0, rng.choice((0.0, 0.3, 1.0)), grain)
        exact, qp = solve_exact(*case), solve(*case)
        assert isinstance(exact, Moving)
        assert not isinstance(qp, AtRest)
        for name in ("vx", "vy", "omega", "slip", "fx", "fy"):
            assert getattr(qp, name) == pytest.approx(getattr(exact, name), abs=1e-6)


def test_patches_average_to_one_stay_in_range_and_depend_on_the_seed():
    field = FrictionField(0.3, 0.25, seed=5)
    rng = random.Random(1)
    places = [(rng.uniform(-50, 50), rng.uniform(-50, 50)) for _ in range(5000)]
    values = [field.at(*p) for p in places]
    assert 0.7 <= min(values) < 0.85
    assert 1.15 < max(values) <= 1.3
    assert statistics.fmean(values) == pytest.approx(1.0, abs=0.01)
    again, other = FrictionField(0.3, 0.25, seed=5), FrictionField(0.3, 0.25, seed=6)
    assert [again.at(*p) for p in reversed(places)] == values[::-1]  # whatever was asked before
    assert [other.at(*p) for p in places] != values
    assert abs(field.at(0.1, 0.2) - field.at(0.1 + 1e-9, 0.2)) < 1e-7


def test_runs_on_patches_differ_by_seed_and_repeat_to_the_bit():
    def end(seed, strength=0.3):
        floor = Floor(BOX, "uniform", FloorEffects(patch_strength=strength, patch_m=0.2, seed=seed))
        slider, ball = PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05, floor=floor), (-0.26, 0.0)
        forces = []
        for _ in range(8000):
            to = (ball[0] + 1e-4, ball[1])
            o = slider.step(ball, to, 1e-3)
            forces.append(math.hypot(o.force_x, o.force_y))
            ball = to
        return slider.pose, max(forces)

    assert end(1) == end(1)
    assert end(1)[0].yaw != end(2)[0].yaw
    assert end(1)[1] != pytest.approx(BOX.f_max_N, rel=1e-3)
    assert end(1, strength=0.0)[0].yaw == 0.0
