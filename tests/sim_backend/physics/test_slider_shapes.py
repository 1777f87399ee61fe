"""Shapes, their distances, and the refusal of impossible sliders."""

import math
import random

import pytest

from robot_io.errors import ConfigError
from sim_backend.physics.slider import Circle, ConvexPolygon, Rectangle, SliderModel, pressure_distance_m

NAN = float("nan")


def test_uniform_pressure_of_the_papers_sliders():
    assert pressure_distance_m(Rectangle(1, 1), "uniform") == pytest.approx(0.382598, abs=5e-7)
    # closed form for a square of side a: a (sqrt 2 + asinh 1) / 6
    assert pressure_distance_m(Rectangle(1, 1), "uniform") == pytest.approx((math.sqrt(2) + math.asinh(1)) / 6)
    assert pressure_distance_m(Circle(0.5), "uniform") == pytest.approx(1 / 3, abs=1e-15)


def test_rim_and_point_pressure():
    assert pressure_distance_m(Rectangle(1, 1), "rim") == pytest.approx(math.sqrt(0.5))
    assert pressure_distance_m(Circle(0.5), "rim") == 0.5
    assert pressure_distance_m(Circle(0.5), "rim", (0.1, 0)) == pytest.approx(0.6)
    assert pressure_distance_m(Rectangle(1, 1), "point") == pytest.approx(0.0382598, abs=5e-8)


@pytest.mark.parametrize("shape", [Rectangle(0.4, 0.7), Circle(0.3), ConvexPolygon(((0, 0), (0.6, 0.1), (0.2, 0.5)))])
def test_mean_distance_is_the_integral_over_the_area(shape):
    point = (shape.centroid_m[0] + 0.05, shape.centroid_m[1] - 0.03)
    rng = random.Random(4)
    distances = []
    while len(distances) < 40_000:
        p = (rng.uniform(-0.7, 0.7), rng.uniform(-0.7, 0.7))
        if shape.contains(p):
            distances.append(math.dist(p, point))
    assert shape.mean_distance_m(point) == pytest.approx(sum(distances) / len(distances), rel=0.01)


def test_mean_distance_about_a_point_almost_on_the_edge():
    assert Rectangle(1, 1).mean_distance_m((-0.5, 0.0)) == pytest.approx(0.593, abs=2e-3)
    # mean distance of a disc from a point of its rim is 32 r / (9 pi)
    assert Circle(1.0).mean_distance_m((1.0, 0.0)) == pytest.approx(32 / (9 * math.pi), rel=1e-6)


def test_turning_sense_of_the_corners_does_not_matter():
    corners = ((0.0, 0.0), (1.0, 0.0), (0.0, 2.0))
    one, other = ConvexPolygon(corners), ConvexPolygon(corners[::-1])
    assert one.area_m2 == other.area_m2 == 1.0
    assert one.centroid_m == pytest.approx((1 / 3, 2 / 3))
    for face in one.faces + other.faces:
        assert face.normal_x * one.centroid_m[0] + face.normal_y * one.centroid_m[1] > face.offset
        for u, end in ((face.u_low, face.end_low), (face.u_high, face.end_high)):
            assert face.normal_x * end[1] - face.normal_y * end[0] == pytest.approx(u)


def test_friction_of_a_box_on_the_floor():
    model = SliderModel.from_mass(Rectangle(0.4, 0.4), mass_kg=5.1, floor_friction=0.3, contact_friction=0.3)
    assert model.f_max_N == pytest.approx(0.3 * 5.1 * 9.80665)
    assert model.tau_max_Nm == pytest.approx(model.f_max_N * 0.4 * 0.382598, rel=1e-6)
    assert model.d_m == pytest.approx(0.4 * 0.382598, rel=1e-6)


@pytest.mark.parametrize(
    "build",
    [
        lambda: Rectangle(0.0, 1.0),
        lambda: Rectangle(NAN, 1.0),
        lambda: Rectangle(-1.0, 1.0),
        lambda: Circle(float("inf")),
        lambda: Circle(0),
        lambda: ConvexPolygon(((0, 0), (1, 0))),
        lambda: ConvexPolygon(((0, 0), (1, 0), (2, 0))),
        lambda: ConvexPolygon(((0, 0), (2, 0), (1, 0.2), (1, 2))),
        lambda: ConvexPolygon(((0, 0), (1, 0), (1, 1), (NAN, 1))),
        lambda: ConvexPolygon(((0, 0), (1, 0), (1, 0), (0, 1))),
        # a pentagram turns left at every corner and is not convex
        lambda: ConvexPolygon(tuple((math.cos(a), math.sin(a)) for a in (0, 2.513, 5.027, 1.257, 3.770))),
        lambda: SliderModel(Circle(1), 0.0, 1.0, 0.5),
        lambda: SliderModel(Circle(1), 1.0, NAN, 0.5),
        lambda: SliderModel(Circle(1), 1.0, 1.0, -0.1),
        lambda: SliderModel(Circle(1), 1.0, 1.0, 0.1, cof_m=(2.0, 0.0)),
        lambda: pressure_distance_m(Circle(1), "rim", (NAN, 0.0)),
    ],
)
def test_an_impossible_slider_is_one_sentence(build):
    with pytest.raises(ConfigError) as caught:
        build()
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)
