"""The whole tool on a small project: survivors, interruption and resumption, a new test, a mutant that never ends."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tools.dev.mutants.targets import ROOT

TABLE = '''"""A small table."""
from pathlib import Path
from tools.dev.mutants import real_targets
from tools.dev.mutants.real_targets import Shell
ROOT = Path(__file__).resolve().parents[3]
WHOLE = ("control/*.py",)
WHOLE_TESTS = ("tests/control",)
SHELLS = (Shell("tools/shell.py", ("tests/test_shell.py",)),)
SAMPLE, SEED = 5, "seed"
PRODUCT = real_targets.PRODUCT
def whole_paths(root=ROOT):
    return ["control/law.py"]
'''
LAW = '''"""A law."""
LIMIT = 3


def clamp(a):
    return min(a, LIMIT)


def count(n):
    while n > 0:
        n -= 5
    return n < 1
'''
TEST = """from control.law import clamp, count
def test_clamp():
    assert clamp(9) == 3
def test_count():
    assert count(5) is True
"""
SHELL = '"""A shell."""\nif __name__ == "__main__":\n    raise SystemExit(WORTH)\nWORTH = 7\n'
SHELL_TEST = """import subprocess, sys
def test_exit():
    code = "import tools.shell; raise SystemExit(tools.shell.WORTH)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 7
"""
LONG_TEST = "import pytest\n@pytest.mark.long\ndef test_long():\n    assert False\n"
"""A file of long tests only, none of which `make test` runs."""
PYTEST_SETTINGS = """[tool.pytest.ini_options]
pythonpath = ["."]
addopts = "--import-mode=importlib -m 'not long'"
markers = ["long"]
"""
MORE = "def test_more():\n    assert clamp(2) == 2\n    assert count(0) and count(6) and count(1)\n"


@pytest.fixture
def project(tmp_path):
    """A checkout of its own, with the tool and next to nothing for it to look at."""
    shutil.copytree(ROOT / "tools/dev", tmp_path / "tools/dev", ignore=shutil.ignore_patterns("__pycache__"))
    tool = tmp_path / "tools/dev/mutants"
    (tool / "targets.py").rename(tool / "real_targets.py")
    (tool / "targets.py").write_text(TABLE)
    for folder in ("control", "tests/control"):
        (tmp_path / folder).mkdir(parents=True)
    for file, text in {
        "tools/__init__.py": "",
        "tools/shell.py": SHELL,
        "control/__init__.py": "",
        "control/law.py": LAW,
        "tests/control/test_law.py": TEST,
        "tests/test_shell.py": SHELL_TEST,
        "tests/control/test_long.py": LONG_TEST,
        "tests/mutants_equivalent.toml": "",
        "pyproject.toml": PYTEST_SETTINGS,
        ".gitignore": ".mutants/\n",
    }.items():
        (tmp_path / file).write_text(text)
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    return tmp_path


def command(project, *words):
    environment = os.environ | {"PYTHONPATH": str(project)}
    argv = [sys.executable, "-m", "tools.dev.mutants", "--workers", "1", *words]
    return {"args": argv, "cwd": project, "env": environment, "text": True}


def run(project, *words):
    return subprocess.run(**command(project, *words), capture_output=True, timeout=200, check=False)


def tried(project):
    lines = (project / ".mutants/results.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


@pytest.mark.long
@pytest.mark.timeout(300)
def test_it_names_survivors_and_after_a_new_test_tries_only_these_again(project):
    before = {path: path.read_bytes() for path in project.rglob("*.py")}
    done = run(project)
    assert done.returncode == 1, done.stderr
    survivors = [line for line in done.stdout.splitlines() if "->" in line]
    assert "control/law.py:6: return min(a, LIMIT) -> return max(a, LIMIT)" not in survivors  # 9 is not 3
    assert "control/law.py:10: while n > 0: -> while n > 1:" in survivors
    assert all(line.startswith("control/law.py:") for line in survivors)
    outcomes = {one["name"].partition(": ")[2]: one["outcome"] for one in tried(project)}
    assert outcomes["n -= 5 -> n += 5"] == outcomes["n -= 5 -> pass"] == "timeout"
    assert outcomes["WORTH = 7 -> WORTH = 8"] == "killed"  # in a process that a test started
    assert {path: path.read_bytes() for path in project.rglob("*.py")} == before

    first = len(tried(project))
    test = project / "tests/control/test_law.py"
    (project / "tests/control/test_more.py").write_text(TEST.splitlines()[0] + "\n" + MORE)
    done = run(project)
    again = [one["name"] for one in tried(project)[first:]]
    timed_out = {one["name"] for one in tried(project)[:first] if one["outcome"] == "timeout"}
    assert set(again) == set(survivors) | timed_out
    assert len([line for line in done.stdout.splitlines() if "->" in line]) < len(survivors)

    test.write_text("def test():\n    assert False\n")
    done = run(project)
    assert done.returncode == 2
    assert "tests/control/test_law.py::test" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_interrupted_it_goes_on_where_it_was(project):
    (project / "control/law.py").write_text(LAW.partition("def count")[0])
    (project / "tests/control/test_law.py").write_text(TEST.replace(", count", "").partition("def test_count")[0])
    process = subprocess.Popen(**command(project), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    results = project / ".mutants/results.jsonl"
    deadline = time.monotonic() + 60.0
    while not results.exists() or len(results.read_text().splitlines()) < 2:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130, said
    assert "continues from there" in said
    begun = [one["id"] for one in tried(project)]
    assert run(project).returncode == 0  # the tests of this law leave nothing out
    names = [one["id"] for one in tried(project)]
    assert len(names) > len(begun)
    assert len(set(names)) == len(names)


ENDLESS = """
import sys, json
from pathlib import Path
from tools.dev.mutants.trial.session import prepare, run_tests
prepare()
ended = run_tests(Path(sys.argv[1]), ["test_endless.py"], None, 3.0)
print(json.dumps([ended.passed, ended.failed]))
"""
ENDLESS_TEST = """import os, subprocess, sys
from pathlib import Path
def test():
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], start_new_session=True)
    Path("pid").write_text(str(child.pid))
    while True:
        pass
"""


@pytest.mark.long
def test_a_session_that_never_ends_is_killed_with_what_it_started(tmp_path):
    (tmp_path / "test_endless.py").write_text(ENDLESS_TEST)
    (tmp_path / "pyproject.toml").write_text("[tool.pytest.ini_options]\n")
    words = [sys.executable, "-c", ENDLESS, str(tmp_path)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    assert json.loads(done.stdout) == [False, []]
    assert not Path(f"/proc/{(tmp_path / 'pid').read_text()}").exists()
