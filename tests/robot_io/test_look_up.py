"""Names of hosts: found, unknown, or not answered in time."""

from __future__ import annotations

import time

import pytest

from robot_io import look_up
from robot_io.errors import DeviceUnreachable
from robot_io.look_up import addresses_of


def test_a_name_of_this_machine_is_found():
    assert set(addresses_of("localhost", where="here")) <= {"127.0.0.1", "::1"}
    assert addresses_of("localhost", where="here")


@pytest.mark.parametrize(
    ("written", "usual"), [("127.0.0.1", "127.0.0.1"), ("127.1", "127.0.0.1"), ("::1", "::1"), ("0:0::1", "::1")]
)
def test_an_address_needs_no_look_up(written, usual, monkeypatch):
    monkeypatch.setattr(look_up.sys, "executable", "/nonexistent")
    assert addresses_of(written, where="here") == [usual]


@pytest.mark.parametrize("name", ["nosuchhost.invalid", "a name", "x" * 300])
def test_an_unknown_name_is_said(name):
    with pytest.raises(DeviceUnreachable, match="no host has the name") as caught:
        addresses_of(name, where="ws://there")
    assert caught.value.where == "ws://there"
    assert "name" in caught.value.do


def test_a_name_server_that_is_silent_costs_2_s(monkeypatch):
    monkeypatch.setattr(look_up, "_LOOK_UP", "import time; time.sleep(60)")
    began_s = time.monotonic()
    with pytest.raises(DeviceUnreachable, match="could not be looked up within 2 s"):
        addresses_of("robot", where="ws://there")
    assert 2.0 <= time.monotonic() - began_s < 4.0
