"""The contract every driver keeps, at every level (sim, emulated, hardware), and what a sensor declares of itself.

`open` identifies the device, or raises a `DeviceError` within a named time. `start` begins the flow. `drain`
returns all new samples since the last call, oldest first, bounded, and never blocks and never raises on
link loss (it gives what came before, then nothing, and `health` says LOST). While a driver is UP and gives nothing
because `start` was not called, the cause of its `health` says so. `stop` and `close` are idempotent,
bounded and never raise. A driver stamps arrivals; it never judges staleness and never resumes motion by itself.
It starts no threads and takes no locks: use it from one thread, the one that opened it.

A rig names a driver by its `kind`; `from_rig` then builds it. A driver outside this project keeps the protocol of its
device (`Sensor`, `Base`, or for an arm `Driver` of `JointState` samples); deriving from `DriverBase` gives it `with`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, ClassVar, Protocol, Self, TypeVar, runtime_checkable

import msgspec

from robot_io.errors import ConfigError
from robot_io.messages import BaseFeed, BodyTwist, DeviceHealth, DeviceInfo, SensorWrench, Stamped, Vector6

SampleT = TypeVar("SampleT")


class SensorFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a force-torque sensor declares of itself.

    Six numbers are those of fx, fy, fz (N) and mx, my, mz (N*m) in the SENSOR frame. Safety, tare and settings go by
    these. All must be finite and above 0; the rate is 50 to 8000 Hz.
    """

    range: Vector6
    """The largest reading of each axis, either way."""
    rate_hz: float
    """Readings a second."""
    resolution: Vector6
    """The smallest step of each axis."""
    noise: Vector6
    """One standard deviation of each axis at rest."""
    source: str
    """Where these come from: a data sheet, a measurement."""


class Driver(Protocol[SampleT]):
    """A device that gives samples."""

    @classmethod
    def from_rig(cls, address: str, options: Mapping[str, Any]) -> Self:
        """Return the driver for what a rig says. Raises ConfigError for options that it cannot use.

        address: the rig's `port` (sensor), `host` (arm) or `url` (base), or where its emulator is.
        options: the table `[ft.options]`, `[arm.options]` or `[base.options]`, and what all devices of this sort share.
        """
        ...

    def open(self) -> DeviceInfo:
        """Connect and identify, within a time the driver names.

        Raises DeviceUnreachable, DeviceProtocolError or DeviceNotReady.
        """
        ...

    def start(self) -> None:
        """Begin the flow of samples, within a time the driver names. Raises DeviceError when the device refuses."""
        ...

    def drain(self) -> tuple[Stamped[SampleT], ...]:
        """Return every new sample since the last call, oldest first. Never blocks, never raises on link loss."""
        ...

    def health(self) -> DeviceHealth:
        """Return link state, cause, counters and rate (Hz). Never blocks, never raises."""
        ...

    def stop(self) -> None:
        """Stop the flow (and any motion). Idempotent, bounded, never raises."""
        ...

    def close(self) -> None:
        """Release everything. Idempotent, bounded, never raises."""
        ...


class Sensor(Driver[SensorWrench], Protocol):
    """A force-torque sensor: a `Driver` of `SensorWrench` samples. Its health counts at least `packets_ok`."""

    facts: ClassVar[SensorFacts]
    """What the sensor declares of itself."""

    def fileno(self) -> int:
        """Return the descriptor that is readable when samples wait, or raise OSError when it is closed."""
        ...


class Base(Driver[BaseFeed], Protocol):
    """A mobile base: a `Driver` of `BaseFeed` samples that takes velocities, too."""

    before_close: Callable[[int], None] | None
    """Called with the descriptor just before it is closed, so that nobody waits on it any more."""
    sent_ns: int
    """When the newest command left (CLOCK_MONOTONIC), 0 before."""
    newest_inbound_ns: int
    """When the newest message of any kind arrived, 0 before."""
    newest_pong_ns: int
    """When the link last answered a question of ours whether it lives, 0 where it is not asked."""

    def fileno(self) -> int:
        """Return the descriptor that is readable when messages wait."""
        ...

    def command(self, wanted: BodyTwist) -> BodyTwist:
        """Send a velocity (BODY frame, m/s, rad/s); return what was really sent. ValueError unless finite."""
        ...


@runtime_checkable
class SharedBase(Protocol):
    """A base that others can command as well, over a bus or a bridge: it is checked that nobody does."""

    def take_command(self) -> None:
        """Make sure that nobody else commands the base, and that our commands arrive. Raises DeviceError."""
        ...


class DriverBase(ABC):
    """`with driver:` opens and starts it, and always stops and closes it."""

    @classmethod
    def from_rig(cls, address: str, options: Mapping[str, Any]) -> Self:
        """Return `cls(address)`; a driver with options of its own overrides this. Raises ConfigError for any option."""
        no_more_options(cls.__name__, options)
        return cls(address)  # type: ignore[call-arg]  # a driver whose constructor takes more overrides this

    @abstractmethod
    def open(self) -> DeviceInfo:
        """See `Driver.open`."""

    @abstractmethod
    def start(self) -> None:
        """See `Driver.start`."""

    @abstractmethod
    def stop(self) -> None:
        """See `Driver.stop`."""

    @abstractmethod
    def close(self) -> None:
        """See `Driver.close`."""

    def __enter__(self) -> Self:
        try:
            self.open()
            self.start()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.stop()
        finally:
            self.close()


def no_more_options(name: str, options: Mapping[str, Any]) -> None:
    """Raise ConfigError naming the options that are left."""
    if options:
        raise ConfigError(f"{name} has no option `{'`, `'.join(options)}`", where="options")
