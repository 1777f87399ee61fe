"""`push completion`: a real bash completes commands, options and paths with what it prints."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tools.cli import COMMANDS, main


@pytest.fixture(scope="module")
def script(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "push"
    done = subprocess.run(
        [sys.executable, "-c", "from robot_io._entry import main; raise SystemExit(main())", "completion", "bash"],
        cwd=Path(__file__).resolve().parents[3],
        capture_output=True,
        text=True,
        check=True,
    )
    path.write_text(done.stdout)
    return path


def completed(script: Path, line: str, cwd: Path) -> list[str]:
    """Return what bash offers for the last word of a line, by the function that the script registers for `push`."""
    words = shlex.split(line) + ([""] if line.endswith(" ") else [])
    ask = (
        f"source {shlex.quote(str(script))}\n"
        'registered=($(complete -p push)); for i in "${!registered[@]}"; do\n'
        '  [ "${registered[i]}" = -F ] && ask=${registered[i+1]}\ndone\n'
        f"COMP_WORDS=({shlex.join(words)}); COMP_CWORD={len(words) - 1}\n"
        '"$ask" push\nprintf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "--norc", "-c", ask], cwd=cwd, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("push repl", ["replay"]),
        ("push re", ["replay", "report"]),
        ("push study sh", ["show"]),
        ("push study show --wh", ["--where"]),
        ("push bench ", ["sim", "physics", "loop", "latency"]),
        ("push log exp", ["export"]),
        ("push run sim --dist", ["--distance-m"]),
        ("push replay --w", ["--what-if"]),
        ("push bench physics --j", ["--json"]),
        ("push completion z", ["zsh"]),
        ("push nonsense --o", []),
    ],
)
def test_bash_completes_commands_and_options(line, offered, script, tmp_path):
    assert completed(script, line, tmp_path) == offered


def test_bash_offers_every_command(script, tmp_path):
    offered = completed(script, "push ", tmp_path)
    assert {name.split()[0] for name in COMMANDS} <= set(offered)


@pytest.mark.parametrize("line", ["push replay a-", "push run sim --out a-", "push log info a-"])
def test_bash_completes_paths(line, script, tmp_path):
    (tmp_path / "a-run").mkdir()
    assert completed(script, line, tmp_path) == ["a-run"]


def test_zsh_accepts_its_script(tmp_path, capsys):
    assert main(["completion", "zsh"]) == 0
    script = capsys.readouterr().out
    assert script.startswith("#compdef push")
    if shutil.which("zsh") is None:
        pytest.skip("zsh is not installed; its script was made, and not read by it")
    path = tmp_path / "_push"
    path.write_text(script)
    subprocess.run(["zsh", "-n", str(path)], check=True)


def test_another_shell_is_refused(capsys):
    assert main(["completion", "fish"]) == 2
    assert "'bash', 'zsh'" in capsys.readouterr().err
