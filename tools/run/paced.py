"""A lockstep run in front of an operator: at the pace of the wall clock, with live line, keys and signals."""

from __future__ import annotations

import signal
from typing import Any

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from robot_io.tick import Operator, TickInput, TickOutput, TickState
from tools.run.lockstep import Lockstep
from tools.run.run_state import status_line
from tools.terminal.live_line import LiveLine
from tools.terminal.operator_keys import OperatorKeys

SECOND_STOP_NS = NS_PER_S
"""As of a wall-clock run: `timeout` and shells may send one stop twice."""


class WallPace:
    """Paces ticks to the wall clock while its event loop serves what else happens."""

    def __init__(self, loop: EventLoop, period_s: float) -> None:
        self._loop = loop
        self._period_ns = round(period_s * NS_PER_S)
        self._next_ns = monotonic_ns()

    def wait(self) -> None:
        """Serve the event loop until the next tick's time; late ticks are not caught up in a burst."""
        self._next_ns = max(self._next_ns + self._period_ns, monotonic_ns())
        due: list[int] = []
        self._loop.call_at(self._next_ns, due.append)
        while not due:
            self._loop.run_once()


class PacedRun:
    """Runs a lockstep run at the pace of the wall clock; keys and signals do what they do in a wall-clock run."""

    def __init__(self, one: Lockstep, live: LiveLine) -> None:
        self._one = one
        self._live = live
        self._loop = EventLoop()
        self._pace = WallPace(self._loop, 1.0 / one.rig.loop.rate_hz)
        self._status_every = max(1, round(one.rig.loop.rate_hz / 5.0))
        self._stop_asked_ns = 0
        self._at_once = False

    def run(self) -> dict[str, Any]:
        """Run to the end and return the figures."""
        self._keys = OperatorKeys(self._loop, self._stop, self._resume, self._pause)
        try:
            return self._one.run(self._on_tick)
        finally:
            self._keys.close()
            self._loop.close()
            self._live.end()

    def _on_tick(self, inp: TickInput, state: TickState, output: TickOutput) -> None:
        if not self._at_once:
            self._pace.wait()
        if inp.tick % self._status_every == 0 or output.finished:
            self._live.show(status_line(inp, state, output), keys=self._keys.heard)

    def _stop(self) -> None:
        now_ns = monotonic_ns()
        if not self._stop_asked_ns:
            self._stop_asked_ns = now_ns
            self._live.say("stopping ...")
            self._one.operator = Operator.STOP
        elif now_ns - self._stop_asked_ns > SECOND_STOP_NS:
            self._at_once = True

    def _resume(self) -> None:
        self._one.paused = False
        if self._one.operator != Operator.STOP:
            self._one.operator = Operator.RESUME

    def _pause(self) -> None:
        self._one.paused = not self._one.paused


def run_fast(one: Lockstep) -> dict[str, Any]:
    """Run as fast as possible and return the figures; what is typed meanwhile is for the shell, signals stop."""

    def stop(*_: object) -> None:
        one.operator = Operator.STOP

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        return one.run(lambda *_: None)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
