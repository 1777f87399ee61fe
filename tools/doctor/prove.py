"""Proves that a base stops by itself: it is driven slowly, then nothing more is sent, and its stop is measured.

It moves 2 to 3 cm. Where it does not stop, it is sent zeros.
"""

from __future__ import annotations

import math
import signal
import statistics
import time
from types import FrameType

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.driver import Base, SharedBase
from robot_io.errors import DeviceError, DeviceNotReady
from robot_io.kinds import build_driver, started
from robot_io.messages import BaseOdometry, BodyTwist
from robot_io.rig.config import RigConfig
from robot_io.tick import REST_M_PER_S, REST_NS
from safety.checks.base_checks import IGNORE_SHARE
from safety.stopping import ALONE_S, WIRE_S
from tools.doctor.check import Check, Rows
from tools.places import base_proof

SPEED_M_PER_S = 0.02
DRIVE_S = 1.0
WATCH_S = 1.5
PERIOD_S = 0.02
REPORT_S = 0.04
"""A wheel odometry of 25 Hz tells of a stop this much later."""
LIMIT_S = ALONE_S + WIRE_S + REPORT_S
OLD_S = 24 * 3600.0
NAME = "timeout"
FIX = "Do not push: let base.topics.command pass the controller that stops the wheels when commands end (0.25 s)"
AGAIN = "`push doctor RIG --prove-base-timeout --move-robot` drives it 2 cm and measures"


def prove_base_timeout(rig: RigConfig, kind_folder: str) -> Check:
    """Drive the rig's base and measure its stop; return the row `base.timeout`. Never raises DeviceError."""
    rows = Rows("base")
    options = {
        "topics": rig.base.topics,
        "pose_source": rig.base.pose_source,
        "base_from_marker": rig.frames.base_from_marker,
        **rig.base.options,
    }
    base: Base = build_driver("base", rig.base.kind, rig.base.url, options, folder=kind_folder)
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        started(base, "base", rig.base.kind)
        if isinstance(base, SharedBase):
            base.take_command()
        _drive(base)
        stopped_after_s = _watch(base)
    except DeviceError as error:
        rows.error(NAME, error)
    else:
        _judge(rows, rig, stopped_after_s)
    finally:
        base.stop()
        base.close()
        signal.signal(signal.SIGTERM, before)
    return rows.of(NAME)


def proof_row(rig: RigConfig) -> Check:
    """Return the row `base.timeout` of a rig that was proved earlier, or never."""
    rows, age_s = Rows("base"), base_proof.age_s(rig)
    if age_s is None:
        rows.bad(NAME, "warning", "this base was never seen to stop by itself", AGAIN)
    elif age_s > OLD_S:
        told = f"it is {age_s / 3600.0:.0f} hours since this base was seen to stop by itself"
        rows.bad(NAME, "warning", told, AGAIN, age_s / 3600.0, OLD_S / 3600.0, "h")
    else:
        told = f"seen to stop by itself {age_s / 3600.0:.1f} hours ago"
        rows.ok(NAME, told, age_s / 3600.0, OLD_S / 3600.0, "h")
    return rows.of(NAME)


def _drive(base: Base) -> None:
    """Drive for DRIVE_S. Raises DeviceNotReady where the base does not follow."""
    wanted, speeds = BodyTwist(SPEED_M_PER_S), list[float]()
    began_s = time.monotonic()
    while (since_s := time.monotonic() - began_s) < DRIVE_S:
        if base.command(wanted) != wanted:
            raise DeviceNotReady(f"commands do not leave ({base.health().cause or 'the link is quiet'})")
        speeds += [speed for speed, _ in _speeds(base) if since_s > DRIVE_S / 2]
        time.sleep(PERIOD_S)
    if not speeds or statistics.median(speeds) < IGNORE_SHARE * SPEED_M_PER_S:
        raise DeviceNotReady(
            f"it does not move when told to go {SPEED_M_PER_S:g} m/s, so its stop proves nothing",
            do="Release the stop, end a joystick's override, and check base.topics.command",
        )


def _watch(base: Base) -> float | None:
    """Send nothing more; return after how long the base was at rest (s), None where it was not within WATCH_S."""
    last_ns, rest_ns = base.sent_ns, 0
    while monotonic_ns() - last_ns < WATCH_S * NS_PER_S:
        for speed, at_ns in _speeds(base):
            rest_ns = 0 if not speed < REST_M_PER_S else rest_ns or at_ns
            if rest_ns and at_ns - rest_ns >= REST_NS:
                return max(rest_ns - last_ns, 0) / NS_PER_S
        time.sleep(PERIOD_S / 4)
    return None


def _speeds(base: Base) -> list[tuple[float, int]]:
    return [
        (math.hypot(sample.value.twist.vx, sample.value.twist.vy), sample.received_ns)
        for sample in base.drain()
        if isinstance(sample.value, BaseOdometry)
    ]


def _judge(rows: Rows, rig: RigConfig, stopped_after_s: float | None) -> None:
    if stopped_after_s is None:
        told = f"still moving {WATCH_S:g} s after the last command; it was stopped by zeros"
        rows.bad(NAME, "failed", told, FIX, WATCH_S, LIMIT_S, "s")
        return
    told = f"driven at {SPEED_M_PER_S:g} m/s, it stood {stopped_after_s:.2f} s after the last command"
    if stopped_after_s > LIMIT_S:
        rows.bad(NAME, "failed", told, FIX, stopped_after_s, LIMIT_S, "s")
        return
    rows.ok(NAME, told, stopped_after_s, LIMIT_S, "s")
    if rig.base.level == "hardware":
        base_proof.save(rig, stopped_after_s)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt
