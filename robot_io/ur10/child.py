"""The arm's own process: reads a UR with the ur_rtde wheel and publishes each of its packets as one shared record.

`python -m robot_io.ur10.child` with an `ArmJob` on stdin. It is a process because the wheel can abort, hang or
hold the interpreter; whoever reads the record needs to know none of that, only its age. With `hold = "monitor"`
nothing is sent to the controller but the request for data. It never connects again by itself: when the link is
lost it says so in the record, reports it, and ends.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import time
from typing import NoReturn

import msgspec
from msgspec.structs import replace

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.errors import DeviceError, DeviceNotReady, DeviceUnreachable, PushError
from robot_io.ipc.process import (
    die_with_parent,
    forbid_new_descriptors,
    is_hung_up,
    lock_memory,
    set_timer_slack_1ns,
    starting_threads_at,
    try_realtime,
)
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.ipc.status import StatusPipe
from robot_io.look_up import addresses_of
from robot_io.messages import ArmError, ArmRecord, LinkState
from robot_io.ur10.job import ArmJob
from robot_io.ur10.preflight import preflight
from robot_io.ur10.reader import ArmReader
from robot_io.ur10.servo import ActiveHold

PUBLISH_NS = 8 * NS_PER_MS
"""A record is written for every new packet, and at least this often."""
MOST_POLL_NS = 2 * NS_PER_MS
"""A new packet is looked for this often, and at least twice in a cycle of the controller."""
FATAL = (ArmError.LINK_LOST, ArmError.TIME_WENT_BACK)

_CAUSE = {
    ArmError.LINK_LOST: "the RTDE connection is gone",
    ArmError.TIME_WENT_BACK: "the controller's clock jumped back: it was restarted",
    ArmError.NOT_FINITE: "the controller reports joints that are not numbers",
    ArmError.SERVO_STOPPED: "the control script no longer runs",
    ArmError.SERVO_NOT_HOLDING: "the joints left the held target",
    ArmError.SERVO_STALE: "no new packet for 0.1 s",
}

RECEIVER_PRIORITY = 60
"""SCHED_FIFO priority of the wheel's own thread, which starved for 40 ms looks like a controller that has stopped.

Below every priority of this program, because that thread is not ours."""


class Ending:
    """Takes SIGTERM from now on, for the loop to act on: a control script that has begun must be ended, not left."""

    def __init__(self) -> None:
        self.asked = False
        signal.signal(signal.SIGTERM, self._on_sigterm)

    def _on_sigterm(self, _signal: int, _frame: object) -> None:
        self.asked = True


class ArmProcess:
    """The loop: look for a packet, publish, and in servo mode command the target."""

    def __init__(
        self, job: ArmJob, record: TypedRecord[ArmRecord], reader: ArmReader, hold: ActiveHold | None, ending: Ending
    ) -> None:
        self._job = job
        self._record = record
        self._reader = reader
        self._hold = hold
        self._ending = ending
        self._pid = os.getpid()
        self._cycle_ns = reader.generation.cycle_ns
        self._poll_ns = min(MOST_POLL_NS, self._cycle_ns // 2)
        self._published_ns = 0
        self._publish(monotonic_ns(), LinkState.UP, reader.error)

    def run(self) -> None:
        """Publish until SIGTERM or the end of the run; then end cleanly.

        Raises DeviceError when the link or the holding is lost.
        """
        deadline_ns = monotonic_ns()
        command_ns = deadline_ns
        while not (self._ending.asked or is_hung_up(self._job.run_fd)):
            now_ns = monotonic_ns()
            fresh = self._reader.poll(now_ns)
            error = self._reader.error
            if error in FATAL:
                self._give_up(error)
            if self._hold is not None and now_ns >= command_ns:
                command_ns = max(command_ns + self._cycle_ns, now_ns - self._cycle_ns)
                error = self._hold.tick(self._reader, now_ns)
                if error != ArmError.NONE:
                    self._give_up(error)
            if fresh or now_ns - self._published_ns >= PUBLISH_NS:
                self._publish(now_ns, LinkState.UP, error)
            deadline_ns = _sleep_until_next(deadline_ns, self._poll_ns)
        if self._hold is not None:
            self._hold.end()
        self._publish(monotonic_ns(), LinkState.CLOSED, ArmError.NONE)

    def _give_up(self, error: ArmError) -> NoReturn:
        """Leave the last packet with its fault in the record, and end; the watchdog stops a control script."""
        link = LinkState.LOST if error in FATAL else LinkState.UP
        self._publish(monotonic_ns(), link, error)
        kind = DeviceUnreachable if error in FATAL else DeviceNotReady
        raise kind(_CAUSE[error], where=self._job.host, do="Look at the arm, then start again")

    def _publish(self, now_ns: int, link: LinkState, error: ArmError) -> None:
        reader = self._reader
        assert reader.joints is not None, "the loop starts after the first packets"
        self._published_ns = now_ns
        servo = self._hold is not None and link == LinkState.UP and error == ArmError.NONE
        record = ArmRecord(reader.joints, reader.packets, now_ns, reader.changed_ns, link, error, servo, self._pid)
        self._record.publish(record)


def _sleep_until_next(deadline_ns: int, poll_ns: int) -> int:
    """Sleep to the next absolute deadline, skipping the ones already missed; return it."""
    now_ns = monotonic_ns()
    deadline_ns += poll_ns
    if deadline_ns <= now_ns:
        deadline_ns += (now_ns - deadline_ns) // poll_ns * poll_ns + poll_ns
    time.sleep((deadline_ns - now_ns) / NS_PER_S)
    return deadline_ns


def hold_arm(job: ArmJob, record: TypedRecord[ArmRecord], status: StatusPipe) -> NoReturn:
    """Connect, report ready, publish until told to end; then end this process. Raises DeviceError."""
    job = replace(job, host=addresses_of(job.host, where=job.host)[0])  # the wheel would look it up without a deadline
    info, generation = preflight(job.host, job.model)
    threads_priority = RECEIVER_PRIORITY if job.realtime_priority > 0 else 0
    with starting_threads_at(threads_priority):
        reader = ArmReader(job.host, generation)
    reader.wait_flowing()
    ending = Ending()  # before this, SIGTERM ends the process at once, in a wheel that hangs as well
    hold = None
    if job.hold == "servo":
        with starting_threads_at(threads_priority):
            hold = ActiveHold(job.host, reader, job.held_pose_rad, job.held_pose_tolerance_rad)
    forbid_new_descriptors()  # the wheel's own thread would connect again and restart its script
    gc.freeze()
    gc.disable()
    lock_memory()
    realtime = job.realtime_priority > 0 and try_realtime(job.realtime_priority)
    if hold is not None:
        hold.begin()  # from here on its watchdog waits 0.1 s at most: the slow preparations are done
    process = ArmProcess(job, record, reader, hold, ending)  # publishes the first record
    status.say("ready", info=msgspec.to_builtins(info), realtime=realtime)
    process.run()
    _leave(0)


def _leave(code: int) -> NoReturn:
    """End while the wheel's objects still live: their destructors sleep, and have been seen to crash."""
    os._exit(code)  # the kernel closes everything


def main() -> NoReturn:
    """Run the job on stdin. Exit code 0 after SIGTERM, 4 for a device error, 1 otherwise."""
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=ArmJob)
    die_with_parent(job.parent_pid)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the launcher's to handle
    set_timer_slack_1ns()
    status = StatusPipe(job.status_fd)
    try:
        hold_arm(job, TypedRecord(job.record_fd, ARM_RECORD), status)
    except PushError as error:
        status.error(error)
        # In here: after this block the error lets go of the frames that hold the wheel's objects.
        _leave(error.exit_code)
    except Exception as error:  # the last line of a process: whatever it was, the parent hears of it
        status.error(DeviceError(f"the arm's process failed: {error!r}", where=job.host))
        _leave(1)


if __name__ == "__main__":
    main()
