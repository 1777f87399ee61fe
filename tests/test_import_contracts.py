"""The import contracts of pyproject.toml bite: one offence against each, and each is reported."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LAYERS = "tools on top, then laws, checks and simulation, which do not know each other, then robot_io"
FOLDERS = ("robot_io", "control", "safety", "sim_backend", "tools")

OFFENCES = {
    "robot_io/ft300": (
        "tools.rig, robot_io.ur10",
        {LAYERS, "the rooms of robot_io, devices independent of each other"},
    ),
    "sim_backend/ridgeback": (
        "sim_backend.ur10, robot_io.ridgeback",
        {
            "the rooms of sim_backend: physics knows no wire, emulators do not know each other",
            "no emulator knows the driver of its device",
        },
    ),
    "sim_backend/ur10/motion": (
        "sim_backend.ur10.programs.load",
        {"the rooms of the emulated arm: motion knows no program, programs know no wire"},
    ),
    "sim_backend/physics": ("socket", {"physics knows no wire, file or process"}),
    "safety": ("control.wrench", {LAYERS}),
    "tools/places": (
        "threading, tools.run",
        {"no asyncio, no threads, no multiprocessing of ours", "the rooms of tools"},
    ),
    "tools/calibrate/estimators": (
        "tools.calibrate.session",
        {
            "the rooms of tools.calibrate: estimators know neither devices nor people",
        },
    ),
    "tools/report/drawing": (
        "tools.report.page",
        {
            "the rooms of tools.report: pages are made of figures and facts, these of what was read from the log",
        },
    ),
    "control": (
        "time, safety.limits, robot_io.ipc.event_loop, sim_backend.world.plant, control.loop",
        {
            LAYERS,
            "laws and checks know messages and settings, no device, clock or log",
            "laws and checks are pure: no clock, random, environment, socket or process, and math instead of numpy",
            "the impure rooms are entered from tools only",
        },
    ),
}


def test_each_contract_is_broken_by_its_offence(tmp_path):
    for folder in FOLDERS:
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for room, (imports, _) in OFFENCES.items():
        (tmp_path / room / "offence.py").write_text(f"import {imports}\n", encoding="utf-8")
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
