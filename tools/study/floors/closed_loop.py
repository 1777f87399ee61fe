"""A push by the paper's law with nothing but physics: a ball on a given course, the slider, the force it feels.

No base, noise, filter or delay but that of one step, so that two floors differ by themselves alone.
"""

from __future__ import annotations

from math import atan2, cos, hypot, radians, sin, sqrt
from typing import NamedTuple

from sim_backend.physics.contact import PushedSlider
from sim_backend.physics.floor import Floor, FloorEffects
from sim_backend.physics.slider import Circle, Rectangle, SliderModel
from sim_backend.physics.support import SUPPORT_POINTS, Pressure
from tools.study.floors.starts import DISTANCE_M, FLOOR_FRICTION, PUSH_HEIGHT_M, Start, edge_offset_m

BALL_RADIUS_M = 0.05
STEP_M = 1e-3
STEP_S = 0.01
MASS_KG = 5.0
LOST_STEPS = 100
KEEP_EVERY = 10


class Course(NamedTuple):
    """Where the slider's middle was (m, PATH frame) each centimetre of the ball's way, and whether contact was lost."""

    places: list[tuple[float, float]]
    lost: bool


def slider_of(start: Start, pressure: Pressure) -> SliderModel:
    """Return the pushed object of a start."""
    shape = Rectangle(0.4, 0.6) if start.slider == "box" else Circle(0.25)
    return SliderModel.from_mass(
        shape,
        mass_kg=MASS_KG,
        floor_friction=FLOOR_FRICTION,
        contact_friction=start.contact_friction,
        pressure=pressure,
    )


def push(
    start: Start,
    pressure: Pressure,
    effects: FloorEffects,
    points: int = SUPPORT_POINTS,
    distance_m: float = DISTANCE_M,
) -> Course:
    """Push an object from its first touch; the way of the ball is `distance_m`. Raises ConfigError if it tips over."""
    model = slider_of(start, pressure)
    floor = None if effects.has_none else Floor(model, pressure, effects, points)
    heading = radians(start.heading_deg)
    c, s = cos(heading), sin(heading)
    edge = edge_offset_m(start)
    if start.slider == "box":
        touch_x, touch_y, normal_x, normal_y = -0.2, edge, 1.0, 0.0
    else:
        normal_x, normal_y = cos(edge / 0.25), -sin(edge / 0.25)
        touch_x, touch_y = -0.25 * normal_x, -0.25 * normal_y
    centre_x, centre_y = touch_x - BALL_RADIUS_M * normal_x, touch_y - BALL_RADIUS_M * normal_y
    slider = PushedSlider(
        model, (-(c * centre_x - s * centre_y), -(s * centre_x + c * centre_y), heading), BALL_RADIUS_M, floor=floor
    )
    x = y = theta = 0.0
    without = 0
    places = []
    for i in range(round(distance_m / STEP_M) + 1):
        if i % KEEP_EVERY == 0:
            places.append((slider.x_m, slider.y_m))
        to_x, to_y = x + STEP_M * cos(theta), y + STEP_M * sin(theta)
        touch = slider.step((x, y), (to_x, to_y), STEP_S)
        x, y = to_x, to_y
        without = without + 1 if hypot(touch.force_x, touch.force_y) == 0.0 else 0
        if without == 0:
            theta = (start.k_f + 1.0) * atan2(touch.force_y, touch.force_x) + start.k_y_rad_per_m * y
        if without > LOST_STEPS:
            return Course(places, True)
    return Course(places, False)


def shift_m() -> float:
    """Return how far the pressure runs ahead of these objects' middles."""
    return FLOOR_FRICTION * PUSH_HEIGHT_M


def rms_m(one: Course, other: Course) -> float:
    """Return the root mean square distance of two courses, over what they have in common."""
    pairs = list(zip(one.places, other.places, strict=False))
    return sqrt(sum((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 for a, b in pairs) / len(pairs))
