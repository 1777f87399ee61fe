"""The commands of docs/commissioning.md do what the page shows; the robot is emulated behind loopback."""

import json
import os
import re
import shlex
import subprocess
import textwrap
from pathlib import Path

import pytest

from tests.docs.test_docs_are_current import PUSH
from tests.push_runs import QUICK
from tools.cli import COMMANDS
from tools.doctor.emulated import emulators
from tools.rig import resolve_rig

ROOT = Path(__file__).parents[2]
ROW = re.compile(r"^(?:ok|warning|failed|skipped) +([a-z]+\.[a-z-]+)", re.MULTILINE)

UNTIL_ENDED = ("timeout", "--preserve-status", "--signal=INT", "8")
"""What goes on until the operator ends it, ends with the program's own exit code."""


def commands():
    """Return each command of the page and what is shown below it."""
    text = (ROOT / "docs/commissioning.md").read_text()
    blocks = [textwrap.dedent(block).strip() for block in re.findall(r"(?:^ {4}.*\n)+", text, re.MULTILINE)]
    return [(block, shown) for block, shown in zip(blocks, [*blocks[1:], ""], strict=True) if block.startswith("push ")]


def test_every_command_of_the_page_is_one_of_the_program():
    assert len(commands()) >= 6
    assert {command.split()[1] for command, _ in commands()} <= set(COMMANDS)


def shape(line):
    """Return a line without its numbers, and without what differs between a person and a rehearsed one."""
    line = re.sub(r"(, then press Enter| \(rehearsed\)) ?", "", line.strip())
    line = re.sub(r"on f[xyz] ", "on an axis ", line)  # whichever drifts most
    return re.sub(r"[-+]?\d+(\.\d+)?(e-?\d+)?", "#", line)


def desk():
    """Return the rig with hidden errors that the page shows."""
    return re.search(r"```toml\n(# desk\.toml\n.*?)```", (ROOT / "docs/commissioning.md").read_text(), re.DOTALL)[1]


def pushed(folder, command, *more):
    """Run one command of the page in `folder`; return it."""
    return subprocess.run(
        [*(UNTIL_ENDED if command.startswith("push watch") else ()), PUSH, *shlex.split(command)[1:], *more],
        cwd=folder, env=os.environ | {"XDG_STATE_HOME": str(folder)}, stdin=subprocess.DEVNULL,
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def check_shown(command, shown, done):
    """Check that a command printed what the page shows below it."""
    told = done.stdout + done.stderr
    rows = set(ROW.findall(told)) | {"base.timeout"}  # proved a moment ago, so no longer warned of
    assert set(ROW.findall(shown)) <= rows, command
    for line in ("nothing was opened", "nothing was moved", "stopping distance at 0.1 m/s", "doctor: "):
        assert line not in shown or line in told, command
    if command.startswith("push calibrate"):
        shapes = {shape(line) for line in told.splitlines()}
        assert {shape(line) for line in shown.splitlines()} - {"..."} <= shapes, (command, told)


@pytest.mark.long
@pytest.mark.timeout(240)
def test_every_command_prints_what_the_page_shows(tmp_path):
    with emulators(resolve_rig("emulated"), "", []) as served:
        (tmp_path / "ours.toml").write_text(
            'extends = "emulated"\nname = "ours"\n'
            f'[ft]\nlevel = "hardware"\nport = "{served.ft.port}"\n'
            f'[arm]\nlevel = "hardware"\nhost = "{served.arm.host}"\n'
            f'[base]\nlevel = "hardware"\nurl = "{served.base.url}"\n'
        )
        for command, shown in commands():
            if command.startswith("push calibrate") or "desk.toml" in command:
                continue
            done = pushed(tmp_path, command, *(QUICK if "--distance-m" in command else ()))
            assert done.returncode in (0, 9), f"{command}: {done.stderr}"
            check_shown(command, shown, done)


@pytest.mark.long
@pytest.mark.timeout(400)
def test_every_calibration_prints_what_the_page_shows(tmp_path):
    """A rehearsed person does what the page asks of the reader; the rig is called as on the page."""
    (tmp_path / "ours.toml").write_text('extends = "emulated"\nname = "ours"\n')
    measured = [(command, shown) for command, shown in commands() if command.startswith("push calibrate")]
    measured = [(command, shown) for command, shown in measured if "desk.toml" not in command]
    assert [command.split()[2] for command, _ in measured] == ["bias", "sign", "marker", "contact", "frame", "path"]
    for command, shown in measured:
        done = pushed(tmp_path, command, "--rehearse")
        assert done.returncode == 0, f"{command}: {done.stderr}"
        check_shown(command, shown, done)
    age = pushed(tmp_path, "push doctor ours.toml").stdout
    assert re.search(r"ok +rig\.calibration-age +calibrated: frame, contact, marker, path", age), age


@pytest.mark.long
@pytest.mark.timeout(600)
def test_a_robot_with_hidden_errors_is_found_out_and_mended(tmp_path):
    (tmp_path / "desk.toml").write_text(desk())
    (tmp_path / "before.toml").write_text(desk())
    for command, shown in commands():
        if "desk.toml" in command:
            done = pushed(tmp_path, command, *(QUICK if "--distance-m" in command else ()))
            assert done.returncode == (4 if command.startswith("push doctor") else 0), f"{command}: {done.stderr}"
            check_shown(command, shown, done)
            if command.startswith("push doctor"):
                assert {shape(line) for line in shown.splitlines()} <= {
                    shape(line) for line in done.stdout.splitlines()
                }
    # By the world's own truth: where the object ended, beside the line.
    assert sum(ended_m(tmp_path, "before.toml", seed) <= 0.1 for seed in range(10)) == 0
    assert sum(ended_m(tmp_path, "desk.toml", seed) <= 0.1 for seed in range(10)) >= 9


def ended_m(folder, rig, seed):
    """Return how far beside the line the object ended after 6 m in the rig's world, at level sim."""
    levels = [flag for device in ("ft", "arm", "base") for flag in ("--set", f"{device}.level=sim")]
    out = f"runs/{rig}-{seed}"
    flags = ["--fast", "--no-report", "--json", "--distance-m=6", f"--seed={seed}", f"--out={out}"]
    done = pushed(folder, f"push run {rig}", *levels, "--set", "ft.tare_s=5", *flags)
    assert done.returncode in (0, 9), done.stderr
    return abs(json.loads(done.stdout)["object_lateral_error_m"])
