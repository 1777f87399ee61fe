"""Everything that can be wrong with a device on the wire gives the row that names it.

The rows come from the lists of failures in the field: serial adapters, controllers and bridges that people had.
"""

import functools

import pytest

from sim_backend.injection.wire_words import ON_THE_WIRE, WIRE_KINDS, parse_wire_fault
from tools.doctor.emulated import emulators
from tools.doctor.examine import device_checks
from tools.rig import resolve_rig

SENSOR = [
    (["ft.lost"], "ft.port", "failed"),
    (["ft.busy"], "ft.lock", "failed"),
    (["ft.shared"], "ft.lock", "failed"),
    (["ft.silent"], "ft.identity", "failed"),
    (["ft.off at 0 s"], "ft.identity", "failed"),
    (["ft.other-device"], "ft.identity", "failed"),
    (["ft.latency=16"], "ft.latency-timer", "warning"),
    (["ft.latency=16", "ft.streaming"], "ft.latency-timer", "warning"),
    (["ft.streaming"], "ft.identity", "ok"),
    (["ft.echo"], "ft.echo", "failed"),
    (["ft.crc=2 at 0 s"], "ft.crc", "failed"),
    (["ft.crc=15"], "ft.crc", "warning"),
    (["ft.streaming", "ft.crc=2"], "ft.crc", "failed"),
    (["ft.junk=2"], "ft.crc", "failed"),
    (["ft.streaming", "ft.junk=2"], "ft.crc", "failed"),
    (["ft.slow=5"], "ft.rate", "failed"),
    (["ft.frozen"], "ft.rate", "failed"),
    (["ft.intermittent=0.4"], "ft.rate", "warning or failed"),
    (["ft.dead-axis=2"], "ft.noise", "failed"),
    (["ft.garbage"], "ft.noise", "failed"),
    (["ft.drifting=0,0,-5"], "ft.noise", "failed"),
    (["ft.wrong=200"], "ft.bias", "failed"),
    (["ft.saturated=2"], "ft.bias", "failed"),
]
ARM = [
    (["arm.lost"], "arm.ports", "failed"),
    (["arm.silent"], "arm.ports", "failed"),
    (["arm.off"], "arm.ports", "failed"),
    (["arm.dashboard-silent"], "arm.ports", "failed"),
    (["arm.truncated=20"], "arm.ports", "failed"),
    (["arm.version=10.07"], "arm.version", "failed"),
    (["arm.version=3.14"], "arm.version", "failed"),
    (["arm.other-model"], "arm.version", "failed"),
    (["arm.protective-stop at 0 s"], "arm.safety", "failed"),
    (["arm.emergency-stop"], "arm.safety", "failed"),
    (["arm.safeguard-stop"], "arm.safety", "failed"),
    (["arm.powered-off"], "arm.mode", "failed"),
    (["arm.brakes-on"], "arm.mode", "failed"),
    (["arm.freedrive"], "arm.mode", "failed"),
    (["arm.other-program"], "arm.mode", "failed"),
    (["arm.paused-program"], "arm.mode", "failed"),
    (["arm.garbage"], "arm.pose", "failed"),
    (["arm.wrong=0.2"], "arm.pose", "failed"),
    (["arm.moving=0.05"], "arm.pose", "failed"),
    (["arm.drifting=0.02"], "arm.pose", "failed"),
    (["arm.turned"], "arm.turns", "failed"),
    (["arm.inputs-taken"], "arm.inputs", "failed"),
]
BASE = [
    (["base.silent"], "base.handshake", "failed"),
    (["base.command.lost"], "base.handshake", "failed"),
    (["base.lag=0.2"], "base.round-trip", "warning"),
    (["base.lag=0.4"], "base.round-trip", "failed"),
    (["base.no-rosapi"], "base.command-type", "warning"),
    (["base.cold=1.5"], "base.command-type", "ok"),
    (["base.slow-answers=0.2"], "base.round-trip", "warning"),
    (["base.command-type"], "base.command-type", "failed"),
    (["base.no-listener"], "base.command-listener", "failed"),
    (["base.command.ignored at 0 s"], "base.command-listener", "failed"),
    (["base.second-publisher"], "base.other-publisher", "warning"),
    (["base.second-client"], "base.other-publisher", "warning"),
    (["base.commanded=0.1"], "base.other-publisher", "failed"),
    (["base.pose.off"], "base.pose", "failed"),
    (["base.pose.slow=5"], "base.pose", "failed"),
    (["base.pose.slow=15"], "base.pose", "warning"),
    (["base.pose.intermittent=0.4"], "base.pose", "failed"),
    (["base.pose.invalid"], "base.pose", "failed"),
    (["base.pose.garbage"], "base.pose", "failed"),
    (["base.pose-type"], "base.pose", "failed"),
    (["base.frame"], "base.frame", "failed"),
    (["base.odometry.off"], "base.odometry", "failed"),
    (["base.odometry.slow=2"], "base.odometry", "failed"),
    (["base.odometry.slow=7"], "base.odometry", "warning"),
    (["base.odometry.garbage"], "base.odometry", "failed"),
    (["base.odometry.wrong=0.2"], "base.odometry", "failed"),
    (["base.status.off"], "base.status", "failed"),
    (["base.clock=5"], "base.clock", "warning"),
    (["base.status.e-stop at 0 s"], "base.e-stop", "failed"),
    (["base.status.motors-off"], "base.e-stop", "failed"),
    (["base.battery=21"], "base.battery", "warning"),
    (["base.battery=19"], "base.battery", "failed"),
    (["base.status.wrong=-5"], "base.battery", "warning"),
]
NOT_AT_REST = {
    "ft.scaled", "ft.mirrored", "ft.turned", "ft.delayed",  # nothing that is known of the force at rest contradicts
    "ft.spike",  # one reading in fifty is asked for or not
    "base.odometry.intermittent", "base.status.slow",  # as good as half the rate, and as a status of 1 Hz
}  # fmt: skip


QUICK = {"arm.silent", "arm.version=10.07", "arm.protective-stop at 0 s", "arm.turned", "arm.inputs-taken"}


def table(rows):
    """Return the rows as parameters; all but the quickest few are long."""
    return [
        pytest.param(*row, id="+".join(row[0]), marks=() if row[0][0] in QUICK else pytest.mark.long) for row in rows
    ]


@functools.cache
def rig():
    return resolve_rig("emulated", ["arm.hold=servo"])


def named(device, faults, check, result):
    """Look at a device with these faults; the row must say so, and what to do about it."""
    with emulators(rig(), "", faults) as served:
        rows = {row.check: row for row in device_checks(served, device, {})}
    told = rows[check]
    assert told.result in result.split(" or "), told
    assert told.evidence
    assert bool(told.fix) == (result != "ok")


@pytest.mark.parametrize(("faults", "check", "result"), table(ARM))
def test_a_fault_of_the_arm_is_named(faults, check, result):
    named("arm", faults, check, result)


@pytest.mark.parametrize(("faults", "check", "result"), table(SENSOR))
def test_a_fault_of_the_sensor_is_named(faults, check, result):
    named("ft", faults, check, result)


@pytest.mark.parametrize(("faults", "check", "result"), table(BASE))
def test_a_fault_of_the_base_is_named(faults, check, result):
    named("base", faults, check, result)


def test_the_table_leaves_no_word_out():
    tried = {(fault.device, fault.kind) for row in SENSOR + ARM + BASE for fault in map(parse_wire_fault, row[0])}
    words = {(device, kind) for kinds in (WIRE_KINDS, ON_THE_WIRE) for device in kinds for kind in kinds[device]}
    assert {f"{device}.{kind}" for device, kind in words - tried} == NOT_AT_REST
