"""Checks that the force is plausible: enough whole packets, none wild, none stuck, and a direction a push can have."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.messages import BodyTwist, Vector3, Vector6
from robot_io.rig.types import Matrix3
from robot_io.tick import ControlState, Counts6, ForceState, FtReading, Phase, SafetyState, TickInput
from safety.finding import Finding
from safety.settings import DAMAGED_S, SafetySettings

DAMAGED_NS = round(DAMAGED_S * 1e9)
RATE_EVERY_NS = 100_000_000
RATE_BUCKETS = 10
"""The rate is judged over the last 0.9 to 1 s."""
SPIKE_N = 80.0
WRONG_READINGS = 20
WRONG_WITHIN_M = 0.05
"""Later the object may have turned so far that the force points anywhere."""
VERTICAL_SHARE = 0.5
BEFORE_CONTACT_N = 3.0


def note(state: SafetyState, inp: TickInput) -> SafetyState:
    """Record how many packets were damaged until now, without judging them: the line is only just settling."""
    return replace(state, force=replace(state.force, crc_fail=inp.ft.crc_fail))


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of the sensor's packets; to be called before `last_ft_force` moves on."""
    faults: list[str] = []
    force = _damaged(state.force, inp)
    if sum(force.damaged) >= settings.damaged_packets:
        faults.append(Finding("F04", sum(force.damaged)))
    force, rate = _rate(force, inp)
    if rate < settings.least_rate:
        faults.append(Finding("F12-hold", rate))
    elif rate < settings.low_rate:
        faults.append(Finding("F12-low", rate))
    last, torque, runs = state.last_ft_force, state.last_ft_torque, force.axis_runs
    before, wrong = force.before_last, force.wrong_run
    sought = control.phase == Phase.PUSH and 0.0 <= control.progress_m <= WRONG_WITHIN_M
    for reading in inp.ft.readings:
        runs = _axis_runs(runs, (*last, *torque), (*reading.force, *reading.torque), settings.same)
        if _spike(before, last, reading.force):
            faults.append(Finding("F08", math.dist(before, last)))
        if control.phase != Phase.LOST:  # a force that turns about goes through none
            wrong = wrong + 1 if sought and _wrong(settings.base_from_sensor, control, inp.base.sent, reading) else 0
        before, last, torque = last, reading.force, reading.torque
    frozen = max([run for run, scatters in zip(runs, settings.scatters, strict=True) if scatters], default=0)
    if frozen >= settings.frozen_readings and control.speed > 0.0:
        faults.append(Finding("F06", frozen))
    if wrong >= WRONG_READINGS:
        faults.append(Finding("F11", wrong))
    if control.early_contact:
        faults.append("F53-early")
    if control.force_before_contact_N > BEFORE_CONTACT_N:
        faults.append(Finding("F09-before", control.force_before_contact_N))
    force = replace(force, axis_runs=runs, before_last=before, wrong_run=wrong)
    return replace(state, force=force, frozen_run=min(runs)), faults


def _damaged(state: ForceState, inp: TickInput) -> ForceState:
    """Return the state with the packets damaged in this tick, and without those of more than 0.2 s ago."""
    new = inp.ft.crc_fail - state.crc_fail
    if new <= 0 and not state.damaged:
        return state if new == 0 else replace(state, crc_fail=inp.ft.crc_fail)
    kept = [pair for pair in zip(state.damaged_ns, state.damaged, strict=True) if inp.now_ns - pair[0] < DAMAGED_NS]
    if new > 0:
        kept.append((inp.now_ns, new))
    times, counts = tuple(at for at, _ in kept), tuple(count for _, count in kept)
    return replace(state, crc_fail=inp.ft.crc_fail, damaged_ns=times, damaged=counts)


def _rate(state: ForceState, inp: TickInput) -> tuple[ForceState, float]:
    """Return the state and the rate of good packets over the last second, Hz; infinite before there was one."""
    if not state.counted_ns or inp.now_ns - state.counted_ns[-1] >= RATE_EVERY_NS:
        times = (*state.counted_ns, inp.now_ns)[-RATE_BUCKETS:]
        counts = (*state.counted, inp.ft.packets_ok)[-RATE_BUCKETS:]
        state = replace(state, counted_ns=times, counted=counts)
    if len(state.counted) < RATE_BUCKETS:
        return state, math.inf
    return state, (inp.ft.packets_ok - state.counted[0]) / ((inp.now_ns - state.counted_ns[0]) * 1e-9)


def _axis_runs(runs: Counts6, old: Vector6, new: Vector6, same: Vector6) -> Counts6:
    a, b, c, d, e, f = [
        run + 1 if abs(after - before) < close else 0
        for run, before, after, close in zip(runs, old, new, same, strict=True)
    ]
    return a, b, c, d, e, f


def _spike(before: Vector3, middle: Vector3, after: Vector3) -> bool:
    """Return whether the middle one of three readings is far from both others, which agree."""
    return (
        math.dist(before, middle) > SPIKE_N
        and math.dist(middle, after) > SPIKE_N
        and math.dist(before, after) <= SPIKE_N
    )


def _wrong(base_from_sensor: Matrix3, control: ControlState, sent: BodyTwist, reading: FtReading) -> bool:
    """Return whether this force on the slider points against the motion, or too much up or down."""
    if not control.tared or (sent.vx == 0.0 and sent.vy == 0.0):
        return False
    tip = [reading.force[i] - control.bias_force[i] for i in range(3)]
    x, y, z = (-(row[0] * tip[0] + row[1] * tip[1] + row[2] * tip[2]) for row in base_from_sensor)
    return x * sent.vx + y * sent.vy <= 0.0 or abs(z) > VERTICAL_SHARE * math.hypot(x, y)
