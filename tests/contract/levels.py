"""What the contract suite needs of a level: drivers, a way to let time pass, and a way to break a link.

PUSH_TEST_KIND=ft=udp_sensor:UdpSensor (or arm=, base=) with PUSH_TEST_KIND_FOLDER tests a kind of one's own instead, on
its own emulator.

sim: in-process devices on one simulated world and a virtual clock. emulated: the real drivers and a process with a
wire emulator for each. hardware: the real drivers at the addresses of these environment variables.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import pytest

from robot_io.clock import VirtualClock
from robot_io.ft300.driver import Ft300
from robot_io.kinds import find_kind
from robot_io.ridgeback.driver import Ridgeback
from robot_io.rig.config import load_rig
from robot_io.rig.topics import TopicsConfig
from robot_io.ur10.driver import Ur10
from robot_io.ur10.tool_force import UrToolForce
from sim_backend.ridgeback.settings import ridgeback_settings
from sim_backend.sim.ft300 import SimFt300
from sim_backend.sim.ridgeback import SimRidgeback
from sim_backend.sim.ur10 import SimUr10
from sim_backend.world.world import World
from tests.wire.bridge_process import running_bridge
from tests.wire.ft300_process import ft300_process
from tests.wire.kind_process import kind_process
from tests.wire.ur_process import EmulatorProcess

OWN_DEVICE, _, OWN_KIND = os.environ.get("PUSH_TEST_KIND", "").partition("=")
OWN_FOLDER = os.environ.get("PUSH_TEST_KIND_FOLDER", "")
DEVICES = (OWN_KIND,) if OWN_KIND else ("ft300", "ur10", "ridgeback", "ur10e", "ur-tool-force")
ADDRESSES = {
    "ft300": "PUSH_TEST_FT300_PORT",
    "ur10": "PUSH_TEST_UR10_HOST",
    "ridgeback": "PUSH_TEST_RIDGEBACK_URL",
    "ur10e": "PUSH_TEST_UR10E_HOST",
    "ur-tool-force": "PUSH_TEST_UR10E_HOST",
}
TOPICS = TopicsConfig(status="")
"""The status comes once a second, and every start would wait for it."""


class Level(Protocol):
    """One device at one level."""

    device: str

    def driver(self) -> Any:
        """Return a new, closed driver."""
        ...

    def let_pass(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def break_link(self) -> None:
        """Take the device away for good."""
        ...

    def freeze(self) -> contextlib.AbstractContextManager[None]:
        """Keep the device silent without closing anything."""
        ...


class Simulated:
    def __init__(self, device: str) -> None:
        self.device = device
        self._rig = load_rig("sim")
        self._clock = VirtualClock(10**9)
        self._world = World(self._rig, 0, 10**9)

    def driver(self) -> Any:
        if self.device == "ft300":
            return SimFt300(self._world, self._clock)
        if self.device == "ur10":
            return SimUr10(self._world, self._clock)
        return SimRidgeback(self._world, self._clock, settings=ridgeback_settings(self._rig, 0))

    def let_pass(self, seconds: float) -> None:
        self._clock.advance_to(self._clock() + round(seconds * 1e9))

    def freeze(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()  # time stands still between two drains anyway


class OnTheWire:
    """The real driver at an address; `broken` and `frozen` do it to the device."""

    def __init__(
        self,
        device: str,
        address: str,
        broken: Callable[[], object] | None = None,
        frozen: Callable[[bool], object] | None = None,
    ) -> None:
        self.device = device
        self._address = address
        self._broken = broken
        self._frozen = frozen

    def driver(self) -> Any:
        if self.device == "ft300":
            return Ft300(self._address)
        if self.device in ("ur10", "ur10e"):
            return Ur10(self._address)
        if self.device == "ur-tool-force":
            return UrToolForce(self._address)
        if self.device == OWN_KIND:
            return find_kind(OWN_DEVICE, OWN_KIND, OWN_FOLDER).from_rig(self._address, {})
        return Ridgeback(self._address, topics=TOPICS)

    def let_pass(self, seconds: float) -> None:
        time.sleep(seconds)

    def break_link(self) -> None:
        if self._broken is None:
            pytest.skip("nobody pulls the plug of a real device here")
        self._broken()

    @contextlib.contextmanager
    def freeze(self) -> Iterator[None]:
        if self._frozen is None:
            pytest.skip("nobody freezes a real device here")
        self._frozen(True)
        try:
            yield
        finally:
            self._frozen(False)


@contextlib.contextmanager
def emulated(device: str) -> Iterator[OnTheWire]:
    """Serve one emulated device from a process of its own."""
    if device == "ft300":
        with ft300_process() as sensor:
            yield OnTheWire(device, sensor.port, lambda: sensor.ask("hang_up"), _stopper(sensor.pid))
    elif device in ("ur10", "ur10e", "ur-tool-force"):
        options = {} if device == "ur10" else {"model": "ur10e", "wrench": (0.0,) * 6}
        with EmulatorProcess(**options) as robot:
            stop_or_go = lambda frozen: robot.freeze_process() if frozen else robot.thaw_process()  # noqa: E731
            yield OnTheWire(device, robot.host, robot.kill, stop_or_go)
    elif device == OWN_KIND:
        with kind_process(OWN_DEVICE, OWN_KIND, OWN_FOLDER) as emulator:
            yield OnTheWire(device, emulator.address, emulator.process.kill, _stopper(emulator.process.pid))
    else:
        with running_bridge(topics=TOPICS) as bridge:
            yield OnTheWire(device, bridge.url, lambda: bridge.do("kill"), _stopper(bridge.process.pid))


def hardware(device: str) -> OnTheWire:
    """Use the real device whose address the environment names."""
    address = os.environ.get(ADDRESSES[device], "")
    if not address:
        pytest.skip(f"{ADDRESSES[device]} names no device")
    return OnTheWire(device, address)


def _stopper(pid: int) -> Callable[[bool], None]:
    import signal

    return lambda frozen: os.kill(pid, signal.SIGSTOP if frozen else signal.SIGCONT)
