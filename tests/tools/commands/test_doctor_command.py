"""`push doctor` as somebody calls it: what it prints, its report and its exit code."""

import pytest

from tests.forked_push import forked
from tests.push_runs import finished

PROMISED = {
    "ft": "port permission lock latency-timer identity rate crc noise bias echo",
    "arm": "ports version mode safety pose turns inputs",
    "base": "handshake round-trip command-type command-listener other-publisher pose odometry status clock frame "
    "e-stop battery",
    "host": "scheduling limits disk memory suspend clock",
    "rig": "workspace corridor stopping-distance gains calibration-age",
}
NAMED = [f"{of}.{name}" for of, names in PROMISED.items() for name in names.split()]


def test_level_sim_has_no_devices_to_look_at(state):
    ended = forked(state, "doctor", "sim", "--json")
    told = ended.last_object
    assert ended.code == 0
    assert [check["check"] for check in told["checks"]] == NAMED
    device_rows = [c for c in told["checks"] if c["check"].startswith(("ft.", "arm.", "base."))]
    assert {check["result"] for check in device_rows} == {"skipped"}


def test_an_emulated_robot_in_order_passes(state):
    ended = finished(state, "doctor", "emulated", "--json")
    told = ended.last_object
    bad = [check for check in told["checks"] if check["result"] == "failed"]
    assert (ended.code, bad, told["ok"]) == (0, [], True)
    assert [check["check"] for check in told["checks"]] == NAMED
    skipped = [check["check"] for check in told["checks"] if check["result"] == "skipped"]
    assert [name for name in skipped if not name.startswith("host.")] == ["arm.inputs"]


@pytest.mark.parametrize("words", [("no-such-rig",), ("emulated", "--set", "control.k_f=many")])
def test_a_rig_that_cannot_be_used(state, words):
    ended = forked(state, "doctor", *words, "--json")
    assert (ended.code, ended.last_object["error"]["code"]) == (2, 2)


def test_a_device_that_is_not_there_fails_with_exit_code_4(state):
    where = ("--set", "base.level=hardware", "--set", "base.url=ws://127.0.0.1:1")
    ended = finished(state, "doctor", "emulated", *where)
    assert ended.code == 4
    [failed] = [line for line in ended.out.splitlines() if line.startswith("failed")]
    assert "base.handshake" in failed
    assert "Start rosbridge" in ended.out
    assert "nothing was moved" in ended.out.splitlines()[-1]


def test_the_proof_of_the_base_needs_the_word(state):
    error = forked(state, "doctor", "emulated", "--prove-base-timeout", "--json").last_object["error"]
    assert error["code"] == 2
    assert "--move-robot" in error["do"]


@pytest.mark.long
def test_an_emulated_base_stops_by_itself(state):
    """The Ridgeback's promise: 0.25 s after the last command, and its control tick of 40 ms."""
    ended = finished(state, "doctor", "emulated", "--prove-base-timeout", "--move-robot", "--json")
    assert ended.code == 0
    [row] = [check for check in ended.last_object["checks"] if check["check"] == "base.timeout"]
    assert row["result"] == "ok"
    assert 0.2 < row["value"] < row["limit"]


@pytest.mark.long
def test_three_faults_at_once_are_all_named(state):
    faults = ("ft.latency=16", "base.command-type", "base.second-publisher")
    words = [word for fault in faults for word in ("--fault", fault)]
    ended = finished(state, "doctor", "emulated", *words, "--json")
    assert ended.code == 4
    rows = {check["check"]: check for check in ended.last_object["checks"]}
    assert rows["ft.latency-timer"]["result"] == "warning"
    assert rows["ft.latency-timer"]["value"] == pytest.approx(16.0, abs=2.0)
    assert rows["base.command-type"]["result"] == "failed"
    assert rows["base.other-publisher"]["result"] == "warning"
    assert "/teleop" in rows["base.other-publisher"]["evidence"]
    assert "never calibrated" in rows["rig.calibration-age"]["evidence"]


@pytest.mark.parametrize("fault", ["ft.latency at 3 s", "ft.nonsense", "arm.version=many", "base.no-rosapi=1"])
def test_a_fault_that_cannot_be(state, fault):
    ended = forked(state, "doctor", "emulated", "--fault", fault, "--json")
    assert (ended.code, ended.last_object["error"]["code"]) == (2, 2)
    assert fault in ended.last_object["error"]["what"]


def test_no_fault_where_a_device_is_real(state):
    real = ("--set", "base.level=hardware", "--set", "base.url=ws://127.0.0.1:1")
    ended = forked(state, "doctor", "emulated", *real, "--fault", "base.no-rosapi", "--json")
    assert (ended.code, ended.last_object["error"]["code"]) == (2, 2)
