"""A sensor behind a serial server: what can be looked at over TCP is, and what only a local port has is skipped."""

import select
import socket
import threading

import pytest
import serial

from tests.wire.ft300_process import ft300_process
from tools.doctor.ft_checks import ft_checks
from tools.rig import resolve_rig


def carry(listener, emulator, done):
    """Carry bytes between one client and the emulator's pty."""
    client, _ = listener.accept()
    with client, serial.Serial(emulator.port, 19200, timeout=0) as port:
        while not done.is_set():
            ready, _, _ = select.select([client, port], [], [], 0.02)
            if client in ready:
                if not (data := client.recv(4096)):
                    return
                port.write(data)
            if port in ready:
                client.sendall(port.read(4096))


def rows_of(port):
    rig = resolve_rig("emulated", ["ft.level=hardware", f"ft.port={port}"])
    return {row.check: row for row in ft_checks(rig)}


@pytest.mark.long
def test_what_can_be_seen_over_tcp_is():
    done = threading.Event()
    with ft300_process(ramp=True) as emulator, socket.create_server(("127.0.0.1", 0)) as listener:
        carrier = threading.Thread(target=carry, args=(listener, emulator, done))
        carrier.start()
        try:
            rows = rows_of(f"socket://127.0.0.1:{listener.getsockname()[1]}")
        finally:
            done.set()
            carrier.join()
    assert {name for name, row in rows.items() if row.result == "skipped"} == {
        "ft.permission",
        "ft.lock",
        "ft.latency-timer",
    }
    for name in ("ft.port", "ft.identity", "ft.echo", "ft.crc", "ft.rate"):
        assert rows[name].result == "ok", rows[name]


def test_a_server_that_is_not_there():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    row = rows_of(f"socket://127.0.0.1:{port}")["ft.port"]
    assert row.result == "failed"
    assert "serial server" in row.fix
