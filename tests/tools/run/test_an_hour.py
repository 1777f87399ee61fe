"""A push of an hour: constant memory while it is recorded and while it is replayed, and how large its log is.

Ten minutes of it by default, all of it where the environment says PUSH_TEST_FULL=1; `pytest -s` prints the figures.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robot_io.mcap.files import files_of
from robot_io.mcap.read import read_summary
from tests.how_many import how_many
from tests.replay.runs import PUSH, ROOT

MINUTES = how_many(10, 60)
METRES = 6.0 * MINUTES
"""At 0.1 m/s."""
GROWTH_MB = 8.0
"""From a quarter of the way to its end; Python's own arenas vary by a few MB."""

pytestmark = pytest.mark.long


def grown(words: list[str], state: Path) -> tuple[float, str]:
    """Run a command; return by how many MB it grew after the first quarter of its time, and its output."""
    environment = os.environ | {"XDG_STATE_HOME": str(state), "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-c", PUSH, *words], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
    )
    sizes = []
    while process.poll() is None:
        for line in Path(f"/proc/{process.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS"):
                sizes.append(int(line.split()[1]) / 1000)
        time.sleep(0.2)
    output = process.stdout.read()
    process.stdout.close()
    assert process.returncode == 0, output
    assert len(sizes) > 20
    return max(sizes[len(sizes) // 4 :]) - sizes[len(sizes) // 4], output


@pytest.mark.parametrize("topics", ["all", "lean"])
def test_memory_is_constant_over_a_long_push_and_its_replay(tmp_path, topics):
    out = tmp_path / "run"
    words = ["run", "sim", "--fast", "--no-report", "--distance-m", str(METRES), "--out", str(out)]
    settings = ["--set", "log.split_minutes=10", "--set", f'log.topics="{topics}"']
    recording, _ = grown([*words, *settings], tmp_path / "state")
    replaying, output = grown(["replay", str(out), "--json"], tmp_path / "state")
    summary = read_summary(out / "run.mcap")
    hours = (summary.end_ns - summary.start_ns) / 3600e9
    found = json.loads(output.splitlines()[-1])
    print(
        f"{topics}: {hours * 60:.1f} min in {len(files_of(out / 'run.mcap'))} parts, "
        f"{summary.size_bytes / 1e6 / hours:.0f} MB an hour; memory grew by {recording:.1f} MB while it was recorded, "
        f"by {replaying:.1f} MB while it was replayed"
    )
    assert found["identical"] == found["ticks"] >= MINUTES * 6000
    assert found["world"]["identical"] == found["world"]["states"]
    assert recording < GROWTH_MB
    assert replaying < GROWTH_MB
