"""RTDE frames of the emulated controller, against bytes written down from the RTDE guide and from captures."""

import itertools
import socket
import struct

import pytest

from tests.wire.ur_process import EmulatorProcess, wait_until

HELD_POSE = bytes.fromhex(
    "3ff921ff2e48e8a7bfc65604189374bc3ff921ff2e48e8a7bff6573eab367a103ff921ff2e48e8a73ff4f5c28f5c28f6"
)


class RawRtde:
    """A socket to port 30004 that sends hex and reads whole frames."""

    def __init__(self, host: str) -> None:
        self.socket = socket.create_connection((host, 30004), timeout=3)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def __enter__(self) -> "RawRtde":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, data_hex: str) -> None:
        self.socket.sendall(bytes.fromhex(data_hex))

    def frame(self) -> bytes:
        head = self._exactly(3)
        return head + self._exactly(int.from_bytes(head[:2]) - 3)

    def ask(self, data_hex: str) -> str:
        self.send(data_hex)
        return self.frame().hex()

    def ask_text(self, kind: str, head: bytes, names: str) -> bytes:
        """Send an O or I frame; return the reply's payload."""
        body = head + names.encode()
        self.socket.sendall(struct.pack(">HB", 3 + len(body), ord(kind)) + body)
        reply = self.frame()
        assert reply[2:3] == kind.encode()
        return reply[3:]

    def at_end(self) -> bool:
        while True:
            if self.socket.recv(4096) == b"":
                return True

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            got = self.socket.recv(count - len(data))
            assert got, "the emulator closed the connection"
            data += got
        return data


@pytest.fixture(scope="module")
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


@pytest.fixture
def rtde(robot):
    with RawRtde(robot.host) as connection:
        yield connection


@pytest.fixture
def rtde2(rtde):
    assert rtde.ask("0005560002") == "00045601"
    return rtde


def test_protocol_2_is_accepted_and_3_refused(rtde) -> None:
    assert rtde.ask("0005560003") == "00045600"
    assert rtde.ask("0005560002") == "00045601"


def test_version(rtde) -> None:
    assert rtde.ask("000376") == "001376000000030000000f0000000800019f63"


def test_output_setup_start_and_first_data_frame(rtde2) -> None:
    names = b"timestamp,actual_q,robot_mode,safety_status_bits,".hex()
    assert rtde2.ask("003c4f405f400000000000" + names) == "00204f01" + b"DOUBLE,VECTOR6D,INT32,UINT32".hex()
    assert rtde2.ask("000353") == "00045301"
    data = rtde2.frame()
    assert len(data) == 68
    assert data[:4].hex() == "00445501"
    assert data[12:60] == HELD_POSE
    assert data[60:].hex() == "0000000700000001"
    assert struct.unpack(">d", rtde2.frame()[4:12])[0] == pytest.approx(struct.unpack(">d", data[4:12])[0] + 0.008)


def test_input_setups_count_from_one(rtde2) -> None:
    assert rtde2.ask("001849" + b"input_int_register_0,".hex()) == "00094901" + b"INT32".hex()
    both = b"input_int_register_0,input_double_register_0,".hex()
    assert rtde2.ask("003049" + both) == "00104902" + b"INT32,DOUBLE".hex()


def test_a_refused_input_setup_uses_up_no_number(rtde2) -> None:
    assert rtde2.ask_text("I", b"", "input_int_register_1,no_such_input") == b"\x00INT32,NOT_FOUND"
    assert rtde2.ask_text("I", b"", "input_int_register_1") == b"\x01INT32"


def test_an_input_belongs_to_one_connection_until_it_closes(robot, rtde2) -> None:
    assert rtde2.ask_text("I", b"", "input_int_register_5") == b"\x01INT32"
    with RawRtde(robot.host) as other:
        assert other.ask("0005560002") == "00045601"
        assert other.ask_text("I", b"", "input_int_register_6,input_int_register_5") == b"\x00INT32,IN_USE"
        rtde2.socket.close()

        def free() -> bool:
            return other.ask_text("I", b"", "input_int_register_5") == b"\x01INT32"

        wait_until(free, "the input is free again")


def test_written_inputs_are_kept_after_the_client_is_gone(robot, rtde2) -> None:
    assert rtde2.ask_text("I", b"", "input_int_register_7") == b"\x01INT32"
    assert rtde2.ask_text("I", b"", "input_int_register_7,input_double_register_7") == b"\x02INT32,DOUBLE"
    rtde2.send("00105502000000104024000000000000")  # recipe 2: 16, 10.0
    wait_until(lambda: robot.get("controller.registers.double_in")[7] == 10.0, "the write arrives")
    rtde2.socket.close()
    wait_until(lambda: not robot.get("rtde.owners"), "the client is gone")
    with RawRtde(robot.host) as other:
        assert other.ask("0005560002") == "00045601"
        assert other.ask_text("O", struct.pack(">d", 125), "input_int_register_7,input_double_register_7")[0] == 1
        assert other.ask("000353") == "00045301"
        assert other.frame().hex() == "00105501000000104024000000000000"


def test_input_bits_are_kept_like_every_input(robot, rtde2) -> None:
    names = "input_bit_registers0_to_31,input_bit_registers32_to_63,input_bit_register_64,input_bit_register_127"
    assert rtde2.ask_text("I", b"", names) == b"\x01UINT32,UINT32,BOOL,BOOL"
    rtde2.send("000e5501" + "80000001" + "0000ff00" + "01" + "00")
    assert rtde2.ask_text("O", struct.pack(">d", 125), names) == b"\x01UINT32,UINT32,BOOL,BOOL"
    assert rtde2.ask("000353") == "00045301"
    assert rtde2.frame().hex() == "000e5501" + "80000001" + "0000ff00" + "01" + "00"


def test_an_input_frame_of_the_wrong_size_changes_nothing(robot, rtde2) -> None:
    assert rtde2.ask_text("I", b"", "input_int_register_9") == b"\x01INT32"
    before = robot.get("requests.bad_frames")
    rtde2.send("0009550100000001ff")
    rtde2.send("00085502000000ff")
    wait_until(lambda: robot.get("requests.bad_frames") == before + 2, "both are counted as bad")
    assert robot.get("controller.registers.int_in")[9] == 0


def test_start_without_an_output_setup_is_refused(rtde2) -> None:
    assert rtde2.ask("000353") == "00045300"


def test_an_unknown_output_makes_no_recipe(rtde2) -> None:
    assert rtde2.ask_text("O", struct.pack(">d", 125), "timestamp,nonsense") == b"\x00DOUBLE,NOT_FOUND"
    assert rtde2.ask("000353") == "00045300"


def test_version_1_has_no_recipe_numbers(rtde) -> None:
    assert rtde.ask_text("O", b"", "robot_mode,runtime_state") == b"INT32,UINT32"
    assert rtde.ask("000353") == "00045301"
    assert rtde.frame().hex() == "000b550000000700000001"


@pytest.mark.parametrize(("asked_hz", "step_s"), [(125.0, 0.008), (500.0, 0.008), (25.0, 0.040), (62.5, 0.016)])
def test_asked_rates_up_to_125_hz(rtde2, asked_hz: float, step_s: float) -> None:
    assert rtde2.ask_text("O", struct.pack(">d", asked_hz), "timestamp") == b"\x01DOUBLE"
    assert rtde2.ask("000353") == "00045301"
    stamps = [struct.unpack(">d", rtde2.frame()[4:])[0] for _ in range(5)]
    assert [b - a for a, b in itertools.pairwise(stamps)] == pytest.approx([step_s] * 4)


def test_pause_ends_the_data_and_start_resumes(rtde2) -> None:
    rtde2.ask_text("O", struct.pack(">d", 125), "robot_mode")
    rtde2.ask("000353")
    rtde2.send("000350")
    while (frame := rtde2.frame())[2:3] == b"U":
        pass
    assert frame.hex() == "00045001"
    assert rtde2.ask("000376")[:6] == "001376"  # nothing but the answer: data has stopped
    assert rtde2.ask("000353") == "00045301"
    assert rtde2.frame().hex() == "00085501" + "00000007"


def test_replies_while_data_flows(rtde2) -> None:
    rtde2.ask_text("O", struct.pack(">d", 125), "robot_mode")
    rtde2.ask("000353")
    rtde2.frame()
    rtde2.send("000376")
    kinds = {rtde2.frame()[2:3] for _ in range(8)}
    assert kinds == {b"U", b"v"}


def test_requests_in_single_bytes_and_several_in_one_segment(rtde) -> None:
    for byte in bytes.fromhex("0005560002"):
        rtde.socket.sendall(bytes([byte]))
    assert rtde.frame().hex() == "00045601"
    rtde.send("000376000376")
    assert rtde.frame() == rtde.frame()


def test_a_frame_shorter_than_its_header_ends_the_connection(rtde2) -> None:
    rtde2.send("000056")
    assert rtde2.at_end()


def test_text_message(robot, rtde2) -> None:
    robot.call("send_text", "hello")
    assert rtde2.frame().hex() == "00154d05" + b"hello".hex() + "0a" + b"controller".hex() + "03"


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("joint_mode", "VECTOR6INT32"),
        ("actual_digital_input_bits", "UINT64"),
        ("actual_tool_accelerometer", "VECTOR3D"),
        ("payload_cog", "VECTOR3D"),
        ("payload_inertia", "VECTOR6D"),
        ("tool_output_voltage", "INT32"),
        ("runtime_state", "UINT32"),
        ("output_int_register_47", "INT32"),
        ("output_double_register_47", "DOUBLE"),
        ("output_bit_register_64", "BOOL"),
        ("output_int_register_48", "NOT_FOUND"),
        ("ft_raw_wrench", "NOT_FOUND"),
    ],
)
def test_documented_types(rtde2, name: str, kind: str) -> None:
    assert rtde2.ask_text("O", struct.pack(">d", 125), name)[1:].decode() == kind


def test_a_client_that_does_not_read_costs_only_itself(robot, rtde2) -> None:
    with RawRtde(robot.host) as slow:
        slow.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        slow.ask("0005560002")
        names = ",".join(f"output_double_register_{i}" for i in range(48))
        slow.ask_text("O", struct.pack(">d", 125), ",".join([names] * 20))
        slow.ask("000353")
        rtde2.ask_text("O", struct.pack(">d", 125), "timestamp")
        rtde2.ask("000353")
        first = struct.unpack(">d", rtde2.frame()[4:])[0]

        def dropped() -> bool:
            nonlocal first
            stamp = struct.unpack(">d", rtde2.frame()[4:])[0]
            assert stamp == pytest.approx(first + 0.008), "the client that reads misses nothing"
            first = stamp
            return robot.get("counters.data_dropped") > 3

        wait_until(dropped, "frames for the slow client are dropped", within_s=20)
