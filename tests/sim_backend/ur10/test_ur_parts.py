"""The parts of the emulated arm that need no socket, and what it says when its ports are not free."""

import contextlib
import math
import socket
import struct

import pytest

from robot_io.clock import NS_PER_MS, NS_PER_S, VirtualClock
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.ipc.event_loop import EventLoop
from robot_io.messages import LinkState
from sim_backend.sim.ur10 import SimUr10
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.emulator import UrEmulator
from sim_backend.ur10.kinematics import flange_pose, rotation_vector
from sim_backend.ur10.models import BY_NAME, UR10
from sim_backend.ur10.modes import RobotMode, SafetyMode, joint_mode, robot_status_bits, safety_bits
from sim_backend.ur10.registers import Registers, Watchdog
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.rtde_server import RtdeServer
from sim_backend.ur10.standalone import HELD_POSE_RAD, StillArm
from sim_backend.world.plant import ArmTruth
from tests.wire.ur_process import fresh_address


class MovingArm:
    """Joint 0 turns at 1 rad/s from time 0."""

    def read_arm(self, t_ns: int) -> ArmTruth:
        return ArmTruth((t_ns / NS_PER_S, 0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))


def test_flange_pose_of_the_outstretched_arm() -> None:
    """All joints zero: along -x by both links, out to -y by the wrist, d1 - d5 high; half of it from UR's table."""
    x, y, z, rx, ry, rz = flange_pose((0.0,) * 6, UR10)
    assert (x, y, z) == pytest.approx((-1.1843, -0.256141, 0.0116))
    assert (rx, ry, rz) == pytest.approx((math.pi / 2, 0.0, 0.0))


def test_flange_pose_turns_with_the_base_joint() -> None:
    x, y, z, *_ = flange_pose((math.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.0), UR10)
    assert (x, y, z) == pytest.approx((0.256141, -1.1843, 0.0116))


def test_flange_pose_straight_up() -> None:
    x, y, z, *_ = flange_pose((0.0, -math.pi / 2, 0.0, -math.pi / 2, 0.0, 0.0), UR10)
    assert (x, y, z) == pytest.approx((0.0, -0.256141, 0.1273 + 0.612 + 0.5723 + 0.1157))


@pytest.mark.parametrize(
    ("name", "reach_m", "out_m", "up_m"),
    [
        ("ur3", 0.24365 + 0.21325, 0.11235 + 0.0819, 0.1519 - 0.08535),
        ("ur5", 0.425 + 0.39225, 0.10915 + 0.0823, 0.089159 - 0.09465),
        ("ur3e", 0.24355 + 0.2132, 0.13105 + 0.0921, 0.15185 - 0.08535),
        ("ur5e", 0.425 + 0.3922, 0.1333 + 0.0996, 0.1625 - 0.0997),
        ("ur10e", 0.6127 + 0.57155, 0.17415 + 0.11655, 0.1807 - 0.11985),
        ("ur16e", 0.4784 + 0.36, 0.17415 + 0.11655, 0.1807 - 0.11985),
    ],
)
def test_every_model_outstretched(name: str, reach_m: float, out_m: float, up_m: float) -> None:
    """From UR's table: both links, then d4 + d6 to the side, d1 - d5 high."""
    x, y, z, *_ = flange_pose((0.0,) * 6, BY_NAME[name])
    assert (x, y, z) == pytest.approx((-reach_m, -out_m, up_m))


def test_generations() -> None:
    """125 Hz and PolyScope 3 or 500 Hz and PolyScope 5; only the e-Series has a force sensor."""
    assert {name for name, model in BY_NAME.items() if model.generation == "CB3"} == {"ur3", "ur5", "ur10"}
    for model in BY_NAME.values():
        new = model.name.endswith("e")
        assert (model.rate_hz, model.version[0], model.force_range_N is not None) == (
            (500.0, 5, True) if new else (125.0, 3, False)
        )
        assert model.dashboard_name == model.name.rstrip("e")
    assert [BY_NAME[name].force_range_N for name in ("ur3e", "ur5e", "ur10e", "ur16e")] == [30.0, 50.0, 100.0, 160.0]


@pytest.mark.parametrize(
    ("matrix", "vector"),
    [
        (((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0, 0, 0)),
        (((0, -1, 0), (1, 0, 0), (0, 0, 1)), (0, 0, math.pi / 2)),
        (((1, 0, 0), (0, -1, 0), (0, 0, -1)), (math.pi, 0, 0)),
        (((-1, 0, 0), (0, 1, 0), (0, 0, -1)), (0, math.pi, 0)),
        (((-1, 0, 0), (0, -1, 0), (0, 0, 1)), (0, 0, math.pi)),
        (((0, 1, 0), (1, 0, 0), (0, 0, -1)), (math.pi / math.sqrt(2), math.pi / math.sqrt(2), 0)),
    ],
)
def test_rotation_vector(matrix, vector) -> None:
    assert rotation_vector(matrix) == pytest.approx(vector)


def test_bits_of_the_guide() -> None:
    assert safety_bits(SafetyMode.NORMAL) == 0b1
    assert safety_bits(SafetyMode.REDUCED) == 0b10
    assert safety_bits(SafetyMode.PROTECTIVE_STOP) == 0b100_0000_0100
    assert safety_bits(SafetyMode.ROBOT_EMERGENCY_STOP) == 0b100_1100_0000
    assert joint_mode(RobotMode.RUNNING, SafetyMode.NORMAL) == 253
    assert joint_mode(RobotMode.IDLE, SafetyMode.NORMAL) == 255
    assert joint_mode(RobotMode.RUNNING, SafetyMode.FAULT) == 252
    assert robot_status_bits(RobotMode.RUNNING, 2, teach_button=True) == 0b111
    assert robot_status_bits(RobotMode.POWER_OFF, 1, teach_button=False) == 0


def test_watchdog_counts_from_the_last_write() -> None:
    registers = Registers()
    watchdog = Watchdog(registers, 24, 10.0, now_ns=0)
    assert not watchdog.tripped(100 * NS_PER_MS)
    assert watchdog.tripped(100 * NS_PER_MS + 1)
    registers.write_int(24, 0, 90 * NS_PER_MS)
    assert not watchdog.tripped(190 * NS_PER_MS)
    assert watchdog.tripped(190 * NS_PER_MS + 1)
    registers.write_int(0, 0, 190 * NS_PER_MS)
    assert watchdog.tripped(190 * NS_PER_MS + 1), "another register does not count"


def test_a_taken_address_is_one_sentence() -> None:
    host = fresh_address()
    loop = EventLoop()
    first = UrEmulator(loop, StillArm(), host=host)
    with pytest.raises(EnvironmentFault, match="already in use") as caught:
        UrEmulator(loop, StillArm(), host=host)
    assert caught.value.where == f"{host}:30004"
    first.close()
    first.close()
    UrEmulator(loop, StillArm(), host=host).close()
    loop.close()


def test_a_half_taken_address_leaves_nothing_open() -> None:
    host = fresh_address()
    loop = EventLoop()
    with socket.create_server((host, 30003)), pytest.raises(EnvironmentFault) as caught:
        UrEmulator(loop, StillArm(), host=host)
    assert caught.value.where == f"{host}:30003"
    UrEmulator(loop, StillArm(), host=host).close()
    loop.close()


def test_a_flood_of_requests_is_taken_a_little_at_a_time() -> None:
    """4096 bytes of one client in a turn of the loop, so that the cycle and the other clients have theirs between."""
    loop, log = EventLoop(), RequestLog()
    # The port alone: a cycle that is late reads as well, and how many are late depends on the machine.
    host = fresh_address()
    server = RtdeServer(loop, host, UrController(StillArm(), UR10, now_ns=0), log)
    requests = 0
    with socket.create_connection((host, 30004)) as client:
        client.sendall(b"\x00\x03v" * 20_000)
        while requests < 20_000:
            log.handshake.clear()
            loop.run_once(1000)
            assert len(log.handshake) <= 4096 / 3 + 1  # one may have begun in the turn before
            requests += len(log.handshake)
    server.close()
    loop.close()


def test_many_clients_may_come_at_once() -> None:
    """Before the emulator has had its turn; beyond the queue a client would wait a second to try again."""
    loop = EventLoop()
    emulator = UrEmulator(loop, StillArm(), host=fresh_address())
    with contextlib.ExitStack() as stack:
        for _ in range(100):
            stack.enter_context(socket.create_connection((emulator.host, 30004), timeout=0.5))
        while emulator.rtde.accepted < 100:
            loop.run_once(1000)
    emulator.close()
    loop.close()


def test_a_client_gone_before_its_greeting_is_forgotten() -> None:
    loop = EventLoop()
    emulator = UrEmulator(loop, StillArm(), host=fresh_address())
    with socket.create_connection((emulator.host, 29999)) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closes with RST
    while not emulator.dashboard.accepted:
        loop.run_once(1000)
    assert not emulator.dashboard.clients
    emulator.close()
    loop.close()


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.131.40", "localhost", ""])
def test_only_loopback(host: str) -> None:
    loop = EventLoop()
    with pytest.raises(UsageError, match="loopback"):
        UrEmulator(loop, StillArm(), host=host)
    loop.close()


def test_simulated_arm_samples_its_own_grid() -> None:
    clock = VirtualClock(5 * NS_PER_S)
    with SimUr10(MovingArm(), clock, rate_hz=125.0, phase=0.25) as arm:
        assert arm.read() is None
        assert arm.drain() == ()
        clock.advance_to(5 * NS_PER_S + 2 * NS_PER_MS)
        (first,) = arm.drain()
        assert (first.seq, first.received_ns) == (1, 5 * NS_PER_S + 2 * NS_PER_MS)
        assert first.value.position[0] == pytest.approx(5.002)
        assert first.value.velocity[0] == 1.0
        assert arm.drain() == ()
        clock.advance_to(5 * NS_PER_S + 9 * NS_PER_MS)
        assert arm.drain() == (), "the next is due at 10 ms"
        clock.advance_to(5 * NS_PER_S + 30 * NS_PER_MS)
        (newest,) = arm.drain()
        assert (newest.seq, newest.received_ns) == (4, 5 * NS_PER_S + 26 * NS_PER_MS)
        record = arm.read()
        assert record is not None
        assert (record.changed_ns, record.published_ns) == (newest.received_ns, newest.received_ns)
        assert record.link == LinkState.UP
    assert arm.health().state == LinkState.CLOSED


def test_simulated_arm_is_the_same_twice() -> None:
    def run() -> list[object]:
        clock = VirtualClock()
        taken: list[object] = []
        with SimUr10(StillArm(), clock) as arm:
            for tick in range(100):
                clock.advance_to(tick * 10 * NS_PER_MS)
                taken.extend(arm.drain())
        return taken

    first = run()
    assert first == run()
    assert len(first) > 90
    assert first[0].value.position == HELD_POSE_RAD  # type: ignore[attr-defined]  # a Stamped[JointState]
