"""The gate's own process: sole holder of the base connection, one thread that never blocks.

    python -m safety.gate_process   (job as one JSON object on stdin)

Frames of control come in over a SEQPACKET socket, velocities go out over the bridge, everything the base says
is stamped, published to control through a shared record, and pushed into the gate's own log ring. When control
is gone it sends zero for at most half a second and ends, whatever it latched before.
"""

from __future__ import annotations

import gc
import signal
import socket
import sys

import msgspec
from msgspec.structs import replace

from robot_io.clock import NS_PER_MS, monotonic_ns
from robot_io.driver import Base
from robot_io.errors import PushError
from robot_io.ipc.base_record import BASE_RECORD_BYTES, pack_base_record
from robot_io.ipc.event_loop import EventLoop
from robot_io.ipc.gate_frame import FRAME_BYTES, GateFrame, unpack_frame
from robot_io.ipc.process import lock_memory, set_timer_slack_1ns, try_realtime
from robot_io.ipc.record import SharedRecord
from robot_io.ipc.ring import Ring
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import find_kind
from robot_io.log.gate_log import GateLog
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseRecord,
    BaseReport,
    CommandEcho,
    LinkState,
    SliderPose,
    Stamped,
)
from robot_io.rig.config import BaseConfig, FramesConfig
from safety import gate
from safety.gate import GateLimits, GateState, Latch

PRIORITY = 82
CLOCK_NS = 2 * NS_PER_MS
"""How often silence is judged and repeats are sent."""
PUBLISH_NS = 10 * NS_PER_MS
LAST_ZEROS_NS = 500 * NS_PER_MS
REST_M_PER_S = REST_RAD_PER_S = 0.005


class GateJob(msgspec.Struct, frozen=True):
    """What the launcher hands over: settings, and descriptors that this process inherits."""

    base: BaseConfig
    frames: FramesConfig
    kind_folder: str
    """Where else the module of the base's kind may be."""
    limits: GateLimits
    control_fd: int
    record_fd: int
    ring_fd: int
    status_fd: int
    wall_offset_ns: int
    """Wall clock minus CLOCK_MONOTONIC, for stamps in the log."""


class GateProcess:
    """The impure shell around `safety.gate`."""

    def __init__(self, job: GateJob, base: Base, status: StatusPipe) -> None:
        self._limits = job.limits
        self._base = base
        self._status = status
        self._control = socket.socket(fileno=job.control_fd)
        self._control.setblocking(False)
        self._record_out = SharedRecord(job.record_fd, BASE_RECORD_BYTES)
        self._log = GateLog(Ring(job.ring_fd).push, job.wall_offset_ns)
        self._record = BaseRecord()
        self._state = GateState()
        self._told = Latch.NONE
        self._loop = EventLoop()
        self._base_fd = -1
        self._end_ns = 0
        self._ran_ns = 0

    def run(self) -> None:
        """Serve until control is gone and the base was told zero."""
        self._base.before_close = self._forget
        self._base_fd = self._base.fileno()
        self._loop.add_fd(self._control.fileno(), self._on_control)
        self._loop.add_fd(self._base_fd, self._on_base)
        self._loop.call_every(CLOCK_NS, self._on_clock)
        self._take(self._base.drain())  # what came while it started: control's first record already holds a pose
        self._publish()
        self._ran_ns = monotonic_ns()
        try:
            self._loop.run()
        finally:
            self._base.stop()
            self._base.close()
            self._loop.close()
        self._status.say("finished", latch=int(self._state.latch), counters=self._base.health().counters)

    def _forget(self, fd: int) -> None:
        self._loop.remove_fd(fd)

    def _on_control(self, _events: int) -> None:
        self._read_control()
        self._send_due()

    def _read_control(self) -> None:
        """Judge every frame that waits; they are read before any silence is judged."""
        now_ns = monotonic_ns()  # before reading: a pause of this process makes no frame old
        frames: list[GateFrame | None] = []
        gone = False
        while not gone and not self._end_ns:
            try:
                payload = self._control.recv(FRAME_BYTES + 1)
            except BlockingIOError:
                break
            except OSError:
                payload = b""
            if payload:
                frames.append(unpack_frame(payload))
            gone = not payload
        if frames:
            self._state = gate.on_frames(self._limits, self._state, frames, now_ns)
            if not self._state.latch:  # silence counts from here: a pause while they were read is none of control's
                self._state = replace(self._state, frame_ns=monotonic_ns())
            verdict = self._state.latch
            newest = frames[-1]
            accepted = newest.seq if newest is not None and not verdict else self._record.accepted_seq
            self._record = replace(self._record, accepted_seq=accepted, verdict=int(verdict))
        if gone:
            self._control_is_gone()

    def _control_is_gone(self) -> None:
        self._loop.remove_fd(self._control.fileno())
        self._state = gate.on_eof(self._state)
        self._end_ns = monotonic_ns() + LAST_ZEROS_NS

    def _on_base(self, _events: int) -> None:
        self._take(self._base.drain())
        self._send_due()

    def _on_clock(self, _deadline_ns: int) -> None:
        now_ns = monotonic_ns()
        self._read_control()
        self._take(self._base.drain())
        self._state = gate.on_clock(self._state, now_ns)
        if self._base.health().state == LinkState.LOST:
            self._state = gate.latched(self._state, Latch.LINK)
        self._send_due()
        if now_ns - self._record.published_ns >= PUBLISH_NS:
            self._publish()
        if self._end_ns and (now_ns >= self._end_ns or self._base.health().state == LinkState.LOST or self._at_rest()):
            self._loop.stop()

    def _at_rest(self) -> bool:
        twist = self._record.odometry
        # The odometry must be newer than the last zeros' first effect: two base ticks after the latch.
        fresh = self._record.odometry_received_ns > self._end_ns - LAST_ZEROS_NS + 120 * NS_PER_MS
        still = abs(twist.vx) < REST_M_PER_S and abs(twist.vy) < REST_M_PER_S and abs(twist.omega) < REST_RAD_PER_S
        return fresh and still

    def _send_due(self) -> None:
        now_ns = monotonic_ns()
        # Here, where all ways out meet: whatever woke a frozen gate first, nothing leaves before this is judged.
        self._state = gate.on_own_pause(self._state, now_ns - self._ran_ns)
        self._ran_ns = now_ns
        if self._state.latch != self._told:
            self._told = self._state.latch
            cause = self._base.health().cause if self._told == Latch.LINK else ""
            text = ": ".join(filter(None, (gate.LATCH_TEXT[self._told], cause)))
            fault = "" if self._told == Latch.EOF else gate.LATCH_FAULT.get(self._told, "F36")
            self._log.latched(now_ns, self._state.seq, self._state.tick, int(self._told), text, fault)
            self._status.say("latched", latch=int(self._told), text=text)
            self._publish()
        wanted = gate.due(self._state, now_ns)
        if wanted is None:
            return
        left_ns = self._base.sent_ns
        really = self._base.command(wanted)
        self._state = gate.sent(self._state, wanted, now_ns)
        if self._base.sent_ns != left_ns:  # over a lost link nothing leaves
            self._record = replace(self._record, sent=really, sent_ns=now_ns)
            self._log.sent(now_ns, really)
        self._publish()

    def _take(self, samples: tuple[Stamped[BaseFeed], ...]) -> None:
        for sample in samples:
            value, at_ns = sample.value, sample.received_ns
            self._log.inbound(sample)
            if isinstance(value, BasePose):
                self._record = replace(
                    self._record,
                    pose=value.pose,
                    pose_valid=value.valid,
                    pose_received_ns=at_ns,
                    pose_seq=self._record.pose_seq + 1,
                )
            elif isinstance(value, BaseOdometry):
                self._record = replace(
                    self._record,
                    odometry=value.twist,
                    odometry_received_ns=at_ns,
                    odometry_seq=self._record.odometry_seq + 1,
                )
                self._state = gate.on_speed(self._limits, self._state, value.twist)
            elif isinstance(value, BaseReport):
                self._record = replace(self._record, status=value.status, status_received_ns=at_ns)
            else:
                # The object's pose is logged and goes no further; the echo of our own commands is for the driver.
                assert isinstance(value, SliderPose | CommandEcho)
        if samples:
            self._publish()

    def _publish(self) -> None:
        self._record = replace(
            self._record,
            newest_inbound_ns=self._base.newest_inbound_ns,
            newest_pong_ns=self._base.newest_pong_ns,
            latched=self._state.latch != Latch.NONE,
            latch_cause=int(self._state.latch),
            published_ns=monotonic_ns(),
        )
        self._record_out.publish(pack_base_record(self._record))


def main() -> int:
    """Run the gate; the exit code is that of the error when the base could not be opened."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # only control's EOF ends the gate
    set_timer_slack_1ns()
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=GateJob)
    status = StatusPipe(job.status_fd)
    try:
        base: Base = find_kind("base", job.base.kind, job.kind_folder).from_rig(
            job.base.url,
            {
                "topics": job.base.topics,
                "pose_source": job.base.pose_source,
                "base_from_marker": job.frames.base_from_marker,
                **job.base.options,
            },
        )
        info = base.open()
        base.start()
    except PushError as error:  # the process ends, and with it whatever was open
        status.error(error)
        return error.exit_code
    process = GateProcess(job, base, status)
    realtime = try_realtime(PRIORITY)
    status.say("ready", info=msgspec.to_builtins(info), realtime=realtime)
    gc.collect()
    gc.freeze()
    lock_memory()
    process.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
