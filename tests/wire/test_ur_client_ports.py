"""Ports 30001 to 30003 byte by byte: lengths and places of the client interface manual, never our own codec."""

import itertools
import socket
import struct
from contextlib import closing

import pytest

from tests.wire.ur_process import EmulatorProcess, wait_until

HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31)
# "URControl", 3, 15, bugfix 8, build 106339 = 0x00019f63, "Oct 05 2021"; its time stamp is left out
VERSION_HEAD = bytes.fromhex("0000002e 14")
VERSION_TAIL = bytes.fromhex(
    "fe 03 09 5552436f6e74726f6c 03 0f 00000008 00019f63 4f6374203035203230 3231".replace(" ", "")
)
PARTS_LATER = {0: 47, 1: 251, 4: 101, 3: 72, 2: 37, 7: 61, 8: 7}
"""Kind -> length in bytes of the parts of a CB3 with PolyScope 3.15, in every packet."""
PARTS_FIRST = PARTS_LATER | {5: 225, 6: 445}


@pytest.fixture(scope="module")
def robot():
    with EmulatorProcess(power_step_s=0.02) as emulator:
        yield emulator


class Packets:
    """One connection to a port; packets as (type, body)."""

    def __init__(self, host: str, port: int) -> None:
        self.socket = socket.create_connection((host, port), timeout=3)

    def close(self) -> None:
        self.socket.close()

    def send(self, text: str) -> None:
        self.socket.sendall(text.encode())

    def raw(self) -> bytes:
        head = self.socket.recv(4, socket.MSG_WAITALL)
        return head + self.socket.recv(int.from_bytes(head) - 4, socket.MSG_WAITALL)

    def next(self, kind: int) -> bytes:
        """Return the next packet of a type (16 state, 20 message), whole."""
        while True:
            packet = self.raw()
            if packet[4] == kind:
                return packet

    def message(self, kind: int) -> bytes:
        """Return the body of the next message of a kind, behind time stamp, source and kind."""
        while True:
            packet = self.next(20)
            if packet[14] == kind:
                return packet[15:]


def parts(packet: bytes) -> dict[int, bytes]:
    found: dict[int, bytes] = {}
    at = 5
    while at < len(packet):
        length, kind = struct.unpack_from(">iB", packet, at)
        found[kind] = packet[at + 5 : at + length]
        at += length
    assert at == len(packet)
    return found


@pytest.mark.parametrize("port", [30001, 30002])
def test_a_connection_begins_with_the_version_and_the_whole_state(robot, port: int) -> None:
    with closing(Packets(robot.host, port)) as client:
        version, first, later = client.raw(), client.raw(), client.raw()
    assert version[:5] == VERSION_HEAD
    assert version[13:] == VERSION_TAIL
    own = {9: 53} if port == 30001 else {}
    assert {kind: len(body) + 5 for kind, body in parts(first).items()} == PARTS_FIRST | own
    assert {kind: len(body) + 5 for kind, body in parts(later).items()} == PARTS_LATER | own


def test_the_state_of_a_healthy_arm_at_rest(robot) -> None:
    with closing(Packets(robot.host, 30002)) as client:
        state = parts(client.next(16))
    # connected, enabled, power on, no stops, no program; mode 7, position control; fraction, scaling and its limit 1
    assert state[0][8:].hex() == "010101" + "00000000" + "0700" + "3ff0000000000000" * 3 + "00"
    # base joint: 1.5708 twice, at rest, 0.05 A, 47.5 V, 31 degrees, 0, running (253)
    assert state[1][:41].hex() == "3ff921ff2e48e8a7" * 2 + "00" * 8 + "3d4ccccd423e000041f8000000000000" + "fd"
    assert struct.unpack(">6d", state[4][:48]) == pytest.approx(robot.get("controller.tcp_pose"))
    assert state[4][48:] == bytes(48), "no tool"
    # the calibration is the published one: d1 = 0.1273, a2 = -0.612, alpha1 = pi/2, status 0
    assert state[5][72 + 8 : 72 + 16].hex() == "bfe395810624dd2f"
    assert state[5][120:128].hex() == "3fc04b5dcc63f141"
    assert state[5][168:176].hex() == "3ff921fb54442d18"
    assert state[5][216:] == bytes(4)
    # joints turn 363 degrees; the base trips at 120 degrees/s and 0.2 rad/s more; the type of a UR10 is 2
    assert struct.unpack(">2d", state[6][:16]) == pytest.approx((-6.33555, 6.33555), abs=1e-5)
    assert struct.unpack(">2d", state[6][96:112]) == pytest.approx((2.29440, 40.0), abs=1e-5)
    assert struct.unpack(">i", state[6][-8:-4]) == (2,)
    assert state[8] == b"\x00\x01", "teach button not pressed, but enabled"


@pytest.mark.parametrize(
    ("fault", "undo", "flags"),
    [
        ("protective_stop", "clear_stop", "01010100010000"),
        ("safeguard_stop", "clear_stop", "01010100000000"),
    ],
)
def test_stops_are_flags_of_the_state(robot, fault: str, undo: str, flags: str) -> None:
    robot.call(fault)
    with closing(Packets(robot.host, 30002)) as client:
        assert parts(client.next(16))[0][8:15].hex() == flags
    robot.call(undo)


@pytest.mark.parametrize(
    ("version", "length", "mode_length"),
    [
        ((3, 1, 0, 0), 1044, 46),
        ((3, 4, 0, 0), 1060, 46),
        ((3, 5, 0, 0), 1108, 47),
        ((3, 10, 0, 0), 1116, 47),
        ((3, 14, 0, 0), 1140, 47),
        ((3, 15, 8, 106339), 1220, 47),
    ],
)
@pytest.mark.long
def test_packets_are_as_long_as_in_the_manual_of_each_version(version, length: int, mode_length: int) -> None:
    with EmulatorProcess(version=version) as old, closing(Packets(old.host, 30003)) as realtime:
        assert len(realtime.raw()) == length
        with closing(Packets(old.host, 30002)) as secondary:
            assert len(parts(secondary.next(16))[0]) + 5 == mode_length


def test_the_real_time_packet(robot) -> None:
    with closing(Packets(robot.host, 30003)) as client:
        one, two = client.raw(), client.raw()
    assert one[:4].hex() == "000004c4", "1220 bytes"
    assert struct.unpack_from(">d", two, 4)[0] - struct.unpack_from(">d", one, 4)[0] == pytest.approx(0.008)
    for first in (12, 252):  # q target, q actual
        assert struct.unpack_from(">6d", one, first) == HELD
    assert struct.unpack_from(">6d", one, 444) == pytest.approx(robot.get("controller.tcp_pose"))
    assert struct.unpack_from(">d", one, 756) == (7.0,), "robot mode"
    assert struct.unpack_from(">6d", one, 764) == (253.0,) * 6, "joint modes"
    assert struct.unpack_from(">d", one, 812) == (1.0,), "safety mode"
    assert struct.unpack_from(">d", one, 940) == (1.0,), "speed scaling"
    assert struct.unpack_from(">d", one, 1052) == (1.0,), "no program"


def test_rates_are_ten_and_a_hundred_and_twenty_five(robot) -> None:
    """By the controller's own clock: state 100 ms apart on average, 12 or 13 cycles each."""
    with closing(Packets(robot.host, 30002)) as client:
        client.next(16)
        stamps = [int.from_bytes(parts(client.next(16))[0][:8]) for _ in range(7)]
    gaps = [(b - a) / 8e6 for a, b in itertools.pairwise(stamps[1:])]
    assert set(map(round, gaps)) == {12, 13}


def test_a_program_is_told_of_from_start_to_end(robot) -> None:
    with closing(Packets(robot.host, 30001)) as client:
        client.next(16)
        client.send('def hello():\n  textmsg("q is ", 0.5)\n  sleep(0.02)\nend\n')
        started = bytes.fromhex("00000000 00000000 13".replace(" ", "")) + b"PROGRAM_XXX_STARTED" + b"hello"
        assert client.message(7) == started
        assert client.message(0) == b"q is 0.5"
        assert client.message(7)[-24:] == b"PROGRAM_XXX_STOPPEDhello"


@pytest.mark.parametrize(
    ("body", "line", "column", "text"),
    [
        ("  calldoesntexist()\n", 2, 3, b"compile_error_name_not_found:calldoesntexist:"),
        ("  pose = get_target_tcp_pose()\n  movel(pos)\n", 3, 3, b"compile_error_name_not_found:pos:"),
        ("  movej([0,0,0\n", 2, 1, b"syntax_error_on_line:2:  movej([0,0,0:"),
        ("  thread a():\n    sync()\n  end\n", 2, 3, b"compile_error_not_emulated:thread:"),
        ("  force_mode(p[0,0,0,0,0,0])\n", 2, 3, b"compile_error_name_not_found:force_mode:"),
    ],
)
def test_a_program_it_cannot_run_is_an_error_on_the_primary_port(
    robot, body: str, line: int, column: int, text: bytes
) -> None:
    started = robot.get("counters.programs_started")
    with closing(Packets(robot.host, 30001)) as client:
        client.next(16)
        client.send(f"def bad():\n{body}end\n")
        assert client.message(10) == struct.pack(">ii", line, column) + text
    assert robot.get("counters.programs_started") == started


def test_a_program_without_a_pause_is_ended(robot) -> None:
    with closing(Packets(robot.host, 30001)) as client:
        client.next(16)
        client.send("def spin():\n  while True:\n    x = 1\n  end\nend\n")
        assert client.message(10)[8:] == b"Runtime is too much behind"
    wait_until(lambda: robot.get("controller.runtime_state") == 1, "it is over")


def test_a_secondary_program_speaks_beside_the_first(robot) -> None:
    with closing(Packets(robot.host, 30001)) as client:
        client.next(16)
        client.send('sec beside():\n  textmsg("here")\nend\n')
        assert client.message(0) == b"here"


def test_the_commands_of_urs_own_client(robot) -> None:
    with closing(Packets(robot.host, 30001)) as client:
        client.send("power off\n")
        wait_until(lambda: robot.get("controller.robot_mode") == 3, "off")
        client.send("power on\n")
        wait_until(lambda: robot.get("controller.robot_mode") == 5, "brakes are on")
        client.send("power off\nset robotmode run\n")
        wait_until(lambda: robot.get("controller.robot_mode") == 7, "runs")
        client.send("def long():\n  sleep(60)\nend\n")
        wait_until(lambda: robot.get("controller.runtime_state") == 2, "plays")
        client.send("stop program\n")
        wait_until(lambda: robot.get("controller.runtime_state") == 1, "stopped")
        client.send("set speed 0.25\n")
        wait_until(lambda: robot.get("controller.speed_fraction") == 0.25, "slower")
        client.send("set speed 1\n")
        wait_until(lambda: robot.get("controller.speed_fraction") == 1.0, "as before")


def test_a_safety_mode_is_reported(robot) -> None:
    with closing(Packets(robot.host, 30001)) as client:
        client.next(16)
        robot.call("protective_stop")
        assert client.message(5) == bytes(8) + b"\x03" + bytes(8)
        robot.call("clear_stop")


def test_a_client_that_does_not_read_loses_state_and_no_more(robot) -> None:
    dropped = robot.get("counters.state_dropped")
    with socket.socket() as lazy, closing(Packets(robot.host, 30003)) as keen:
        lazy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        lazy.connect((robot.host, 30003))
        while robot.get("counters.state_dropped") == dropped:
            assert len(keen.raw()) == 1220


@pytest.mark.long
def test_a_script_of_variables_poses_and_moves_comes_where_it_says(robot) -> None:
    """0.1 m along the tool's y axis, without a turn: UR's own example for sending a script."""
    with closing(Packets(robot.host, 30001)) as client:
        client.next(16)
        client.send(
            "def example():\n  movej([0,-1.2,1.2,-0.1,1.57,0])\n  sleep(0.6)\n  here = get_target_tcp_pose()\n"
            "  way = p[0,-0.1,0,0,0,0]\n  movel(pose_trans(here, way), t=1)\nend\n"
        )
        client.message(7)
        there = pytest.approx([0, -1.2, 1.2, -0.1, 1.57, 0], abs=1e-9)
        wait_until(lambda: robot.get("controller.motion.actual") == there, "there")
        here = robot.get("controller.tcp_pose")
        assert client.message(7)[-26:] == b"PROGRAM_XXX_STOPPEDexample"
    there = robot.get("controller.tcp_pose")
    assert there[3:] == pytest.approx(here[3:], abs=1e-9)
    assert sum((a - b) ** 2 for a, b in zip(here[:3], there[:3], strict=True)) == pytest.approx(0.01)


def test_registers_go_through_a_program(robot) -> None:
    """The mirror that UR's own example for writing over RTDE uploads."""
    with closing(Packets(robot.host, 30001)) as client:
        client.send(
            "def mirror():\n  while (True):\n"
            "    write_output_boolean_register(64, not read_input_boolean_register(64))\n"
            "    write_output_integer_register(24, read_input_integer_register(24) + 1)\n"
            "    write_output_float_register(24, -1.0 * read_input_float_register(24))\n"
            "    sync()\n  end\nend\n"
        )
        wait_until(lambda: robot.get("controller.registers.int_out")[24] == 1, "0 + 1")
        assert robot.get("controller.registers.bits_out")[64] is True
        client.send("stop program\n")
        wait_until(lambda: robot.get("controller.runtime_state") == 1, "stopped")
