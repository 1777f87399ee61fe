"""The simulated world of a rig file: `[world]` and its tables, used at levels sim and emulated."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from robot_io.messages import Vector3, Vector6
from robot_io.rig.types import InBase, NonNegative, OnRobot2, Positive, Table, Vector2

SupportPoint = tuple[float, float, float]
"""x (m), y (m) from the middle of the object, and share of the load."""
Pressure = (
    Literal["uniform", "rim", "point", "frame", "corners", "centre"]
    | Annotated[tuple[SupportPoint, ...], Meta(min_length=3, max_length=36)]
)


class SliderConfig(Table, frozen=True):
    """The object in the simulated world. `width_m` is along a rectangle's pushed face; a circle uses `radius_m`."""

    shape: Literal["rectangle", "circle"] = "rectangle"
    length_m: Positive = 0.40
    width_m: Positive = 0.40
    radius_m: Positive = 0.25
    mass_kg: Positive = 5.1
    floor_friction: Annotated[float, Meta(gt=0, le=2)] = 0.30
    contact_friction: Annotated[float, Meta(ge=0, le=2)] = 0.30
    pressure: Pressure = "uniform"
    """How it presses on the floor: `uniform`, even over its area; `centre` and `point`, over a half and a tenth of its
    lengths; `frame`, along its outline; `corners`; `rim`, the places farthest from its middle; or a list of
    `[x_m, y_m, share]`, from the middle along the push and to the left."""
    cof_m: Vector2 = (0.0, 0.0)
    """Centre of friction, from the middle: along the push and to the left (a load that is not in the middle). A list of
    points has its own."""


class FloorConfig(Table, frozen=True):
    """The floor of the simulated world."""

    push_height_m: Annotated[float, Meta(ge=0, le=2)] | None = None
    """Height of the push above the floor: moves the pressure ahead, by this times the floor's friction. By default the
    height of `frames.contact_in_base_m`; 0 is the paper's world."""
    turning: Literal["ellipsoid", "along-push", "coulomb"] = "along-push"
    """What resists turning: the pressure along the push, the greatest torque (`ellipsoid`, the paper's), or Coulomb
    friction at each support point, the exact sum: slower (docs/simulation-studies.md)."""
    along_over_across: Annotated[float, Meta(ge=0.5, le=2)] = 1.0
    """Friction along the path over friction across it."""
    support_points: Annotated[int, Meta(ge=9, le=36)] = 16
    """On about how many points the object stands for `coulomb`; a grid has the largest square below."""
    patch_strength: Annotated[float, Meta(ge=0, le=0.9)] = 0.0
    """How much the friction varies from place to place, relative to its mean; each seed is another floor."""
    patch_m: Annotated[float, Meta(ge=0.01, le=10)] = 0.3
    """About how large a patch is."""


class StartConfig(Table, frozen=True):
    """Where things stand in the simulated world before the approach, relative to the path."""

    lateral_offset_m: float = 0.05
    """Lateral offset of the contact ball from the path (left positive)."""
    edge_offset_m: float = 0.03
    """Where on the object's pushed face the ball will meet it, from the middle (left positive)."""
    heading_deg: float = 3.0
    """Heading of the object relative to the path."""
    gap_m: NonNegative = 0.05
    """Free distance between ball and object along the path; 0 with `--start-in-contact`."""
    spread: Annotated[float, Meta(ge=0, le=1)] = 0.2
    """How much each seed varies the three offsets above (0: not at all; 0.2: by up to 20 %)."""


class SensorModelConfig(Table, frozen=True):
    """How the simulated sensor errs: bias (N, N*m, sensor frame), tool weight and its centre, noise (1 sigma).

    The weight is felt as the arm holds the sensor, by the published kinematics of the UR arms.
    """

    bias: Vector6 = (-20.68, 21.95, -48.70, -0.097, 1.172, -0.321)
    tool_mass_kg: NonNegative = 0.6
    tool_com_in_sensor_m: Vector3 = (0.0, 0.0, 0.06)
    noise_force_N: NonNegative = 1.2
    """The product sheet's figure for its noisiest force axes; sensors at rest were seen to read quieter (0.2 N)."""
    noise_torque_Nm: NonNegative = 0.03
    rate_hz: Annotated[float, Meta(ge=20, le=120)] = 100.016
    phase: Annotated[float, Meta(ge=0, lt=1)] = 0.37
    latency_ms: Annotated[int, Meta(ge=0, le=16)] = 1
    """Latency timer of the emulated USB adapter: 0, 1 or 16 ms."""


class TruthConfig(Table, frozen=True):
    """How far the simulated world is from `[frames]`, to rehearse calibrations: the world is `[frames]` plus this.

    Drivers, law, checks and replay believe `[frames]` (docs/frames-and-signs.md).
    marker_offset: x (m), y (m), yaw (rad), added to `base_from_marker` number by number.
    """

    sensor_yaw_deg: Annotated[float, Meta(ge=-180, le=180)] = 0.0
    """The true sensor is turned this far about the vertical, counter-clockwise seen from above."""
    contact_offset_m: OnRobot2 = (0.0, 0.0)
    """The true ball is this far ahead and to the left of where the rig has it."""
    marker_offset: InBase = (0.0, 0.0, 0.0)
    slider_offset_m: OnRobot2 = (0.0, 0.0)
    """Motion capture's point of the object, ahead and to the left of its middle (in the object's own frame)."""


class HandConfig(Table, frozen=True):
    """A force that somebody puts on the ball by hand: the sensor reads it, and nothing else feels it."""

    at_s: NonNegative
    """Since the world began."""
    for_s: Annotated[float, Meta(gt=0, le=3600)]
    force_body_N: Vector3
    """On the ball, BODY frame: [-10, 0, 0] presses it backward."""


class WorldConfig(Table, frozen=True):
    """The simulated world, used at levels sim and emulated."""

    solver: Literal["exact", "osqp"] = "exact"
    """The closed form, or the paper's program by OSQP (to 1e-6 the same, and much slower)."""
    ball_radius_m: Annotated[float, Meta(ge=0.001, le=0.2)] = 0.05
    """Radius of the contact ball."""
    slider: SliderConfig = SliderConfig()
    floor: FloorConfig = FloorConfig()
    start: StartConfig = StartConfig()
    sensor: SensorModelConfig = SensorModelConfig()
    truth: TruthConfig = TruthConfig()
    hand: tuple[HandConfig, ...] = ()
    arm_model: Literal["UR3", "UR5", "UR10", "UR3e", "UR5e", "UR10e", "UR16e"] = "UR10"
    """Which arm the emulated one is. One with an e is an e-Series arm, with PolyScope 5 and 500 cycles a second."""
    arm_rate_hz: Annotated[float, Meta(ge=20, le=502)] | None = None
    """Cycle of the emulated controller as a clock outside sees it; by default 124.99 (CB3) or 499.96 (e-Series)."""
    arm_phase: Annotated[float, Meta(ge=0, lt=1)] = 0.21
    """Where in a period a device samples, so that no run tests one frozen phase; likewise the others."""
    base_tick_rate_error: Annotated[float, Meta(ge=-0.01, le=0.01)] = 0.0001
    """Relative error of the base's clock (0.0001: 25.0025 Hz)."""
    base_phase: Annotated[float, Meta(ge=0, lt=1)] = 0.53
    mocap_rate_hz: Annotated[float, Meta(ge=5, le=200)] = 100.007
    slip: Annotated[float, Meta(ge=0, le=0.1)] = 0.03
    """Share of the wheels' way that does not reach the floor (turning does not slip): an assumption, because the
    rollers of mecanum wheels always slide a little."""
    odometry_noise_m_per_s: Annotated[float, Meta(ge=0, le=0.1)] = 0.01
    """Noise of the measured velocity while the wheels turn (1 sigma; the turn rate's follows from the wheels' places).
    An assumption; the controller of such wheels states 0.03 (a variance of 0.001) in its messages."""
    mocap_noise_m: Annotated[float, Meta(ge=0, le=0.01)] = 0.0005
    """Noise of motion capture, each coordinate (1 sigma): measured on a Vicon, 0.15 mm at rest and below 2 mm in
    motion (Merriaux et al., Sensors 17, 1591, 2017)."""
    mocap_noise_deg: Annotated[float, Meta(ge=0, le=2)] = 0.2
    """The same of the heading: 0.5 mm at markers 0.15 m from their middle."""

    @property
    def arm_cycle_hz(self) -> float:
        """Control cycles of the emulated arm in a second, never exactly the nominal ones."""
        return self.arm_rate_hz or (499.96 if self.arm_model.endswith("e") else 124.99)
