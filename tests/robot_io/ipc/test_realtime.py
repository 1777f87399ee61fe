"""What a process takes of the system, and what it says when it is denied: in processes of their own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from typing import Any

import pytest

from robot_io.ipc.process import fresh_interpreter

SAY = """
import json, os, sys
import msgspec
from robot_io.ipc.realtime import set_up_realtime
got = set_up_realtime(70, cpu=int(sys.argv[1]), spin_us=150.0)
print(json.dumps({
    **msgspec.to_builtins(got), "policy": os.sched_getscheduler(0), "cpus": sorted(os.sched_getaffinity(0)),
}))
"""
FIFO_RESET_ON_FORK = 1 | 0x40000000


def said(cpu: int, before: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return what a process got that asked for everything."""
    _, environment = fresh_interpreter("json")
    done = subprocess.run(
        [*before, sys.executable, "-P", "-c", SAY, str(cpu)],
        env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.mark.skipif(os.getuid() != 0, reason="only root may surely have real-time priority")
def test_root_gets_what_it_asks_for():
    last = max(os.sched_getaffinity(0))
    found = said(last)
    assert found["fifo"]
    assert found["policy"] == FIFO_RESET_ON_FORK
    assert found["cpus"] == [last] == [found["cpu"]]
    assert found["spin_us"] == (150.0 if (os.cpu_count() or 1) > 1 else 0.0)


def test_a_processor_that_does_not_exist_leaves_it_on_any():
    found = said(1023)
    assert found["cpu"] == -1
    assert found["cpus"] == sorted(os.sched_getaffinity(0))


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="setpriv is not installed (package util-linux)")
def test_without_real_time_priority_nobody_waits_awake():
    found = said(-1, before=("setpriv", "--inh-caps=-all", "--bounding-set=-all"))
    assert (found["fifo"], found["policy"], found["spin_us"]) == (False, 0, 0.0)
