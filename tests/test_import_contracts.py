"""The import contracts of pyproject.toml bite: one offence against each, and each is reported."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("robot_io", "control", "safety", "sim_backend", "tools")

OFFENCES = {
    "robot_io": ("tools.rig", {"robot_io stands alone"}),
    "sim_backend": ("tools.rig", {"sim_backend builds on robot_io only"}),
    "safety": ("control.path", {"safety does not know control"}),
    "tools": ("threading", {"no asyncio, no threads, no multiprocessing of ours"}),
    "control": (
        "time, safety.limits, robot_io.event_loop, sim_backend.plant, control.loop",
        {
            "only tools and tests know the simulation",
            "laws and checks know messages and settings, no device, clock or log",
            "control laws and safety checks do not know each other",
            "laws and checks are pure: no clock, random, environment, socket or process, and math instead of numpy",
            "the impure rooms are entered from tools only",
        },
    ),
}


def test_each_contract_is_broken_by_its_offence(tmp_path):
    for folder in FOLDERS:
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
        (tmp_path / folder / "offence.py").write_text(f"import {OFFENCES[folder][0]}\n", encoding="utf-8")
    for impure in ("control/loop.py", "safety/gate_process.py"):
        (tmp_path / impure).touch()
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    done = subprocess.run(
        [str(Path(sys.executable).parent / "lint-imports"), "--no-cache"],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path), "COLUMNS": "300"},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    broken = set(re.findall(r"^(.+?) BROKEN", done.stdout, flags=re.MULTILINE))
    expected = set().union(*(names for _, names in OFFENCES.values()))
    assert broken == expected, done.stdout + done.stderr
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    assert {contract["name"] for contract in contracts} == expected
