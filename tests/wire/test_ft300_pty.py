"""The emulated sensor as a plain program sees it that opens its port, with nothing of ours in between."""

from __future__ import annotations

import itertools
import os
import select
import termios
import time
from pathlib import Path

import pytest

from robot_io.errors import EnvironmentFault
from robot_io.ipc.event_loop import EventLoop
from sim_backend.ft300.emulator import Ft300Emulator
from sim_backend.ft300.pty import PtyPort
from sim_backend.ft300.standalone import ConstantWrench
from tests.how_many import mostly_long
from tests.wire.ft300_process import ft300_process, until

PACKET = bytes.fromhex("20 4E D2 04 D2 E9 10 27 64 00 32 FB 8A 0C 0C 17")
START = bytes.fromhex("09 10 01 9A 00 01 02 02 00 CD CA")
STARTED = bytes.fromhex("09 10 01 9A 00 01 21 52")
READ_FIRMWARE = bytes.fromhex("09 03 01 F4 00 01 C5 4C")
FIRMWARE = bytes.fromhex("09 03 02 46 54 6A 1A")


def open_port(path, *, set_speed=True):
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    if set_speed:
        attributes = termios.tcgetattr(fd)
        attributes[4] = attributes[5] = termios.B19200
        termios.tcsetattr(fd, termios.TCSANOW, attributes)
    return fd


def read_for(fd, wanted, limit_s=3.0):
    """Return at least `wanted` bytes, or what came within the limit."""
    data = b""
    deadline_s = time.monotonic() + limit_s
    while len(data) < wanted and (left_s := deadline_s - time.monotonic()) > 0:
        if select.select([fd], [], [], left_s)[0]:
            data += os.read(fd, 4096)
    return data


def test_a_client_that_only_listens_hears_a_streaming_sensor_twice():
    with ft300_process(streaming=True) as emulator:
        for _ in range(2):
            fd = open_port(emulator.port)
            assert PACKET * 3 in read_for(fd, 16 * 6)
            os.close(fd)


def test_nothing_is_echoed_and_hostile_bytes_pass():
    wrench = (25.73, 48.81, -0.01, 6.659, 32.540, 3.338)
    packet = bytes.fromhex("20 4E 0D 0A 11 13 FF FF 03 1A 1C 7F 0A 0D CF 13")
    with ft300_process(streaming=True, wrench=wrench) as emulator:
        fd = open_port(emulator.port)
        assert packet * 3 in read_for(fd, 16 * 6)
        assert emulator.counters()["junk_bytes"] == 0  # what it sent did not come back to it
        os.close(fd)


def test_the_emulator_does_not_hold_the_port_open():
    with ft300_process() as emulator:
        held = {str(fd.readlink()) for fd in Path(f"/proc/{emulator.pid}/fd").iterdir()}
        assert emulator.port not in held


def test_what_is_sent_while_nobody_listens_is_lost_not_queued():
    with ft300_process(streaming=True) as emulator:
        fd = open_port(emulator.port)
        assert until(lambda: emulator.counters()["bytes_delivered"] > 500)  # and never read
        os.close(fd)
        lost = emulator.counters()["bytes_lost"]
        assert until(lambda: emulator.counters()["bytes_lost"] > lost + 300)
        delivered = emulator.counters()["bytes_delivered"]
        fd = open_port(emulator.port)
        data = read_for(fd, 16 * 10)
        assert PACKET in data
        assert len(data) <= emulator.counters()["bytes_delivered"] - delivered  # nothing from before
        os.close(fd)


def test_a_reader_that_stopped_reading_does_not_grow_the_emulator():
    loop = EventLoop()
    emulator = Ft300Emulator(loop, ConstantWrench(), streaming=True)
    emulator.start()
    fd = open_port(emulator.port)
    deadline_s = time.monotonic() + 0.5
    while time.monotonic() < deadline_s:
        loop.run_once(20)
    assert len(emulator._to_host) <= 16
    os.close(fd)
    emulator.close()
    emulator.close()
    loop.close()


def test_requests_glued_to_a_long_backlog_of_stop_bytes_are_answered():
    with ft300_process() as emulator:
        fd = open_port(emulator.port)
        os.write(fd, b"\xff" * 1100 + READ_FIRMWARE)
        sent_s = time.monotonic()
        assert read_for(fd, 7) == FIRMWARE
        assert time.monotonic() - sent_s > 1100 / 1920  # they had to travel first
        os.close(fd)


@pytest.mark.long
def test_a_backlog_greater_than_the_queue_waits_in_the_kernel():
    with ft300_process() as emulator:
        fd = open_port(emulator.port)
        data = b"\xff" * 4300 + READ_FIRMWARE
        while data:
            select.select([], [fd], [], 3.0)
            data = data[os.write(fd, data[:2000]) :]
        assert read_for(fd, 7, 10.0) == FIRMWARE
        os.close(fd)


def test_the_start_is_acknowledged_before_the_first_packet_and_requests_are_ignored_then():
    with ft300_process() as emulator:
        fd = open_port(emulator.port)
        os.write(fd, START)
        data = read_for(fd, 8 + 16 * 4)
        assert data.startswith(STARTED + PACKET * 3)
        os.write(fd, READ_FIRMWARE)
        assert FIRMWARE not in read_for(fd, 16 * 8)
        os.close(fd)


@pytest.mark.parametrize(("count", "stops"), [(49, False), (50, True)])
def test_fifty_stop_bytes_stop_and_forty_nine_do_not(count, stops):
    with ft300_process(streaming=True) as emulator:
        fd = open_port(emulator.port)
        read_for(fd, 16)
        os.write(fd, b"\xff" * (count - 20))
        time.sleep(0.03)  # a pause between them does not matter
        os.write(fd, b"\xff" * 20)
        assert until(lambda: not emulator.ask("state")["streaming"], 0.3) == stops
        os.close(fd)


def test_only_stop_bytes_in_a_row_stop():
    with ft300_process(streaming=True) as emulator:
        fd = open_port(emulator.port)
        read_for(fd, 16)
        os.write(fd, b"\xff" * 49 + b"\x00" + b"\xff" * 49)
        assert not until(lambda: emulator.ask("state")["streaming"] is False, 0.3)
        os.write(fd, b"\xff")
        assert until(lambda: emulator.ask("state")["streaming"] is False)
        os.close(fd)


def test_after_a_stop_it_is_deaf_for_a_while_and_answers_then():
    with ft300_process(streaming=True, knobs={"mode_change_ms": 300.0}) as emulator:
        fd = open_port(emulator.port)
        os.write(fd, b"\xff" * 50)
        assert until(lambda: emulator.counters()["stops"] == 1)
        while read_for(fd, 1, 0.05):
            pass
        os.write(fd, READ_FIRMWARE)
        assert read_for(fd, 7, 0.1) == b""
        assert until(lambda: os.write(fd, READ_FIRMWARE) and read_for(fd, 7, 0.1) == FIRMWARE)
        os.close(fd)


@pytest.mark.parametrize("unknown", mostly_long(("exception", "silence"), "exception"))
def test_unknown_registers_are_refused_or_met_with_silence(unknown):
    with ft300_process(knobs={"unknown": unknown}) as emulator:
        fd = open_port(emulator.port)
        os.write(fd, bytes.fromhex("09 03 00 00 00 01 85 42"))
        expected = bytes.fromhex("09 83 02 41 33") if unknown == "exception" else b""
        assert read_for(fd, 5, 3.0 if expected else 0.3) == expected
        os.write(fd, READ_FIRMWARE)
        assert read_for(fd, 7) == FIRMWARE
        os.close(fd)


def test_a_pause_of_the_host_is_no_pause_on_the_line():
    loop = EventLoop()
    emulator = Ft300Emulator(loop, ConstantWrench())
    emulator.start()
    fd = open_port(emulator.port)
    os.write(fd, READ_FIRMWARE)
    while not len(emulator._to_sensor):
        loop.run_once(1)
    while len(emulator._to_sensor) == len(READ_FIRMWARE):
        loop.run_once(1)
    time.sleep(0.03)  # the sensor has heard the beginning of the request
    data = b""
    deadline_s = time.monotonic() + 3
    while len(data) < len(FIRMWARE) and time.monotonic() < deadline_s:
        loop.run_once(5)
        if select.select([fd], [], [], 0)[0]:
            data += os.read(fd, 4096)
    assert data == FIRMWARE
    os.close(fd)
    emulator.close()
    loop.close()


def test_a_request_that_was_broken_off_is_forgotten():
    with ft300_process() as emulator:
        fd = open_port(emulator.port)
        # Begins a write of 30 words; the read behind it would be taken for their values.
        os.write(fd, bytes.fromhex("09 10 01 9A 00 1E 3C"))
        time.sleep(0.05)
        os.write(fd, READ_FIRMWARE)
        assert read_for(fd, 7) == FIRMWARE
        os.close(fd)


def test_a_port_whose_speed_nobody_set_gives_garbage():
    with ft300_process(streaming=True) as emulator:
        fd = open_port(emulator.port, set_speed=False)
        assert PACKET not in read_for(fd, 100)
        os.close(fd)


def test_packets_around_a_stop_collide_on_the_half_duplex_line():
    with ft300_process(streaming=True, ramp=True, knobs={"stop_bytes": 10_000}) as emulator:
        fd = open_port(emulator.port)
        read_for(fd, 32)
        os.write(fd, b"\xff" * 200)
        read_for(fd, 16 * 10)
        assert emulator.counters()["bytes_garbled"] >= 100
        os.close(fd)


def test_bytes_come_at_line_speed_and_in_the_adapters_time():
    arrivals = []
    with ft300_process(streaming=True, latency_ms=16) as emulator:
        fd = open_port(emulator.port)
        read_for(fd, 64)
        for _ in range(20):
            select.select([fd], [], [], 1.0)
            arrivals.append((time.monotonic(), len(os.read(fd, 4096))))
        os.close(fd)
    gaps = [after[0] - before[0] for before, after in itertools.pairwise(arrivals)]
    assert 0.010 < sorted(gaps)[len(gaps) // 2] < 0.030
    assert {size for _, size in arrivals} - {16, 32}  # cut anywhere, not at packets


def test_link_follows_the_port_and_is_removed(tmp_path):
    link = tmp_path / "ft300"
    with ft300_process(link=str(link)) as emulator:
        assert link.is_symlink()
        assert str(link.readlink()) == emulator.port
        emulator.ask("hang_up", 0.1)
        assert not link.is_symlink()
        assert until(link.is_symlink)
        fd = open_port(link)
        os.write(fd, READ_FIRMWARE)
        assert read_for(fd, 7) == FIRMWARE
        os.close(fd)
    assert not link.is_symlink()


def test_what_is_written_before_a_port_is_closed_is_heard():
    """As from a shell: open, write, close at once. A real port is closed only when all of it is sent."""
    with ft300_process(streaming=True) as emulator:
        fd = open_port(emulator.port)
        os.write(fd, b"\xff" * 50)
        os.close(fd)
        assert until(lambda: emulator.counters()["stops"] == 1)
        fd = open_port(emulator.port)
        # What was on the line when the sensor heard the stop still arrives; then it is silent.
        while select.select([fd], [], [], 0.05)[0]:
            os.read(fd, 4096)
        os.write(fd, READ_FIRMWARE)
        assert read_for(fd, 7) == FIRMWARE
        os.close(fd)


def test_a_request_right_behind_the_stop_bytes_is_answered():
    with ft300_process(streaming=True, knobs={"collisions": False}) as emulator:
        fd = open_port(emulator.port)
        os.write(fd, b"\xff" * 50 + READ_FIRMWARE)
        # What the stream still had on the line comes first, then the answer and nothing else.
        assert read_for(fd, 1000, limit_s=1.0).endswith(FIRMWARE)
        os.close(fd)


def test_link_replaces_a_stale_link_but_nothing_else(tmp_path):
    stale, file = tmp_path / "stale", tmp_path / "file"
    stale.symlink_to("/dev/pts/nonexistent")
    file.write_text("precious")
    loop = EventLoop()
    port = PtyPort(loop, lambda _data: None, lambda: None, str(stale))
    port.open()
    assert str(stale.readlink()) == port.path
    port.close()
    with pytest.raises(EnvironmentFault, match="in the way"):
        PtyPort(loop, lambda _data: None, lambda: None, str(file)).open()
    assert file.read_text() == "precious"
    loop.close()


def test_a_machine_without_ptys_is_named(monkeypatch):
    def none_left():
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "openpty", none_left)
    loop = EventLoop()
    with pytest.raises(EnvironmentFault, match=r"no pseudo-terminal .*No space left") as caught:
        Ft300Emulator(loop, ConstantWrench()).start()
    assert "devpts" in caught.value.do
    loop.close()


def test_a_cooked_client_is_its_own_fault_but_a_fresh_port_is_raw():
    with ft300_process() as emulator:
        fd = open_port(emulator.port)
        input_flags, output_flags, _, local_flags, *_ = termios.tcgetattr(fd)
        assert not local_flags & (termios.ECHO | termios.ICANON | termios.ISIG)
        assert not input_flags & (termios.ICRNL | termios.IXON)
        assert not output_flags & termios.OPOST
        os.close(fd)


def test_several_emulators_in_one_loop_do_not_mix():
    loop = EventLoop()
    wrenches = [(float(k), 0.0, 0.0, 0.0, 0.0, 0.0) for k in range(3)]
    emulators = [Ft300Emulator(loop, ConstantWrench(wrench), streaming=True) for wrench in wrenches]
    for emulator in emulators:
        emulator.start()
    fds = [open_port(emulator.port) for emulator in emulators]
    heard = [b"", b"", b""]
    deadline_s = time.monotonic() + 3
    while min(len(data) for data in heard) < 100 and time.monotonic() < deadline_s:
        loop.run_once(20)
        for index, fd in enumerate(fds):
            if select.select([fd], [], [], 0)[0]:
                heard[index] += os.read(fd, 4096)
    for index, data in enumerate(heard):
        assert bytes((0x20, 0x4E, 100 * index & 0xFF, 100 * index >> 8, 0, 0)) in data
    for fd, emulator in zip(fds, emulators, strict=True):
        os.close(fd)
        emulator.close()
    loop.close()
