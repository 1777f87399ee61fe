"""The gate's own process: sole holder of the base connection, one thread that never blocks.

    python -m safety.gate_process   (job as one JSON object on stdin)

Control's frames arrive on a SEQPACKET socket, velocities go out over the bridge; everything received from the base
is stamped, published to control through a shared record, and pushed into the gate's own log ring. When control
is gone, or the launcher, with which the kernel kills control, the gate sends zero for at most half a second and ends,
whatever it latched before.
"""

from __future__ import annotations

import gc
import signal
import socket
import sys
from collections.abc import Callable
from typing import TypeVar

import msgspec
from msgspec.structs import astuple, replace

from robot_io.clock import NS_PER_MS, asleep_ns, monotonic_ns
from robot_io.driver import Base, SharedBase
from robot_io.errors import PushError
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.gate_frame import FRAME_BYTES, GateFrame, unpack_frame
from robot_io.ipc.process import lock_memory, set_timer_slack_1ns, try_realtime
from robot_io.ipc.record import BASE_RECORD, TypedRecord
from robot_io.ipc.ring import Ring
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import build_driver, started
from robot_io.log.gate_log import GateLog
from robot_io.messages import BodyTwist, ClockOffset, CommandEcho
from robot_io.rig.config import BaseConfig, FramesConfig
from safety.envelope import EnvelopeLimits
from safety.gate_shell import GateShell
from safety.motion_bounds import TravelLimits

PRIORITY = 82
CLOCK_NS = 2 * NS_PER_MS
"""How often silence is judged and repeats are sent."""
MOST_FRAMES = 200
"""Frames of control read before they are judged: two seconds of them, more than a gate in order ever lets wait."""


class GateJob(msgspec.Struct, frozen=True):
    """The launcher's job for the gate: settings, and descriptors that this process inherits."""

    base: BaseConfig
    frames: FramesConfig
    kind_folder: str
    """Further folders in which to look for the module of the base's kind."""
    limits: EnvelopeLimits
    bounds: TravelLimits
    control_fd: int
    record_fd: int
    ring_fd: int
    launcher_fd: int
    """A pipe on which nothing comes but its end: the launcher's."""
    status_fd: int
    wall_offset_ns: int
    """Wall clock minus CLOCK_MONOTONIC, for stamps in the log."""


JobT = TypeVar("JobT", bound=GateJob)


class GateProcess:
    """Sockets, timers, driver and log ring around a `GateShell`, which makes all decisions."""

    def __init__(self, job: GateJob, base: Base, status: StatusPipe) -> None:
        self._base = base
        self._status = status
        self._control = socket.socket(fileno=job.control_fd)
        self._control.setblocking(False)
        self._launcher_fd = job.launcher_fd
        self._record_out = TypedRecord(job.record_fd, BASE_RECORD)
        self._log = GateLog(Ring(job.ring_fd).push, job.wall_offset_ns)
        self._shell = GateShell(job.limits, job.bounds, monotonic_ns())
        self._loop = EventLoop()
        self._foreign_told = False

    def run(self) -> None:
        """Run until control is gone and zero has been sent to the base."""
        self._base.before_close = self._loop.remove_fd
        self._loop.add_fd(self._control.fileno(), self._on_control)
        self._loop.add_fd(self._launcher_fd, self._on_launcher_gone)
        self._loop.add_fd(self._base.fileno(), self._on_base)
        self._loop.call_every(CLOCK_NS, self._on_clock)
        self._drain_base()  # what arrived during start-up: control's first record then already holds a pose
        self._publish()
        self._shell = replace(self._shell, ran_ns=monotonic_ns())
        try:
            self._loop.run()
        finally:
            self._base.stop()
            self._base.close()
            self._loop.close()
        self._status.say("finished", latch=int(self._shell.gate.latch), counters=self._base.health().counters)

    def note_clock(self, offset: ClockOffset | None) -> None:
        """Log how far the base's clock is ahead."""
        self._log.clock(monotonic_ns(), offset)

    def _on_control(self, _events: int) -> None:
        self._read_control()
        self._send_due()

    def _on_launcher_gone(self, _events: int) -> None:
        """Do not wait until the kernel has taken control apart, too: that is some milliseconds of motion."""
        self._loop.remove_fd(self._launcher_fd)
        self._on_control_gone()
        self._send_due()

    def _on_base(self, _events: int) -> None:
        self._drain_base()
        self._send_due()

    def _on_clock(self, _deadline_ns: int) -> None:
        now_ns = monotonic_ns()
        self._read_control()
        self._drain_base()
        self._shell = self._shell.on_clock(now_ns, self._base.health())
        self._send_due()
        if self._shell.publish_due(now_ns):
            self._publish()
        if self._shell.ends(now_ns, self._base.health().state):
            self._loop.stop()

    def _read_control(self) -> None:
        """Read the waiting frames, before silence is judged."""
        began_ns = monotonic_ns()
        frames: list[GateFrame | None] = []
        gone = bool(self._shell.zeros_since_ns)
        while not gone and len(frames) < MOST_FRAMES:
            try:
                payload = self._control.recv(FRAME_BYTES + 1)
            except BlockingIOError:
                break
            except OSError:
                payload = b""
            if payload:
                frames.append(unpack_frame(payload))
            gone = not payload
        self._shell = self._shell.on_frames(frames, began_ns, monotonic_ns())
        if gone:
            self._on_control_gone()

    def _on_control_gone(self) -> None:
        if not self._shell.zeros_since_ns:
            self._loop.remove_fd(self._control.fileno())
            self._shell = self._shell.on_control_gone(monotonic_ns())

    def _drain_base(self) -> None:
        samples, now_ns = self._base.drain(), monotonic_ns()
        if any(sample.received_ns > now_ns for sample in samples):  # it would never become stale
            samples = tuple(replace(sample, received_ns=min(sample.received_ns, now_ns)) for sample in samples)
        for sample in samples:
            self._log.inbound(sample)
            if isinstance(sample.value, CommandEcho) and not sample.value.ours:
                self._tell_of_foreign(sample.value.twist)
        if samples:
            self._shell = self._shell.on_samples(samples)
            self._publish()

    def _tell_of_foreign(self, twist: BodyTwist) -> None:
        """Name the first velocity of somebody else: where the base then ignores ours (F33), this is why."""
        if not self._foreign_told:
            self._foreign_told = True
            velocity = f"{twist.vx:.2f} m/s forward, {twist.vy:.2f} m/s left, {twist.omega:.2f} rad/s"
            self._status.say("warning", text=f"somebody else commands the base as well: {velocity} was heard")

    def _send_due(self) -> None:
        now_ns = monotonic_ns()
        self._shell, latching = self._shell.on_asleep(asleep_ns()).on_leaving(now_ns)
        if latching is not None:
            self._log.latched(now_ns, *astuple(latching))
            self._status.say("latched", latch=int(latching.latch), text=latching.text)
            self._publish()
        wanted = self._shell.due(now_ns)
        if wanted is None:
            return
        left_ns = self._base.sent_ns
        really = self._base.command(wanted)
        if self._base.sent_ns == left_ns:  # nothing is sent over a lost link
            self._shell = self._shell.on_sent(wanted, None, now_ns)
        else:
            self._shell = self._shell.on_sent(wanted, really, now_ns)
            self._log.sent(now_ns, really)
        self._publish()

    def _publish(self) -> None:
        base = self._base
        self._shell = self._shell.on_publish(
            monotonic_ns(), newest_inbound_ns=base.newest_inbound_ns, newest_pong_ns=base.newest_pong_ns
        )
        self._record_out.publish(self._shell.record)


def main(kind: type[JobT], wrapped: Callable[[Base, JobT], Base]) -> int:
    """Run the gate; return 0, or the error's exit code when the base could not be opened.

    kind: the job on stdin. wrapped: makes of the driver what the gate uses, when it has been opened.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # only an EOF, of control or of the launcher, ends the gate
    set_timer_slack_1ns()
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=kind)
    status = StatusPipe(job.status_fd)
    try:
        base: Base = build_driver(
            "base",
            job.base.kind,
            job.base.url,
            {
                "topics": job.base.topics,
                "pose_source": job.base.pose_source,
                "base_from_marker": job.frames.base_from_marker,
                **job.base.options,
            },
            folder=job.kind_folder,
        )
        info = started(base, "base", job.base.kind)
        if isinstance(base, SharedBase):
            base.take_command()
    except PushError as error:  # the process ends, which closes everything that was open
        status.error(error)
        return error.exit_code
    process = GateProcess(job, wrapped(base, job), status)
    process.note_clock(info.clock)
    realtime = try_realtime(PRIORITY)
    status.say("ready", info=msgspec.to_builtins(info), realtime=realtime)
    for remark in info.remarks:
        status.say("warning", text=remark)
    gc.collect()
    gc.freeze()
    lock_memory()
    process.run()
    return 0


if __name__ == "__main__":
    sys.exit(main(GateJob, lambda base, _job: base))
