"""A force-torque sensor under injected faults: a driver around a driver."""

from __future__ import annotations

from typing import Protocol, cast

from msgspec.structs import astuple, replace

from robot_io.driver import Sensor
from robot_io.messages import DeviceHealth, LinkState, SensorWrench, Stamped
from robot_io.rig.config import RigConfig
from robot_io.rig.fault_words import FaultWord
from sim_backend.injection import changes
from sim_backend.injection.injection import Injection, padded
from sim_backend.injection.stages import FLOW_KINDS, Flow, Progress, Stage, Values, through

Sample = Stamped[SensorWrench]
SPIKE_EVERY = 50
JUNK_BYTES = 17
"""A packet of 16 bytes, torn by one that belongs to none."""


class SomeSensor(Protocol):
    """What is needed of the sensor inside."""

    def drain(self) -> tuple[Sample, ...]:
        """Return every new sample."""
        ...

    def health(self) -> DeviceHealth:
        """Return link state and counters."""
        ...


class InjectedSensor:
    """Passes everything on to `sensor`, and changes its samples and its health as the faults of `ft` say."""

    def __init__(self, sensor: SomeSensor, injection: Injection, rig: RigConfig) -> None:
        self._sensor = sensor
        self._clock = injection.clock
        faults = injection.of("ft")
        self._lost = [fault for fault in faults if fault.word.kind == "lost"]
        self._crc = [fault for fault in faults if fault.word.kind == "crc"]
        self._junk = [fault for fault in faults if fault.word.kind == "junk"]
        self._zeroed = [fault for fault in faults if fault.word.kind == "zeroed"]
        self._dropping = [fault for fault in faults if fault.word.kind in ("off", "slow", "intermittent")]
        self._stages = [_stage(fault, rig) for fault in faults if fault not in self._lost]
        self._gone = False

    def fileno(self) -> int:
        """Return the descriptor of the sensor inside; a simulated one has none and is not asked."""
        return cast(Sensor, self._sensor).fileno()

    def drain(self) -> tuple[Sample, ...]:
        """Return the samples that arrive under the faults."""
        now_ns = self._clock()
        samples = through(self._stages, self._sensor.drain(), now_ns)
        for fault in self._lost:
            if fault.active(now_ns):
                fault.count(now_ns)
                self._gone = True
        return () if self._gone else samples

    def health(self) -> DeviceHealth:
        """Return the health under the faults."""
        health = self._sensor.health()
        damaged = sum(fault.changed for fault in self._crc)
        torn = sum(fault.changed for fault in self._junk)
        more = {
            "packets_ok": -damaged - torn - sum(fault.changed for fault in self._dropping),
            "crc_fail": damaged + torn,
            "junk_bytes": torn * JUNK_BYTES,
            "resyncs": torn,
            "bias_jumps": sum(fault.changed > 0 for fault in self._zeroed),
        }
        if any(more.values()):
            counters = health.counters | {name: health.counters.get(name, 0) + by for name, by in more.items() if by}
            health = replace(health, counters=counters)
        return replace(health, state=LinkState.LOST, cause="injected") if self._gone else health


def _stage(fault: Progress, rig: RigConfig) -> Stage[Sample]:
    if fault.word.kind in FLOW_KINDS:
        return Flow(fault, _late, _when)
    if fault.word.kind in ("crc", "junk"):
        return _Damaged(fault)
    change = _change(fault.word, rig)
    value = padded(fault.word.value or (0.0,), 6)

    def changed(sample: Sample, first: Sample, since_s: float) -> Sample:
        return replace(sample, value=SensorWrench(*change(astuple(sample.value), astuple(first.value), value, since_s)))

    return Values(fault, changed, _when)


def _change(word: FaultWord, rig: RigConfig) -> changes.Change:
    simple: dict[str, changes.Change] = {
        "frozen": changes.frozen,
        "garbage": changes.garbage,
        "wrong": changes.wrong,
        "scaled": changes.scaled,
        "mirrored": changes.mirrored,
        "drifting": changes.drifting,
        "dead-axis": changes.dead_axis,
        "zeroed": _zeroed,
        "turned": changes.turned_about(rig.frames.base_from_sensor[2]),
        "saturated": _saturated(rig),
    }
    return _spikes(word.value[0]) if word.kind == "spike" else simple[word.kind]


def _zeroed(now: changes.Numbers, first: changes.Numbers, _value: changes.Numbers, _since_s: float) -> changes.Numbers:
    return tuple(reads - then for reads, then in zip(now, first, strict=True))


def _saturated(rig: RigConfig) -> changes.Change:
    def saturated(
        now: changes.Numbers, _first: changes.Numbers, value: changes.Numbers, _since_s: float
    ) -> changes.Numbers:
        axis = changes.on_axis(value, size=6)
        return (*now[:axis], rig.ft.declared.range[axis], *now[axis + 1 :])

    return saturated


def _spikes(newton: float) -> changes.Change:
    count = 0

    def spike(now: changes.Numbers, _first: changes.Numbers, _value: changes.Numbers, _s: float) -> changes.Numbers:
        nonlocal count
        count += 1
        return now if count % SPIKE_EVERY != 1 else (*now[:2], now[2] + newton, *now[3:])

    return spike


class _Damaged:
    """Drops one sample in so many, as a driver drops a packet with a wrong checksum, or one torn by a stray byte."""

    def __init__(self, fault: Progress) -> None:
        self._fault = fault
        self._count = 0

    def take(self, items: tuple[Sample, ...], now_ns: int) -> tuple[Sample, ...]:
        """Return the samples whose packets are good."""
        return tuple(item for item in items if not self._is_damaged(item, now_ns))

    def _is_damaged(self, item: Sample, _now_ns: int) -> bool:
        if not self._fault.active(item.received_ns):
            return False
        self._count += 1
        if self._count % max(1, round(self._fault.word.value[0])):
            return False
        self._fault.count(item.received_ns)
        return True


def _when(sample: Sample, _now_ns: int) -> int:
    return sample.received_ns


def _late(sample: Sample, by_ns: int) -> Sample:
    return replace(sample, received_ns=sample.received_ns + by_ns)
