"""The devices of a rig as `push calibrate` uses them: opened, listened to and closed; nothing is commanded."""

from __future__ import annotations

import contextlib
import math
import select
import time
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.driver import Sensor
from robot_io.errors import DeviceNotReady, DeviceUnreachable, UsageError
from robot_io.kinds import open_device
from robot_io.messages import (
    BaseOdometry,
    BasePose,
    BodyTwist,
    CommandEcho,
    Joints,
    JointState,
    LinkState,
    SensorWrench,
    SliderPose,
    Stamped,
)
from robot_io.ridgeback.look import RidgebackLook
from robot_io.rig.config import RigConfig
from robot_io.ur10.look import receive
from tools.calibrate.estimators.estimate import Array
from tools.calibrate.estimators.steady import table
from tools.kinds import is_shipped

SILENT_S = 1.0
WAIT_S = 0.05
FIRST_WITHIN_S = 4.0
LONGEST_S = 600.0
"""Nobody drives a base for longer to calibrate it."""


class SensorFeed:
    """An open sensor, whose readings are thrown away while nothing is measured."""

    def __init__(self, driver: Sensor, where: str) -> None:
        self._driver = driver
        self._where = where

    def idle(self) -> None:
        """Take what has come, and forget it."""
        self._driver.drain()

    def collect(self, seconds: float) -> tuple[Array, Array]:
        """Return times (s) and readings (N, N*m) of the next `seconds`. Raises DeviceUnreachable where none come."""
        self.idle()
        began_ns = newest_ns = monotonic_ns()
        samples: list[Stamped[SensorWrench]] = []
        while newest_ns - began_ns < seconds * NS_PER_S:
            self._wait()
            samples += self._driver.drain()
            newest_ns = samples[-1].received_ns if samples else began_ns
            if monotonic_ns() - newest_ns > SILENT_S * NS_PER_S:
                cause = self._driver.health().cause or f"no reading for {SILENT_S:g} s"
                raise DeviceUnreachable(cause, where=self._where, do="`push doctor` looks at the sensor")
        return table(samples)

    def _wait(self) -> None:
        try:
            select.select([self._driver.fileno()], [], [], WAIT_S)
        except (OSError, ValueError):  # closed: its health says why
            if self._driver.health().state == LinkState.LOST:
                time.sleep(WAIT_S)


@contextlib.contextmanager
def open_sensor(rig: RigConfig, folder: str) -> Iterator[SensorFeed]:
    """Open the rig's sensor and let it stream. Raises DeviceError as its driver does."""
    with open_device("ft", rig.ft.kind, rig.ft.port, rig.ft.options, folder=folder) as driver:
        yield SensorFeed(driver, rig.ft.port or rig.ft.kind)


def arm_joints(rig: RigConfig, folder: str) -> Joints:
    """Return the arm's joints, rad. Raises DeviceError, and DeviceNotReady while it moves."""
    if is_shipped("arm", rig.arm.kind):
        packets = receive(rig.arm.host)
        moved = max(abs(a - b) for a, b in zip(packets[0].position, packets[-1].position, strict=True))
        if moved > rig.limits.drift_hold_rad / 4:
            raise DeviceNotReady("the arm still moves", where=rig.arm.host, do="Hold it still, and try again")
        return packets[-1].position
    with open_device("arm", rig.arm.kind, rig.arm.host, rig.arm.options, folder=folder) as driver:
        until_s = time.monotonic() + FIRST_WITHIN_S
        while time.monotonic() < until_s:
            states = [sample.value for sample in driver.drain() if isinstance(sample.value, JointState)]
            if states:
                return states[-1].position
            time.sleep(WAIT_S)
    raise DeviceUnreachable("no joints came", where=rig.arm.kind)


class BaseHeard(NamedTuple):
    """What came of a base: poses (x, y, yaw, WORLD, in rows) of its markers or itself, and of something else."""

    base: Array
    other: Array
    odometry: tuple[BodyTwist, ...]
    commands: tuple[BodyTwist, ...]


def hear_base(
    rig: RigConfig, seconds: float, *, markers: bool = False, other: str = "", until: Callable[[], bool] | None = None
) -> BaseHeard:
    """Listen to the base for `seconds`, and until `until` is true.

    markers: give the poses of the motion-capture markers themselves. other: topic of a second body (m, WORLD).
    Raises DeviceError, and UsageError for a base whose place another kind of driver or no motion capture tells.
    """
    if not is_shipped("base", rig.base.kind):
        raise UsageError(
            f"`{rig.base.kind}` is not of this program, which cannot listen to it without commanding it",
            where=f"rig {rig.name!r}",
            do="Measure by hand and write the value into the rig (docs/frames-and-signs.md)",
        )
    if rig.base.pose_source != "mocap":
        raise UsageError(
            f'base.pose_source = "{rig.base.pose_source}" tells no place in the room',
            where=f"rig {rig.name!r}",
            do='Calibrate with motion capture: --set base.pose_source="mocap"',
        )
    topics = replace(rig.base.topics, slider_pose=other)
    offset = (0.0, 0.0, 0.0) if markers else rig.frames.base_from_marker
    with RidgebackLook(rig.base.url, topics, "mocap", offset) as look:
        if until is None:
            heard = look.listen(seconds, seconds + FIRST_WITHIN_S)
        else:
            heard = look.listen(seconds, LONGEST_S, until)
    if heard.why_silent:
        topic, why = next(iter(heard.why_silent.items()))
        raise DeviceNotReady(f"{topic}: {why or 'nothing came'}", where=rig.base.url, do="`push doctor` looks at it")
    values = [sample.value for sample in heard.samples]
    return BaseHeard(
        _rows([(v.pose.x, v.pose.y, v.pose.yaw) for v in values if isinstance(v, BasePose) and not v.flaw]),
        _rows([(v.pose.x, v.pose.y, v.pose.yaw) for v in values if isinstance(v, SliderPose) and not v.flaw]),
        tuple(v.twist for v in values if isinstance(v, BaseOdometry)),
        tuple(v.twist for v in values if isinstance(v, CommandEcho)),
    )


def _rows(poses: Sequence[tuple[float, float, float]]) -> Array:
    return np.array(poses, dtype=np.float64).reshape(-1, 3)


def direction_driven(heard: BaseHeard) -> tuple[float, float]:
    """Return the direction (rad, BODY) in which the base was driven and 1 sigma: by its commands, else its odometry."""
    commanded = [twist for twist in heard.commands if math.hypot(twist.vx, twist.vy) > 0.0]
    if commanded:
        return math.atan2(sum(t.vy for t in commanded), sum(t.vx for t in commanded)), 0.0
    moving = np.array([(t.vx, t.vy) for t in heard.odometry if math.hypot(t.vx, t.vy) > 0.02]).reshape(-1, 2)
    if len(moving) < 20:
        raise DeviceNotReady("no wheel odometry came of a base that drives", do="Drive while this is measured")
    mean = moving.mean(axis=0)
    error = float(moving.std(axis=0).max()) / math.sqrt(len(moving)) / float(np.hypot(*mean))
    return math.atan2(mean[1], mean[0]), error
