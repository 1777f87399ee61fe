"""Two things at once (F72): two devices lost, or a device and something of the host; the strongest reaction wins."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import combinations
from typing import NamedTuple

from robot_io.tick import Mode
from safety.faults import FAULTS
from tools.faults import alterations as do
from tools.faults.judgement import WIRE_TICKS, Proof, level_of
from tools.faults.lockstep_round import LockstepRound, run_lockstep
from tools.faults.scenario import Alter, Scenario
from tools.faults.wire_proof import prove_on_wire

ID = "F72"


class Loss(NamedTuple):
    """A loss, and the row that ends the run because of it."""

    row: str
    words: tuple[str, ...] = ()
    alter: Alter | None = None


DEVICES = {
    "ft.off": Loss("F01-stop", ("ft.off",)),
    "ft.lost": Loss("F02", ("ft.lost",)),
    "arm.off": Loss("F24-stop", ("arm.off",)),
    "base.odometry.off": Loss("F31-stop", ("base.odometry.off",)),
    "base.pose.off": Loss("F40-stop", ("base.pose.off",)),
    "base.command.lost": Loss("F30", ("base.command.lost",)),
}
HOST = {
    "skipped ticks": Loss("F60-slow", alter=do.host(skipped=1)),
    "recorder gone": Loss("F63", alter=do.host(recorder_alive=False)),
    "stop key": Loss("F64", alter=do.operator_stop()),
    "gate gone": Loss("F67", alter=do.host(gate_alive=False)),
    "arm process gone": Loss("F69", alter=do.host(arm_alive=False)),
}


ON_THE_WIRE = (
    ("ft.off", "arm.off"),
    ("ft.lost", "base.odometry.off"),
    ("arm.off", "base.pose.off"),
    ("base.odometry.off", "base.pose.off"),
)


def prove_pairs() -> Iterator[Proof]:
    """Yield what came of every pair of lost devices, and of every lost device with every fault of the host.

    All of them in lockstep, some of the devices' also on the wire.
    """
    losses = DEVICES | HOST
    for one, two in (*combinations(DEVICES, 2), *((device, host) for device in DEVICES for host in HOST)):
        scenario = _both(losses[one], losses[two], f"{one} and {two}")
        yield _judged(losses[one], losses[two], scenario, run_lockstep(scenario))
    for one, two in ON_THE_WIRE:
        scenario = _both(losses[one], losses[two], f"{one} and {two}")
        yield prove_on_wire(scenario, partial(_judged, losses[one], losses[two], wire=True))


def _both(one: Loss, two: Loss, what: str) -> Scenario:
    return Scenario(one.row, what, one.words + two.words, alter=one.alter or two.alter)


def _judged(one: Loss, two: Loss, scenario: Scenario, found: LockstepRound, *, wire: bool = False) -> Proof:
    """Judge a pair: the strongest reaction of both within the longer of their bounds, measured to the first zero."""
    wanted = max(FAULTS[one.row].mode, FAULTS[two.row].mode)
    bound = max(FAULTS[one.row].bound_ticks, FAULTS[two.row].bound_ticks) + (WIRE_TICKS if wire else 0)
    measured = _to_zero(found, wanted)
    why = f"no {wanted.name} came" if measured is None else "" if measured <= bound else "too late"
    return Proof(ID, scenario.what, level_of(wire=wire), measured, bound, not why, why)


def _to_zero(found: LockstepRound, wanted: Mode) -> int | None:
    if found.first_bad is None:
        return None
    ticks = range(found.first_bad, len(found.ticks))
    reached = (i for i in ticks if found.ticks[i].mode >= wanted and found.ticks[i].speed == 0.0)
    first = next(reached, None)
    return None if first is None else first - found.first_bad
