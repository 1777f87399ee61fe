"""How a rig's simulated or emulated devices behave."""

from __future__ import annotations

from robot_io.config import RigConfig
from sim_backend.ridgeback_settings import RidgebackSettings


def ridgeback_settings(rig: RigConfig) -> RidgebackSettings:
    """Return how the rig's emulated or simulated base behaves."""
    return RidgebackSettings(
        topics=rig.base.topics,
        mocap_rate_hz=rig.world.mocap_rate_hz,
        base_phase=rig.world.base_phase,
        base_rate_error=rig.world.base_tick_rate_error,
        base_from_marker=rig.frames.base_from_marker,
    )
