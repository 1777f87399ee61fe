"""The rig file: TOML to typed, frozen settings with the unit in every key and the range in every type.

`load_rig` reads a shipped name (`sim`, `emulated`, `thing`, ...) or a path. All mistakes of a file are reported
at once, each with its line; an unknown key names the nearest known one. A file may extend a rig and include files
(`robot_io.rig.files`).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from robot_io.driver import SensorFacts
from robot_io.messages import Vector6
from robot_io.rig import files
from robot_io.rig import toml as toml_text
from robot_io.rig.calibration import CalibrationConfig
from robot_io.rig.checks import build
from robot_io.rig.declared import FT300_FACTS
from robot_io.rig.renames import name_today
from robot_io.rig.task import FaultsConfig, GoalConfig, LogConfig, PathConfig, SlidersConfig, WorkspaceConfig
from robot_io.rig.topics import TopicsConfig
from robot_io.rig.types import InBase, Joints, LawFacts, Level, Matrix3, NonNegative, Options, Positive, Table
from robot_io.rig.world import WorldConfig

_LAW = ("control", "law")


class LoopConfig(Table, frozen=True):
    """The control loop's clock. `push bench loop` measures it."""

    rate_hz: Annotated[float, Meta(ge=50, le=500)] = 100.0
    """Below 50 Hz the gate would take a single late tick for silence."""
    spin_us: Annotated[float, Meta(ge=0, le=1000)] = 150.0
    """The loop wakes up this long before each deadline and waits awake, so that the tick begins on time.

    Only with real-time priority and two processors or more. 150 us at 100 Hz take 1.5 % of one processor."""
    cpu: Annotated[int, Meta(ge=-1, le=1023)] = -1
    """The processor that the control process stays on (one kept free of other work); -1: any."""


class FtConfig(Table, frozen=True):
    """The force-torque sensor. `port` is what its kind takes; empty at levels sim and emulated.

    For `robotiq-ft300`: a device path, a pty or `socket://host:port`. `ur-tool-force` is the sensor of the rig's own
    e-Series arm, at its host; `[ft.options]` needs the `model`, whose range it is.
    """

    kind: str = "robotiq-ft300"
    """A shipped kind, or `package.module:Class` on the Python path or beside the rig file (docs/add-a-device.md)."""
    level: Level = "emulated"
    port: str = ""
    tare_s: Annotated[float, Meta(ge=0.2, le=10)] = 5.0
    """How long the tare is averaged. With 1 s an FT 300's noise leaves 0.12 N of error: 5 cm beside the path."""
    noise_force_N: NonNegative | None = None
    """Noise of the sensor, one standard deviation of a force axis; without it what the kind declares (FT 300: 1.2)."""
    noise_torque_Nm: NonNegative | None = None
    """The same of a torque axis (FT 300: 0.03)."""
    options: Options = msgspec.field(default_factory=dict)
    """What the kind itself understands."""
    declared: SensorFacts = FT300_FACTS
    """What the kind declares of its sensor, filled in at the start of a run: not for you to write."""

    @property
    def noise(self) -> Vector6:
        """One standard deviation of each axis: N, N*m."""
        force, torque = self.declared.noise[:3], self.declared.noise[3:]
        if self.noise_force_N is not None:
            force = (self.noise_force_N,) * 3
        if self.noise_torque_Nm is not None:
            torque = (self.noise_torque_Nm,) * 3
        return (*force, *torque)


class ArmConfig(Table, frozen=True):
    """The arm. `hold = "monitor"` sends nothing to it; `"servo"` holds it actively (see the safety page)."""

    kind: str = "ur"
    """A shipped kind, or `package.module:Class`."""
    level: Level = "emulated"
    host: str = ""
    hold: Literal["monitor", "servo"] = "monitor"
    held_pose_rad: Joints = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.3100)
    """Joints for which `[frames]` is given; an arm that is elsewhere is refused (R04)."""
    held_pose_tolerance_rad: Annotated[float, Meta(gt=0, le=0.2)] = 0.05
    """How far the measured joints may be from `held_pose_rad` at start."""
    options: Options = msgspec.field(default_factory=dict)
    """What the kind itself understands."""


class BaseConfig(Table, frozen=True):
    """The mobile base. `pose_source` says which topic localises it."""

    kind: str = "ridgeback-rosbridge"
    """A shipped kind, or `package.module:Class`."""
    level: Level = "emulated"
    url: str = ""
    """`ws://host:port` of rosbridge, or `wss://host:port`: then its certificate is checked against the system's store,
    or the file that the environment variable SSL_CERT_FILE names."""
    pose_source: Literal["mocap", "odometry", "joint_states"] = "mocap"
    """`mocap`: topic `base_pose`; `odometry`: counted from where the run starts; `joint_states`: as it says."""
    pose_rate_hz: Annotated[float, Meta(ge=5, le=500)] = 100.0
    """How often poses come: late after 3 periods, at least 50 ms, and lost after 6, at least 120 ms (F40)."""
    outline_m: tuple[Positive, Positive] = (0.960, 0.793)
    """Length and width about its centre, for the workspace; by default a Ridgeback's (data sheet of May 2025)."""
    options: Options = msgspec.field(default_factory=dict)
    """What the kind itself understands."""
    topics: TopicsConfig = TopicsConfig()


class FramesConfig(Table, frozen=True):
    """Constants of the rig, because the arm is held.

    base_from_sensor: rotation, rows; its columns are the sensor's x, y, z axes in the BODY frame.
    contact_in_base_m: centre of the contact ball in the BODY frame.
    sensor_in_base_m: origin of the sensor frame in the BODY frame.
    base_from_marker: x (m), y (m), yaw (rad) of the motion-capture marker frame in the BODY frame.
    """

    base_from_sensor: Matrix3
    contact_in_base_m: InBase
    sensor_in_base_m: InBase
    base_from_marker: InBase = (0.0, 0.0, 0.0)


class ControlConfig(Table, frozen=True):
    """Gains and speeds of the push."""

    law: str = "force"
    """`force` (the paper's), `force-integral`, `open-loop`, `line`, or your own: `module:Class` (docs/own-law.md)."""
    k_f: Annotated[float, Meta(ge=0, le=2)] = 0.3
    k_y_rad_per_m: Annotated[float, Meta(ge=0, le=2)] = 0.2
    push_speed_m_per_s: Annotated[float, Meta(gt=0, le=0.5)] = 0.1
    approach_speed_m_per_s: Annotated[float, Meta(gt=0, le=0.2)] = 0.05
    ramp_s: Annotated[float, Meta(ge=0.1, le=10)] = 1.0
    """Time from rest to full speed, and back."""
    distance_m: Annotated[float, Meta(gt=0, le=1000)] = 2.0
    """Along the path, from first contact to the contact point."""
    force_filter_tau_s: Annotated[float, Meta(ge=0, le=2)] = 0.05
    """Time constant of the low-pass on the force; 0: none."""
    force_min_N: Annotated[float, Meta(gt=0, le=50)] = 5.0
    """This horizontal force is contact at once; a lighter object is felt by its mean, from 2.5 N on."""
    contact_samples: Annotated[int, Meta(ge=1, le=100)] = 5
    """This many readings in a row above `force_min_N` are contact, at 100 a second; in proportion for other rates."""
    heading_gain_per_s: Annotated[float, Meta(ge=0, le=5)] = 1.0
    """Turn rate for each radian that the base has turned away from its heading at the start ..."""
    max_turn_rate_rad_per_s: Annotated[float, Meta(gt=0, le=0.25)] = 0.1
    """... and the most of it."""
    lost_turn_rate_rad_per_s: Annotated[float, Meta(gt=0, le=1)] = 0.2
    """Without contact the push turns back over the path this fast ..."""
    lost_time_s: Annotated[float, Meta(gt=0, le=10)] = 3.0
    """... for at most this long ..."""
    lost_distance_m: Annotated[float, Meta(gt=0, le=2)] = 0.3
    """... or this far, then the base holds ..."""
    lost_rest_s: Annotated[float, Meta(gt=0, le=60)] = 2.0
    """... and the run ends after this long at rest, unless the operator resumes."""
    retreat_m: Annotated[float, Meta(ge=0, le=0.2)] = 0.05
    """How far the base backs off after the push, so that the sensor can be checked out of contact (0: not at all)."""
    law_settings: Options = msgspec.field(default_factory=dict)
    """What the law adds to `[control]` (docs/laws.md). A law given on the command line begins with its own defaults."""
    law_facts: LawFacts = LawFacts()
    """What a law of your own declares, filled in at the start of a run: not for you to write."""


class LimitsConfig(Table, frozen=True):
    """Limits of this rig; the program's own ceilings (`safety/limits.py`) may only be lowered."""

    max_force_N: Positive = 150.0
    """Force beyond the tare, all three axes, at which the run stops (F50)."""
    slow_force_N: Positive = 100.0
    """From here on half the speed."""
    max_torque_Nm: Positive = 20.0
    """Torque beyond the tare at which the run stops (F51)."""
    envelope_factor: Annotated[float, Meta(gt=1, le=3)] = 1.5
    """Commands may be this many times the push speed, never above 0.75 m/s."""
    max_acceleration_m_per_s2: Annotated[float, Meta(gt=0, le=2.5)] = 1.0
    max_yaw_acceleration_rad_per_s2: Annotated[float, Meta(gt=0, le=1.0)] = 0.5
    max_heading_error_deg: Annotated[float, Meta(gt=0, le=20)] = 5.0
    """Turned away this far from its heading at the start, the base stops (F44)."""
    law_ms: Annotated[float, Meta(gt=0, le=5)] = 1.0
    """A step of a law of your own may take this long (F57-slow)."""
    drift_hold_rad: Positive = 0.005
    """Drift of an arm joint at which the base holds ..."""
    drift_stop_rad: Positive = 0.01
    """... and at which it stops (F20)."""


class RigConfig(Table, frozen=True):
    """One robot, real or not: its devices, frames, path, gains, limits and, where simulated, its world."""

    name: str
    frames: FramesConfig
    description: str = ""
    loop: LoopConfig = LoopConfig()
    ft: FtConfig = FtConfig()
    arm: ArmConfig = ArmConfig()
    base: BaseConfig = BaseConfig()
    path: PathConfig = PathConfig()
    sliders: SlidersConfig = SlidersConfig()
    control: ControlConfig = ControlConfig()
    limits: LimitsConfig = LimitsConfig()
    workspace: WorkspaceConfig = WorkspaceConfig()
    goal: GoalConfig = GoalConfig()
    log: LogConfig = LogConfig()
    calibration: CalibrationConfig = CalibrationConfig()
    world: WorldConfig = WorldConfig()
    faults: FaultsConfig = FaultsConfig()

    @property
    def push_height_m(self) -> float:
        """Height of the push above the floor of the simulated world (m)."""
        said = self.world.floor.push_height_m
        return max(self.frames.contact_in_base_m[2], 0.0) if said is None else said

    @property
    def scatters(self) -> tuple[bool, bool, bool, bool, bool, bool]:
        """Whether each axis of the sensor scatters at rest: all do, but those of a simulated one without noise.

        A real sensor is never exempt, whatever noise its data sheet or this file states.
        """
        hardware = self.ft.level == "hardware"
        force = hardware or self.world.sensor.noise_force_N > 0.0
        torque = hardware or self.world.sensor.noise_torque_Nm > 0.0
        return force, force, force, torque, torque, torque


def load_rig(name_or_path: str | Path, overrides: Sequence[str] = ()) -> RigConfig:
    """Load a shipped rig by name, or a file by path, with `key=value` settings laid over it.

    A value of `overrides` is TOML (`control.k_f=0.1`, `path.direction_deg=-30`); what is not TOML is a string.
    Raises ConfigError (no such rig, unknown key, value out of range, not finite) and UsageError (bad override).
    """
    path = files.find(name_or_path)
    data, origins = files.read(path)
    _lay_over(data, origins, overrides)
    rig = build(RigConfig, data, origins, str(path))
    # said in every log, so that one without the key is of a program that knew no height
    floor = replace(rig.world.floor, push_height_m=min(rig.push_height_m, 2.0))
    return replace(rig, world=replace(rig.world, floor=floor))


def origins_of(name_or_path: str | Path, overrides: Sequence[str] = ()) -> toml_text.Origins:
    """Return where each value of a rig was written: `file:line`, or `--set key`; none for a default.

    Raises as `load_rig`.
    """
    path = files.find(name_or_path)
    data, origins = files.read(path)
    _lay_over(data, origins, overrides)
    return {key: toml_text.origin_of(key, origins, str(path)) for key in files.leaves(data)}


def rig_to_toml(rig: RigConfig) -> str:
    """Write the whole resolved rig as TOML; `rig_from_toml` returns an equal rig, every float bit for bit."""
    return toml_text.emit(msgspec.to_builtins(rig))


def rig_from_toml(text: str, name: str = "rig", overrides: Sequence[str] = (), *, option: str = "--set") -> RigConfig:
    """Read what `rig_to_toml` wrote, with `key=value` settings of a command's `option` laid over it.

    Raises ConfigError (with `name` as its place) when it is anything else, and as `load_rig` for the settings.
    """
    data, origins = toml_text.parse(text, name)
    _lay_over(data, origins, overrides, option)
    return build(RigConfig, data, origins, name)


def _lay_over(
    data: dict[str, Any], origins: toml_text.Origins, overrides: Sequence[str], option: str = "--set"
) -> None:
    parsed = [toml_text.parse_setting(setting, option) for setting in overrides]
    settings = [(name_today(key, option), value) for key, value in parsed]
    # The law first: another one than the file's begins with its own defaults, which further settings may change.
    for key, value in sorted(settings, key=lambda item: item[0] != _LAW):
        control = data.get("control")
        if key == _LAW and isinstance(control, dict) and control.get("law", "force") != value:
            control.pop("law_settings", None)
            control.pop("law_facts", None)
        toml_text.put(data, key, value, option)
        origins[key] = f"{option} {'.'.join(key)}"
