"""A ball pushing a slider: touch inside a step, rest, separation, re-contact, and the equation of the slip."""

import math

import pytest

from robot_io.errors import ConfigError
from sim_backend.physics.contact import ContactMode, PushedSlider
from sim_backend.physics.slider import Circle, Rectangle, SliderModel
from sim_backend.physics.slider_exact import solve_exact

BOX = SliderModel.from_mass(Rectangle(0.4, 0.6), mass_kg=5.1, floor_friction=0.3, contact_friction=0.3)
BARREL = SliderModel.from_mass(Circle(0.25), mass_kg=5.0, floor_friction=0.3, contact_friction=0.3)


def push(slider, ball, velocity, steps, dt=1e-3):
    """Move the ball straight; return where it ends and every outcome."""
    outcomes = []
    for _ in range(steps):
        to = (ball[0] + velocity[0] * dt, ball[1] + velocity[1] * dt)
        outcomes.append(slider.step(ball, to, dt))
        ball = to
    return ball, outcomes


@pytest.mark.parametrize("solver", ["exact", "osqp"])
@pytest.mark.parametrize(("model", "depth"), [(BOX, 0.2), (BARREL, 0.25)])
def test_a_centred_push_moves_the_slider_with_the_ball(model, depth, solver):
    slider = PushedSlider(model, (0.0, 0.0, 0.0), 0.05, solver)
    start = (-depth - 0.05 - 0.00137, 0.0)
    ball, outcomes = push(slider, start, (0.1, 0.0), 100)
    assert [o.mode for o in outcomes[:13]] == [ContactMode.FREE] * 13
    assert {o.mode for o in outcomes[14:]} == {ContactMode.STICKING}
    assert slider.x_m == pytest.approx(0.01 - 0.00137, abs=1e-12)  # touched inside the 14th step, moved the rest of it
    assert outcomes[13].force_x == pytest.approx(model.f_max_N)
    assert (outcomes[-1].contact_x, outcomes[-1].contact_y) == pytest.approx((ball[0] - 1e-4 + 0.05, 0.0), abs=1e-9)
    assert (outcomes[-1].normal_x, outcomes[-1].normal_y) == pytest.approx((1, 0))


def test_a_slider_not_touched_does_not_move_a_bit():
    slider = PushedSlider(BOX, (0.3, 0.1, 0.2), 0.05)
    _, outcomes = push(slider, (-0.3, 0.0), (0.1, 0.05), 1000)
    assert all(not o.in_contact and o.force_x == 0 == o.force_y for o in outcomes)
    assert (slider.x_m, slider.y_m, slider.heading_rad) == (0.3, 0.1, 0.2)


def test_at_rest_the_force_is_held_and_at_the_first_touch_there_is_none_yet():
    slider = PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05)
    ball = (-0.25, 0.05)
    assert slider.step(ball, ball, 1e-3).mode is ContactMode.FREE
    ball, moving = push(slider, ball, (0.1, 0.0), 5)
    held = slider.step(ball, ball, 1e-3)
    assert held.mode is ContactMode.HOLDING
    assert held.in_contact
    assert (held.force_x, held.force_y) == (moving[-1].force_x, moving[-1].force_y)
    pose = (slider.x_m, slider.y_m, slider.heading_rad)
    assert slider.step(ball, ball, 1e-3) == held
    assert (slider.x_m, slider.y_m, slider.heading_rad) == pose


def test_backing_off_frees_the_slider_at_once_and_coming_back_meets_it_where_it_stands():
    slider = PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05)
    ball, _ = push(slider, (-0.25, 0.05), (0.1, 0.0), 100)
    pose = (slider.x_m, slider.y_m, slider.heading_rad)
    ball, back = push(slider, ball, (-0.1, 0.03), 50)
    assert {o.mode for o in back} == {ContactMode.FREE}
    assert (slider.x_m, slider.y_m, slider.heading_rad) == pose
    assert slider.gap_m(ball) > 0.004
    _, again = push(slider, ball, (0.1, -0.03), 60)
    modes = [o.mode for o in again]
    assert modes.index(ContactMode.STICKING) in (49, 50)
    assert ContactMode.FREE not in modes[51:]


def test_after_backing_off_rest_holds_no_force():
    slider = PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05)
    ball, _ = push(slider, (-0.25, 0.05), (0.1, 0.0), 10)
    ball, _ = push(slider, ball, (-0.1, 0.0), 2)
    assert slider.step(ball, ball, 1e-3).mode is ContactMode.FREE


def test_a_ball_position_that_is_no_number_touches_nothing():
    slider = PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05)
    ball, _ = push(slider, (-0.25, 0.05), (0.1, 0.0), 10)
    pose = (slider.x_m, slider.y_m, slider.heading_rad)
    for to in ((float("nan"), 0.0), (float("inf"), 0.0)):
        assert slider.step(ball, to, 1e-3).mode is ContactMode.FREE
    assert (slider.x_m, slider.y_m, slider.heading_rad) == pose


def test_a_ball_set_inside_the_slider_pushes_it_out_without_a_force():
    slider = PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05)
    outcome = slider.step((-0.22, 0.0), (-0.22, 0.0), 1e-3)
    assert outcome.mode is ContactMode.FREE
    assert slider.gap_m((-0.22, 0.0)) == pytest.approx(0.0, abs=1e-12)


def test_osqp_and_the_closed_form_push_along_the_same_way():
    sliders = [PushedSlider(BOX, (0.0, 0.0, 0.05), 0.05, solver) for solver in ("exact", "osqp")]
    for slider in sliders:
        push(slider, (-0.27, 0.06), (0.1, 0.02), 3000)
    one, other = (s.pose for s in sliders)
    assert (one.x, one.y, one.yaw) == pytest.approx((other.x, other.y, other.yaw), abs=1e-7)


@pytest.mark.parametrize("radius", [0.0, 0.02, 0.05])
def test_contact_moves_along_the_face_by_slip_plus_rolling(radius):
    # ds/dt = slip + R omega on a face, for a round ball that does not turn
    slider = PushedSlider(BOX, (0.2 + radius, 0.0, 0.0), radius)
    ball, _ = push(slider, (0.0, 0.05), (0.1, -0.12), 100)
    places, rates = [], []
    for _ in range(300):
        x, y, heading = slider.x_m, slider.y_m, slider.heading_rad
        ball, (o,) = push(slider, ball, (0.1, -0.12), 1)
        arm = (o.contact_x - x, o.contact_y - y)
        s = solve_exact(*arm, o.normal_x, o.normal_y, 0.1, -0.12, BOX.d_m, BOX.f_max_N, BOX.contact_friction)
        assert (s.fx, s.fy) == pytest.approx((o.force_x, o.force_y), abs=1e-9)
        assert slider.heading_rad - heading == pytest.approx(s.omega * 1e-3, abs=1e-12)
        places.append(o.normal_x * arm[1] - o.normal_y * arm[0])
        rates.append(s.slip + radius * s.omega)
    moved = places[-1] - places[0]
    assert abs(moved) > 1e-3
    assert moved == pytest.approx(sum(rates[:-1]) * 1e-3, rel=0.01)


def test_small_ball_radii_are_refused():
    for radius in (1e-4, -0.05, float("nan")):
        with pytest.raises(ConfigError):
            PushedSlider(BOX, (0.0, 0.0, 0.0), radius)
    with pytest.raises(ConfigError):
        PushedSlider(BOX, (0.0, 0.0, 0.0), 0.05, "newton")


def test_pose_is_wrapped():
    slider = PushedSlider(BOX, (1.0, 2.0, 3 * math.pi), 0.05)
    assert slider.pose.yaw == pytest.approx(math.pi)
