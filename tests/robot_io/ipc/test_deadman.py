"""A process that renews no more is killed by the kernel, frozen or not; one that was released lives on."""

import signal
import subprocess
import sys
import time

import pytest

from tests.how_many import mostly_long

CODE = """
import sys, time
from robot_io.ipc.deadman import Deadman
deadman = Deadman(1)
print("ready", flush=True)
for word in sys.stdin:
    if word == "renew\\n":
        deadman.renew()
    elif word == "release\\n":
        deadman.release()
    print("done", flush=True)
"""


@pytest.fixture
def process():
    child = subprocess.Popen([sys.executable, "-c", CODE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    yield child
    child.kill()
    child.communicate()


def ask(process, word):
    process.stdin.write(f"{word}\n")
    process.stdin.flush()
    assert process.stdout.readline() == "done\n"


@pytest.mark.parametrize("frozen", mostly_long((False, True), True))
def test_killed_when_it_renews_no_more(process, frozen):
    ask(process, "renew")
    began_s = time.monotonic()
    if frozen:
        process.send_signal(signal.SIGSTOP)
    assert process.wait(10.0) == -signal.SIGKILL
    assert time.monotonic() - began_s > 0.9


def test_it_lives_while_it_renews_and_after_its_release(process):
    until_s = time.monotonic() + 1.5
    while time.monotonic() < until_s:
        ask(process, "renew")
    ask(process, "release")
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.5)
