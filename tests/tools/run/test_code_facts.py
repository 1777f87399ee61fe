"""Which code makes a log: commit and dirty flag of the checkout, soon or not at all, and versions of packages."""

from __future__ import annotations

import importlib.metadata
import os
import subprocess
import time
from pathlib import Path

import pytest

from tools.run.facts import code_facts
from tools.run.facts.code_facts import commit_of

ROOT = Path(__file__).resolve().parents[3]


def git(folder: Path, *words: str) -> str:
    identity = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
    command = ("git", "-C", str(folder), *identity, *words)
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


@pytest.fixture
def checkout(tmp_path) -> Path:
    folder = tmp_path / "checkout"
    folder.mkdir()
    git(folder, "init", "-q")
    (folder / "code.py").write_text("x = 1\n")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    return folder


def test_a_clean_a_changed_and_a_staged_checkout(checkout):
    commit = git(checkout, "rev-parse", "HEAD")
    assert len(commit) == 40
    assert commit_of(checkout) == {"commit": commit, "dirty": "False"}
    (checkout / "notes.txt").write_text("not of the program\n")
    assert commit_of(checkout)["dirty"] == "False"
    (checkout / "code.py").write_text("x = 2\n")
    assert commit_of(checkout) == {"commit": commit, "dirty": "True"}
    git(checkout, "add", "code.py")
    assert commit_of(checkout) == {"commit": commit, "dirty": "True"}
    git(checkout, "commit", "-qm", "second")
    assert commit_of(checkout) == {"commit": git(checkout, "rev-parse", "HEAD"), "dirty": "False"}


def test_nothing_is_said_where_there_is_no_checkout_of_its_own(checkout, tmp_path):
    inner = checkout / "site-packages"
    inner.mkdir()
    assert commit_of(inner) == {}
    empty = tmp_path / "empty"
    empty.mkdir()
    git(empty, "init", "-q")
    assert commit_of(empty) == {}
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / ".git").write_text("gitdir: /nowhere\n")
    assert commit_of(tmp_path / "odd") == {}


def test_a_repository_named_in_the_environment_is_not_asked(checkout, tmp_path, monkeypatch):
    other = tmp_path / "other"
    other.mkdir()
    git(other, "init", "-q")
    monkeypatch.setenv("GIT_DIR", str(other / ".git"))
    assert commit_of(checkout)["dirty"] == "False"


def test_the_repository_is_not_written_to(checkout):
    os.utime(checkout / "code.py", (1, 1))  # git would like to note that this file is unchanged
    before = (checkout / ".git" / "index").read_bytes()
    assert commit_of(checkout)["dirty"] == "False"
    assert (checkout / ".git" / "index").read_bytes() == before


@pytest.mark.parametrize("script", ["sleep 30", "exit 128", "echo '# branch.oid nonsense'", None])
def test_a_git_that_hangs_fails_or_is_missing_costs_at_most_a_moment(script, checkout, tmp_path, monkeypatch):
    tools = tmp_path / "bin"
    tools.mkdir()
    if script is not None:
        (tools / "git").write_text(f"#!/bin/sh\n{script}\n")
        (tools / "git").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tools}:/bin:/usr/bin" if script else str(tools))
    began_s = time.monotonic()
    assert commit_of(checkout) == {}
    assert time.monotonic() - began_s < 2.0  # 0.2 s, and what a loaded machine takes to start and end a process
    assert code_facts.GIT_MAX_S <= 0.2


def test_versions_are_those_installed_and_a_missing_package_is_left_out(monkeypatch):
    code_facts.code_facts.cache_clear()
    facts = code_facts.code_facts()
    assert facts["format"] == "5"
    assert facts["program"] == "single-point-push 0.1.0"
    for name in ("numpy", "mcap", "msgspec", "ur-rtde"):
        assert facts[name] == importlib.metadata.version(name)
    monkeypatch.setattr(code_facts, "_PACKAGES", ("numpy", "no-such-package"))
    code_facts.code_facts.cache_clear()
    assert "no-such-package" not in code_facts.code_facts()
    monkeypatch.undo()
    code_facts.code_facts.cache_clear()


def test_git_is_asked_once(monkeypatch):
    asked = []
    monkeypatch.setattr(code_facts, "commit_of", lambda checkout: asked.append(checkout) or {})
    code_facts.code_facts.cache_clear()
    for _ in range(3):
        code_facts.code_facts()
    assert asked == [ROOT]
    monkeypatch.undo()
    code_facts.code_facts.cache_clear()
