"""What a process of ours does first: it dies with its parent, even with one that was gone before it could ask."""

import os
import select
import subprocess
import sys

import pytest

ALIVE_AFTER = "from robot_io.ipc.process import die_with_parent; die_with_parent({parent}); print('alive')"
LEAVES_A_CHILD = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", '''
import time
from robot_io.ipc.process import die_with_parent
die_with_parent()
print("ready", flush=True)
time.sleep(60)
'''], stdout=subprocess.PIPE)
child.stdout.readline()
print(child.pid, flush=True)
sys.stdin.read()
"""


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=20, check=False)


@pytest.mark.parametrize("known", [True, False])
def test_a_parent_that_lives_changes_nothing(known):
    done = run(ALIVE_AFTER.format(parent=os.getpid() if known else 0))
    assert (done.returncode, done.stdout) == (0, "alive\n"), done.stderr


def test_a_parent_that_is_gone_already_is_noticed():
    """Another pid than the one who started it: the real parent has died, and the process was handed on."""
    done = run(ALIVE_AFTER.format(parent=os.getpid() + 1))
    assert (done.returncode, done.stdout) == (1, ""), done.stderr


def test_a_process_dies_with_its_parent():
    parent = subprocess.Popen(
        [sys.executable, "-c", LEAVES_A_CHILD], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdin is not None
    assert parent.stdout is not None
    pidfd = os.pidfd_open(int(parent.stdout.readline()))
    parent.kill()
    parent.wait()
    gone, _, _ = select.select([pidfd], [], [], 10)
    assert gone
    os.close(pidfd)
    parent.stdin.close()
    parent.stdout.close()
