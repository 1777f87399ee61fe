"""One-shot timers of an event loop, known by name: setting one again replaces it."""

from __future__ import annotations

from collections.abc import Callable

from robot_io.clock import NS_PER_MS
from robot_io.ipc.event_loop import EventLoop, Timer


class NamedTimers:
    """The timers of one emulator, each called back once, at a time of CLOCK_MONOTONIC in ns."""

    def __init__(self, loop: EventLoop) -> None:
        self._loop = loop
        self._timers: dict[str, Timer] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._timers

    def at(self, name: str, deadline_ns: int, callback: Callable[[int], None]) -> None:
        """Call back once at `deadline_ns`, unless a timer of that name is set again before."""

        def fire(at_ns: int) -> None:
            self._timers.pop(name, None)
            callback(at_ns)

        previous = self._timers.get(name)
        if previous is not None:
            previous.cancel()
        self._timers[name] = self._loop.call_at(deadline_ns, fire)

    def cancel_all(self) -> None:
        """Call none of them back."""
        for timer in self._timers.values():
            timer.cancel()
        self._timers.clear()


def nanoseconds(milliseconds: float) -> int:
    """Return a time in whole ns."""
    return int(milliseconds * NS_PER_MS)
