"""The FT 300 driver when line, sensor or cable misbehave: it counts, reports, and never raises from drain."""

from __future__ import annotations

import contextlib
import itertools
import os
import pty
import select
import socket
import struct
import threading
import time
import tty
from pathlib import Path

import pytest
import serial

from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError, DeviceUnreachable
from robot_io.ft300.driver import Ft300
from robot_io.messages import LinkState
from tests.how_many import mostly_long
from tests.wire.ft300_process import ft300_process, until

PACKET = bytes.fromhex("20 4E D2 04 D2 E9 10 27 64 00 32 FB 8A 0C 0C 17")


def numbers(samples):
    return [round(sample.value.fx * 100) for sample in samples]


def collect(sensor, count):
    samples = []

    def enough():
        select.select([sensor], [], [], 0.05)
        samples.extend(sensor.drain())
        return len(samples) >= count

    assert until(enough), f"only {len(samples)} of {count} samples: {sensor.health()}"
    return samples


@contextlib.contextmanager
def echoing(sensor_port):
    """Yield a port in front of a sensor's, on which everything that is sent also comes back."""
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    sensor = serial.Serial(sensor_port, 19200, timeout=0)
    over = threading.Event()

    def pass_on():
        while not over.is_set():
            for fd in select.select([ours, sensor.fileno()], [], [], 0.02)[0]:
                data = os.read(fd, 4096)
                os.write(ours, data)
                if fd == ours:
                    os.write(sensor.fileno(), data)

    thread = threading.Thread(target=pass_on)
    thread.start()
    try:
        yield os.ttyname(theirs)
    finally:
        over.set()
        thread.join()
        sensor.close()
        os.close(ours)
        os.close(theirs)


@pytest.mark.parametrize(
    "fault",
    mostly_long(
        ("corrupt_every", "drop_byte_every", "insert_byte_every", "drop_packet_every"),
        "corrupt_every",
        "drop_byte_every",
    ),
)
def test_every_seventh_packet_bad_costs_those_only(fault):
    with ft300_process(ramp=True, knobs={fault: 7}) as emulator, Ft300(emulator.port) as sensor:
        got = numbers(collect(sensor, 40))
        missing = sorted(set(range(got[0], got[-1] + 1)) - set(got))
        assert len(missing) >= 4
        assert {after - before for before, after in itertools.pairwise(missing)} == {7}
        health = sensor.health()
        assert health.state is LinkState.UP
        assert (health.counters["resyncs"] >= 4) == (fault != "drop_packet_every")


def test_a_stall_is_a_gap_and_no_more():
    with ft300_process(ramp=True) as emulator, Ft300(emulator.port) as sensor:
        before = collect(sensor, 5)
        emulator.ask("stall", 0.2)
        after = collect(sensor, 10)
        health = sensor.health()
        assert health.state is LinkState.UP
        assert health.counters["max_gap_us"] > 150_000
        assert health.counters["long_gaps"] >= 1
        assert [sample.seq for sample in before + after] == list(range(len(before + after)))


def test_hang_up_is_lost_and_only_a_fresh_open_brings_it_back(tmp_path):
    link = str(tmp_path / "ft")
    with ft300_process(link=link, ramp=True) as emulator:
        sensor = Ft300(link)
        sensor.open()
        sensor.start()
        collect(sensor, 3)
        emulator.ask("hang_up", 0.3)
        assert until(lambda: sensor.drain() == () and sensor.health().state is LinkState.LOST)
        assert "gone" in sensor.health().cause
        with pytest.raises(DeviceUnreachable, match="no such port"):
            Ft300(link).open()
        assert until(lambda: Path(link).exists())
        assert sensor.drain() == ()
        assert sensor.health().state is LinkState.LOST
        with pytest.raises(DeviceNotReady, match=r"not open .*gone"):
            sensor.probe()
        sensor.stop()
        sensor.close()
        sensor.close()
        with pytest.raises(DeviceError):
            sensor.start()
        sensor.open()
        sensor.start()
        assert len(collect(sensor, 5)) >= 5
        sensor.close()


def test_line_dying_at_the_stop_is_no_exception():
    with ft300_process() as emulator, Ft300(emulator.port) as sensor:
        emulator.ask("hang_up")
        sensor.stop()
        assert sensor.health().state is LinkState.LOST
        sensor.close()
        assert sensor.health().state is LinkState.CLOSED


def test_line_dying_while_opening_is_unreachable():
    with ft300_process() as emulator:
        thread = threading.Timer(0.05, lambda: emulator.ask("hang_up"))
        thread.start()
        try:
            with pytest.raises(DeviceUnreachable):
                Ft300(emulator.port).open()
        finally:
            thread.join()


@pytest.mark.parametrize("streaming", mostly_long((False, True), False))
def test_an_adapter_that_echoes_is_named(streaming):
    """A two-wire RS-485 adapter whose receiver stays on while it sends."""
    with ft300_process(streaming=streaming) as emulator, echoing(emulator.port) as port:
        with pytest.raises(DeviceProtocolError, match="echo") as caught:
            Ft300(port).open()
        assert "RS-485" in caught.value.do


def test_wrong_baud_gives_garbage_and_no_answer():
    with ft300_process(streaming=True) as emulator:
        port = serial.Serial(emulator.port, 115200, timeout=0.5)
        heard = port.read(160)
        assert len(heard) == 160
        assert PACKET not in heard
        port.baudrate = 19200
        port.reset_input_buffer()
        assert PACKET in port.read(160)
        port.close()


def test_a_sensor_at_another_speed_does_not_answer():
    with ft300_process() as emulator:
        port = serial.Serial(emulator.port, 115200, timeout=0.3)
        port.write(bytes.fromhex("09 03 01 F4 00 01 C5 4C"))
        assert port.read(7) == b""
        port.baudrate = 19200
        port.write(bytes.fromhex("09 03 01 F4 00 01 C5 4C"))
        assert port.read(7) == bytes.fromhex("09 03 02 46 54 6A 1A")
        port.close()


def test_a_reader_that_paused_gets_everything_the_line_kept():
    with ft300_process(ramp=True) as emulator, Ft300(emulator.port) as sensor:
        first = collect(sensor, 1)
        start = time.monotonic()
        assert until(lambda: time.monotonic() - start > 0.5)
        late = collect(sensor, 40)
        got = numbers(first + late)
        assert got == list(range(got[0], got[0] + len(got)))


class Server:
    """A serial server of one client on loopback, speaking bytes given by the test."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = f"socket://127.0.0.1:{self.listener.getsockname()[1]}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.close()


def bridge(server, emulator, done, *, flood=b"", reset=False):
    """Carry bytes between the TCP client and the emulator's pty until `done`."""
    client, _ = server.listener.accept()
    with client, serial.Serial(emulator.port, 19200, timeout=0) as port:
        while not done.is_set():
            ready, _, _ = select.select([client, port], [], [], 0.02)
            if client in ready:
                data = client.recv(4096)
                if not data:
                    return
                port.write(data)
            if port in ready:
                client.sendall(port.read(4096))
        if flood:
            client.sendall(flood)
        if reset:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        else:
            client.shutdown(socket.SHUT_RDWR)


def test_a_serial_server_over_tcp_and_its_end():
    done = threading.Event()
    with ft300_process(ramp=True, streaming=True) as emulator, Server() as server:
        carrier = threading.Thread(target=bridge, args=(server, emulator, done))
        carrier.start()
        sensor = Ft300(server.port)
        try:
            assert sensor.open().version == "FTS-1.2.3"
            sensor.start()
            got = numbers(collect(sensor, 30))
            assert got == list(range(got[0], got[0] + len(got)))
            done.set()
            assert until(lambda: bool(sensor.drain()) or sensor.health().state is LinkState.LOST)
            assert until(lambda: sensor.drain() == () and sensor.health().state is LinkState.LOST)
            assert "closed the line" in sensor.health().cause
        finally:
            done.set()
            sensor.close()
            carrier.join()


def test_a_serial_server_that_resets_the_connection_leaves_nothing_open():
    done = threading.Event()
    with ft300_process() as emulator, Server() as server:
        carrier = threading.Thread(target=bridge, args=(server, emulator, done), kwargs={"reset": True})
        carrier.start()
        sensor = Ft300(server.port)
        try:
            sensor.open()
            sensor.start()
            descriptor = sensor.fileno()
            done.set()
            carrier.join()
            assert until(lambda: sensor.drain() == () and sensor.health().state is LinkState.LOST)
            assert "reset" in sensor.health().cause.lower()
        finally:
            done.set()
            sensor.close()
            carrier.join()
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(descriptor)


def test_a_flood_is_read_in_bounded_bites_oldest_dropped_and_counted():
    done = threading.Event()
    with ft300_process() as emulator, Server() as server:
        carrier = threading.Thread(target=bridge, args=(server, emulator, done), kwargs={"flood": PACKET * 3000})
        carrier.start()
        sensor = Ft300(server.port)
        try:
            sensor.open()
            sensor.start()
            done.set()
            carrier.join()
            bites = []
            while sensor.health().state is LinkState.UP:
                bites.append(sensor.drain())
            counters = sensor.health().counters
            assert counters["packets_ok"] >= 3000
            assert max(len(bite) for bite in bites) == 512
            assert counters["overflow"] == counters["packets_ok"] - sum(len(bite) for bite in bites) > 0
            sequence = [sample.seq for bite in bites for sample in bite]
            assert sequence == sorted(set(sequence))
        finally:
            done.set()
            sensor.close()
            carrier.join()
