"""A Ridgeback on its own: wheels on a floor without the rest of the world, for `push emulate ridgeback`."""

from __future__ import annotations

from robot_io.clock import monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import BodyTwist, Pose2D
from sim_backend.ridgeback.emulator import RosbridgeEmulator
from sim_backend.ridgeback.settings import BridgeSettings, RidgebackSettings
from sim_backend.world.base_plant import BasePlant
from sim_backend.world.plant import BaseTruth

SLIDER_POSE = Pose2D(1.3, 0.0, 0.0)
"""The object is a little ahead of the base; nothing ever touches it here."""


class StandaloneBase:
    """A `BaseSource` that consists of the wheels only, starting at `start` (WORLD frame) at `start_ns`."""

    def __init__(self, settings: RidgebackSettings, start_ns: int, start: Pose2D = Pose2D()) -> None:  # noqa: B008 - frozen
        self.plant = BasePlant(start, start_ns, tick_phase=settings.base_phase, rate_error=settings.base_rate_error)

    def read_base(self, t_ns: int) -> BaseTruth:
        """Return pose and velocity at `t_ns`."""
        self.plant.step_to(t_ns)
        return BaseTruth(self.plant.pose, self.plant.velocity, self.plant.rolled)

    def read_slider(self, t_ns: int) -> Pose2D:
        """Return the object's pose."""
        del t_ns  # it never moves
        return SLIDER_POSE

    def command_base(self, twist: BodyTwist, arrival_ns: int) -> None:
        """Send the wheels a command."""
        self.plant.command(twist, arrival_ns)

    def set_drivers(self, active: bool, at_ns: int) -> None:
        """Switch the motors on or off."""
        self.plant.set_drivers(active, at_ns)


def standalone_emulator(
    loop: EventLoop,
    *,
    host: str = "127.0.0.1",
    port: int = 9090,
    settings: RidgebackSettings = RidgebackSettings(),  # noqa: B008 - frozen
    bridge: BridgeSettings = BridgeSettings(),  # noqa: B008 - frozen
) -> RosbridgeEmulator:
    """Serve a Ridgeback without a world from `loop`; raises what `RosbridgeEmulator` raises."""
    source = StandaloneBase(settings, monotonic_ns())
    return RosbridgeEmulator(loop, source, host=host, port=port, settings=settings, bridge=bridge)
