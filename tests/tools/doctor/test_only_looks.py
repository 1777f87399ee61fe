"""What doctor sends: nothing that starts, moves, writes or publishes. Judged at the devices' end."""

import threading

import pytest

from robot_io.rig.topics import TopicsConfig
from tests.how_many import mostly_long
from tests.wire.bridge_process import running_bridge
from tests.wire.ft300_process import ft300_process
from tests.wire.ur_process import EmulatorProcess as UrProcess
from tools.doctor.arm_checks import arm_checks
from tools.doctor.base_checks import base_checks
from tools.doctor.ft_checks import ft_checks
from tools.rig import resolve_rig

QUESTIONS = {"get robot model", "get serial number", "robotmode", "safetymode", "running"}


def real(device, key, address, *more):
    return resolve_rig("emulated", [f"{device}.level=hardware", f"{device}.{key}={address}", *more])


@pytest.mark.parametrize("streaming", mostly_long((False, True), False))
def test_the_sensor_is_never_told_to_stream(streaming):
    with ft300_process(streaming=streaming) as sensor:
        rows = {row.check: row.result for row in ft_checks(real("ft", "port", sensor.port))}
        counters = sensor.ask("counters")
    assert rows["ft.identity"] == "ok"
    assert (counters["starts"], counters["streaming"]) == (0, False)
    assert counters["requests"] > 10


def test_an_adapter_that_is_pulled_out_meanwhile_is_said():
    with ft300_process() as sensor:
        pulled = threading.Timer(1.0, lambda: sensor.ask("hang_up"))
        pulled.start()
        rows = {row.check: row for row in ft_checks(real("ft", "port", sensor.port))}
        pulled.join()
    assert rows["ft.port"].result == "failed"
    assert "went away" in rows["ft.port"].evidence


@pytest.mark.parametrize("hold", ["monitor", "servo"])
def test_the_arm_gets_questions_only(hold):
    with UrProcess() as robot:
        rows = {row.check: row.result for row in arm_checks(real("arm", "host", robot.host, f"arm.hold={hold}"))}
        asked = set(robot.get("requests.dashboard_lines"))
        handshake = "".join(line[0] for line in robot.get("requests.handshake"))
        counters, script_bytes = robot.get("counters"), robot.get("requests.script_bytes")
    assert set(rows.values()) <= {"ok", "skipped"}
    assert rows["arm.inputs"] == ("ok" if hold == "servo" else "skipped")
    assert asked <= QUESTIONS
    assert script_bytes == 0
    assert (counters["input_frames"], counters["programs_started"], counters["bad_frames"]) == (0, 0, 0)
    assert set(handshake) == ({"V", "v", "O", "S", "I"} if hold == "servo" else {"V", "v", "O", "S"})


def test_the_base_hears_nothing():
    with running_bridge(topics=TopicsConfig()) as bridge:
        rows = {row.check: row.result for row in base_checks(real("base", "url", bridge.url))}
        report = bridge.report()
    assert rows["base.pose"] == "ok"
    assert report["heard"] == []
    assert report["counters"]["commands_forwarded"] == 0
    assert report["counters"].get("ignored", 0) == 0
