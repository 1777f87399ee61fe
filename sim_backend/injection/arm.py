"""The records of an arm under injected faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from msgspec.structs import replace

from robot_io.messages import ArmRecord, ArmState, LinkState
from robot_io.rig.fault_words import FaultWord
from sim_backend.injection import changes
from sim_backend.injection.injection import Injection, padded
from sim_backend.injection.stages import FLOW_KINDS, Flow, Progress, Stage, Values, through

STATES = {
    "protective-stop": ArmState.PROTECTIVE_STOP,
    "emergency-stop": ArmState.EMERGENCY_STOP,
    "powered-off": ArmState.OFF,
    "freedrive": ArmState.MOVING,
    "other-program": ArmState.FOREIGN_PROGRAM,
}


class SomeArm(Protocol):
    """What is needed of the arm inside."""

    def read(self) -> ArmRecord | None:
        """Return the newest record."""
        ...


class InjectedArm:
    """Reads the newest record of `arm` and changes it as the faults of `arm` say."""

    def __init__(self, arm: SomeArm, injection: Injection) -> None:
        self._arm = arm
        self._clock = injection.clock
        self._stages = [_stage(fault) for fault in injection.of("arm")]
        self._newest: ArmRecord | None = None

    def read(self) -> ArmRecord | None:
        """Return the newest record that has arrived under the faults; None before the first."""
        record = self._arm.read()
        now_ns = self._clock()
        arrived = through(self._stages, () if record is None else (record,), now_ns)
        if arrived:
            self._newest = arrived[-1]
        return self._newest


def _stage(fault: Progress) -> Stage[ArmRecord]:
    if fault.word.kind in FLOW_KINDS:
        return Flow(fault, _late, _when)
    return Values(fault, _change(fault.word), _when)


def _change(word: FaultWord) -> Callable[[ArmRecord, ArmRecord, float], ArmRecord]:
    if word.kind == "lost":
        return lambda now, _first, _s: replace(now, link=int(LinkState.LOST))
    if word.kind == "frozen":
        return lambda now, first, _s: replace(first, published_ns=now.published_ns)
    if word.kind in STATES:
        return lambda now, _first, _s: replace(now, joints=replace(now.joints, state=int(STATES[word.kind])))
    value = padded(word.value, 6)

    def moved(now: ArmRecord, first: ArmRecord, since_s: float) -> ArmRecord:
        kinds = {"garbage": changes.garbage, "wrong": changes.wrong, "scaled": changes.scaled}
        change = kinds.get(word.kind, changes.drifting)
        position = change(now.joints.position, first.joints.position, value, since_s)
        velocity = now.joints.velocity
        if word.kind == "moving":
            velocity = tuple(v + by for v, by in zip(velocity, value, strict=True))  # type: ignore[assignment]  # six as before
        return replace(now, joints=replace(now.joints, position=position, velocity=velocity))

    return moved


def _when(_record: ArmRecord, now_ns: int) -> int:
    return now_ns


def _late(record: ArmRecord, by_ns: int) -> ArmRecord:
    return replace(record, published_ns=record.published_ns + by_ns, changed_ns=record.changed_ns + by_ns)
