"""Open wire emulators on one world; used by a run's emulator process and by `push emulate all`."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import EnvironmentFault
from robot_io.ipc.event_loop import EventLoop
from robot_io.kinds import find_kind
from robot_io.rig.config import RigConfig
from robot_io.rig.declared import TOOL_FORCE
from sim_backend.ft300.emulator import Ft300Emulator
from sim_backend.ridgeback.emulator import RosbridgeEmulator
from sim_backend.ridgeback.settings import ridgeback_settings
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.ur10.models import BY_NAME
from sim_backend.world.world import World
from tools.rig import kinds_of

ARM_HOSTS = tuple(f"127.0.0.{last}" for last in range(10, 250))
"""A UR's ports are fixed, so each emulated arm needs its own loopback address."""


class Emulator(Protocol):
    """What all emulators have in common."""

    @property
    def counters(self) -> dict[str, int]:
        """Counts by name."""
        ...

    def close(self) -> None:
        """Stop serving."""
        ...


def open_ft300(loop: EventLoop, world: World, rig: RigConfig) -> Ft300Emulator:
    """Open an FT 300 on the world; its `port` is a pty."""
    sensor = rig.world.sensor
    emulator = Ft300Emulator(loop, world, rate_hz=sensor.rate_hz, phase=sensor.phase, latency_ms=sensor.latency_ms)
    emulator.start()
    return emulator


def open_ur10(loop: EventLoop, world: World, rig: RigConfig, hosts: tuple[str, ...] = ARM_HOSTS) -> UrEmulator:
    """Open the world's UR on the first loopback address whose ports are free. Raises EnvironmentFault if none is.

    Its own sensor feels the world where it is the rig's sensor.
    """
    model = BY_NAME[rig.world.arm_model.lower()]
    wrench = world if rig.ft.kind == TOOL_FORCE else None
    for host in hosts:
        try:
            return UrEmulator(
                loop,
                world,
                host=host,
                model=model,
                rate_hz=rig.world.arm_cycle_hz,
                phase=rig.world.arm_phase,
                wrench=wrench,
            )
        except EnvironmentFault:
            if len(hosts) == 1:
                raise
    raise EnvironmentFault(
        "no loopback address is free for an emulated UR",
        where=f"{hosts[0]} to {hosts[-1]}",
        do="Stop other emulators",
    )


def open_ridgeback(
    loop: EventLoop, world: World, rig: RigConfig, host: str = "127.0.0.1", port: int = 0
) -> RosbridgeEmulator:
    """Open a rosbridge server with a Ridgeback behind it; port 0 picks a free port."""
    return RosbridgeEmulator(loop, world, host=host, port=port, settings=ridgeback_settings(rig, world.seed))


OPENERS: dict[str, Callable[[EventLoop, World, RigConfig], Emulator]] = {
    "robotiq-ft300": open_ft300,
    "ur": open_ur10,
    "ridgeback-rosbridge": open_ridgeback,
}
"""The function that opens the emulator of each shipped kind."""


class ExternalEmulator:
    """The emulator of an external kind: its `tick(now_ns)` is called every `period_s`."""

    def __init__(self, loop: EventLoop, emulator: Any) -> None:
        self._emulator = emulator
        self._timer = loop.call_every(round(emulator.period_s * NS_PER_S), lambda _: emulator.tick(monotonic_ns()))

    @property
    def address(self) -> str:
        """The address for its driver."""
        return str(self._emulator.address)

    @property
    def counters(self) -> dict[str, int]:
        """Counts by name."""
        return dict(self._emulator.counters)

    def close(self) -> None:
        """Stop serving."""
        self._timer.cancel()
        self._emulator.close()


def open_emulator(loop: EventLoop, world: World, rig: RigConfig, device: str, folder: str) -> Emulator:
    """Open the emulator of the rig's ft, arm or base. Raises ConfigError and EnvironmentFault.

    folder: another place to look for the module of its kind.
    """
    kind = kinds_of(rig)[device]
    if kind in OPENERS:
        return OPENERS[kind](loop, world, rig)
    options = {"ft": rig.ft.options, "arm": rig.arm.options, "base": rig.base.options}[device]
    return ExternalEmulator(loop, find_kind(device, kind, folder).Emulator(world, options))


def open_emulators(
    loop: EventLoop, world: World, rig: RigConfig, devices: Iterable[str], folder: str
) -> dict[str, Emulator]:
    """Open the emulator of each device. Raises as `open_emulator`, and then none is left open."""
    opened: dict[str, Emulator] = {}
    with contextlib.ExitStack() as opening:
        for device in sorted(devices, key=lambda name: name != "arm"):
            if device == "ft" and rig.ft.kind == TOOL_FORCE:
                opened["ft"] = opened["arm"]  # one controller, one address
                continue
            opened[device] = open_emulator(loop, world, rig, device, folder)
            opening.callback(opened[device].close)
        opening.pop_all()
    return opened


def endpoint(emulator: Emulator) -> dict[str, str]:
    """Return where an emulator can be reached, as `push emulate` prints it: its `port`, `host` or `url`."""
    if isinstance(emulator, Ft300Emulator):
        return {"device": "ft300", "port": emulator.port}
    if isinstance(emulator, UrEmulator):
        return {"device": emulator.controller.model.name.lower(), "host": emulator.host}
    if isinstance(emulator, ExternalEmulator):
        return {"device": "own", "address": emulator.address}
    assert isinstance(emulator, RosbridgeEmulator)
    return {"device": "ridgeback", "url": emulator.url}


def address_of(emulator: Emulator) -> str:
    """Return the address that the emulator's driver connects to."""
    return next(value for name, value in endpoint(emulator).items() if name != "device")


def addresses_of(opened: Mapping[str, Emulator]) -> dict[str, str]:
    """Return the address of each device's emulator."""
    return {device: address_of(emulator) for device, emulator in opened.items()}
