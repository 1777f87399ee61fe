"""The control process: `python -m tools.run.control_process` (job on stdin). Opens the sensor and runs the loop."""

from __future__ import annotations

import gc
import logging
import os
import select
import signal
import socket
import sys
import time

import msgspec

from control.laws.law import Law
from control.loop import ControlLoop, Watch
from control.notes.run_notes import outcome
from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.driver import Sensor
from robot_io.errors import EnvironmentFault, PushError
from robot_io.ipc.deadman import Deadman
from robot_io.ipc.gate_link import GateLink
from robot_io.ipc.process import die_with_parent, set_timer_slack_1ns
from robot_io.ipc.realtime import RealtimeFacts, set_up_realtime
from robot_io.ipc.ring import Ring
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import build_driver, started
from robot_io.rig.config import RigConfig, rig_from_toml
from robot_io.tick import TickInput, TickOutput, TickState
from robot_io.ur10.driver import ArmLink
from sim_backend.injection.arm import InjectedArm
from sim_backend.injection.event import event_writer
from sim_backend.injection.injection import Injection
from sim_backend.injection.sensor import InjectedSensor
from tools.kinds import name_of
from tools.laws import own_law
from tools.run.jobs import ControlJob
from tools.run.law_clock import LawClock
from tools.run.run_state import initial_state, status_line
from tools.run.tick_core import TickCore

PRIORITY = 80
VERDICT_WITHIN_S = 3.0
"""How long a launcher on a busy machine may take to read the result; the base is already at rest."""
LAUNCHER_SILENT_S = 2.0
"""A launcher that was silent for this long before the start is frozen, and nobody holds the operator's keys."""

FROZEN_S = 2
"""A loop that has stood still for this long is killed, or a launcher frozen with it would leave the others waiting."""


class DriverWarnings(logging.Handler):
    """Forwards the sensor driver's warnings to the launcher (a late USB adapter): nobody sees our stderr."""

    def __init__(self, status: StatusPipe, name: str) -> None:
        super().__init__(logging.WARNING)
        self._status = status
        self._name = name

    def emit(self, record: logging.LogRecord) -> None:
        """Send the warning to the launcher."""
        self._status.say("warning", text=f"{self._name}: {record.getMessage()}")


def main() -> int:
    """Run the loop to its end; return the exit code of the run."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=ControlJob)
    die_with_parent(job.launcher_pid)
    set_timer_slack_1ns()
    status = StatusPipe(job.status_fd)
    rig = rig_from_toml(job.rig_toml)
    logging.getLogger().addHandler(DriverWarnings(status, name_of(rig.ft.kind)))
    try:
        sensor: Sensor = build_driver("ft", rig.ft.kind, rig.ft.port, rig.ft.options, folder=job.kind_folder)
    except PushError as error:
        status.error(error)
        return error.exit_code
    ring = Ring(job.ring_fd)
    injection = Injection(rig.faults.inject, monotonic_ns, event_writer(ring.push, job.wall_offset_ns))
    try:
        law = own_law(rig.control, job.kind_folder)
    except PushError as error:
        status.error(error)
        return error.exit_code
    base = GateLink(socket.socket(fileno=job.gate_fd), job.base_record_fd)
    deadman = Deadman(FROZEN_S)
    loop = _loop(job, rig, law, sensor, base, ring, injection, status, deadman)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    try:
        info = started(sensor, "ft", rig.ft.kind)
        signal.signal(signal.SIGTERM, lambda *_: loop.stop_requested())
    except PushError as error:
        sensor.close()
        status.error(error)
        return error.exit_code
    except SystemExit:  # SIGTERM during the start: a stream that has begun is not left running
        sensor.close()
        raise
    got = set_up_realtime(PRIORITY, cpu=rig.loop.cpu, spin_us=rig.loop.spin_us)
    status.say("ready", info=msgspec.to_builtins(info), realtime=got.fifo)
    if not _wait_for_go(job.operator_fd, sensor, status):
        base.close()
        sensor.stop()
        sensor.close()
        return 1
    gc.collect()
    gc.freeze()
    gc.disable()
    injection.begin(monotonic_ns() + round(NS_PER_S / rig.loop.rate_hz))
    loop.run(got.spin_us)
    deadman.release()
    base.close()  # first: the gate reads the EOF as the end and sends its last zeros
    gc.enable()
    return _finish(loop, sensor, status, rig.loop.rate_hz, injection.counts("ft", "arm"), got)


def _loop(
    job: ControlJob,
    rig: RigConfig,
    law: Law | None,
    sensor: Sensor,
    base: GateLink,
    ring: Ring,
    injection: Injection,
    status: StatusPipe,
    deadman: Deadman,
) -> ControlLoop:
    """Return the loop, which renews `deadman` and reports to `status` five times a second."""
    timed = None if law is None else LawClock(law)
    core = TickCore.of(rig, in_contact=job.saved_tare is not None, law=timed)
    arm = ArmLink(job.arm_record_fd)

    def on_status(inp: TickInput, state: TickState, output: TickOutput) -> None:
        deadman.renew()
        status.say("status", **status_line(inp, state, output))

    watch = Watch(gate=job.gate_pidfd, arm=job.arm_pidfd, recorder=job.recorder_pidfd)
    return ControlLoop(
        core.fold,
        initial_state(job.saved_tare),
        rate_hz=rig.loop.rate_hz,
        sensor_rate_hz=rig.ft.declared.rate_hz,
        sensor=InjectedSensor(sensor, injection, rig) if injection.of("ft") else sensor,
        arm=InjectedArm(arm, injection) if injection.of("arm") else arm,
        base=base,
        ring=ring,
        watch=watch,
        operator_fd=job.operator_fd,
        on_status=on_status,
        law_ns=(lambda: 0) if timed is None else timed.take_ns,
    )


def _wait_for_go(operator_fd: int, sensor: Sensor, status: StatusPipe) -> bool:
    """Return whether the launcher lets the loop start; keep the sensor drained while waiting."""
    os.set_blocking(operator_fd, False)
    heard_s = time.monotonic()
    while time.monotonic() - heard_s < LAUNCHER_SILENT_S:
        readable, _, _ = select.select([operator_fd], [], [], 0.05)
        sensor.drain()
        if readable:
            heard_s = time.monotonic()
            key = os.read(operator_fd, 1)
            if key != b"H":
                return key == b"G"
    frozen = f"the launcher was frozen for {LAUNCHER_SILENT_S:g} s before the start; nothing has moved"
    status.error(EnvironmentFault(frozen, do="Start again"))
    return False


def _finish(
    loop: ControlLoop, sensor: Sensor, status: StatusPipe, rate_hz: float, injected: dict[str, int], got: RealtimeFacts
) -> int:
    counters = sensor.health().counters
    sensor.stop()
    sensor.close()
    if loop.last is None:
        return 1
    figures = outcome(*loop.last)
    status.say_whole(
        VERDICT_WITHIN_S,
        "finished",
        **figures,
        loop=loop.timing.summary(rate_hz, loop.first_ns, loop.last_ns) | {"realtime": msgspec.to_builtins(got)},
        **loop.notes.figures(),
        ft=counters,
        injected=injected,
        error="" if loop.error is None else f"{type(loop.error).__name__}: {loop.error}",
    )
    if loop.error is not None:
        sys.excepthook(type(loop.error), loop.error, loop.error.__traceback__)
    return loop.last[2].exit_code


if __name__ == "__main__":
    sys.exit(main())
