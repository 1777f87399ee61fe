"""The same study on a real Dask scheduler with two worker processes on loopback."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tools import cli

pytest.importorskip("distributed")

GRID = """
name = "small"
[grid]
shape = ["square", "circle"]
contact_friction = [0, 0.5]
y0_m = [-0.4, 0.4]
[time]
duration_s = 20
"""


@contextlib.contextmanager
def process(*arguments):
    """A child of its own group, ended with everything it started."""
    child = subprocess.Popen(
        [sys.executable, "-m", *map(str, arguments)],
        cwd=Path(cli.__file__).resolve().parents[1],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield child
    finally:
        os.killpg(child.pid, signal.SIGTERM)
        try:
            child.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()


def wait_for(condition, what, seconds=60):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


@pytest.mark.long
def test_a_cluster_gives_the_same_bytes(tmp_path, capsys):
    grid, address_file = tmp_path / "grid.toml", tmp_path / "scheduler.json"
    grid.write_text(GRID)
    here = ["--host", "127.0.0.1", "--scheduler-file", address_file, "--no-dashboard"]
    with process("distributed.cli.dask_scheduler", *here, "--port", 0):
        wait_for(address_file.exists, "no scheduler")
        address = json.loads(address_file.read_text())["address"]
        assert "127.0.0.1" in address
        worker = ("distributed.cli.dask_worker", *here, "--nthreads", 1, "--no-nanny")
        with process(*worker), process(*worker):
            code = cli.main(["sweep", str(grid), "--out", str(tmp_path / "dask"), "--engine", "dask",
                             "--scheduler", address, "--json"])  # fmt: skip
            out, err = capsys.readouterr()
            assert code == 0, err
            assert json.loads(out.splitlines()[-1])["lanes"] == 8
    assert cli.main(["sweep", str(grid), "--out", str(tmp_path / "here"), "--workers", "1"]) == 0
    for name in ("results.csv", "states.npz", "summary.json", "trajectories.png"):
        assert (tmp_path / "dask" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


def test_no_scheduler_is_one_sentence(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("tools.parallel.engine.SCHEDULER_TIMEOUT_S", 0.5)
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{closed.getsockname()[1]}"
    out = tmp_path / "out"
    code = cli.main(["sweep", "--out", str(out), "--engine", "dask", "--scheduler", address, "--json"])
    stdout, err = capsys.readouterr()
    assert code == 3
    assert address in err
    assert len(err.strip().splitlines()) == 1
    assert json.loads(stdout.splitlines()[-1])["error"]["code"] == 3
    assert not out.exists()
