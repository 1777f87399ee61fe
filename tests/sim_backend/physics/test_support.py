"""Support points: their spread is that of the pressure they stand for, and they lean as a stiff body does."""

import math

import pytest

from robot_io.errors import ConfigError
from robot_io.rig.config import load_rig
from sim_backend.physics.shapes import Circle, Rectangle
from sim_backend.physics.slider import SliderModel
from sim_backend.physics.support import centre_of, leaning, support_points
from sim_backend.world.scene import support_of

BOX, BARREL = Rectangle(0.4, 0.6), Circle(0.25)
COUNTS = (9, 12, 16, 25, 36)


def spread(points):
    x0, y0 = centre_of(points)
    return (
        sum(w * (x - x0) ** 2 for x, _, w in points),
        sum(w * (x - x0) * (y - y0) for x, y, w in points),
        sum(w * (y - y0) ** 2 for _, y, w in points),
    )


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(
    ("shape", "pressure", "xx", "yy"),
    [
        # half sides a = 0.2 along x, b = 0.3 along y: a^2/3 for an even pressure
        (BOX, "uniform", 0.04 / 3, 0.09 / 3),
        (BOX, "centre", 0.01 / 3, 0.0225 / 3),
        (BOX, "point", 0.0004 / 3, 0.0009 / 3),
        # two sides at a, two along it: (b a^2 + a a^2/3) / (a + b)
        (BOX, "frame", (0.3 * 0.04 + 0.2 * 0.04 / 3) / 0.5, (0.2 * 0.09 + 0.3 * 0.09 / 3) / 0.5),
        (BOX, "corners", 0.04, 0.09),
        (BOX, "rim", 0.04, 0.09),
        # a disc of radius R: R^2/4; a ring R^2/2
        (BARREL, "uniform", 0.0625 / 4, 0.0625 / 4),
        (BARREL, "centre", 0.0625 / 16, 0.0625 / 16),
        (BARREL, "point", 0.000625 / 4, 0.000625 / 4),
        (BARREL, "frame", 0.0625 / 2, 0.0625 / 2),
        (BARREL, "corners", 0.0625 / 2, 0.0625 / 2),
        (BARREL, "rim", 0.0625 / 2, 0.0625 / 2),
    ],
)
def test_mean_squares_are_those_of_the_pressure_for_any_number_of_points(shape, pressure, xx, yy, count):
    points = support_points(shape, pressure, count)
    assert len(points) <= count
    assert sum(w for _, _, w in points) == pytest.approx(1.0)
    assert centre_of(points) == pytest.approx((0.0, 0.0), abs=1e-15)
    assert spread(points) == pytest.approx((xx, 0.0, yy), abs=1e-12)
    assert all(abs(x) <= 0.2 + 1e-12 and abs(y) <= 0.3 + 1e-12 for x, y, _ in points) or shape is BARREL


def test_points_approach_the_integral_of_the_distance():
    for shape, exact in ((Rectangle(1, 1), (math.sqrt(2) + math.asinh(1)) / 6), (Circle(0.5), 1 / 3)):
        points = support_points(shape, "uniform", 36)
        assert sum(w * math.hypot(x, y) for x, y, w in points) == pytest.approx(exact, rel=0.02)


def test_a_load_that_is_not_in_the_middle_leans_the_pressure_linearly():
    # corners: (1 + a x + b y)/4 has its centre at (a 0.2^2, b 0.3^2)
    points = support_points(BOX, "corners", cof_m=(0.05, 0.03))
    assert {(x, y): pytest.approx(w) for x, y, w in points} == {
        (x, y): 0.25 * (1 + x * 0.05 / 0.04 + y * 0.03 / 0.09) for x in (0.2, -0.2) for y in (0.3, -0.3)
    }


def test_a_point_that_would_pull_carries_nothing():
    """A beam on three places: with its load beyond a third of its half length, the far one is in the air."""
    beam = tuple((x, y, 1 / 6) for x in (-0.3, 0.0, 0.3) for y in (-0.1, 0.1))
    standing = leaning(beam, (0.15, 0.0))
    assert [w for _, _, w in standing] == pytest.approx([1 / 24, 1 / 24, 1 / 6, 1 / 6, 7 / 24, 7 / 24])
    lifted = leaning(beam, (0.25, 0.0))
    assert [w for _, _, w in lifted] == pytest.approx([0, 0, 1 / 12, 1 / 12, 5 / 12, 5 / 12])
    assert centre_of(lifted) == pytest.approx((0.25, 0.0))
    with pytest.raises(ConfigError, match="tips"):
        leaning(beam, (0.301, 0.0))


def test_points_of_ones_own_are_taken_as_they_are():
    feet = ((0.1, 0.1, 2.0), (-0.1, 0.1, 1.0), (0.0, -0.1, 1.0))
    assert support_points(BOX, feet) == ((0.1, 0.1, 0.5), (-0.1, 0.1, 0.25), (0.0, -0.1, 0.25))
    model = SliderModel.from_mass(BOX, mass_kg=5, floor_friction=0.3, contact_friction=0.3, pressure=feet)
    assert model.cof_m == pytest.approx((0.025, 0.05))
    middle = (0.025, 0.05)
    assert model.d_m == pytest.approx(sum(w * math.dist((x, y), middle) for x, y, w in support_points(BOX, feet)))


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (((0.1, 0.0, 1.0), (0.0, 0.0, 1.0), (-0.1, 0.0, 1.0)), "in a line"),
        (((0.1, 0.0, 1.0), (0.0, 0.4, 1.0), (-0.1, 0.0, 1.0)), r"\[0, 0.4\] is not under the slider"),
        (((0.1, 0.0, 1.0), (0.0, 0.2, 0.0), (-0.1, 0.0, 1.0)), "a share above 0"),
        (((0.1, 0.0, 1.0), (0.0, 0.2, math.nan), (-0.1, 0.0, 1.0)), "a share above 0"),
    ],
)
def test_points_on_which_nothing_stands_are_refused_in_one_sentence(points, words):
    with pytest.raises(ConfigError, match=words):
        support_points(BOX, points)


def test_a_rig_names_its_pressure_or_lists_its_points():
    rig = load_rig("sim", ["world.slider.pressure=corners"])
    assert {(x, y) for x, y, _ in support_of(rig)} == {(x, y) for x in (0.2, -0.2) for y in (0.2, -0.2)}
    listed = load_rig("sim", ["world.slider.pressure=[[0.1, 0.1, 1], [-0.1, 0.1, 1], [0, -0.1, 2]]"])
    assert support_of(listed)[2] == (0.0, -0.1, 0.5)
    assert len(support_of(load_rig("sim", ["world.floor.support_points=25"]))) == 25
    with pytest.raises(ConfigError, match=r"one of uniform, rim, .*, or a list"):
        load_rig("sim", ["world.slider.pressure=pillow"])
    with pytest.raises(ConfigError, match="array"):
        load_rig("sim", ["world.slider.pressure=[[0.1, 0.1], [0, 0, 1], [0.1, 0, 1]]"])
