"""What `push watch` has heard so far, from reports of devices or of a run."""

from __future__ import annotations

from collections import deque

import msgspec

from control.settings import Settings
from robot_io.clock import NS_PER_MS, NS_PER_S
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseReport,
    BaseStatus,
    BodyTwist,
    JointState,
    LinkState,
    Stamped,
    Vector3,
)
from robot_io.rig.config import RigConfig
from robot_io.tick import FtReading, Mode, Phase
from tools.watch.reports import DeviceReport, RunReport
from tools.watch.tare import WatchTare

MEAN_NS = 200 * NS_PER_MS
"""The force shown is the mean over this long: its noise is then a few tenths of a newton."""
OLD_NS = 2 * NS_PER_S
"""A rate is not shown when nothing has come for this long."""
DEVICES = ("ft", "arm", "base")


class Link(msgspec.Struct, frozen=True):
    """How a device is: `state` in a word, `cause` in words where it is not up."""

    state: str
    cause: str = ""


class Stage(msgspec.Struct, frozen=True):
    """Where a run is."""

    phase: str
    mode: str
    progress_m: float
    faults: tuple[str, ...]


class Rate:
    """Samples a second, from the sequence numbers of those that came."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, int]] = deque(maxlen=200)

    def note(self, seq: int, at_ns: int) -> None:
        """Note a sample; one that is no newer than the last counts only where the sequence has begun anew."""
        if self._seen and seq < self._seen[-1][0]:
            self._seen.clear()
        if not self._seen or seq > self._seen[-1][0]:
            self._seen.append((seq, at_ns))

    @property
    def newest_ns(self) -> int | None:
        """Return when the newest sample came, None before the first."""
        return self._seen[-1][1] if self._seen else None

    def hz(self, now_ns: int) -> float | None:
        """Return the rate of the last two seconds, None where too little came."""
        recent = [(seq, at_ns) for seq, at_ns in self._seen if now_ns - at_ns <= OLD_NS]
        if len(recent) < 2 or recent[-1][1] <= recent[0][1]:
            return None
        return (recent[-1][0] - recent[0][0]) * NS_PER_S / (recent[-1][1] - recent[0][1])


class Seen:
    """The newest of everything. `now_ns` is the time of a run's newest tick, None for devices of our own."""

    def __init__(self, rig: RigConfig) -> None:
        self.rig = rig
        self.tare = WatchTare(Settings.of(rig), rig.ft.declared.rate_hz)
        self.bias: Vector3 | None = None
        self.bias_torque: Vector3 | None = None
        self.tare_words = ""
        self.readings: deque[FtReading] = deque(maxlen=2048)
        self.links = {device: Link("opening") for device in DEVICES}
        self.rates = {name: Rate() for name in ("ft", "arm", "pose", "odometry", "status")}
        self.arm: JointState | None = None
        self.pose: BasePose | None = None
        self.twist: BodyTwist | None = None
        self.status: BaseStatus | None = None
        self.stage: Stage | None = None
        self.now_ns: int | None = None

    def take_device(self, report: DeviceReport) -> None:
        """Take in what a device of our own gave."""
        if report.device == "ft" and report.state == "opening" and self.links["ft"].state != "opening":
            self.tare.begin()  # a sensor that was away may have lost its power, and its bias with it
            self.readings.clear()
        self.links[report.device] = Link(report.state, report.cause)
        readings = tuple(
            FtReading(
                sample.received_ns,
                sample.seq,
                (sample.value.fx, sample.value.fy, sample.value.fz),
                (sample.value.mx, sample.value.my, sample.value.mz),
            )
            for sample in report.ft
        )
        self._take_readings(readings)
        self.tare.take(readings)
        self.bias, self.bias_torque, self.tare_words = self.tare.bias, self.tare.bias_torque, self.tare.words
        for joints in report.arm:
            self.arm = joints.value
            self.rates["arm"].note(joints.seq, joints.received_ns)
        for sample in report.base:
            self._take_base(sample)

    def take_run(self, report: RunReport) -> None:
        """Take in the newest tick of a run."""
        self.now_ns = report.now_ns
        control, base = report.control, report.base
        self._take_readings(report.readings)
        self.bias = control.bias_force if control.tared else None
        self.bias_torque = control.bias_torque if control.tared else None
        self.tare_words = "tared by the run" if control.tared else "the run has not tared yet: the bias is unknown"
        self.links["ft"] = _link(report.ft_link)
        self.links["arm"] = _link(report.arm.link)
        self.links["base"] = _link(LinkState.UP if base.newest_inbound_ns else LinkState.OPENING)
        if report.arm.packets:
            self.arm = report.arm.joints
            self.rates["arm"].note(report.arm.packets, report.arm.changed_ns)
        if base.pose_received_ns:
            self.pose = BasePose(base.pose, "" if base.pose_valid else "no usable pose")
            self.rates["pose"].note(base.pose_seq, base.pose_received_ns)
        if base.odometry_received_ns:
            self.twist = base.odometry
            self.rates["odometry"].note(base.odometry_seq, base.odometry_received_ns)
        if base.status_received_ns:
            self.status = base.status
            self.rates["status"].note(base.status_received_ns, base.status_received_ns)
        mode = "PAUSED" if report.paused else Mode(report.mode).name
        self.stage = Stage(Phase(control.phase).name, mode, control.progress_m, report.faults)

    def recent(self) -> list[FtReading]:
        """Return the readings of the last MEAN_NS before the newest: N, N*m, SENSOR frame, bias still in them."""
        if not self.readings:
            return []
        since_ns = self.readings[-1].received_ns - MEAN_NS
        return [reading for reading in self.readings if reading.received_ns > since_ns]

    def _take_readings(self, readings: tuple[FtReading, ...]) -> None:
        self.readings.extend(readings)
        for reading in readings:
            self.rates["ft"].note(reading.seq, reading.received_ns)

    def _take_base(self, sample: Stamped[BaseFeed]) -> None:
        value = sample.value
        if isinstance(value, BasePose):
            self.pose = value
            self.rates["pose"].note(sample.seq, sample.received_ns)
        elif isinstance(value, BaseOdometry):
            self.twist = value.twist
            self.rates["odometry"].note(sample.seq, sample.received_ns)
        elif isinstance(value, BaseReport):
            self.status = value.status
            self.rates["status"].note(sample.seq, sample.received_ns)


def _link(state: int) -> Link:
    return Link(LinkState(state).name.lower(), "its link is lost" if state == LinkState.LOST else "")
