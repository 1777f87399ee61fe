"""`push doctor --find`: adapters by the names that stay theirs, and none is opened."""

import os
import pty
from types import SimpleNamespace

import pytest

from robot_io.ft300 import adapters
from tools.doctor.find import adapter_lines


@pytest.fixture
def plugged_in(tmp_path, monkeypatch):
    """Two adapters: the FT 300's with a name of its own, another without."""
    ptys = [pty.openpty() for _ in range(2)]
    ports = [os.ttyname(slave) for _, slave in ptys]
    (tmp_path / "usb-FTDI_X-if00-port0").symlink_to(ports[0])
    infos = [
        SimpleNamespace(device=ports[0], vid=0x0403, pid=0x6015, product="USB TO RS-485"),
        SimpleNamespace(device=ports[1], vid=0x1A86, pid=0x7523, product=None),
    ]
    monkeypatch.setattr(adapters.list_ports, "comports", lambda: infos)
    yield tmp_path, ports
    for fds in ptys:
        for fd in fds:
            os.close(fd)


def test_adapters_are_named_by_id(plugged_in, monkeypatch):
    folder, ports = plugged_in
    monkeypatch.setattr(os, "open", lambda *_: pytest.fail("opened"))
    found = {adapter.port: adapter for adapter in adapters.adapters(folder)}
    assert found[ports[0]].by_id == str(folder / "usb-FTDI_X-if00-port0")
    assert (found[ports[0]].usb, found[ports[0]].likely) == ("0403:6015", True)
    assert (found[ports[1]].by_id, found[ports[1]].usb, found[ports[1]].likely) == (ports[1], "1a86:7523", False)
    told = adapter_lines(list(found.values()))
    assert any("usb-FTDI_X" in line and "as an FT 300 comes with" in line for line in told)


def test_none_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(adapters.list_ports, "comports", list)
    assert adapters.adapters(tmp_path / "missing") == []
    assert "no serial adapter" in adapter_lines([])[0]
