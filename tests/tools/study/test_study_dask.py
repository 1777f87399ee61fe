"""The same study on a real Dask scheduler with two worker processes on loopback."""

import json

import pytest

from tests.tools.commands.test_sweep_dask import process, wait_for
from tools import cli

pytest.importorskip("distributed")

STUDY = """
[study]
name = "small"
seeds = 2
[settings]
control.distance_m = 0.05
ft.tare_s = 0.5
[axes]
control.law = ["force", "open-loop"]
"""


@pytest.mark.long
@pytest.mark.timeout(300)
def test_a_cluster_gives_the_same_bytes(tmp_path, capsys):
    file, address_file = tmp_path / "small.toml", tmp_path / "scheduler.json"
    file.write_text(STUDY)
    here = ["--host", "127.0.0.1", "--scheduler-file", address_file, "--no-dashboard"]
    with process("distributed.cli.dask_scheduler", *here, "--port", 0):
        wait_for(address_file.exists, "no scheduler")
        address = json.loads(address_file.read_text())["address"]
        assert "127.0.0.1" in address
        worker = ("distributed.cli.dask_worker", *here, "--nthreads", 1, "--no-nanny")
        with process(*worker), process(*worker):
            words = ["study", str(file), "--out", str(tmp_path / "dask"), "--engine", "dask", "--scheduler", address]
            assert cli.main(words) == 0, capsys.readouterr().err
    assert cli.main(["study", str(file), "--out", str(tmp_path / "here"), "--workers", "1"]) == 0
    for name in ("runs.csv", "summary.json", "figures/trajectories.svg"):
        assert (tmp_path / "dask" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()
