"""`push doctor` as somebody calls it: what it prints, its report and its exit code."""

import pytest

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
    ended = finished(state, "doctor", "sim", "--json")
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
    ended = finished(state, "doctor", *words, "--json")
    assert (ended.code, ended.last_object["error"]["code"]) == (2, 2)


def test_a_device_that_is_not_there_fails_with_exit_code_4(state):
    where = ("--set", "base.level=hardware", "--set", "base.url=ws://127.0.0.1:1")
    ended = finished(state, "doctor", "emulated", *where)
    assert ended.code == 4
    [failed] = [line for line in ended.out.splitlines() if line.startswith("failed")]
    assert "base.handshake" in failed
    assert "Start rosbridge" in ended.out
    assert "nothing was moved" in ended.out.splitlines()[-1]
