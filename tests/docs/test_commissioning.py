"""The commands of docs/commissioning.md do what the page shows; the robot is emulated behind loopback."""

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
            quick = QUICK if "--distance-m" in command else ()
            until_ended = UNTIL_ENDED if command.startswith("push watch") else ()
            done = subprocess.run(
                [*until_ended, PUSH, *shlex.split(command)[1:], *quick],
                cwd=tmp_path, env=os.environ | {"XDG_STATE_HOME": str(tmp_path)}, stdin=subprocess.DEVNULL,
                capture_output=True, text=True, timeout=90, check=False,
            )  # fmt: skip
            assert done.returncode in (0, 9), f"{command}: {done.stderr}"
            told = done.stdout + done.stderr
            rows = set(ROW.findall(told)) | {"base.timeout"}  # proved a moment ago, so no longer warned of
            assert set(ROW.findall(shown)) <= rows, command
            for line in ("nothing was opened", "nothing was moved", "stopping distance at 0.1 m/s", "doctor: "):
                assert line not in shown or line in told, command
