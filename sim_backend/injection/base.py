"""A mobile base under injected faults: a driver around a driver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, cast

from msgspec.structs import replace

from robot_io.driver import Base, DriverBase
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseReport,
    BodyTwist,
    DeviceHealth,
    DeviceInfo,
    LinkState,
    Pose2D,
    SliderPose,
    Stamped,
)
from robot_io.rig.fault_words import FaultWord
from sim_backend.injection import changes
from sim_backend.injection.injection import Injection, padded
from sim_backend.injection.stages import FLOW_KINDS, Flow, Progress, Stage, Values, through

FEEDS: dict[str, type[Any]] = {"base.pose": BasePose, "base.odometry": BaseOdometry, "base.status": BaseReport}
DEVICES = (*FEEDS, "base.command")
Sample = Stamped[BaseFeed]
Command = Stamped[BodyTwist]


class SomeBase(Protocol):
    """What is needed of the base inside, beside what every driver has."""

    sent_ns: int
    newest_pong_ns: int

    def open(self) -> DeviceInfo:
        """Connect."""
        ...

    def start(self) -> None:
        """Begin the flow."""
        ...

    def drain(self) -> tuple[Sample, ...]:
        """Return every new sample."""
        ...

    def command(self, wanted: BodyTwist) -> BodyTwist:
        """Send a velocity."""
        ...

    def health(self) -> DeviceHealth:
        """Return link state and counters."""
        ...

    def stop(self) -> None:
        """Stop the flow."""
        ...

    def close(self) -> None:
        """Release everything."""
        ...


class InjectedBase(DriverBase):
    """Passes everything on to `base`, and changes what it says and what it obeys as the faults of `base.*` say.

    The first command is the first tick, unless the run has begun before.
    """

    def __init__(self, base: SomeBase, injection: Injection) -> None:
        self._base = base
        self._injection = injection
        self._clock = injection.clock
        self._slider: Pose2D | None = None
        self._feeds = [(FEEDS[device], self._stages(device)) for device in FEEDS]
        commands = injection.of("base.command")
        self._lost = [fault for fault in commands if fault.word.kind == "lost"]
        self._commands = [_command_stage(fault) for fault in commands if fault not in self._lost]
        self._gone = False
        self.sent_ns = 0
        self.newest_inbound_ns = 0
        self.newest_pong_ns = 0

    # The next two are asked of a real driver only: a simulated base has no descriptor.

    @property
    def before_close(self) -> Callable[[int], None] | None:
        """What is called just before the descriptor is closed."""
        return cast(Base, self._base).before_close

    @before_close.setter
    def before_close(self, call: Callable[[int], None] | None) -> None:
        cast(Base, self._base).before_close = call

    def fileno(self) -> int:
        """Return the descriptor of the base inside."""
        return cast(Base, self._base).fileno()

    def open(self) -> DeviceInfo:
        """Connect."""
        return self._base.open()

    def start(self) -> None:
        """Begin the flow."""
        self._base.start()

    def stop(self) -> None:
        """Stop the flow and the base."""
        self._base.stop()

    def close(self) -> None:
        """Release everything."""
        self._base.close()

    def drain(self) -> tuple[Sample, ...]:
        """Return the samples that arrive under the faults."""
        now_ns = self._clock()
        self._obey((), now_ns)
        samples = self._base.drain()
        self.newest_pong_ns = self._base.newest_pong_ns
        for sample in samples:
            if isinstance(sample.value, SliderPose):
                self._slider = sample.value.pose
        for kind, stages in self._feeds:
            if stages:
                mine = tuple(sample for sample in samples if isinstance(sample.value, kind))
                others = tuple(sample for sample in samples if not isinstance(sample.value, kind))
                samples = tuple(sorted((*others, *through(stages, mine, now_ns)), key=lambda s: s.received_ns))
        self._judge_link(now_ns)
        if self._gone:
            return ()
        if samples:
            self.newest_inbound_ns = max(self.newest_inbound_ns, samples[-1].received_ns)
        return samples

    def command(self, wanted: BodyTwist) -> BodyTwist:
        """Send what the base obeys under the faults; return what the sender believes to have sent."""
        now_ns = self._clock()
        self._injection.begin(now_ns)
        self._judge_link(now_ns)
        if self._gone:
            return BodyTwist()
        if not self._commands:
            really = self._base.command(wanted)
            self.sent_ns = self._base.sent_ns
            return really
        self._obey((Stamped(wanted, 0, now_ns),), now_ns)
        self.sent_ns = now_ns
        return wanted

    def health(self) -> DeviceHealth:
        """Return the health under the faults; its counters also count what each fault has changed."""
        health = self._base.health()
        health = replace(health, counters=health.counters | self._injection.counts(*DEVICES))
        return replace(health, state=LinkState.LOST, cause="injected") if self._gone else health

    def _obey(self, commands: tuple[Command, ...], now_ns: int) -> None:
        for command in through(self._commands, commands, now_ns):
            self._base.command(command.value)

    def _judge_link(self, now_ns: int) -> None:
        for fault in self._lost:
            if fault.active(now_ns):
                fault.count(now_ns)
                self._gone = True

    def _stages(self, device: str) -> list[Stage[Sample]]:
        return [self._stage(fault) for fault in self._injection.of(device)]

    def _stage(self, fault: Progress) -> Stage[Sample]:
        if fault.word.kind in FLOW_KINDS:
            return Flow(fault, _late, _when)
        change = {"base.pose": self._pose_change, "base.odometry": _odometry_change, "base.status": _status_change}[
            fault.word.device
        ](fault.word)

        def changed(sample: Sample, first: Sample, since_s: float) -> Sample:
            return replace(sample, value=change(sample.value, first.value, since_s))

        return Values(fault, changed, _when)

    def _pose_change(self, word: FaultWord) -> Callable[[Any, Any, float], BasePose]:
        if word.kind == "invalid":
            return lambda now, _first, _s: replace(now, flaw="injected")
        if word.kind == "swapped":
            return lambda now, _first, _s: now if self._slider is None else replace(now, pose=self._slider)
        from_first, position_only = changes.from_first, changes.position_only
        change = {
            "scaled": from_first(position_only(changes.scaled)),
            "mirrored": from_first(position_only(changes.mirrored)),
            "turned": from_first(changes.turned_in_plane),
            "trembling": changes.trembling,
            "drifting": changes.drifting,
        }.get(word.kind) or _SIMPLE[word.kind]
        value = padded(word.value or (0.0,), 3)

        def changed(now: BasePose, first: BasePose, since_s: float) -> BasePose:
            a, b = now.pose, first.pose
            return replace(now, pose=Pose2D(*change((a.x, a.y, a.yaw), (b.x, b.y, b.yaw), value, since_s)))

        return changed


_SIMPLE: dict[str, changes.Change] = {
    "frozen": changes.frozen,
    "garbage": changes.garbage,
    "wrong": changes.wrong,
    "scaled": changes.scaled,
    "mirrored": changes.mirrored,
    "turned": changes.turned_in_plane,
}


def _twist_change(word: FaultWord) -> Callable[[BodyTwist, BodyTwist, float], BodyTwist]:
    value = padded(word.value or (0.0,), 3)
    change = _SIMPLE[word.kind]

    def changed(now: BodyTwist, first: BodyTwist, since_s: float) -> BodyTwist:
        was = (first.vx, first.vy, first.omega)
        return BodyTwist(*change((now.vx, now.vy, now.omega), was, value, since_s))

    return changed


def _odometry_change(word: FaultWord) -> Callable[[Any, Any, float], BaseOdometry]:
    change = _twist_change(word)
    return lambda now, first, since_s: replace(now, twist=change(now.twist, first.twist, since_s))


def _status_change(word: FaultWord) -> Callable[[Any, Any, float], BaseReport]:
    if word.kind == "e-stop":
        return lambda now, _first, _s: BaseReport(replace(now.status, stop_engaged=True, drivers_active=False))
    if word.kind == "motors-off":
        return lambda now, _first, _s: BaseReport(replace(now.status, drivers_active=False))
    if word.kind == "frozen":
        return lambda _now, first, _s: first
    value = padded(word.value or (0.0,), 1)
    change = _SIMPLE[word.kind]

    def changed(now: BaseReport, first: BaseReport, since_s: float) -> BaseReport:
        [volt] = change((now.status.battery_v,), (first.status.battery_v,), value, since_s)
        return BaseReport(replace(now.status, battery_v=volt))

    return changed


def _command_stage(fault: Progress) -> Stage[Command]:
    word = fault.word
    if word.kind in FLOW_KINDS:
        return Flow(fault, _late, _when)
    if word.kind == "ignored":
        return Values(fault, lambda now, _first, _s: replace(now, value=BodyTwist()), _when)
    change = _twist_change(word)

    def changed(now: Command, first: Command, since_s: float) -> Command:
        return replace(now, value=change(now.value, first.value, since_s))

    return Values(fault, changed, _when)


def _when(sample: Stamped[Any], _now_ns: int) -> int:
    return sample.received_ns


def _late(sample: Stamped[Any], by_ns: int) -> Stamped[Any]:
    return replace(sample, received_ns=sample.received_ns + by_ns)
