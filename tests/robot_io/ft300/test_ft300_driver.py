"""The FT 300 driver against the emulated sensor: open, start, read, stop, and what it says when it cannot."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import socket
import threading
import time
import tty
from pathlib import Path

import pytest
import serial

from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError, DeviceUnreachable, UsageError
from robot_io.ft300 import serial_link
from robot_io.ft300.driver import Ft300
from robot_io.messages import LinkState
from tests.how_many import mostly_long
from tests.wire.ft300_process import ft300_process, until

WRENCH = (12.34, -56.78, 100.0, 0.1, -1.23, 3.21)


def values(sample):
    wrench = sample.value
    return (wrench.fx, wrench.fy, wrench.fz, wrench.mx, wrench.my, wrench.mz)


def collect(sensor, count, limit_s=5.0):
    samples = []

    def enough():
        select.select([sensor], [], [], 0.05)
        samples.extend(sensor.drain())
        return len(samples) >= count

    assert until(enough, limit_s), f"only {len(samples)} of {count} samples: {sensor.health()}"
    return samples


def ramp_numbers(samples):
    return [round(values(sample)[0] * 100) for sample in samples]


def test_identity_wrench_stamps_and_modbus_mode_afterwards():
    with ft300_process() as emulator:
        sensor = Ft300(emulator.port)
        assert sensor.fileno() == -1
        info = sensor.open()
        assert (info.device, info.where, info.version, info.serial) == (
            "ft300", emulator.port, "FTS-1.2.3", "FTA-12345",
        )  # fmt: skip
        assert "2018" in info.model
        assert sensor.health().state is LinkState.UP
        sensor.start()
        samples = collect(sensor, 40)
        assert {values(sample) for sample in samples} == {WRENCH}
        assert [sample.seq for sample in samples] == list(range(len(samples)))
        stamps = [sample.received_ns for sample in samples]
        assert stamps == sorted(stamps)
        assert stamps[-1] <= time.monotonic_ns()
        health = sensor.health()
        assert health.counters["packets_ok"] == len(samples)
        assert health.counters["crc_fail"] == 0
        assert 60 < health.rate_hz < 140  # exact on a quiet machine only
        sensor.stop()
        assert emulator.ask("state")["streaming"] is False
        assert sensor.drain() == ()
        sensor.start()  # the same open port may start again
        assert values(collect(sensor, 3)[0]) == WRENCH
        sensor.stop()
        sensor.stop()
        sensor.close()
        sensor.close()
        assert sensor.health().state is LinkState.CLOSED
        assert sensor.drain() == ()
        with Ft300(emulator.port) as again:  # the next client finds a sensor that answers
            assert values(collect(again, 1)[0]) == WRENCH


@pytest.mark.parametrize("latency_ms", mostly_long((0, 1, 16), 16))
def test_every_packet_arrives_at_every_latency_timer(latency_ms):
    with ft300_process(latency_ms=latency_ms, ramp=True, streaming=True) as emulator, Ft300(emulator.port) as sensor:
        samples = collect(sensor, 40)
        numbers = ramp_numbers(samples)
        assert numbers == list(range(numbers[0], numbers[0] + len(samples)))
        health = sensor.health()
        assert health.counters["packets_ok"] == len(samples)
        assert health.counters["crc_fail"] == 0
        assert (health.counters["bursts"] > 0) or latency_ms < 16


def test_a_burst_after_a_pause_is_complete_and_in_order():
    with ft300_process(ramp=True) as emulator, Ft300(emulator.port) as sensor:
        last = collect(sensor, 1)[-1]
        assert until(lambda: waiting_bytes(sensor) >= 16 * 16)
        burst = sensor.drain()
        assert len(burst) >= 16
        stamps = [last.received_ns, *(sample.received_ns for sample in burst)]
        assert stamps == sorted(stamps)
        numbers = ramp_numbers([last, *burst])
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert sensor.health().counters["bursts"] >= 1


def waiting_bytes(sensor):
    return sensor._line.serial.in_waiting


def test_a_wake_up_is_the_end_of_a_packet_also_after_reading_in_the_middle_of_one():
    with ft300_process(ramp=True) as emulator, Ft300(emulator.port) as sensor:
        collect(sensor, 2)
        for _ in range(25):
            for _ in range(5):  # as a loop that drains on its own ticks does
                sensor.drain()
                time.sleep(0.001)
            ready, _, _ = select.select([sensor], [], [], 1.0)
            assert ready
            assert len(sensor.drain()) >= 1
            assert sensor._parser.pending_bytes == 0  # the beginning of the next packet stays in the kernel
        assert sensor.health().counters["crc_fail"] == 0


@pytest.mark.parametrize(
    "knobs",
    mostly_long(
        ({"ack_delay_ms": 5.0}, {"ack_delay_ms": 15.0}, {"ack": False}), {"ack_delay_ms": 15.0}, {"ack": False}
    ),
    ids=str,
)
def test_acknowledgement_early_late_and_never(knobs):
    with ft300_process(knobs=knobs) as emulator, Ft300(emulator.port) as sensor:
        assert values(collect(sensor, 5)[-1]) == WRENCH


def test_a_sensor_left_streaming_by_a_client_that_died_is_taken_over():
    with ft300_process(streaming=True, latency_ms=16) as emulator, Ft300(emulator.port) as sensor:
        assert values(collect(sensor, 5)[-1]) == WRENCH
        assert emulator.counters()["stops"] == 1


def test_hostile_wrenches_arrive_unharmed():
    for fx, fy in ((200.0, -56.78), (82.0, 0.78), (25.73, 48.81)):  # header inside, header across, CR LF XON XOFF
        wrench = (fx, fy, -0.01, 66.59 / 10, 32.540, 3.338)
        with ft300_process(wrench=wrench, knobs={"paced": False}) as emulator, Ft300(emulator.port) as sensor:
            assert values(collect(sensor, 20)[-1]) == pytest.approx(wrench)
            assert sensor.health().counters["crc_fail"] == 0


def test_probe_reads_without_starting():
    with ft300_process() as emulator:
        sensor = Ft300(emulator.port)
        reading = sensor.probe()
        assert values_of(reading.wrench) == WRENCH
        assert reading.acceleration_g == (0.0, 0.0, -1.0)
        assert reading.info.serial == "FTA-12345"
        assert sensor.health().state is LinkState.CLOSED
        sensor.open()
        assert values_of(sensor.probe().wrench) == WRENCH
        assert emulator.counters()["starts"] == 0
        sensor.start()
        with pytest.raises(DeviceNotReady, match="while it streams"):
            sensor.probe()
        sensor.close()


def values_of(wrench):
    return (wrench.fx, wrench.fy, wrench.fz, wrench.mx, wrench.my, wrench.mz)


def test_second_opener_is_told_the_port_is_busy_and_the_first_goes_on():
    with ft300_process() as emulator, Ft300(emulator.port) as sensor:
        with pytest.raises(DeviceUnreachable, match="another program uses") as caught:
            Ft300(emulator.port).open()
        assert emulator.port in caught.value.do
        assert len(collect(sensor, 5)) >= 5


def test_missing_port_fails_at_once_and_says_what_to_do(tmp_path):
    for port in (str(tmp_path / "ttyNone"), "/dev/pts/9999"):
        sensor = Ft300(port)
        with pytest.raises(DeviceUnreachable, match="no such port") as caught:
            sensor.open()
        assert caught.value.do
        assert sensor.health().state is LinkState.CLOSED


def test_what_is_no_serial_port_is_refused(tmp_path):
    plain = tmp_path / "file"
    plain.write_text("x")
    with pytest.raises(DeviceUnreachable, match="cannot be used as a serial port"):
        Ft300(str(plain)).open()
    with pytest.raises(DeviceUnreachable, match="cannot be used as a serial port"):
        Ft300(str(tmp_path)).open()
    assert plain.read_text() == "x"
    with pytest.raises(UsageError, match="not a port of an FT 300"):
        Ft300("hwgrep://FTDI").open()


def test_no_permission_names_the_group(monkeypatch):
    def refuse(*_args, **_kwargs):
        raise serial.SerialException(13, "could not open port")

    monkeypatch.setattr(serial_link.serial, "Serial", refuse)  # as root nothing is forbidden
    with pytest.raises(DeviceUnreachable, match="may not open") as caught:
        Ft300("/dev/ttyUSB0").open()
    assert "dialout" in caught.value.do


def test_a_closed_tcp_port_fails_at_once():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(DeviceUnreachable, match="nothing accepts"):
        Ft300(f"socket://127.0.0.1:{port}").open()


@pytest.mark.parametrize(
    "rest", ["", "127.0.0.1", "127.0.0.1:", ":4000", "127.0.0.1:tty", "127.0.0.1:0", "127.0.0.1:99999",
             "127.0.0.1:4000/tty", "127.0.0.1:4000?logging=debug", "[::1:4000"],
)  # fmt: skip
def test_a_tcp_address_that_names_no_port_is_a_usage_error(rest):
    with pytest.raises(UsageError, match="not a port of an FT 300") as caught:
        Ft300(f"socket://{rest}").open()
    assert "socket://host:port" in caught.value.do


def test_a_silent_port_names_the_power_supply_in_time():
    master, slave = pty.openpty()
    tty.setraw(slave)
    try:
        started_s = time.monotonic()
        with pytest.raises(DeviceUnreachable, match="no answer") as caught:
            Ft300(os.ttyname(slave)).open()
        assert time.monotonic() - started_s < 4  # promised by open
        assert "24 V" in caught.value.do
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.long
def test_a_device_that_never_stops_talking_is_named():
    with ft300_process(streaming=True, knobs={"stop_bytes": 1_000_000}) as emulator:
        started_s = time.monotonic()
        with pytest.raises(DeviceProtocolError, match="does not stop"):
            Ft300(emulator.port).open()
        assert time.monotonic() - started_s < 5


@pytest.mark.long
def test_a_device_that_falls_silent_only_to_talk_again_ends_the_opening_in_time():
    master, slave = pty.openpty()
    tty.setraw(slave)
    done = threading.Event()

    def talk():
        started_s = time.monotonic()
        while not done.wait(0.01):
            if (time.monotonic() - started_s) % 3.1 < 2.85:
                os.write(master, b"READY\r\n")
            if select.select([master], [], [], 0)[0]:
                os.read(master, 4096)

    thread = threading.Thread(target=talk)
    thread.start()
    started_s = time.monotonic()
    try:
        with pytest.raises(DeviceProtocolError):
            Ft300(os.ttyname(slave)).open()
        assert time.monotonic() - started_s < 5  # promised by open
    finally:
        done.set()
        thread.join()
        os.close(master)
        os.close(slave)


def test_another_firmware_is_another_device():
    with ft300_process(firmware="GRP-1.2.3") as emulator:
        with pytest.raises(DeviceProtocolError, match="firmware is 'GRP"):
            Ft300(emulator.port).open()
        assert emulator.counters()["starts"] == 0


class Imposter:
    """Something else on a pty that answers every write with the same bytes."""

    def __init__(self, answer):
        self.answer = answer
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        self.done = threading.Event()
        self.thread = threading.Thread(target=self.serve)

    def serve(self):
        while not self.done.is_set():
            if select.select([self.master], [], [], 0.02)[0]:
                os.read(self.master, 4096)
                os.write(self.master, self.answer)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.done.set()
        self.thread.join()
        os.close(self.master)
        os.close(self.slave)


@pytest.mark.parametrize(
    "answer",
    mostly_long(
        (bytes.fromhex("09 83 02 41 33"), b"READY\r\n\r\n", bytes.fromhex("01 03 02 46 54 6A 1A 00 00 00 00")),
        bytes.fromhex("09 83 02 41 33"),
    ),
)
def test_a_device_that_answers_otherwise_is_named_as_such(answer):
    with Imposter(answer) as imposter:
        with pytest.raises(DeviceProtocolError, match="answers, but not as an FT 300") as caught:
            Ft300(imposter.port).open()
        assert "which device" in caught.value.do


@pytest.mark.long
def test_a_tcp_peer_that_never_falls_silent_ends_the_opening_in_time():
    done = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def flood():
            client, _ = listener.accept()
            with client, contextlib.suppress(OSError):
                while not done.is_set():
                    client.sendall(b" N" * 32768)

        thread = threading.Thread(target=flood)
        thread.start()
        started_s = time.monotonic()
        try:
            with pytest.raises(DeviceError):
                Ft300(f"socket://127.0.0.1:{listener.getsockname()[1]}").open()
        finally:
            done.set()
            thread.join()
        assert time.monotonic() - started_s < 5


def test_a_sensor_that_stops_answering_at_the_start_needs_a_power_cycle():
    with ft300_process() as emulator:
        sensor = Ft300(emulator.port)
        sensor.open()
        emulator.ask("stall", 60)
        with pytest.raises(DeviceNotReady, match="sends no packets") as caught:
            sensor.start()
        assert "24 V" in caught.value.do
        assert sensor.drain() == ()
        sensor.close()


def test_a_closed_sensor_does_not_start():
    with pytest.raises(DeviceNotReady, match="not open"):
        Ft300("/dev/null").start()


def test_latency_timer_is_asked_for_and_warned_about(monkeypatch, tmp_path, caplog):
    with ft300_process() as emulator:
        timer = tmp_path / Path(emulator.port).name / "device" / "latency_timer"
        timer.parent.mkdir(parents=True)
        timer.write_text("16\n")
        monkeypatch.setattr(serial_link, "SYSFS_TTY", tmp_path)
        sensor = Ft300(emulator.port)
        sensor.open()
        assert "udev" in caplog.text
        assert "every 16 ms" in caplog.text
        caplog.clear()
        monkeypatch.setattr(
            serial.Serial, "set_low_latency_mode", lambda _port, _on: timer.write_text("1\n"), raising=True
        )
        sensor.open()
        assert timer.read_text() == "1\n"
        assert caplog.text == ""
        sensor.close()
