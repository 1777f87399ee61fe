"""The UR10, held still: its driver, and the reader that the control process uses.

    with Ur10("127.0.0.10") as arm:                 # hold="monitor": nothing is ever sent that could move it
        time.sleep(0.1)
        for sample in arm.drain():
            print(sample.value.position)            # rad

The wheel runs in a child process (`child`) that publishes a shared record; abort, hang and crash of that
process all look the same from here: the record grows old.
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
from robot_io.ur10.job import ArmJob, Hold

START_WITHIN_S: dict[Hold, float] = {"monitor": 5.0, "servo": 8.0}
"""From spawn to ready. The wheel itself waits 5 s for its control script before it says why."""
STOP_WITHIN_S = 3.0


def spawn_arm(job: ArmJob) -> Child:
    """Start the arm's process; it is ready within START_WITHIN_S, dies with the calling thread, ends on SIGTERM."""
    return spawn("arm", "robot_io.ur10.child", job, [job.record_fd])


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
        self._child: Child | None = None
        self._link: ArmLink | None = None
        self._flowing = False
        self._last = NO_ARM
        self._drained = 0
        self._first = NO_ARM
        self._stopped = False

    @classmethod
    def from_rig(cls, address: str, options: Mapping[str, Any]) -> Self:
        """Return the arm at a rig's host; `options` has how it is held and where, and no others."""
        left = dict(options)
        shared = {name: left.pop(name) for name in ("hold", "held_pose_rad", "held_pose_tolerance_rad") if name in left}
        no_more_options("ur", left)
        return cls(address, **shared)

    def open(self) -> DeviceInfo:
        """Start the arm's process and wait until it has published (5 s, servo 8 s). Raises DeviceError.

        That process dies with the thread that calls this: open the arm in one that lives as long as you need it.
        """
        if self._child is not None:
            raise DeviceError("the arm is already open", where=self.host)
        record = TypedRecord.create("arm", ARM_RECORD)
        job = ArmJob(self.host, self._hold, record.fd, os.getpid(), self._held_pose_rad, self._tolerance_rad)
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
        if self._child is None or self._stopped:
            state = LinkState.CLOSED
        elif self._child.process.poll() is not None:
            state, cause = LinkState.LOST, f"the arm's process {self._child.how_it_ended()}"
        if state == LinkState.LOST or record.error != ArmError.NONE:
            cause = ArmError(record.error).name.lower() if record.error else cause
        return DeviceHealth(state, cause, {"packets": record.packets}, self._rate_hz(record))

    def stop(self) -> None:
        """End the arm's process (3 s, then it is killed). With `hold="monitor"` nothing is sent to the arm."""
        self._flowing = False
        if self._child is not None and not self._stopped:
            self._stopped = True
            self._child.stop(STOP_WITHIN_S)

    def close(self) -> None:
        """Stop and release everything; idempotent."""
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
