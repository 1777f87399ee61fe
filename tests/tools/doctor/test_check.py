"""The rows of doctor and the report made of them, as the command's promise has them."""

import json

import pytest

from tools.doctor.check import NAMES, Check, Rows, lines, report, summary_line


def some_checks():
    return [
        Check("ft.port", "ok", evidence="/dev/ttyUSB0"),
        Check("ft.latency-timer", "warning", 16.0, 1.0, "ms", "the timer is 16 ms", "Add a rule"),
        Check("arm.mode", "failed", "IDLE", evidence="not running", fix="Release the brakes"),
        Check("base.pose", "skipped", evidence="held"),
    ]


def test_the_report_has_the_promised_form():
    told = report("mine", some_checks())
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert list(told) == ["schema", "rig", "ok", "counts", "checks"]
    assert (told["schema"], told["rig"], told["ok"]) == (1, "mine", False)
    assert told["counts"] == {"ok": 1, "warning": 1, "failed": 1, "skipped": 1}
    assert told["checks"][1] == {
        "check": "ft.latency-timer",
        "result": "warning",
        "value": 16.0,
        "limit": 1.0,
        "unit": "ms",
        "evidence": "the timer is 16 ms",
        "fix": "Add a rule",
    }


@pytest.mark.parametrize(("left_out", "ok"), [("failed", True), ("warning", False)])
def test_only_failed_rows_are_not_ok(left_out, ok):
    assert report("mine", [c for c in some_checks() if c.result != left_out])["ok"] is ok


def test_every_check_gets_a_row_in_order():
    rows = Rows("arm")
    rows.ok("safety", "NORMAL")
    rows.bad("mode", "failed", "off", "Switch it on")
    checks = rows.all("not reached")
    assert [check.check for check in checks] == [f"arm.{name}" for name in NAMES["arm"]]
    assert {check.check: check.result for check in checks if check.result != "skipped"} == {
        "arm.mode": "failed",
        "arm.safety": "ok",
    }
    assert {check.evidence for check in checks if check.result == "skipped"} == {"not reached"}


def test_no_row_has_a_number_that_json_lacks():
    rows = Rows("base")
    rows.ok("battery", "?", float("nan"))
    json.dumps(report("mine", rows.all("")), allow_nan=False)


def test_people_read_aligned_rows_with_the_fix_below():
    told = lines(some_checks())
    assert told[0] == "ok       ft.port                /dev/ttyUSB0"
    assert told[1] == "warning  ft.latency-timer       the timer is 16 ms"
    assert told[2] == "                                -> Add a rule"
    assert summary_line(some_checks()) == "1 ok, 1 warning, 1 failed, 1 skipped"
    assert summary_line(some_checks() * 2) == "2 ok, 2 warnings, 2 failed, 2 skipped"
