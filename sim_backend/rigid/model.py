"""The MuJoCo model of a slider on feet and of the ball that pushes it, as MJCF text.

MuJoCo's contacts are soft, and each of these choices keeps that out of the result (docs/simulation-studies.md has the
measurements):

- A foot is a spring and damper whose stiffness is its share of the load, so that all feet sink equally at rest and
  carry their shares; pushed above the floor, the body leans and the pressure moves ahead.
- Sliding lifts a contact: by friction coefficient times slip speed times the rate of `solreffriction`, against the
  compliance of its constraint. Feet have so small an impedance that this is `LIFT` of their load at `SLIP_M_PER_S`;
  with MuJoCo's defaults it is more than the load, and the feet chatter.
- The solver that follows MuJoCo's own takes the creep out of friction (`noslip_iterations`).
- The ball gives way vertically, as an arm does: only horizontal friction is left between ball and slider. A stiff ball
  would hold down the side that rises when the body leans, and change what the floor carries.
"""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from sim_backend.physics.shapes import Circle, Rectangle
from sim_backend.physics.slider import STANDARD_GRAVITY_M_PER_S2
from sim_backend.physics.support import SupportPoint, centre_of

FEET_RAD_PER_S = 150.0
"""The body on its feet swings up and down with this frequency: they sink g over its square, 0.44 mm."""
BALL_RAD_PER_S = 100.0
"""The same of the body against the ball."""
ARM_RAD_PER_S = 5.0
"""The same of the ball against the arm, vertically."""
LIFT, SLIP_M_PER_S = 0.05, 0.1
COMPLIANCE = 6.0
"""Compliance of a foot's constraint, (1 - impedance) / impedance, for each foot there is."""
BALL_IMPEDANCE = 0.1
STICKING_PER_S = 200.0
"""Slip of a contact that sticks decays at this rate."""
HEAVY_KG = 1e6
"""What moves the ball is not moved by it."""
FOOT_RADIUS_M = 0.005
NOSLIP_ITERATIONS = 50
NOSLIP_TOLERANCE = 1e-9
"""With MuJoCo's own, 1e-6, an object at rest creeps away from the ball, which loses its force within seconds."""
SMALLEST_FRICTION = 1e-5
"""MuJoCo has no smaller one."""


class RigidModel(msgspec.Struct, frozen=True):
    """What the MuJoCo model is made of.

    support: the points on which the slider stands (BODY frame). push_height_m: height of the ball's centre; the body is
    a uniform one of twice that height, and its centre of mass is above the centre of the support. timestep_s: step of
    the integration. impratio: stiffness of friction over that of the normal force, in the solver's first pass.
    """

    shape: Circle | Rectangle
    support: tuple[SupportPoint, ...]
    mass_kg: float
    floor_friction: float
    contact_friction: float
    ball_radius_m: float
    push_height_m: float
    timestep_s: float = 0.001
    impratio: float = 10.0

    @property
    def sag_m(self) -> float:
        """How far the feet sink at rest."""
        return STANDARD_GRAVITY_M_PER_S2 / FEET_RAD_PER_S**2

    def mjcf(self) -> str:
        """Return the model; `slider` and `ball` name its bodies, `side` and `ball` the geoms that touch."""
        h, mass = self.push_height_m, self.mass_kg
        feet = [point for point in self.support if point[2] > 0.0]
        cof_x, cof_y = centre_of(feet)
        side, inertia = self._side()
        geoms = "".join(
            f'<geom name="foot{i}" type="sphere" size="{FOOT_RADIUS_M}" pos="{x!r} {y!r} {FOOT_RADIUS_M}"/>'
            for i, (x, y, _) in enumerate(feet)
        )
        return f"""<mujoco>
<compiler angle="radian" inertiafromgeom="false"/>
<option timestep="{self.timestep_s!r}" gravity="0 0 {-STANDARD_GRAVITY_M_PER_S2!r}" cone="elliptic"
  impratio="{self.impratio!r}" solver="Newton" noslip_iterations="{NOSLIP_ITERATIONS}"
  noslip_tolerance="{NOSLIP_TOLERANCE}"/>
<default><geom contype="0" conaffinity="0"/></default>
<worldbody>
  <geom name="floor" type="plane" size="0 0 1"/>
  <body name="slider">
    <freejoint/>
    <inertial pos="{cof_x!r} {cof_y!r} {h!r}" mass="{mass!r}" diaginertia="{inertia}"/>
    {side}{geoms}
  </body>
  <body name="ball" pos="0 0 {h!r}" gravcomp="1">
    <joint type="slide" axis="1 0 0" armature="{HEAVY_KG}"/>
    <joint type="slide" axis="0 1 0" armature="{HEAVY_KG}"/>
    <joint type="slide" axis="0 0 1" stiffness="{mass * ARM_RAD_PER_S**2!r}" damping="{2 * mass * ARM_RAD_PER_S!r}"/>
    <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
    <geom name="ball" type="sphere" size="{self.ball_radius_m!r}"/>
  </body>
</worldbody>
<contact>{self._pairs()}</contact>
</mujoco>"""

    def _side(self) -> tuple[str, str]:
        """Return the geom that the ball touches, and the moments of inertia (kg m^2)."""
        h, mass = self.push_height_m, self.mass_kg
        tall = (2 * h) ** 2
        reach = h + 4 * self.ball_radius_m  # the ball is well below the upper edge, and above the lower one
        if isinstance(self.shape, Circle):
            r = self.shape.radius_m
            across = mass * (3 * r * r + tall) / 12
            inertia = f"{across!r} {across!r} {mass * r * r / 2!r}"
            return f'<geom name="side" type="cylinder" size="{r!r} {reach!r}" pos="0 0 {h!r}"/>', inertia
        a, b = self.shape.corners[3]
        x, y = (2 * a) ** 2, (2 * b) ** 2
        inertia = " ".join(repr(mass * two / 12) for two in (y + tall, x + tall, x + y))
        return f'<geom name="side" type="box" size="{a!r} {b!r} {reach!r}" pos="0 0 {h!r}"/>', inertia

    def references(self, slider_per_kg: float, ball_per_kg: float) -> list[Reference]:
        """Return what each contact strives for, in the order of the pairs: the feet's, then the ball's.

        slider_per_kg, ball_per_kg: the inverse masses from which MuJoCo reckons a contact's compliance.
        """
        shares = [share for _, _, share in self.support if share > 0.0]
        compliance = self._foot_compliance * slider_per_kg
        sink = self.mass_kg * compliance  # a foot's reference for each unit of share
        lift = LIFT * STANDARD_GRAVITY_M_PER_S2 / (self.floor_friction * SLIP_M_PER_S)
        feet = [
            Reference(
                share * sink * FEET_RAD_PER_S**2,
                share * sink * 2 * FEET_RAD_PER_S,
                min(share * sink * lift, STICKING_PER_S),
            )
            for share in shares
        ]
        give = self.mass_kg * (slider_per_kg + ball_per_kg) * (1.0 - BALL_IMPEDANCE) / BALL_IMPEDANCE
        return [*feet, Reference(give * BALL_RAD_PER_S**2, give * 2 * BALL_RAD_PER_S, STICKING_PER_S)]

    @property
    def _foot_compliance(self) -> float:
        return COMPLIANCE * sum(share > 0.0 for _, _, share in self.support)

    def _pairs(self) -> str:
        feet = [point for point in self.support if point[2] > 0.0]
        impedance = 1.0 / (1.0 + self._foot_compliance)
        each = [_pair(f"foot{i}", "floor", self.floor_friction, impedance) for i in range(len(feet))]
        return "".join([*each, _pair("ball", "side", self.contact_friction, BALL_IMPEDANCE)])


class Reference(NamedTuple):
    """A contact strives for the acceleration -stiffness r - damping v, and across for -sticking v (1/s^2, 1/s, 1/s)."""

    stiffness: float
    damping: float
    sticking: float


def _pair(one: str, other: str, friction: float, impedance: float) -> str:
    mu = max(friction, SMALLEST_FRICTION)
    return (
        f'<pair geom1="{one}" geom2="{other}" condim="3" friction="{mu!r} {mu!r} 1 1 1"'
        f' solimp="{impedance!r} {impedance!r} 0.001 0.5 2"/>'
    )
