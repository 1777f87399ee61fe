"""How an emulated or simulated Ridgeback behaves: topics, rates, phases, errors."""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import Pose2D
from robot_io.rig.config import RigConfig
from robot_io.rig.topics import TopicsConfig
from sim_backend.world.truth import marker_error, true_frames

DEFAULT_SLIDER_TOPIC = "/vicon/ThingBox/ThingBox"


class RidgebackSettings(msgspec.Struct, frozen=True):
    """Rates in Hz, times in s, volt; phases in [0, 1) of a period; `base_rate_error` relative (0.0001: 0.01 %)."""

    topics: TopicsConfig = TopicsConfig()
    mocap_rate_hz: float = 100.007
    mocap_phase: float = 0.29
    mocap_latency_s: float = 0.004
    """A pose is published this long after it was measured."""
    mocap_jitter_s: float = 0.0
    """Poses are delayed by up to this much more, at random; less than a period, so that their order is kept."""
    base_phase: float = 0.53
    base_rate_error: float = 0.0001
    base_from_marker: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """x (m), y (m), yaw (rad) of the marker frame in the BODY frame."""
    ball_in_base_m: tuple[float, float] = (1.0, 0.0)
    """Where the contact ball is in the BODY frame: motion capture sees a marker on it, where `ball_pose` names one."""
    marker_error: Pose2D = Pose2D()
    """Where a driver with the rig's frames takes the base to be, seen from the base; for one without markers."""
    slider_offset_m: tuple[float, float] = (0.0, 0.0)
    """Motion capture's point of the object, in the object's frame."""
    battery_v: float = 26.2
    mocap_noise_m: float = 0.0
    """1 sigma, as the two below."""
    mocap_noise_rad: float = 0.0
    odometry_noise_m_per_s: float = 0.0
    seed: int = 0
    """Of the noise."""

    @property
    def slider_topic(self) -> str:
        """Topic of the object's pose; motion capture sees it whether or not the rig logs it."""
        return self.topics.slider_pose or DEFAULT_SLIDER_TOPIC

    def resolved(self) -> RidgebackSettings:
        """Return the same settings with every topic's full name."""
        names = {
            field: value if value.startswith("/") else f"/{value}"
            for field, value in msgspec.structs.asdict(self.topics).items()
            if isinstance(value, str) and value and not field.endswith(("_type", "_frame"))
        }
        return msgspec.structs.replace(self, topics=msgspec.structs.replace(self.topics, **names))


def ridgeback_settings(rig: RigConfig, seed: int) -> RidgebackSettings:
    """Return how the rig's emulated or simulated base behaves; each seed has its own noise."""
    return RidgebackSettings(
        topics=rig.base.topics,
        mocap_rate_hz=rig.world.mocap_rate_hz,
        base_phase=rig.world.base_phase,
        base_rate_error=rig.world.base_tick_rate_error,
        ball_in_base_m=true_frames(rig).contact_in_base_m[:2],
        base_from_marker=true_frames(rig).base_from_marker,
        marker_error=marker_error(rig),
        slider_offset_m=rig.world.truth.slider_offset_m,
        mocap_noise_m=rig.world.mocap_noise_m,
        mocap_noise_rad=math.radians(rig.world.mocap_noise_deg),
        odometry_noise_m_per_s=rig.world.odometry_noise_m_per_s,
        seed=seed,
    )


class BridgeSettings(msgspec.Struct, frozen=True):
    """Behaviour of the emulated bridge process."""

    escape_slashes: bool = True
    """Write slashes in JSON as `\\/`, as the server does with one of its two possible JSON libraries."""
    nagle: bool = False
    """Leave the kernel's Nagle algorithm on, as the server does with newer versions of autobahn."""
    rosapi: bool = True
    """Whether the rosapi node runs."""
    cold_s: float = 0.0
    """For how long from the start it is still starting: its services do not exist yet."""
    answer_delay_s: float = 0.0
    """How long it takes over each answer."""
    ping_interval_s: float = 0.0
    ping_timeout_s: float = 0.0
    clock_skew_s: float = 0.0
    """How far the robot's wall clock is ahead of this machine's."""
    zero_on_new_connection: bool = False
    """Whether the base gets one zero when a new client publishes on or subscribes to its command topic."""
