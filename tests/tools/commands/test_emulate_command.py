"""`push emulate` as a process: its lines, its addresses, its end, and a client nobody here wrote on each."""

import contextlib
import errno
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import minimalmodbus
import pytest
import serial
import websocket

from robot_io.ur10.tool_force import UrToolForce
from tests.wire.ur_process import wait_until
from tools import cli

ROOT = Path(__file__).resolve().parents[3]
PUSH = [sys.executable, "-c", "from robot_io._entry import main; raise SystemExit(main())", "emulate"]


@contextlib.contextmanager
def emulate(*argv, lines=1, stdin=subprocess.DEVNULL):
    """Start `push emulate ... --json`; give the process and its endpoint lines."""
    with subprocess.Popen(
        [*PUSH, *argv, "--json"], cwd=ROOT, stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as child:
        try:
            yield child, [json.loads(read_line(child)) for _ in range(lines)]
        finally:
            child.kill()


def read_line(child, within_s=20.0):
    deadline = time.monotonic() + within_s
    line = b""
    while not line.endswith(b"\n"):
        ready, _, _ = select.select([child.stdout], [], [], max(0.0, deadline - time.monotonic()))
        assert ready, "no endpoint line in time"
        byte = os.read(child.stdout.fileno(), 1)
        assert byte, child.stderr.read().decode()
        line += byte
    return line


@pytest.mark.parametrize("device", ["ft300", "ridgeback"])
def test_the_help_says_what_is_modelled_and_what_is_not(device, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["emulate", device, "--help"])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "\nmodelled: " in told
    assert "\nnot modelled: " in told
    assert max(map(len, told.splitlines())) <= 80


def registers_of(port):
    sensor = minimalmodbus.Instrument(port, 9)
    sensor.serial.baudrate = 19200
    sensor.serial.timeout = 0.5
    try:
        # 180..185: forces in 0.01 N, torques in 0.001 N*m (Robotiq FT 300 manual)
        return [value - 65536 if value > 32767 else value for value in sensor.read_registers(180, 6)]
    finally:
        sensor.serial.close()


def test_ft300_says_the_wrench_it_was_given():
    with emulate("ft300", "--wrench=-10,1.5,0,0,-0.25,0") as (_, [endpoint]):
        assert set(endpoint) == {"device", "port"}
        assert endpoint["device"] == "ft300"
        assert registers_of(endpoint["port"]) == [-1000, 150, 0, 0, -250, 0]


def test_ft300_steps_and_may_be_found_streaming():
    argv = ("ft300", "--streaming", "--latency-ms", "0", "--step-after-s", "0", "--step-wrench=-20,0,0,0,0,0")
    with emulate(*argv) as (_, [endpoint]), serial.Serial(endpoint["port"], 19200, timeout=2.0) as port:
        data = port.read(64)
        start = data.index(b"\x20\x4e")
        assert struct.unpack_from("<6h", data, start + 2) == (-2000, 0, 0, 0, 0, 0)


def rtde_version_accepted(host):
    with socket.create_connection((host, 30004), timeout=5.0) as client:
        client.sendall(bytes.fromhex("0005560002"))
        return client.recv(16) == bytes.fromhex("00045601")


def test_every_model_of_a_ur(tmp_path):
    """One that is not named is the UR10; one with an e has a sensor, which the driver reads."""
    with emulate("ur", "--host", "127.0.42.11") as (_, ur10):
        assert ur10 == [{"device": "ur10", "host": "127.0.42.11"}]
    arguments = ("ur", "--model", "UR5e", "--host", "127.0.42.12", "--wrench=0,0,-15,0,0,0")
    with emulate(*arguments) as (_, ur5e), UrToolForce("127.0.42.12", model="UR5e") as sensor:
        assert ur5e == [{"device": "ur5e", "host": "127.0.42.12"}]
        assert wait_until(sensor.drain, "a reading")[-1].value.fz == -15.0


def test_a_cb3_arm_has_no_sensor_to_feed():
    done = subprocess.run([*PUSH, "ur", "--model", "ur5", "--wrench=1,0,0,0,0,0"], capture_output=True, text=True)
    assert done.returncode == 2
    assert "a UR5 has no force sensor" in done.stderr


def test_two_robots_side_by_side():
    with emulate("ur10", "--host", "127.0.42.1") as (_, one), emulate("ur10", "--host", "127.0.42.2") as (_, two):
        assert (one, two) == ([{"device": "ur10", "host": "127.0.42.1"}], [{"device": "ur10", "host": "127.0.42.2"}])
        assert rtde_version_accepted("127.0.42.1")
        assert rtde_version_accepted("127.0.42.2")


def test_ridgeback_is_found_by_a_plain_client():
    with emulate("ridgeback", "--port", "0") as (_, [endpoint]):
        assert endpoint["device"] == "ridgeback"
        assert endpoint["url"].startswith("ws://127.0.0.1:")
        client = websocket.create_connection(endpoint["url"], timeout=5.0)
        with contextlib.closing(client):
            call = {"op": "call_service", "service": "/rosapi/topic_type", "args": {"topic": "/cmd_vel"}}
            client.send(json.dumps(call))
            assert json.loads(client.recv())["values"] == {"type": "geometry_msgs/Twist"}


def test_two_bridges_on_one_port_number():
    with emulate("ridgeback", "--host", "127.0.42.5", "--port", "9191") as (_, one):
        assert one == [{"device": "ridgeback", "url": "ws://127.0.42.5:9191"}]
        with emulate("ridgeback", "--host", "127.0.42.6", "--port", "9191") as (_, two):
            assert two == [{"device": "ridgeback", "url": "ws://127.0.42.6:9191"}]


def test_all_share_one_world():
    """The sensor of the world reads tool weight and bias: not zero, and not what `ft300` alone reads."""
    where = ("--arm-host", "127.0.42.7", "--base-host", "127.0.42.8", "--base-port", "9292")
    with emulate("all", "emulated", "--seed", "3", *where, lines=3) as (child, endpoints):
        ft, ur, base = endpoints
        assert ur["host"] == "127.0.42.7"
        assert base["url"] == "ws://127.0.42.8:9292"
        assert [endpoint["device"] for endpoint in endpoints] == ["ft300", "ur10", "ridgeback"]
        forces = [value / 100.0 for value in registers_of(ft["port"])[:3]]
        assert max(abs(force) for force in forces) > 10.0
        assert rtde_version_accepted(ur["host"])
        websocket.create_connection(base["url"], timeout=5.0).close()
        child.send_signal(signal.SIGTERM)
        assert child.wait(timeout=10) == 0


QUIET = (
    *("--set", "world.sensor.noise_force_N=0", "--set", "world.sensor.noise_torque_Nm=0"),
    *("--set", "world.sensor.bias=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"),
)


def forces_within(port, wanted, within_s=10.0):
    """Wait until the sensor reads these forces (N), to 0.02 N: it counts in 0.01 N."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        forces = [value / 100.0 for value in registers_of(port)[:3]]
        if forces == pytest.approx(wanted, abs=0.02):
            return True
    raise AssertionError(f"it reads {forces}, not {wanted}")


def test_hands_press_and_move_the_arm_by_lines_on_stdin():
    """0.6 kg weigh 5.886 N; with the last joint at pi/2 the sensor's x points up (docs/frames-and-signs.md)."""
    where = ("--arm-host", "127.0.42.11", "--base-host", "127.0.42.12", "--base-port", "0")
    with emulate("all", *where, *QUIET, lines=3, stdin=subprocess.PIPE) as (child, [ft, *_]):

        def say(line):
            child.stdin.write(line.encode() + b"\n")
            child.stdin.flush()

        assert forces_within(ft["port"], [-5.69, -1.52, 0.0])
        say('{"hand": {"force_body_N": [-10, 0, 0], "for_s": 3600}}')
        assert forces_within(ft["port"], [-5.69, -1.52, -10.0])
        for nonsense in ("{", "[]", "{}", '{"arm_rad": [1, 2]}', '{"hand": {"force_body_N": [1, 2, 3], "for_s": 0}}',
                         '{"hand": {"force_body_N": [1e999, 0, 0], "for_s": 1}}', "x" * 10_000):  # fmt: skip
            say(nonsense)
        say('{"arm_rad": [1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.5708], "in_s": 0.1}')
        assert forces_within(ft["port"], [-5.89, 0.0, -10.0])
        child.stdin.close()
        assert forces_within(ft["port"], [-5.89, 0.0, -10.0]), "the end of the lines ends nothing"
        child.send_signal(signal.SIGTERM)
        assert child.wait(timeout=10) == 0
        told = child.stderr.read().decode().splitlines()
    assert len(told) == 7
    assert told[0].startswith("push: line 2 of stdin is not understood and does nothing: ")
    assert "neither `hand` nor `arm_rad`" in told[2]


def test_a_file_of_lines_is_read_at_once(tmp_path):
    lines = tmp_path / "lines"
    lines.write_text('{"hand": {"force_body_N": [-10, 0, 0], "for_s": 3600}}\n')
    where = ("--arm-host", "127.0.42.13", "--base-host", "127.0.42.14", "--base-port", "0")
    with lines.open() as file, emulate("all", *where, *QUIET, lines=3, stdin=file) as (_, [ft, *_rest]):
        assert forces_within(ft["port"], [-5.69, -1.52, -10.0])


@pytest.mark.parametrize(
    ("argv", "port", "options"),
    [
        (["ur10", "--host", "127.0.42.9"], 30004, ["--host 127.x.y.z"]),
        (["all", "--arm-host", "127.0.42.9"], 30004, ["--arm-host 127.x.y.z"]),
        (["ridgeback", "--host", "127.0.42.9", "--port", "9090"], 9090, ["--host 127.x.y.z", "--port"]),
        (
            ["all", "--arm-host", "127.0.42.10", "--base-host", "127.0.42.9", "--base-port", "9090"],
            9090,
            ["--base-host 127.x.y.z", "--base-port"],
        ),
    ],
)
def test_a_taken_address_names_the_option_for_another(argv, port, options, capsys):
    with socket.create_server(("127.0.42.9", port)):
        assert cli.main(["emulate", *argv, "--json"]) == 3
    error = json.loads(capsys.readouterr().out.splitlines()[-1])["error"]
    assert error["where"] == f"127.0.42.9:{port}"
    assert all(option in error["do"] for option in options)


def test_a_taken_address_is_one_sentence():
    with emulate("ur10", "--host", "127.0.42.3"):
        second = subprocess.run(
            [*PUSH, "ur10", "--host", "127.0.42.3", "--json"],
            cwd=ROOT, capture_output=True, text=True, timeout=30, check=False,
        )  # fmt: skip
    assert second.returncode == 3
    assert second.stderr.count("\n") == 1
    assert "127.0.42.3" in second.stderr
    assert json.loads(second.stdout)["error"]["code"] == 3


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_0_and_frees_the_ports(number):
    with emulate("ur10", "--host", "127.0.42.4") as (child, _):
        child.send_signal(number)
        assert child.wait(timeout=10) == 0
        assert child.stderr.read() == b""
        with pytest.raises(OSError, match=os.strerror(errno.ECONNREFUSED)):
            rtde_version_accepted("127.0.42.4")


@pytest.mark.parametrize(
    "argv",
    [
        ["ur10", "--host", "0.0.0.0"],
        ["ur10", "--host", "192.168.131.40"],
        ["ur10", "--host", "localhost"],
        ["ridgeback", "--host", "::1"],
        ["ridgeback", "--port", "70000"],
        ["all", "nonsense"],
        ["all", "--set", "world.slider.mass_kg=-1"],
        ["all", "--base-host", "10.0.0.1"],
        ["ft300", "--wrench=1,2,3"],
        ["ft300", "--wrench=1,2,3,4,5,nan"],
        ["ft300", "--step-after-s", "1"],
        ["ft300", "--latency-ms", "2"],
        ["toaster"],
        [],
    ],
)
def test_what_cannot_be_is_a_usage_error(argv, capsys):
    assert cli.main(["emulate", *argv, "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out)["error"]["code"] == 2
    assert err.count("\n") == 1


def test_people_get_a_line_they_can_read():
    with subprocess.Popen(
        [*PUSH, "ft300"], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as child:
        try:
            assert read_line(child).decode().split()[0] == "ft300"
        finally:
            child.kill()
