"""Two things at once (F72): two devices lost, or a device and something of the host; the strongest reaction wins."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

from robot_io.tick import Mode
from safety.faults import FAULTS
from tools.faults import alterations as do
from tools.faults.judgement import Proof
from tools.faults.lockstep_round import LockstepRound, run_lockstep
from tools.faults.scenario import Alter, Scenario

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


def prove_pairs() -> list[Proof]:
    """Return what came of every pair of lost devices, and of every lost device with every fault of the host."""
    losses = DEVICES | HOST
    pairs = [*combinations(DEVICES, 2), *((device, host) for device in DEVICES for host in HOST)]
    return [_proof(f"{one} and {two}", losses[one], losses[two]) for one, two in pairs]


def _proof(what: str, one: Loss, two: Loss) -> Proof:
    """Judge a pair: the strongest reaction of both within the longer of their bounds, measured to the first zero."""
    found = run_lockstep(Scenario(one.row, what, one.words + two.words, alter=one.alter or two.alter))
    wanted = max(FAULTS[one.row].mode, FAULTS[two.row].mode)
    bound = max(FAULTS[one.row].bound_ticks, FAULTS[two.row].bound_ticks)
    measured = _to_zero(found, wanted)
    if measured is None:
        return Proof(ID, what, "sim", None, bound, False, f"no {wanted.name} came")
    return Proof(ID, what, "sim", measured, bound, measured <= bound, "" if measured <= bound else "too late")


def _to_zero(found: LockstepRound, wanted: Mode) -> int | None:
    if found.first_bad is None:
        return None
    ticks = range(found.first_bad, len(found.ticks))
    reached = (i for i in ticks if found.ticks[i].mode >= wanted and found.ticks[i].speed == 0.0)
    first = next(reached, None)
    return None if first is None else first - found.first_bad
