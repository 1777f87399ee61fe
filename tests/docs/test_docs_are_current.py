"""The pages made from the code say what the code says, every link leads somewhere, and the README's commands work."""

from __future__ import annotations

import contextlib
import csv
import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from tests.host_watch import HostWatch, repeated_when_the_host_stalls
from tests.push_runs import QUICK, blame_the_host
from tools.cli import COMMANDS
from tools.dev.drivers_page import page
from tools.dev.fault_table import page as faults_page
from tools.dev.fault_table import table
from tools.dev.rig_reference import reference
from tools.rig import resolve_rig
from tools.study.pushes import pushes_of
from tools.study.study_file import read_study
from tools.sweep.grid import load_grid

ROOT = Path(__file__).parents[2]
PUSH = Path(sys.executable).parent / "push"
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])


def test_rig_reference_is_current():
    assert (ROOT / "docs/rig-files.md").read_text() == reference(), (
        "python -m tools.dev.rig_reference > docs/rig-files.md"
    )


def test_drivers_page_is_current():
    assert (ROOT / "docs/drivers.md").read_text() == page(), "python -m tools.dev.drivers_page > docs/drivers.md"


def test_fault_table_is_current():
    assert table() in (ROOT / "docs/safety.md").read_text(), "paste the output of python -m tools.dev.fault_table"


def test_faults_page_is_current():
    assert (ROOT / "docs/faults.md").read_text() == faults_page(), (
        "python -m tools.dev.fault_table --page > docs/faults.md"
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def examples(page, beginning):
    """Return the indented blocks of a page that begin with these words, without their indentation."""
    blocks = re.findall(r"(?:^ {4,}.*\n|^\n(?= {4}))+", (ROOT / page).read_text(), re.M)
    return [text for block in blocks if (text := textwrap.dedent(block).strip()).startswith(beginning)]


@pytest.mark.parametrize("page", ["docs/rig-files.md", "docs/first-push-on-the-robot.md"])
def test_rigs_of_the_pages_are_good(page, tmp_path):
    [text] = examples(page, "extends = ")
    (tmp_path / "example.toml").write_text(text)
    resolve_rig(tmp_path / "example.toml")


def test_the_grid_of_the_page_is_good(tmp_path):
    [text] = examples("docs/simulation-studies.md", "name = ")
    (tmp_path / "example.toml").write_text(text)
    assert len(load_grid(tmp_path / "example.toml", {}).cases) == 3 * 3 * 100


def test_the_study_of_the_page_is_good():
    [text] = examples("docs/simulation-studies.md", "[study]")
    assert len(pushes_of(read_study(text, "example.toml", str(ROOT)))) == 20 * 3 * 2


def readme_commands():
    text = (ROOT / "README.md").read_text()
    for block in re.findall(r"```sh\n(.*?)```", text, re.S):
        for line in block.splitlines():
            command = line.split("#")[0].strip()
            if command:
                yield command


@pytest.mark.timeout(300)
@pytest.mark.long
@pytest.mark.parametrize("shortened", [True, False])
@repeated_when_the_host_stalls
def test_readme_shell_blocks_run(tmp_path, shortened):
    """Every command of the README in order, in an empty folder; make targets are looked up, not run again.

    shortened: whether pushes with the wall clock get a quick approach and tare and end after 10 cm; others, 30 cm.
    """
    environment = os.environ | {
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "XDG_STATE_HOME": str(tmp_path / "state"),
    }
    commands = list(readme_commands())
    assert any(command.startswith("make demo") for command in commands)
    with contextlib.closing(HostWatch()) as host:
        for command in commands:
            if command.startswith("make "):
                subprocess.run(["make", "-n", *shlex.split(command)[1:]], cwd=ROOT, check=True, capture_output=True)
                continue
            if shortened and re.match(r"push run (?!sim|thing)", command):
                command = shlex.join([*re.sub(r"--distance-m \S+", "--distance-m 0.1", command).split(), *QUICK])
            if shortened and re.match(r"push run sim", command):
                command = re.sub(r"--distance-m \S+", "--distance-m 0.3", command)
            began_ns = time.monotonic_ns()
            done = subprocess.run(
                ["bash", "-c", command], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=80,
                stdin=subprocess.DEVNULL, check=False,
            )  # fmt: skip
            blame_the_host(host, began_ns, done.returncode, done.stderr)
            assert done.returncode == 0, f"{command}: {done.stderr[-500:]}"
    assert (tmp_path / "runs/first/run.mcap").exists()
    assert (tmp_path / "runs/six/summary.json").exists()


def test_no_word_of_the_program_names_a_command_that_is_not_there():
    """Advice such as "run `push NAME`" must work when somebody follows it."""
    for source in [*PAGES, *(ROOT / "robot_io").rglob("*.py"), *(ROOT / "tools").rglob("*.py")]:
        for line in source.read_text().splitlines():
            for words in re.findall(r"`push ([a-z]+(?: [a-z]+)?)", line):
                assert words in COMMANDS or words.split()[0] in COMMANDS, f"{source.name} names `push {words}`"


def python_blocks(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)


def test_readme_driver_snippets_work():
    """Each driver alone, as the README shows it, against the emulators that `push emulate all` serves."""
    emulators = subprocess.Popen(
        [PUSH, "emulate", "all", "--base-port", "0", "--arm-host", "127.0.7.31", "--json"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert emulators.stdout is not None
        where = {}
        for line in emulators.stdout:
            where |= json.loads(line)
            if len(where) == 4:  # device, port, host, url
                break
        blocks = python_blocks("README.md")
        assert len(blocks) == 3
        for block in blocks:
            code = block.replace("/dev/ttyUSB0", where["port"]).replace("192.168.131.40", where["host"])
            code = code.replace("ws://192.168.131.1:9090", where["url"])
            assert len([line for line in block.splitlines() if line.strip()]) <= 5
            done = subprocess.run(
                [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=30, check=False
            )
            assert done.returncode == 0, done.stderr
            assert done.stdout.strip(), f"nothing was printed by:\n{block}"
    finally:
        emulators.terminate()
        emulators.wait(10)
        emulators.stdout.close()


def test_log_reading_snippets_work(tmp_path):
    """The readers by others read every tick; as the page says, neither needs anything of this program."""
    done = subprocess.run(
        [PUSH, "run", "sim", "--fast", "--no-report", "--json", "--distance-m", "0.05", "--out", "runs/first"],
        cwd=tmp_path, env=os.environ | {"XDG_STATE_HOME": str(tmp_path)},
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    ticks = json.loads(done.stdout)["loop"]["ticks"]
    *blocks, table = python_blocks("docs/logs.md")
    assert [re.search(r"mcap_ros2|rosbags", block)[0] for block in blocks] == ["mcap_ros2", "rosbags"]
    for block in blocks:
        done = subprocess.run(
            [sys.executable, "-W", "error", "-P", "-c", block],
            cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert len(done.stdout.splitlines()) == ticks
    check_table_snippet(table, tmp_path)


def check_table_snippet(block: str, cwd: Path) -> None:
    """Five lines of pandas, which is no dependency: run where it is installed; its columns must be there anyway."""
    [command] = re.findall(r"push log export runs/first --signals(?= )(?! --to)", (ROOT / "docs/logs.md").read_text())
    subprocess.run([PUSH, *command.split()[1:]], cwd=cwd, capture_output=True, timeout=60, check=True)
    with (cwd / "runs/first/run_signals.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert "run_signals.csv" in block
    assert len([line for line in block.splitlines() if line.strip()]) <= 5
    named = set(re.findall(r'"([a-z_]+)"', block)) | set(re.findall(r"table\.([a-z]+) ==", block))
    values = {row["phase"] for row in rows}
    assert "push" in named
    assert named - {"push"} <= set(rows[0])
    assert "push" in values
    if importlib.util.find_spec("pandas"):
        done = subprocess.run([sys.executable, "-c", block], cwd=cwd, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_the_snippet_of_a_wire_fault_works():
    [block] = python_blocks("docs/working-on-it.md")
    done = subprocess.run(
        [sys.executable, "-c", block], cwd=ROOT, capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 0, done.stderr
