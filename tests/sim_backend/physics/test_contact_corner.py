"""A point pusher at a corner: clears it, goes on along a face, or sticks."""

import math

import pytest

from sim_backend.physics.contact import ContactMode, PushedSlider
from sim_backend.physics.contact_geometry import Outline
from sim_backend.physics.corner import solve_at_corner
from sim_backend.physics.slider import ConvexPolygon, Rectangle, SliderModel
from sim_backend.physics.slider_exact import Sliding, solve_exact

SQUARE = Outline(Rectangle(1, 1)).rows
TOP_LEFT = 0
"""Corner 0 of the square is (-0.5, 0.5): high end of the left face, low end of the top face."""


def at_top_left(vx, vy, d=0.38, mu=0.3):
    return solve_at_corner(SQUARE, TOP_LEFT, solve_exact, vx, vy, (-0.5, 0.5, d, 1.0, mu, None))


@pytest.mark.parametrize("velocity", [(0.1, 0.01), (0.1, 0.0), (-0.01, -0.1), (0.0, -0.1), (-0.1, 0.1)])
def test_leaving_over_either_faces_line_clears_the_corner(velocity):
    assert at_top_left(*velocity) is None


def test_pushing_at_the_centre_sticks_without_any_friction():
    motion, nx, ny, face = at_top_left(0.1, -0.1, mu=0.0)
    assert motion.mode is Sliding.STICKING
    assert face == -1
    assert (nx, ny) == pytest.approx((math.sqrt(0.5), -math.sqrt(0.5)))
    assert (motion.vx, motion.vy, motion.omega) == pytest.approx((0.1, -0.1, 0.0))
    assert math.hypot(motion.fx, motion.fy) == pytest.approx(1.0)


def test_a_corner_the_contact_slides_over_continues_on_the_next_face():
    # the corner (-0.5, -0.1) lies below the centre of friction, so a push along +x turns it down and the contact up
    shape = ConvexPolygon(((-0.5, -0.1), (-0.5, -0.6), (0.5, -0.6), (0.5, 0.5)))
    rows = Outline(shape).rows
    motion, nx, ny, face = solve_at_corner(rows, 0, solve_exact, 0.1, 0.0, (-0.5, -0.1, 0.3, 1.0, 0.0, None))
    assert face == 3
    assert motion.mode is Sliding.LEFT
    assert (nx, ny) == pytest.approx((0.6 / math.hypot(1, 0.6), -1 / math.hypot(1, 0.6)))

    model = SliderModel(shape, 1.0, 0.3, 0.0, cof_m=(0.0, 0.0))
    slider = PushedSlider(model, (0.0, 0.0, 0.0), 0.0)
    ball, normals = (-0.5, -0.104), set()
    for _ in range(600):
        to = (ball[0] + 1e-4, ball[1])
        outcome = slider.step(ball, to, 1e-3)
        ball = to
        assert outcome.mode is ContactMode.SLIDING_LEFT
        turned = math.atan2(outcome.normal_y, outcome.normal_x) - slider.heading_rad
        normals.add(round(turned, 1))
    assert len(normals) == 2  # first the left face's, then the slanted one's


OBTUSE = (-0.5, -0.1), (-0.5, -0.6), (0.5, -0.6), (0.5, 0.5)
"""Its first corner's faces are the left one, inward normal (1, 0), and the slanted one, (0.6, -1) made unit."""
SLANTED = (0.6 / math.hypot(0.6, 1.0), -1.0 / math.hypot(0.6, 1.0))


def turned(x, y, deg):
    """Turn a vector; what sticks does so whichever way the slider lies."""
    cos, sin = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return cos * x - sin * y, sin * x + cos * y


def corner_velocity(corner, force, d=0.3):
    """Velocity of a corner under a force there: v + w x c, with v along the force and w = (c x f) / d^2."""
    (cx, cy), (fx, fy) = corner, force
    turn = (cx * fy - cy * fx) / d**2
    return fx - turn * cy, fy + turn * cx


@pytest.mark.parametrize("lies_deg", [0.0, 70.0, 160.0, 250.0])
@pytest.mark.parametrize(
    ("force_deg", "normal", "beyond_deg"),
    [
        (6.0, (1.0, 0.0), 6.0),
        (-65.0, SLANTED, 65.0 - math.degrees(math.atan2(1.0, 0.6))),
        (-30.0, (math.cos(math.radians(30)), -math.sin(math.radians(30))), 0.0),
    ],
)
def test_a_force_beyond_both_normals_sticks_by_the_friction_of_the_nearer_face(force_deg, normal, beyond_deg, lies_deg):
    """Sticking at the corner needs the force within the friction cone of some normal between the two faces'."""
    points = tuple(turned(*point, lies_deg) for point in OBTUSE)
    force = turned(1.0, 0.0, force_deg + lies_deg)
    velocity = corner_velocity(points[0], force)
    needed = math.tan(math.radians(beyond_deg))

    def answer(friction):
        rows = Outline(ConvexPolygon(points)).rows
        return solve_at_corner(rows, 0, solve_exact, *velocity, (*points[0], 0.3, 2.0, friction, None))

    motion, nx, ny, face = answer(needed + 0.01)
    assert (motion.mode, face) == (Sliding.STICKING, -1)
    assert (nx, ny) == pytest.approx(turned(*normal, lies_deg), abs=1e-9)
    size = math.hypot(motion.fx, motion.fy)
    assert (motion.fx / size, motion.fy / size) == pytest.approx(force, abs=1e-9)
    if beyond_deg:
        sliding = answer(needed - 0.01)
        assert sliding is None or sliding[0].mode is not Sliding.STICKING


def test_first_touch_right_on_a_corner_does_not_choke():
    model = SliderModel(Rectangle(1, 1), 1.0, 0.38, 0.0)
    slider = PushedSlider(model, (0.0, 0.0, math.pi / 4), 0.0)
    ball = (-math.sqrt(0.5) - 0.00025, 0.0)
    modes = []
    for _ in range(50):
        to = (ball[0] + 1e-4, 0.0)
        modes.append(slider.step(ball, to, 1e-3).mode)
        ball = to
    assert modes[0] is ContactMode.FREE
    assert modes[5] is ContactMode.STICKING
    assert slider.x_m == pytest.approx(50 * 1e-4 - 0.00025, abs=1e-5)


def test_edge_exit_is_found_inside_the_step():
    def where_lost(piece):
        slider = PushedSlider(SliderModel(Rectangle(0.4, 0.4), 15, 15 * 0.153, 0.0), (0.2, 0.0, 0.0), 0.0)
        ball, steps = (0.0, 0.1), 0
        while True:
            to = (ball[0] + piece, ball[1])
            if not slider.step(ball, to, piece / 0.1).in_contact and steps > 2:
                return ball[0], slider.heading_rad
            ball, steps = to, steps + 1

    fine, coarse = where_lost(2e-5), where_lost(8e-4)
    assert coarse[0] == pytest.approx(fine[0], abs=2e-3)
    assert coarse[1] == pytest.approx(fine[1], abs=5e-3)


def test_a_ball_meets_a_corner_at_the_right_moment():
    # a box turned by 45 degrees: the ball touches its corner when their distance is the radius, inside a step
    slider = PushedSlider(SliderModel(Rectangle(0.4, 0.4), 15, 15 * 0.153, 0.3), (0.0, 0.0, math.pi / 4), 0.05)
    ball, gap = (-0.2 * math.sqrt(2) - 0.05 - 0.00123, 0.0), 0.00123
    for step in range(40):
        to = (ball[0] + 1e-4, 0.0)
        outcome = slider.step(ball, to, 1e-3)
        ball = to
        assert outcome.in_contact is (step >= 12)
        assert slider.gap_m(ball) > -1e-9
    assert outcome.mode is ContactMode.STICKING
    assert (outcome.normal_x, outcome.normal_y) == pytest.approx((1.0, 0.0), abs=1e-9)
    assert slider.x_m == pytest.approx(40e-4 - gap, abs=1e-9)
