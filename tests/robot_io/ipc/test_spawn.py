"""A process of ours as its starter sees it: ready, failed, ended, hanging, frozen."""

import os
import signal
import subprocess
import sys
import tempfile
import time

import pytest

from robot_io.errors import DeviceNotReady
from robot_io.ipc.spawn import Child

HEAD = (
    "import os, signal, sys, time\n"
    "from robot_io.errors import DeviceNotReady\n"
    "from robot_io.ipc.status import StatusPipe\n"
    "status = StatusPipe(int(sys.argv[1]))\n"
)


@pytest.fixture
def start():
    """Start a process that runs a few lines with `status` in hand."""
    made = []

    def start(code: str) -> Child:
        listen_fd, status_fd = os.pipe()
        stderr = tempfile.TemporaryFile()  # noqa: SIM115 - the Child closes it
        words = [sys.executable, "-c", HEAD + code, str(status_fd)]
        process = subprocess.Popen(words, stderr=stderr, pass_fds=[status_fd])
        os.close(status_fd)
        made.append(Child("planted", process, listen_fd, stderr))
        return made[-1]

    yield start
    for child in made:
        child.process.kill()
        child.process.wait()
        child.close()


def test_ready_is_waited_for(start):
    child = start("time.sleep(0.1)\nstatus.say('ready', info=7)\ntime.sleep(60)")
    assert child.wait_ready(30.0)
    assert child.ready == {"event": "ready", "info": 7}


def test_an_error_ends_the_wait(start):
    child = start("status.error(DeviceNotReady('it is off', where='ur10'))\ntime.sleep(60)")
    assert not child.wait_ready(30.0)
    assert [(type(error), error.what, error.where) for error in child.errors] == [(DeviceNotReady, "it is off", "ur10")]


def test_an_end_without_a_word_ends_the_wait(start):
    child = start("sys.exit('planted')")
    assert not child.wait_ready(30.0)
    assert (child.errors, child.status.open) == ([], False)
    assert child.stop(30.0) == 1
    assert child.how_it_ended() == "ended with code 1 (planted)"


def test_one_that_says_nothing_is_not_waited_for_longer(start):
    child = start("time.sleep(60)")
    began_s = time.monotonic()
    assert not child.wait_ready(0.2)
    assert 0.2 <= time.monotonic() - began_s < 30.0
    assert child.status.open


def test_it_is_told_to_end_even_when_it_is_frozen(start):
    child = start("signal.signal(signal.SIGTERM, lambda *_: sys.exit(9))\nstatus.say('ready')\ntime.sleep(60)")
    assert child.wait_ready(30.0)
    child.process.send_signal(signal.SIGSTOP)
    assert child.stop(30.0) == 9
    assert child.stop(30.0) == 9


def test_one_that_ignores_sigterm_is_killed(start):
    child = start("signal.signal(signal.SIGTERM, signal.SIG_IGN)\nstatus.say('ready')\ntime.sleep(60)")
    assert child.wait_ready(30.0)
    assert child.stop(0.1) == -signal.SIGKILL
    assert child.how_it_ended() == "was killed by SIGKILL"
