"""What must hold for every motion of the ball: finite, no overlap, no force without contact, only dissipation."""

import math
import random

import pytest

from robot_io.errors import ConfigError
from sim_backend.physics.contact import ContactMode, PushedSlider
from sim_backend.physics.slider import Circle, ConvexPolygon, Rectangle, SliderModel

MOVING = (ContactMode.STICKING, ContactMode.SLIDING_LEFT, ContactMode.SLIDING_RIGHT)
MIRRORED = {
    ContactMode.STICKING: ContactMode.STICKING,
    ContactMode.SLIDING_LEFT: ContactMode.SLIDING_RIGHT,
    ContactMode.SLIDING_RIGHT: ContactMode.SLIDING_LEFT,
    ContactMode.FREE: ContactMode.FREE,
    ContactMode.HOLDING: ContactMode.HOLDING,
}


def random_polygon(rng):
    while True:
        angles = sorted(rng.uniform(0, 2 * math.pi) for _ in range(rng.randint(3, 7)))
        try:
            return ConvexPolygon(tuple((0.3 * math.cos(a), 0.3 * math.sin(a)) for a in angles))
        except ConfigError:
            continue


def random_slider(rng):
    shape = rng.choice([Rectangle(0.4, 0.4), Rectangle(0.4, 0.6), Circle(0.25), random_polygon(rng)])
    pressure = rng.choice(["uniform", "rim", "point"])
    (x, y), (towards_x, towards_y) = shape.centroid_m, getattr(shape, "corners", ((0.1, 0.05),))[0]
    off_centre = (x + 0.1 * (towards_x - x), y + 0.1 * (towards_y - y))
    model = SliderModel.from_mass(
        shape,
        mass_kg=5,
        floor_friction=0.3,
        contact_friction=rng.choice([0.0, 0.1, 0.3, 1.0, 2.0]),
        pressure=pressure,
        cof_m=rng.choice([None, off_centre]),
    )
    return PushedSlider(model, (0.0, 0.0, rng.uniform(-4, 4)), rng.choice([0.0, 0.0, 0.001, 0.01, 0.05]))


def random_motion(rng, slider, steps):
    """A ball wandering around the slider: aims roughly at it, changes its mind, stops, runs at up to 2 m/s."""
    angle = rng.uniform(0, 2 * math.pi)
    ball = (0.45 * math.cos(angle), 0.45 * math.sin(angle))
    velocity, left = (0.0, 0.0), 0
    for _ in range(steps):
        if left == 0:
            left = rng.choice([20, 100, 300])
            aim = math.atan2(slider.y_m - ball[1], slider.x_m - ball[0]) + rng.gauss(0, 0.5)
            speed = rng.choice([0.0, 0.1, 0.5, 0.5, 2.0])
            velocity = (speed * math.cos(aim), speed * math.sin(aim))
        left -= 1
        to = (ball[0] + velocity[0] * 1e-3, ball[1] + velocity[1] * 1e-3)
        yield ball, to, velocity
        ball = to


def assert_force_fits(slider, o, pose, velocity):
    """Force in the friction cone, on the limit surface about where the centre of friction was, never braking."""
    model = slider.model
    normal = o.force_x * o.normal_x + o.force_y * o.normal_y
    tangential = o.normal_x * o.force_y - o.normal_y * o.force_x
    assert abs(tangential) <= model.contact_friction * normal + 1e-9
    assert o.force_x * velocity[0] + o.force_y * velocity[1] >= 0
    x, y, heading = pose
    cof_x = x + math.cos(heading) * model.cof_m[0] - math.sin(heading) * model.cof_m[1]
    cof_y = y + math.sin(heading) * model.cof_m[0] + math.cos(heading) * model.cof_m[1]
    torque = (o.contact_x - cof_x) * o.force_y - (o.contact_y - cof_y) * o.force_x
    # a ball at 2 m/s takes two pieces a step, and the force is the second one's
    assert math.hypot(o.force_x, o.force_y, torque / model.d_m) == pytest.approx(model.f_max_N, rel=0.05)


@pytest.mark.parametrize("batch", range(6))
def test_any_motion_is_finite_dissipative_and_free_of_overlap(batch):
    seen = dict.fromkeys(ContactMode, 0)
    for seed in range(10 * batch, 10 * batch + 10):
        rng = random.Random(seed)
        slider = random_slider(rng)
        for ball, to, velocity in random_motion(rng, slider, 1500):
            pose = (slider.x_m, slider.y_m, slider.heading_rad)
            o = slider.step(ball, to, 1e-3)
            moved = (slider.x_m, slider.y_m, slider.heading_rad) != pose
            seen[o.mode] += 1
            assert all(map(math.isfinite, (slider.x_m, slider.y_m, slider.heading_rad, o.force_x, o.force_y)))
            assert slider.gap_m(to) > -1e-6
            if o.mode in MOVING:
                assert moved
                assert slider.gap_m(to) < 1e-6
                assert_force_fits(slider, o, pose, velocity)
            elif o.mode is ContactMode.FREE:
                assert o.force_x == 0 == o.force_y
                assert not moved or seen[ContactMode.STICKING] > 0
            else:
                assert not moved
    assert min(seen.values()) > 50


def trajectory(slider, motion):
    states = []
    for ball, to, dt in motion:
        o = slider.step(ball, to, dt)
        states.append((slider.x_m, slider.y_m, slider.heading_rad, o.force_x, o.force_y, o.mode))
    return states


def wiggle(rng, steps):
    """A ball path that does not look at the slider: forward with a swaying heading and a stop."""
    ball, path = (-0.30, rng.uniform(-0.08, 0.08)), []
    for i in range(steps):
        speed = 0.0 if 900 < i < 950 else 1e-4
        angle = 0.4 * math.sin(i / 300)
        to = (ball[0] + speed * math.cos(angle), ball[1] + speed * math.sin(angle))
        path.append((ball, to, 1e-3))
        ball = to
    return path


@pytest.mark.parametrize("seed", range(8))
def test_mirrored_motion_gives_the_mirrored_bits(seed):
    rng = random.Random(seed)
    shape = rng.choice([Rectangle(0.4, 0.6), Circle(0.25)])
    model = SliderModel.from_mass(
        shape, mass_kg=5, floor_friction=0.3, contact_friction=rng.choice([0, 0.3, 1.0]), cof_m=(0.02, 0.0)
    )
    heading, radius = rng.uniform(-0.3, 0.3), rng.choice([0.0, 0.05])
    path = wiggle(rng, 3000)
    one = trajectory(PushedSlider(model, (0.0, 0.01, heading), radius), path)
    mirrored = [((a[0], -a[1]), (b[0], -b[1]), dt) for a, b, dt in path]
    other = trajectory(PushedSlider(model, (0.0, -0.01, -heading), radius), mirrored)
    assert {s[5] for s in one} & set(MOVING)
    for (x, y, phi, fx, fy, mode), b in zip(one, other, strict=True):
        assert b == (x, -y, -phi, fx, -fy, MIRRORED[mode])


def test_only_speed_times_time_matters():
    model = SliderModel.from_mass(Rectangle(0.4, 0.6), mass_kg=5, floor_friction=0.3, contact_friction=0.3)
    path = wiggle(random.Random(3), 3000)
    fast = trajectory(PushedSlider(model, (0.0, 0.01, 0.1), 0.05), path)
    slow = trajectory(PushedSlider(model, (0.0, 0.01, 0.1), 0.05), [(a, b, 2 * dt) for a, b, dt in path])
    assert fast == slow


def test_same_steps_same_bits():
    model = SliderModel.from_mass(Circle(0.25), mass_kg=5, floor_friction=0.3, contact_friction=0.3)
    path = wiggle(random.Random(4), 2000)
    first, second = (trajectory(PushedSlider(model, (0.0, 0.01, 0.1), 0.05), path) for _ in range(2))
    assert first == second


@pytest.mark.parametrize(
    ("shape", "radius"), [(Rectangle(0.4, 0.6), 0.05), (Rectangle(0.4, 0.6), 0.0), (Circle(0.25), 0.05)]
)
def test_error_falls_in_first_order_with_the_step(shape, radius):
    model = SliderModel.from_mass(shape, mass_kg=5, floor_friction=0.3, contact_friction=0.2)

    def end(dt):
        slider = PushedSlider(model, (0.5, 0.0, 0.2), radius)
        ball, t = (0.0, 0.05), 0.0
        steps = round(4.5 / dt)
        for i in range(steps):
            t = (i + 1) * dt
            to = (0.1 * t, 0.05 + 0.02 * math.sin(t))
            slider.step(ball, to, dt)
            ball = to
        return slider.x_m, slider.y_m, slider.heading_rad

    finest = end(1 / 4096)
    errors = [math.dist(end(1 / n), finest) for n in (128, 256, 512)]
    assert errors[0] < 2e-3
    assert errors[1] < 0.75 * errors[0]
    assert errors[2] < 0.75 * errors[1]
