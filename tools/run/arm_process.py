"""The process of an external arm driver: `python -m tools.run.arm_process` (job on stdin). Publishes one shared record.

The driver may block or crash without affecting the loop, which only sees a record that gets old.
"""

from __future__ import annotations

import os
import signal
import sys
import time

import msgspec

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.driver import Driver
from robot_io.errors import DeviceUnreachable, PushError
from robot_io.ipc.process import die_with_parent, is_hung_up, lock_memory, set_timer_slack_1ns, try_realtime
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.ipc.status import StatusPipe
from robot_io.kinds import build_driver, started
from robot_io.messages import ArmRecord, ArmState, JointState, LinkState
from robot_io.rig.config import rig_from_toml
from robot_io.tick import link_number
from tools.run.jobs import ArmKindJob

PRIORITY = 81
PERIOD_NS = 4 * NS_PER_MS
"""How often the driver is drained and a record is published."""
MOST_STATE = 255
"""The largest that a record holds; a driver that says anything else says nothing."""


def main() -> int:
    """Serve until SIGTERM or the end of the run; return the exit code, the error's if the arm could not be opened."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = msgspec.json.decode(sys.stdin.buffer.read(), type=ArmKindJob)
    die_with_parent(job.launcher_pid)
    set_timer_slack_1ns()
    status = StatusPipe(job.status_fd)
    arm = rig_from_toml(job.rig_toml).arm
    shared = {
        "hold": arm.hold,
        "held_pose_rad": arm.held_pose_rad,
        "held_pose_tolerance_rad": arm.held_pose_tolerance_rad,
    }
    asked: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: asked.append(number))
    try:
        options = shared | arm.options
        driver: Driver[JointState] = build_driver("arm", arm.kind, arm.host, options, folder=job.kind_folder)
        info = started(driver, "arm", arm.kind)
    except PushError as error:
        status.error(error)
        return error.exit_code
    status.say("ready", info=msgspec.to_builtins(info), realtime=try_realtime(PRIORITY))
    lock_memory()
    record = TypedRecord(job.record_fd, ARM_RECORD)
    newest = ArmRecord(child_pid=os.getpid())
    try:
        while not (asked or is_hung_up(job.run_fd)):
            newest = publish(driver, record, newest, servo=arm.hold == "servo")
            if newest.link == LinkState.LOST:
                lost = DeviceUnreachable(
                    driver.health().cause or "its link is lost", where=arm.host, do="Check the arm"
                )
                status.error(lost)
                return lost.exit_code
            time.sleep(PERIOD_NS / NS_PER_S)
    finally:
        driver.stop()
        driver.close()
    return 0


def publish(driver: Driver[JointState], record: TypedRecord[ArmRecord], before: ArmRecord, *, servo: bool) -> ArmRecord:
    """Publish the driver's newest state, even if it has not changed; return it."""
    samples, link, now_ns = driver.drain(), link_number(driver.health().state), monotonic_ns()
    newest = before
    if samples:
        sample = samples[-1]
        arrived = min(sample.received_ns, now_ns)  # a time stamp in the future would never get old
        joints = sample.value
        if not 0 <= joints.state <= MOST_STATE:
            joints = msgspec.structs.replace(joints, state=int(ArmState.UNKNOWN))
        newest = msgspec.structs.replace(before, joints=joints, packets=sample.seq, changed_ns=arrived)
    holds = servo and link == LinkState.UP and newest.joints.state == ArmState.HOLDING
    newest = msgspec.structs.replace(newest, link=link, servo=holds, published_ns=now_ns)
    record.publish(newest)
    return newest


if __name__ == "__main__":
    sys.exit(main())
