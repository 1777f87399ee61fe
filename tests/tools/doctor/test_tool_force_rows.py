"""The rows of an arm's own force sensor: what it has not is skipped with a reason, what is wrong is named."""

import pytest

from robot_io.rig.config import RigConfig
from tests.wire.ur_process import EmulatorProcess
from tools.doctor.check import FT, Check
from tools.doctor.emulated import check_faults
from tools.doctor.tool_force_checks import tool_force_checks
from tools.rig import resolve_rig, with_addresses

QUIET = ("world.sensor.noise_force_N=0", "world.sensor.noise_torque_Nm=0")
"""The emulator of these tests is fed a constant."""


def rig_at(host: str, *settings: str) -> RigConfig:
    return with_addresses(resolve_rig("ur10e-emulated", [*QUIET, *settings]), {"ft": host, "arm": host})


def rows_of(robot: EmulatorProcess, *settings: str) -> dict[str, Check]:
    rows = {check.check: check for check in tool_force_checks(rig_at(robot.host, *settings))}
    assert list(rows) == [f"ft.{name}" for name in FT]
    return rows


@pytest.mark.long
def test_a_sound_sensor_has_no_row_that_fails() -> None:
    with EmulatorProcess(model="ur10e", wrench=(-3.0, 2.0, 5.0, 0.1, 0.0, 0.0)) as robot:
        rows = rows_of(robot)
    results = {name: row.result for name, row in rows.items()}
    skipped = {"ft.permission", "ft.lock", "ft.latency-timer", "ft.crc", "ft.echo"}
    assert {name for name, result in results.items() if result == "skipped"} == skipped
    assert all(rows[name].evidence for name in skipped), "each says why"
    assert all(result == "ok" for name, result in results.items() if name not in skipped), results
    assert "UR10e" in rows["ft.identity"].evidence


@pytest.mark.long
def test_a_bias_that_takes_half_of_the_range_is_named() -> None:
    with EmulatorProcess(model="ur10e", wrench=(0.0, 0.0, 60.0, 0.0, 0.0, 0.0)) as robot:
        row = rows_of(robot)["ft.bias"]
    assert (row.result, row.value) == ("failed", pytest.approx(60.0))


def test_a_cb3_arm_is_named_and_the_rest_skipped() -> None:
    with EmulatorProcess(model="ur10") as robot:
        rows = rows_of(robot)
    assert rows["ft.port"].result == "failed"
    assert "a CB3 arm has no force sensor" in rows["ft.port"].evidence
    assert rows["ft.rate"].result == rows["ft.noise"].result == "skipped"


def test_another_model_is_named() -> None:
    with EmulatorProcess(model="ur16e") as robot:
        rows = rows_of(robot)
    assert "this is a UR16e, not the UR10e that the rig says" in rows["ft.port"].evidence


def test_faults_of_a_line_are_refused_where_there_is_none() -> None:
    rig = resolve_rig("ur10e-emulated")
    check_faults(rig, ["ft.wrong=60,0,0"])
    with pytest.raises(Exception, match="has no line of its own"):
        check_faults(rig, ["ft.latency=16"])
