"""How many files a process may open: raised where that is allowed, and said where it is not."""

import subprocess
import sys

ASK = """
import resource
from robot_io.errors import EnvironmentFault
from robot_io.ipc.process import allow_descriptors
try:
    allow_descriptors(128)
except EnvironmentFault as fault:
    print(fault)
print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])
"""


def told(limits):
    command = f"{limits}; exec {sys.executable} -c '{ASK}'"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=30, check=True)
    return done.stdout.splitlines()


def test_a_soft_limit_is_raised():
    assert told("ulimit -S -n 40") == ["128"]


def test_a_higher_limit_stays():
    assert told("ulimit -n 200") == ["200"]


def test_a_hard_limit_is_said():
    words, limit = told("ulimit -n 40")
    assert words == "a process may have only 40 files open here, and 128 are needed. Allow more: ulimit -n 128"
    assert limit == "40"
