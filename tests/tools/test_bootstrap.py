"""Set-up on machines that lack one thing or another, played by a `python` that refuses some of its jobs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools import bootstrap

ROOT = Path(__file__).resolve().parents[2]


def python_that_refuses(folder: Path, *refusals: str) -> str:
    """Write an interpreter that fails when its arguments, joined by spaces, match one of the shell patterns."""
    cases = "".join(f"  {pattern.replace(' ', chr(92) + ' ')}) exit 1 ;;\n" for pattern in refusals)
    path = folder / "python3"
    path.write_text(f'#!/bin/sh\ncase "$*" in\n{cases}esac\nexec {sys.executable} "$@"\n', encoding="utf-8")
    path.chmod(0o755)
    return str(path)


NO_VENV_PACKAGE = "-m venv [!-]*"  # Debian without python3-venv: only --without-pip works
NO_PIP_PACKAGE = "-m pip*"


@pytest.mark.long
def test_only_pip_present_installs_from_outside(tmp_path):
    python = python_that_refuses(tmp_path, NO_VENV_PACKAGE)
    venv = tmp_path / "env"
    pip = bootstrap.make_venv(python, venv)
    assert pip == [python, "-m", "pip", "--python", str(venv / "bin" / "python")]
    listed = subprocess.run([*pip, "list"], capture_output=True, text=True, timeout=60, check=True)
    assert "pytest" not in listed.stdout  # it looks into the new environment, not into this one
    assert not (venv / "bin" / "pip").exists()


@pytest.mark.long
def test_only_venv_present_uses_the_pip_inside(tmp_path):
    python = python_that_refuses(tmp_path, NO_PIP_PACKAGE)
    venv = tmp_path / "env"
    assert bootstrap.make_venv(python, venv) == [str(venv / "bin" / "python"), "-m", "pip"]
    assert bootstrap.make_venv("/no/such/python", venv) == [str(venv / "bin" / "python"), "-m", "pip"]  # kept


def test_neither_present_names_the_one_line_that_helps(tmp_path):
    python = python_that_refuses(tmp_path, NO_VENV_PACKAGE, NO_PIP_PACKAGE)
    with pytest.raises(bootstrap.SetUpError, match="sudo apt install python3-venv"):
        bootstrap.make_venv(python, tmp_path / "env")
    assert not (tmp_path / "env").exists()


def test_old_python_gets_a_sentence(monkeypatch):
    monkeypatch.setattr(sys, "version_info", (3, 9, 2, "final", 0))
    with pytest.raises(bootstrap.SetUpError, match=r"Python 3\.11 or newer is needed and .* is 3\.9"):
        bootstrap.choose_python()


def test_newer_python_gives_way_to_one_the_wheels_are_made_for(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "version_info", (3, 14, 0, "final", 0))
    older = tmp_path / "python3.12"
    older.symlink_to(python_that_refuses(tmp_path))
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert bootstrap.choose_python() == str(older)


def test_an_active_environment_of_ours_is_not_made_from_itself(tmp_path):
    """`source .venv/bin/activate`, then `make test`: python3 is that of `.venv`, and must not be told to remake it."""
    outside = subprocess.run(
        [sys.executable, "-c", "import sys; print(sys._base_executable)"], capture_output=True, text=True, check=True
    ).stdout.strip()
    venv = tmp_path / ".venv"
    subprocess.run([outside, "-m", "venv", "--without-pip", str(venv)], check=True, timeout=60)
    ask = "from tools import bootstrap; print(bootstrap.choose_python())"
    chosen = [
        subprocess.run([python, "-c", ask], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60).stdout
        for python in (outside, str(venv / "bin" / "python3"))
    ]
    assert chosen[0] == chosen[1]
    assert str(tmp_path) not in chosen[1]


@pytest.fixture
def recorded(monkeypatch, tmp_path):
    """Set-up whose commands are recorded instead of run; uv is there when asked for by name."""
    commands = []

    def record(*command, quiet=True):
        commands.append(list(command))
        return not (record.no_uv and command[-1] == "uv")

    record.no_uv = False
    monkeypatch.setattr(bootstrap, "run", record)
    return record, commands


def test_stamp_guards_against_doing_it_twice(recorded, tmp_path):
    _, commands = recorded
    venv = tmp_path / ".venv"
    venv.mkdir()
    bootstrap.set_up("runtime", venv)
    assert commands[-1][-1] == f"{ROOT}[app]"
    assert "-c" in commands[-1]
    commands.clear()
    bootstrap.set_up("runtime", venv)
    assert commands == []
    bootstrap.set_up("dev", venv)
    assert commands[-1][-1].endswith("[dev,sweep,cluster]")
    commands.clear()
    bootstrap.set_up("runtime", venv)  # dev holds it already
    assert commands == []


def test_stamp_of_other_pins_python_or_folder_does_not_count(recorded, tmp_path):
    _, commands = recorded
    venv = tmp_path / ".venv"
    venv.mkdir()
    bootstrap.set_up("dev", venv)
    kind, digest, home = (venv / ".installed").read_text(encoding="utf-8").splitlines()
    for changed, kept in ((f"{kind}\nother\n{home}\n", True), (f"{kind}\n{digest}\nelsewhere\n", False)):
        (venv / "marker").touch()
        (venv / ".installed").write_text(changed, encoding="utf-8")
        commands.clear()
        bootstrap.set_up("runtime", venv)
        assert commands[-1][-1].endswith("[dev,sweep,cluster]")
        assert (venv / "marker").exists() == kept


@pytest.mark.parametrize("stamp", ["", "runtime\n", None])
def test_one_left_half_made_by_a_kill_is_made_anew(recorded, tmp_path, stamp):
    """What a killed installer left looks installed, and is not."""
    record, commands = recorded
    venv = tmp_path / ".venv"

    class KilledError(Exception):
        pass

    def killed(*command, quiet=True):
        if "-e" in command:
            (venv / "half").touch()
            raise KilledError
        return record(*command)

    venv.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bootstrap, "run", killed)
        with pytest.raises(KilledError):
            bootstrap.set_up("runtime", venv)
    if stamp is not None:  # the kill may come while it is written, too
        (venv / ".installed").write_text(stamp, encoding="utf-8")
    bootstrap.set_up("runtime", venv)
    assert not (venv / "half").exists()
    commands.clear()
    bootstrap.set_up("runtime", venv)
    assert commands == []


def test_a_home_that_keeps_nothing_is_no_hindrance(recorded, tmp_path, monkeypatch):
    record, commands = recorded
    venv = tmp_path / ".venv"
    venv.mkdir()
    bootstrap.set_up("runtime", venv)
    assert "--no-cache" not in commands[-1]
    monkeypatch.setattr(bootstrap, "run", lambda *command, quiet=True: record(*command) and "list" not in command)
    bootstrap.set_up("dev", venv)
    assert "--no-cache" in commands[-1]


def test_a_checkout_that_cannot_be_written_is_said(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(sys, "argv", ["bootstrap.py", "runtime"])
    monkeypatch.setattr(bootstrap, "ROOT", tmp_path)
    for name in ("pyproject.toml", "constraints.txt"):
        (tmp_path / name).touch()
    (tmp_path / ".venv").touch()  # in the way, as a folder of somebody else's would be
    assert bootstrap.main() == 2
    said = capsys.readouterr().err
    assert f"{tmp_path / '.venv'} cannot be written" in said
    assert "apt" not in said


def test_without_uv_plain_pip_installs(recorded, tmp_path):
    record, commands = recorded
    record.no_uv = True
    venv = tmp_path / ".venv"
    venv.mkdir()
    bootstrap.set_up("runtime", venv)
    assert commands[-1][:3] == [str(venv / "bin" / "python"), "-m", "pip"]
    assert commands[-1][-1] == f"{ROOT}[app]"


def test_constraints_name_versions_and_no_hosts():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert len(lines) > 40
    assert all("==" in line and "://" not in line and " @ " not in line for line in lines)


@pytest.mark.long
@pytest.mark.timeout(600)
def test_fresh_clone_sets_itself_up(tmp_path):
    clone = tmp_path / "a clone"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True, timeout=60)
    ours = ("PYTHONPATH", "VIRTUAL_ENV", "MAKEFLAGS", "MAKELEVEL", "MFLAGS")  # this test may itself run under make
    environment = {key: value for key, value in os.environ.items() if key not in ours}
    for goal in ("runtime", "dev"):
        done = subprocess.run(
            ["make", goal], cwd=clone, env=environment, capture_output=True, text=True, timeout=500, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        assert "setting up" in done.stdout
    again = subprocess.run(
        ["make", "dev"], cwd=clone, env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    assert again.stdout == ""
    push = [str(clone / ".venv" / "bin" / "push"), "config", "check", "sim"]
    assert subprocess.run(push, cwd=tmp_path, env=environment, timeout=60, check=False).returncode == 0
