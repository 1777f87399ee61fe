"""The UR10, held still: its driver, and the reader that the control process uses.

    with Ur10("127.0.0.10") as arm:                 # hold="monitor": nothing is ever sent that could move it
        time.sleep(0.1)
        for sample in arm.drain():
            print(sample.value.position)            # rad

The wheel runs in a child process (`child`) that publishes a shared record; abort, hang and crash of that
process all look the same from here: the record grows old.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
from typing import IO

import msgspec

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.driver import DriverBase
from robot_io.errors import DeviceError, DeviceUnreachable
from robot_io.ipc.process import fresh_interpreter
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.messages import (
    NO_ARM,
    ArmError,
    ArmRecord,
    DeviceHealth,
    DeviceInfo,
    Joints,
    JointState,
    LinkState,
    Stamped,
)
from robot_io.ur10.job import ArmJob, Hold, parse_status

START_WITHIN_S: dict[Hold, float] = {"monitor": 5.0, "servo": 8.0}
"""From spawn to ready. The wheel itself waits 5 s for its control script before it says why."""
STOP_WITHIN_S = 3.0


def spawn_child(
    host: str,
    *,
    hold: Hold,
    record_fd: int,
    status_fd: int | None = None,
    held_pose_rad: Joints | None = None,
    held_pose_tolerance_rad: float = 0.05,
    stderr: int | IO[bytes] = subprocess.DEVNULL,
) -> subprocess.Popen[bytes]:
    """Start the arm's process for the robot at `host`; it publishes into `record_fd` (a `SharedRecord`).

    Angles in rad. It reports on `status_fd` (the write end of a pipe; close yours after this call) with lines
    for `job.parse_status`, dies with the calling thread (prctl(2) PR_SET_PDEATHSIG), and ends on SIGTERM.
    `stderr` takes the wheel's own messages. Nothing here waits: enforce a deadline for the first status line.
    """
    job = ArmJob(host, hold, record_fd, os.getpid(), held_pose_rad, held_pose_tolerance_rad, status_fd)
    command, environment = fresh_interpreter("robot_io.ur10.child")
    child = subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        pass_fds=[fd for fd in (record_fd, status_fd) if fd is not None],
        start_new_session=True,  # Ctrl-Z and a closed terminal are for the caller, not for its whole group
    )
    assert child.stdin is not None, "stdin is a pipe"
    with contextlib.suppress(BrokenPipeError):  # it died at once: its status or its exit tells
        child.stdin.write(msgspec.json.encode(job))
        child.stdin.close()
    return child


def end_child(child: subprocess.Popen[bytes], within_s: float = STOP_WITHIN_S) -> int:
    """Ask the process to end (SIGTERM), kill it when it has not within `within_s`; return its exit code."""
    if child.poll() is None:
        child.terminate()
        child.send_signal(signal.SIGCONT)  # a stopped process acts on SIGTERM only when it continues
        try:
            return child.wait(within_s)
        except subprocess.TimeoutExpired:
            child.kill()
    return child.wait()


class ArmLink:
    """The newest record of the arm's process, from a descriptor made by `TypedRecord.create`."""

    def __init__(self, record_fd: int) -> None:
        self._record = TypedRecord(record_fd, ARM_RECORD)
        self._count = 0
        self._newest: ArmRecord | None = None

    def read(self) -> ArmRecord | None:
        """Return the newest record, however old; None before the first. Never blocks."""
        if self._record.count != self._count:
            read = self._record.read()
            if read is not None:
                self._count, self._newest = read
        return self._newest

    def close(self) -> None:
        """Unmap the record and close its descriptor; idempotent."""
        self._record.close()


class Ur10(DriverBase):
    """Driver of a UR10 (CB3, PolyScope 3.15) that holds still. See `Driver` for the contract.

    `hold="monitor"` sends nothing that could move the arm; the controller's own position loop holds it.
    `hold="servo"` commands the joints measured at start, with the controller-side watchdog armed, and refuses
    to begin while a program plays or more than `held_pose_tolerance_rad` from `held_pose_rad` (rad).
    """

    def __init__(
        self,
        host: str,
        *,
        hold: Hold = "monitor",
        held_pose_rad: Joints | None = None,
        held_pose_tolerance_rad: float = 0.05,
    ) -> None:
        self.host = host
        self._hold: Hold = hold
        self._held_pose_rad = held_pose_rad
        self._tolerance_rad = held_pose_tolerance_rad
        self._child: subprocess.Popen[bytes] | None = None
        self._link: ArmLink | None = None
        self._flowing = False
        self._last = NO_ARM
        self._drained = 0
        self._first = NO_ARM
        self._exit_code: int | None = None

    def open(self) -> DeviceInfo:
        """Start the arm's process and wait until it has published (5 s, servo 8 s). Raises DeviceError.

        That process dies with the thread that calls this: open the arm in one that lives as long as you need it.
        """
        if self._child is not None:
            raise DeviceError("the arm is already open", where=self.host)
        record = TypedRecord.create("arm", ARM_RECORD)
        listen_fd, status_fd = os.pipe()
        try:
            self._link = ArmLink(record.fd)
            self._exit_code = None
            self._last = self._first = NO_ARM
            self._child = spawn_child(
                self.host,
                hold=self._hold,
                record_fd=record.fd,
                status_fd=status_fd,
                held_pose_rad=self._held_pose_rad,
                held_pose_tolerance_rad=self._tolerance_rad,
            )
            os.close(status_fd)
            status_fd = -1
            return self._await_ready(listen_fd)
        except BaseException:
            self.close()
            raise
        finally:
            os.close(listen_fd)
            if status_fd >= 0:
                os.close(status_fd)

    def start(self) -> None:
        """Let samples through from now on; the arm's process publishes since `open`."""
        if self._child is None:
            raise DeviceError("the arm is not open", where=self.host)
        self._first = self.read() or NO_ARM
        self._drained = self._first.packets
        self._flowing = True

    def read(self) -> ArmRecord | None:
        """Return the newest record, however old; None before the first."""
        if self._link is not None:
            self._last = self._link.read() or self._last
        return self._last if self._last.published_ns else None

    def drain(self) -> tuple[Stamped[JointState], ...]:
        """Return the newest state when there is one since the last call (joints in rad), else nothing."""
        record = self.read()
        if not self._flowing or record is None or record.packets == self._drained:
            return ()
        self._drained = record.packets
        return (Stamped(record.joints, record.packets, record.changed_ns, record.joints.controller_time_s),)

    def health(self) -> DeviceHealth:
        """Return the link state as the arm's process last said, LOST when that process is gone."""
        record = self.read() or NO_ARM
        state, cause = LinkState(record.link), ""
        if self._child is None or self._exit_code is not None:
            state = LinkState.CLOSED
        elif (code := self._child.poll()) is not None:
            state, cause = LinkState.LOST, _how_it_ended(code)
        if state == LinkState.LOST or record.error != ArmError.NONE:
            cause = ArmError(record.error).name.lower() if record.error else cause
        return DeviceHealth(state, cause, {"packets": record.packets}, self._rate_hz(record))

    def stop(self) -> None:
        """End the arm's process (3 s, then it is killed). With `hold="monitor"` nothing is sent to the arm."""
        self._flowing = False
        if self._child is not None and self._exit_code is None:
            self._exit_code = end_child(self._child)

    def close(self) -> None:
        """Stop and release everything; idempotent."""
        self.stop()
        self._child = None
        if self._link is not None:
            self._link.close()
            self._link = None

    def _await_ready(self, listen_fd: int) -> DeviceInfo:
        assert self._child is not None, "spawned just before"
        within_s = START_WITHIN_S[self._hold]
        deadline_ns = monotonic_ns() + int(within_s * NS_PER_S)
        line = b""
        while not line.endswith(b"\n"):
            left_ms = (deadline_ns - monotonic_ns()) / 1e6
            poll = select.poll()
            poll.register(listen_fd, select.POLLIN)
            if left_ms <= 0 or not poll.poll(left_ms):
                raise DeviceUnreachable(
                    f"the arm was not ready within {within_s:g} s", where=self.host, do="Check the robot, try again"
                )
            data = os.read(listen_fd, 65536)
            if not data:
                ended = _how_it_ended(self._child.wait(STOP_WITHIN_S))
                raise DeviceUnreachable(f"{ended} before it was ready", where=self.host, do="Try again")
            line += data
        return parse_status(line.split(b"\n", 1)[0]).info

    def _rate_hz(self, record: ArmRecord) -> float:
        span_ns = record.changed_ns - self._first.changed_ns
        return (record.packets - self._first.packets) * NS_PER_S / span_ns if span_ns > 0 else 0.0


def _how_it_ended(code: int) -> str:
    if code < 0:
        return f"the arm's process was ended by {signal.Signals(-code).name}"
    return f"the arm's process ended with code {code}"
