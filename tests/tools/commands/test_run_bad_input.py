"""What `push run` says when something is wrong before it moves: one sentence and object, the right code."""

from __future__ import annotations

import contextlib
import re
import socket
import time

import pytest
import serial

from tests.forked_push import forked
from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import QUICK, finished, one_error
from tests.wire.bridge_process import running_bridge
from tests.wire.ft300_process import ft300_process
from tests.wire.ur_process import EmulatorProcess as UrProcess
from tests.wire.ur_process import fresh_address

THING = """
extends = "thing"
name = "thing-copy"
[ft]
port = "{port}"
[arm]
host = "{host}"
[base]
url = "{url}"
"""


def push_fails(state, tmp_path, code, *argv, also_plain=True):
    """Run it with --json, and without; check everything that holds for every failure; return the error."""
    out = tmp_path / "out"
    ended = forked(state, "run", *argv, "--out", str(out), "--json")
    error = one_error(ended, code)
    assert not out.exists(), "nothing was run, so nothing is kept"
    if not also_plain:
        return error
    plain = forked(state, "run", *argv, "--out", str(out))
    assert (plain.code, plain.out) == (code, "")
    assert [line for line in plain.err.splitlines() if line.startswith("push: ")] == [
        line for line in ended.err.splitlines() if line.startswith("push: ")
    ]
    return error


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("control.push_sped_m_per_s=0.1", ["push_sped_m_per_s", "push_speed_m_per_s"]),
        ("control.push_speed_m_per_s=100", ["push_speed_m_per_s", "100", "0.5"]),
        ("limits.max_force_N=-150", ["max_force_N", "-150"]),
        ("frames.contact_in_base_m=[938, 215, 600]", ["contact_in_base_m", "938", "5.0"]),
        ("arm.held_pose_rad=[90, -10, 90, -80, 90, 75]", ["held_pose_rad", "90", "6.3"]),
        ("control.k_f=many", ["k_f", "many"]),
        ("ft.level=sim", ["sim", "ft"]),
    ],
    ids=[
        "unknown key",
        "speed in mm/s",
        "negative limit",
        "point in mm",
        "joints in degrees",
        "a word",
        "sim beside others",
    ],
)
def test_settings_that_cannot_be(state, tmp_path, setting, words):
    error = push_fails(state, tmp_path, 2, "emulated", "--set", setting)
    said = f"{error['where']} {error['what']} {error['do']}"
    assert [word for word in words if word not in said] == []


@pytest.mark.parametrize("controller", ["force", "open-loop"])
def test_a_world_that_cannot_be_leaves_nothing_behind(state, tmp_path, controller):
    argv = ("sim", "--fast", "--law", controller, "--set", "world.floor.push_height_m=2")
    assert "tips over" in push_fails(state, tmp_path, 2, *argv)["what"]


def test_a_rig_file_with_two_mistakes_names_both_with_their_lines(state, tmp_path):
    rig = tmp_path / "mine.toml"
    rig.write_text('extends = "emulated"\nname = "mine"\n[control]\nkf = 0.1\ndistance_m = -2\n')
    error = push_fails(state, tmp_path, 2, str(rig))
    assert re.search(r"4.*kf", error["what"])
    assert re.search(r"5.*distance_m", error["what"])


@pytest.mark.parametrize(
    ("argv", "word"),
    [
        (["no-such-rig"], "no-such-rig"),
        (["emulatd"], "emulatd"),
        (["emulated", "--seed", "-1"], "-1"),
        (["emulated", "--seed", str(10**30)], str(10**30)),
        (["emulated", "--distance-m", "nan"], "nan"),
        (["emulated", "--law", "magic"], "magic"),
        (["emulated", "--set", "ft.level=hardware", "--move-robot"], "ft.port"),
    ],
)
def test_arguments_that_cannot_be(state, tmp_path, argv, word):
    error = push_fails(state, tmp_path, 2, *argv)
    assert word in f"{error['where']} {error['what']}"


def mixed(tmp_path, table, *lines):
    """Return a rig that is emulated but for one device; `lines` go into its table."""
    rig = tmp_path / "mixed.toml"
    rig.write_text(
        f'extends = "emulated"\nname = "{tmp_path.name}"\n[{table}]\nlevel = "hardware"\n' + "\n".join(lines)
    )
    return str(rig)


def device_fails(state, tmp_path, code, rig):
    """Run a rig whose real device fails at the start."""
    return push_fails(state, tmp_path, code, rig, "--move-robot", "--drive-blind", also_plain=False)


def closed_address():
    """Return a loopback address and port at which nothing listens."""
    with socket.create_server((fresh_address(), 0)) as server:
        return server.getsockname()


def test_missing_port(state, tmp_path):
    rig = mixed(tmp_path, "ft", f'port = "{tmp_path}/ttyUSB7"')
    error = device_fails(state, tmp_path, 4, rig)
    assert error["what"] == "there is no such port"
    assert error["where"] == f"ft300 {tmp_path}/ttyUSB7"
    assert error["do"]


def test_busy_port(state, tmp_path):
    with ft300_process() as sensor, serial.Serial(sensor.port, 19200, exclusive=True):
        error = push_fails(
            state, tmp_path, 4, mixed(tmp_path, "ft", f'port = "{sensor.port}"'), "--move-robot", also_plain=False
        )
        assert error["what"] == "another program uses this port"
        assert sensor.port in error["where"]
        assert "fuser" in error["do"]


def test_an_address_that_is_no_port(state, tmp_path):
    error = push_fails(
        state, tmp_path, 2, mixed(tmp_path, "ft", 'port = "http://sensor"'), "--move-robot", also_plain=False
    )
    assert "http://sensor" in error["what"]


def test_wrong_robot_version(state, tmp_path):
    with UrProcess(version=(5, 3, 0, 1)) as robot:
        error = push_fails(
            state, tmp_path, 4, mixed(tmp_path, "arm", f'host = "{robot.host}"'), "--move-robot", also_plain=False
        )
        assert "5.3" in error["what"]
        assert "3.15" in error["what"]
        assert error["where"] == f"ur10 {robot.host}"


def test_wrong_topic_type(state, tmp_path):
    with running_bridge() as bridge:
        rig = mixed(
            tmp_path,
            "base",
            f'url = "{bridge.url}"',
            "[base.topics]",
            'command_type = "geometry_msgs/TwistStamped"',
        )
        error = device_fails(state, tmp_path, 4, rig)
        assert "/cmd_vel carries geometry_msgs/Twist" in error["what"]
        assert "TwistStamped" in error["what"]
        assert "base.topics" in error["do"]


def test_an_address_that_is_no_bridge(state, tmp_path):
    url = "ws://127.0.0.1:nine"
    error = device_fails(state, tmp_path, 2, mixed(tmp_path, "base", f'url = "{url}"'))
    assert url in f"{error['where']} {error['what']}"


def test_a_real_rig_needs_the_word_before_any_packet(state, tmp_path):
    """Everything the rig names would be answered here: nobody calls."""
    host = fresh_address()
    with contextlib.ExitStack() as stack:
        ports = [30001, 30002, 30003, 30004, 29999, 0, 0]
        listeners = [stack.enter_context(socket.create_server((host, port))) for port in ports]
        serial_port, bridge_port = (listener.getsockname()[1] for listener in listeners[-2:])
        rig = tmp_path / "rig.toml"
        addresses = {"port": f"socket://{host}:{serial_port}", "host": host, "url": f"ws://{host}:{bridge_port}"}
        rig.write_text(THING.format(**addresses))
        error = push_fails(state, tmp_path, 2, str(rig))
        assert "--move-robot" in error["do"]
        for listener in listeners:
            listener.setblocking(False)
            with pytest.raises(BlockingIOError):
                listener.accept()
    one_error(forked(state, "run", "thing", "--json"), 2)


def test_every_device_that_is_not_there_is_named(state, tmp_path):
    host, bridge_port = closed_address()
    rig = tmp_path / "rig.toml"
    rig.write_text(THING.format(port=f"{tmp_path}/ttyFT", host=host, url=f"ws://{host}:{bridge_port}"))
    began_s = time.monotonic()
    ended = forked(state, "run", str(rig), "--move-robot", "--out", str(tmp_path / "out"), "--json")
    assert time.monotonic() - began_s < 5.0
    error = one_error(ended, 4)
    for device, where in (
        ("ft300", f"{tmp_path}/ttyFT"),
        ("ur10", f"{host}:30004"),
        ("ridgeback", f"ws://{host}:{bridge_port}"),
    ):
        assert f"{device} {where}: " in error["what"]
        assert f"{device}: " in error["do"], "what to try"
    plain = finished(state, "run", str(rig), "--move-robot", "--out", str(tmp_path / "out"))
    assert (plain.code, plain.out) == (4, "")
    assert plain.err == ended.err
    for device in ("ft", "arm", "base"):
        assert re.search(rf"^{device} +hardware", ended.err, re.MULTILINE), "announced before anything is opened"


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_sensor_that_already_streams_and_never_changes_is_read_and_refused_as_dead(state, tmp_path, host):
    """Left streaming by a client that crashed, it works; but no real sensor repeats itself, whatever a rig says."""
    with ft300_process(streaming=True, wrench=(0.5, -1.0, 2.0, 0.0, 0.0, 0.0)) as sensor:
        rig = mixed(tmp_path, "ft", f'port = "{sensor.port}"', "noise_force_N = 0.0")
        ended = finished(state, "run", rig, "--move-robot", *QUICK, "--out", str(tmp_path / "out"), "--json", host=host)
        assert ended.code == 4, ended.err
        assert re.search(rf"^ft +hardware +{sensor.port}$", ended.err, re.MULTILINE)
        assert re.search(r"^arm +emulated$", ended.err, re.MULTILINE)
        assert re.search(r"^base +emulated$", ended.err, re.MULTILINE)
        summary = ended.last_object
        assert (summary["level"], summary["verdict"]) == ("mixed", "not ready")
        assert "R02-dead" in summary["fault_counts"]
        assert summary["devices"]["ft300"]["packets_ok"] > 30
        assert sensor.ask("counters")["streaming"] is False, "stopped, so that the next one finds it answering"
