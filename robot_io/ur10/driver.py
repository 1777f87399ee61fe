"""A UR arm, held still: its driver, and the reader that the control process uses.

The `ur_rtde` wheel runs in a child process that publishes a shared record for every packet of the controller;
abort, hang and crash of that process all look the same from here: the record grows old. The child never connects
again by itself.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Self

import msgspec

from robot_io.clock import NS_PER_S
from robot_io.driver import DriverBase, no_more_options
from robot_io.errors import DeviceError, DeviceUnreachable
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.ipc.spawn import Child, spawn
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
from robot_io.ur10.generation import wanted_model
from robot_io.ur10.job import ArmJob, Hold

START_WITHIN_S: dict[Hold, float] = {"monitor": 7.0, "servo": 10.0}
"""From spawn to ready, 2 s of it for looking up a name. The wheel itself waits 5 s for its control script before it
says why."""
STOP_WITHIN_S = 3.0


def spawn_arm(job: ArmJob) -> Child:
    """Start the arm's process; it is ready within START_WITHIN_S, dies with the calling thread, ends on SIGTERM."""
    fds = [job.record_fd] if job.run_fd < 0 else [job.record_fd, job.run_fd]
    return spawn("arm", "robot_io.ur10.child", job, fds)


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
    """A UR arm that holds still: joint positions (rad) and velocities (rad/s).

    CB3 (UR3, UR5, UR10; PolyScope 3.15 or a newer 3.x) at 125 Hz, e-Series (UR3e, UR5e, UR10e, UR16e; PolyScope 5.4 or
    a newer 5.x) at 500 Hz: which one it is, the controller says.

    host: the controller's name or address; ports 29999 (dashboard) and 30004 (RTDE) are used, for `servo` 30003 too.
    hold: `"monitor"` sends nothing that could move the arm, and the controller's own position loop holds it;
        `"servo"` commands the joints measured at the start, with the controller-side watchdog armed, and refuses to
        begin while a program plays or the arm moves.
    model: which arm it must be (`"UR10e"`); empty for any.
    held_pose_rad: six joints (rad) at which `servo` must find the arm; None: wherever it is.
    held_pose_tolerance_rad: how far each joint may be from that pose at the start (rad).

    For one thread, the one that calls `open`: the arm's process dies with it. There is no `fileno`: call `drain` at the
    pace of your loop.
    """

    def __init__(
        self,
        host: str,
        *,
        hold: Hold = "monitor",
        model: str = "",
        held_pose_rad: Joints | None = None,
        held_pose_tolerance_rad: float = 0.05,
    ) -> None:
        self.host = host
        self._hold: Hold = hold
        self._model = model
        self._held_pose_rad = held_pose_rad
        self._tolerance_rad = held_pose_tolerance_rad
        self._child: Child | None = None
        self._link: ArmLink | None = None
        self._flowing = False
        self._last = NO_ARM
        self._drained = 0
        self._first = NO_ARM
        self._stopped = False

    @classmethod
    def from_rig(cls, address: str, options: Mapping[str, Any]) -> Self:
        """Return the arm at a rig's host; `options` has how it is held and where, its `model`, and no others."""
        left: dict[str, Any] = dict(options)
        model = wanted_model(left)
        left.pop("model", None)
        shared = {name: left.pop(name) for name in ("hold", "held_pose_rad", "held_pose_tolerance_rad") if name in left}
        no_more_options("ur", left)
        return cls(address, model=model, **shared)

    def open(self) -> DeviceInfo:
        """Start the arm's process and wait until it has published; at most 7 s, `servo` 10 s.

        Raises DeviceUnreachable (no answer, no packets, not ready in time), DeviceProtocolError (no UR, another
        model or PolyScope), DeviceNotReady (off, stopped by safety; for `servo` also moving, playing a program or
        elsewhere) or DeviceError (open already). That process dies with the thread that calls this: open the arm in
        one that lives as long as you need it.
        """
        if self._child is not None:
            raise DeviceError("the arm is already open", where=self.host)
        record = TypedRecord.create("arm", ARM_RECORD)
        job = ArmJob(
            self.host, self._hold, record.fd, os.getpid(), self._model, self._held_pose_rad, self._tolerance_rad
        )
        try:
            self._link = ArmLink(record.fd)
            self._stopped = False
            self._last = self._first = NO_ARM
            self._child = spawn_arm(job)
            return self._await_ready(self._child)
        except BaseException:
            self.close()
            raise

    def start(self) -> None:
        """Let samples through from now on; returns at once, as the arm's process publishes since `open`.

        Raises DeviceError when the arm is not open.
        """
        if self._child is None:
            raise DeviceError("the arm is not open", where=self.host)
        self._first = self.read() or NO_ARM
        self._drained = self._first.packets
        self._flowing = True

    def read(self) -> ArmRecord | None:
        """Return the newest record, however old (`changed_ns` says how old); None before the first. Never blocks."""
        if self._link is not None:
            self._last = self._link.read() or self._last
        return self._last if self._last.published_ns else None

    def drain(self) -> tuple[Stamped[JointState], ...]:
        """Return the newest state (rad, rad/s) when there is one since the last call, else nothing.

        At most one: states that came in between are not kept, and missing in `seq`. Never blocks, never raises.
        """
        record = self.read()
        if not self._flowing or record is None or record.packets == self._drained:
            return ()
        self._drained = record.packets
        return (Stamped(record.joints, record.packets, record.changed_ns, record.joints.controller_time_s),)

    def health(self) -> DeviceHealth:
        """Return the link state as the arm's process last said, LOST when that process is gone.

        Counts `packets`; the rate (Hz) is that of the controller's packets since `start`: 125 (CB3) or 500 (e-Series).
        """
        record = self.read() or NO_ARM
        state, cause = LinkState(record.link), ""
        if self._child is None or self._stopped:
            state = LinkState.CLOSED
        elif self._child.process.poll() is not None:
            state, cause = LinkState.LOST, f"the arm's process {self._child.how_it_ended()}"
        if state == LinkState.LOST or record.error != ArmError.NONE:
            cause = ArmError(record.error).name.lower() if record.error else cause
        if state == LinkState.UP and not self._flowing:
            cause = cause or "it gives no samples yet: call start()"
        return DeviceHealth(state, cause, {"packets": record.packets}, self._rate_hz(record))

    def stop(self) -> None:
        """End the arm's process (3 s, then it is killed). With `hold="monitor"` nothing is sent to the arm."""
        self._flowing = False
        if self._child is not None and not self._stopped:
            self._stopped = True
            self._child.stop(STOP_WITHIN_S)

    def close(self) -> None:
        """Stop, at most 3 s, and release everything. Idempotent."""
        self.stop()
        if self._child is not None:
            self._child.close()
            self._child = None
        if self._link is not None:
            self._link.close()
            self._link = None

    def _await_ready(self, child: Child) -> DeviceInfo:
        within_s = START_WITHIN_S[self._hold]
        if child.wait_ready(within_s):
            assert child.ready is not None, "it is"
            return msgspec.convert(child.ready["info"], DeviceInfo)
        if child.errors:
            raise child.errors.pop(0)  # its traceback holds the child: kept in there, neither would be freed
        if child.status.open:
            raise DeviceUnreachable(
                f"the arm was not ready within {within_s:g} s", where=self.host, do="Check the robot, try again"
            )
        child.end(STOP_WITHIN_S)
        raise DeviceUnreachable(
            f"the arm's process {child.how_it_ended()} before it was ready", where=self.host, do="Try again"
        )

    def _rate_hz(self, record: ArmRecord) -> float:
        span_ns = record.changed_ns - self._first.changed_ns
        return (record.packets - self._first.packets) * NS_PER_S / span_ns if span_ns > 0 else 0.0
