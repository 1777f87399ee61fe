"""What is said of processes that did not become ready: one error, one exit code, every device by name."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

import pytest

from robot_io.errors import (
    ConfigError,
    DeviceError,
    DeviceNotReady,
    DeviceUnreachable,
    EnvironmentFault,
    PushError,
    UsageError,
)
from robot_io.ipc.spawn import Child
from robot_io.rig.config import load_rig
from tools.terminal.start_errors import combined_error, start_timeout

RIG = load_rig("emulated")


@pytest.fixture
def child():
    """Make children: a process that ran `code`, and what it is to have said."""
    made = []

    def make(name, code="", errors=()):
        stderr = tempfile.TemporaryFile()  # noqa: SIM115 - the Child closes it
        process = subprocess.Popen([sys.executable, "-c", code], stderr=stderr)
        process.wait()
        read_fd, write_fd = os.pipe()
        os.close(write_fd)
        found = Child(name, process, read_fd, stderr)
        found.errors += errors
        made.append(found)
        return found

    yield make
    for found in made:
        found.close()


def said(kind, what, where="there", do="Do this"):
    return kind(what, where=where, do=do)


def test_one_failure_keeps_its_parts(child):
    error = combined_error([child("gate", errors=[said(DeviceNotReady, "it is off", "ws://a:1", "Switch it on")])], RIG)
    assert type(error) is DeviceError
    assert (error.what, error.where, error.do) == ("it is off", "ridgeback ws://a:1", "Switch it on")


def test_a_place_that_names_the_device_is_not_named_twice(child):
    error = combined_error([child("control", errors=[said(DeviceNotReady, "no such port", "ft300 /dev/x")])], RIG)
    assert error.where == "ft300 /dev/x"


def test_several_are_named_in_one_order_each_with_what_to_do(child):
    failed = [child(name, errors=[said(DeviceNotReady, f"{name} fails")]) for name in ("gate", "arm", "control")]
    error = combined_error(failed, RIG)
    assert error.exit_code == 4
    assert error.what == "ft300 there: control fails; ur10 there: arm fails; ridgeback there: gate fails"
    assert error.do == "ft300: Do this; ur10: Do this; ridgeback: Do this"


@pytest.mark.parametrize(
    ("kinds", "kind"),
    [
        ([UsageError, ConfigError], ConfigError),
        ([EnvironmentFault], EnvironmentFault),
        ([ConfigError, DeviceUnreachable], DeviceError),
    ],
)
def test_the_exit_code_is_theirs(child, kinds, kind):
    failed = [child(name, errors=[said(one, "no")]) for name, one in zip(("arm", "gate"), kinds, strict=False)]
    assert type(combined_error(failed, RIG)) is kind


def test_the_recorder_is_no_device(child):
    error = combined_error([child("recorder", errors=[EnvironmentFault("the disk is full")])], RIG)
    assert (error.exit_code, error.what, error.where) == (3, "the disk is full", "recorder")


def test_a_crash_is_a_defect_whose_traceback_is_kept(child, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    error = combined_error([child("arm", "raise ValueError('planted')")], RIG)
    assert type(error) is PushError
    assert error.exit_code == 1
    assert error.what == "its process ended with code 1 (ValueError: planted)"
    [kept] = tmp_path.glob("push-arm-*.txt")
    assert str(kept) in error.do
    assert kept.read_text().startswith("Traceback")


@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM"])
def test_a_process_that_somebody_killed_is_no_defect_of_the_program(child, name):
    error = combined_error([child("gate", f"import os, signal; os.kill(os.getpid(), signal.{name})")], RIG)
    assert (error.exit_code, error.what) == (3, f"its process was killed by {name}")
    assert "memory" in error.do


def test_a_process_that_crashed_is_one(child):
    error = combined_error([child("gate", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")], RIG)
    assert (error.exit_code, error.what) == (1, "its process was killed by SIGSEGV")


def test_one_that_hangs_is_named(child):
    hanging = child("arm")
    error = start_timeout([hanging], RIG)
    assert error.exit_code == 4
    assert f"ur10 (process {hanging.pid})" in error.what
