"""The fixed-rate loop: the only impure module of control.

One thread, one epoll: absolute deadlines from a timerfd, and the sensor's own descriptor, so that every packet
gets its true arrival time. A tick drains all devices without blocking, folds the input into the state, sends one frame
to the gate and pushes one record into the log ring. The loop only ever waits for the next deadline or a descriptor.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Protocol

from msgspec.structs import replace

from control.ft_input import ft_input
from control.notes.run_notes import RunNotes
from control.pace.pacer import spin_until, wake
from control.pace.silence import Silence
from control.pace.timing import LoopTiming
from robot_io.clock import ClockNs, asleep_ns, monotonic_ns
from robot_io.ipc.event_loop import EventLoop, Timer
from robot_io.ipc.gate_link import GateLink
from robot_io.ipc.ring import Ring
from robot_io.log.channels import Kind
from robot_io.messages import ArmRecord, BodyTwist, DeviceHealth, LinkState, SensorWrench, Stamped
from robot_io.tick import (
    TICK_CDR,
    ControlTick,
    HostInput,
    Operator,
    TickInput,
    TickOutput,
    TickState,
)

OPERATOR_BYTES = {b"S": Operator.STOP, b"R": Operator.RESUME}
PAUSE, GO_ON = b"PC"
LOG_LOST = b"L"[0]
"""The launcher reports that the recorder can no longer write: treated as if it were gone."""
BEAT = b"H"[0]
"""The launcher lives."""
FLOOD_S = 0.64
"""More packets in one tick than the sensor sends in this time are a flood; the oldest are dropped."""

Fold = Callable[[TickState, TickInput], tuple[TickState, TickOutput]]


class Sensor(Protocol):
    """What the loop needs of the force-torque sensor's driver."""

    def fileno(self) -> int:
        """Return the descriptor to wait on, or raise OSError when it is closed."""
        ...

    def drain(self) -> tuple[Stamped[SensorWrench], ...]:
        """Return every new sample, oldest first."""
        ...

    def health(self) -> DeviceHealth:
        """Return link state and counters."""
        ...


class Arm(Protocol):
    """What the loop needs of the arm."""

    def read(self) -> ArmRecord | None:
        """Return the newest record."""
        ...


class Watch:
    """Descriptors (pidfds), by name, that report when another process has ended."""

    def __init__(self, **pidfds: int) -> None:
        self.pidfds = pidfds
        self.gone: set[str] = set()


class ControlLoop:
    """Runs ticks until the fold reports that it has finished; `timing` and `last` hold the results."""

    def __init__(
        self,
        fold: Fold,
        state: TickState,
        *,
        rate_hz: float,
        sensor_rate_hz: float,
        sensor: Sensor,
        arm: Arm,
        base: GateLink,
        ring: Ring,
        watch: Watch,
        operator_fd: int,
        on_status: Callable[[TickInput, TickState, TickOutput], None],
        law_ns: Callable[[], int] = lambda: 0,
        clock: ClockNs = monotonic_ns,
        asleep: Callable[[], int | None] = asleep_ns,
    ) -> None:
        self._fold = fold
        self._state = state
        self._period_ns, self._spin_ns = round(1e9 / rate_hz), 0
        self._status_every = max(1, round(rate_hz / 5.0))
        self._sensor, self._arm, self._base, self._ring, self._watch = sensor, arm, base, ring, watch
        self._operator_fd, self._on_status = operator_fd, on_status
        self._law_ns, self._clock, self._read_asleep_ns = law_ns, clock, asleep
        self._loop = EventLoop()
        self._timer: Timer | None = None
        self._tick = self._sensor_fd = -1
        self._most_readings = round(FLOOD_S * sensor_rate_hz)
        self._health = sensor.health()
        self._sensor_error: Exception | None = None
        self._readings: list[Stamped[SensorWrench]] = []
        self._operator, self._paused = Operator.NONE, False
        self._launcher, self._recorder = Silence(), Silence()
        self._consumed = self._taken = self._last_tick_ns = self._asleep_ns = self._woken_ns = 0
        self._recorded = False  # whether the state before this tick is the end of the newest record in the ring
        self._arm_record = ArmRecord()
        self.timing = LoopTiming()
        self.notes = RunNotes()
        self.first_ns = self.last_ns = 0
        self.last: tuple[TickInput, TickState, TickOutput] | None = None
        self.error: BaseException | None = None

    def run(self, spin_us: float = 0.0) -> None:
        """Run until finished, waiting awake for the last `spin_us` before each deadline.

        An exception in a tick sends zero, is logged as F68, and is kept in `error`.
        """
        self._spin_ns = round(spin_us * 1e3)
        self._sensor_fd = self._sensor.fileno()
        self._loop.add_fd(self._sensor_fd, self._on_sensor)
        self._loop.add_fd(self._operator_fd, self._on_operator)
        os.set_blocking(self._operator_fd, False)
        for name, pidfd in self._watch.pidfds.items():
            self._loop.add_fd(pidfd, partial(self._on_gone, name))
        self.first_ns = self._clock() + self._period_ns
        self._launcher.heard(self.first_ns)
        self._sleep_until(self.first_ns)
        try:
            self._loop.run()
        finally:
            self._loop.close()

    def stop_requested(self) -> None:
        """Request a stop because this process itself received SIGTERM; safe in a signal handler."""
        self._operator = Operator.STOP

    def _on_sensor(self, _events: int) -> None:
        self._collect()
        if self._health.state == LinkState.LOST:
            self._loop.remove_fd(self._sensor_fd)

    def _collect(self) -> None:
        """Collect every new reading; keep a third-party driver's exception, on which the next tick gives up."""
        if self._sensor_error is not None:
            return
        try:
            readings = self._sensor.drain()
            self._health = self._sensor.health()
        except Exception as error:
            self._sensor_error = error
            self._loop.remove_fd(self._sensor_fd)
            return
        now_ns = self._clock()
        for reading in readings:  # a stamp from the future would never become stale
            self._readings.append(reading if reading.received_ns <= now_ns else replace(reading, received_ns=now_ns))
        self._taken += len(readings)
        del self._readings[: -self._most_readings]

    def _on_operator(self, _events: int) -> None:
        if self._operator_fd < 0:
            return
        try:
            typed = os.read(self._operator_fd, 64)
        except BlockingIOError:
            return
        self._launcher.heard(self._clock())
        if not typed:  # the launcher is gone
            self._loop.remove_fd(self._operator_fd)
            self._operator_fd = -1
            typed = b"S"
        for key in typed:
            if key in (PAUSE, GO_ON):
                self._paused = key == PAUSE
            elif key == LOG_LOST:
                self._watch.gone.add("recorder")
            elif key != BEAT and self._operator != Operator.STOP:
                self._operator = OPERATOR_BYTES.get(bytes((key,)), Operator.NONE)

    def _on_gone(self, name: str, _events: int) -> None:
        self._watch.gone.add(name)
        self._loop.remove_fd(self._watch.pidfds[name])

    def _sleep_until(self, deadline_ns: int) -> None:
        self._timer = self._loop.call_at(deadline_ns - self._spin_ns, self._on_deadline)

    def _on_deadline(self, woken_ns: int) -> None:
        deadline_ns = woken_ns + self._spin_ns
        now_ns = spin_until(deadline_ns, self._clock)
        self._woken_ns = now_ns
        paced = wake(deadline_ns, self._period_ns, now_ns)
        self._sleep_until(paced.next_deadline_ns)
        self._tick += 1 + paced.skipped
        self._collect()
        self._on_operator(0)
        self._note_silence(paced.skipped * self._period_ns)
        # Drained first: packets that arrived during a pause are read before their age is judged.
        inp = self._input(self._clock(), paced.late_ns, paced.skipped)
        try:
            if self._sensor_error is not None:
                raise self._sensor_error
            self._one_tick(inp)
        except Exception as error:  # top level of the loop: whatever failed, the base gets zero and the log records it
            self._give_up(inp, error)
        self.last_ns = now_ns
        self._last_tick_ns = self._clock() - now_ns
        self.timing.note(paced.late_ns, paced.skipped, self._last_tick_ns)

    def _one_tick(self, inp: TickInput) -> None:
        after, output = self._fold(self._state, inp)
        folded_ns = self._clock()
        self._base.command(output.command_body, tick=inp.tick, mode=output.mode)
        sent_ns = self._clock()
        self._record(inp, after, output)
        deadline_ns = self._woken_ns - inp.host.late_ns
        self.timing.note_stages(deadline_ns, self._woken_ns, inp.now_ns, folded_ns, sent_ns)
        self.timing.note_record(self._clock() - sent_ns)
        self._state = after
        self.last = (inp, after, output)
        self.notes.note(inp, after, output)
        if inp.tick % self._status_every == 0 or output.finished:
            self._on_status(inp, after, output)
        if output.finished:
            self._loop.stop()

    def _give_up(self, inp: TickInput, error: Exception) -> None:
        self.error = error
        self._loop.stop()
        self._base.command(BodyTwist(), tick=inp.tick + 1, mode=0)
        failed = replace(inp, host=replace(inp.host, loop_error=True))
        after, output = self._fold(self._state, failed)
        self._recorded = False  # it may have failed behind its own record
        self._record(failed, after, output)
        self.last = (failed, after, output)
        self.notes.note(failed, after, output)

    def _record(self, inp: TickInput, after: TickState, output: TickOutput) -> None:
        tick = ControlTick(0, 0, inp, () if self._recorded else (self._state,), after, output)
        self._recorded = self._ring.push(Kind.CONTROL_TICK, inp.now_ns, TICK_CDR.encode(tick))

    def _note_silence(self, pause_ns: int) -> None:
        self._launcher.leave_out(pause_ns)
        self._recorder.leave_out(pause_ns)
        if self._ring.consumed != self._consumed or not self._ring.unread:
            self._consumed = self._ring.consumed
            self._recorder.heard(self._clock())

    def _input(self, now_ns: int, late_ns: int, skipped: int) -> TickInput:
        gone = self._watch.gone
        record = self._arm.read()
        if record is not None:
            self._arm_record = record
        asleep_ns = self._read_asleep_ns()
        if asleep_ns is not None:
            self._asleep_ns = asleep_ns
        readings, self._readings = self._readings, []
        operator, self._operator = self._operator, Operator.NONE
        return TickInput(
            self._tick,
            now_ns,
            int(operator),
            HostInput(
                late_ns,
                skipped,
                self._base.alive and "gate" not in gone,
                "arm" not in gone,
                "recorder" not in gone,
                False,
                self._ring.dropped,
                self._launcher.so_far_ns(now_ns),
                self._recorder.so_far_ns(now_ns),
                self._asleep_ns,
                self._last_tick_ns,
                self._law_ns(),
            ),
            ft_input(readings, self._health, self._taken),
            self._arm_record,
            self._base.read(),
            self._paused,
        )
