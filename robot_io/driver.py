"""The contract every driver keeps, at every level (sim, emulated, hardware).

`open` identifies the device, or raises a `DeviceError` within a named time. `start` begins the flow. `drain`
returns all new samples since the last call, oldest first, bounded, and never blocks and never raises on
link loss (it gives what came before, then nothing, and `health` says LOST). `stop` and `close` are idempotent,
bounded and never raise. A driver stamps arrivals; it never judges staleness and never resumes motion by itself.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Protocol, Self, TypeVar

from robot_io.messages import DeviceHealth, DeviceInfo, Stamped

SampleT = TypeVar("SampleT")
CommandT = TypeVar("CommandT")


class Driver(Protocol[SampleT]):
    """A device that gives samples."""

    def open(self) -> DeviceInfo:
        """Connect and identify. Raises DeviceUnreachable, DeviceProtocolError or DeviceNotReady."""
        ...

    def start(self) -> None:
        """Begin the flow of samples. Raises DeviceError when the device refuses."""
        ...

    def drain(self) -> tuple[Stamped[SampleT], ...]:
        """Return every new sample since the last call, oldest first. Never blocks, never raises on link loss."""
        ...

    def health(self) -> DeviceHealth:
        """Return link state, cause and counters."""
        ...

    def stop(self) -> None:
        """Stop the flow (and any motion). Idempotent, bounded, never raises."""
        ...

    def close(self) -> None:
        """Release everything. Idempotent, bounded, never raises."""
        ...


class CommandedDriver(Driver[SampleT], Protocol[SampleT, CommandT]):
    """A device that also takes commands."""

    def command(self, wanted: CommandT) -> CommandT:
        """Send a command; return what was really sent."""
        ...


class DriverBase(ABC):
    """`with driver:` opens and starts it, and always stops and closes it."""

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
