"""`push` with a foreign package called `control` (python-control) in the same environment."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ENTRY = "from robot_io._entry import main; raise SystemExit(main())"


@pytest.fixture
def foreign_site(tmp_path):
    """Return a site folder with a stub of python-control, and nothing of ours but `robot_io`."""
    package = tmp_path / "site" / "control"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("__version__ = '0.10.2'\n", encoding="utf-8")
    return tmp_path / "site"


def run(code, site, cwd, *argv):
    # site comes before the checkout, as site-packages comes before the folder of an editable install
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(site), str(ROOT)])}
    return subprocess.run(
        [sys.executable, "-P", "-c", code, *argv],
        cwd=cwd, env=environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip


def test_the_stub_really_is_in_the_way(foreign_site, tmp_path):
    done = run("import control; print(control.__version__)", foreign_site, tmp_path)
    assert done.stdout == "0.10.2\n"


def test_push_works_beside_python_control(foreign_site, tmp_path):
    done = run(ENTRY, foreign_site, tmp_path, "config", "check", "sim", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["good"] is True


def test_children_find_ours_too(foreign_site, tmp_path):
    code = (
        "import subprocess, sys\nfrom robot_io._entry import put_root_first\nput_root_first()\n"
        "subprocess.run([sys.executable, '-c', 'import control; print(control.__file__)'], check=True)"
    )
    done = run(code, foreign_site, tmp_path)
    assert done.stdout.strip() == str(ROOT / "control" / "__init__.py")


@pytest.mark.parametrize(
    "preload", ["import control", "import sys, types; sys.modules['tools'] = types.ModuleType('tools')"]
)
def test_foreign_module_already_loaded_is_one_sentence_and_exit_3(preload, foreign_site, tmp_path):
    done = run(f"{preload}\n{ENTRY}", foreign_site, tmp_path, "config", "check", "sim", "--json")
    assert done.returncode == 3
    assert "is not this program's" in done.stderr
    assert done.stderr.count("\n") == 1
    answer = json.loads(done.stdout)
    assert answer["error"]["code"] == 3


def test_ctrl_c_while_it_is_still_loading_is_one_sentence(tmp_path):
    """The first tenths of a second go into imports; a stop that comes then must not end in a traceback."""
    code = (
        "import os, signal, sys\nimport robot_io._entry as entry\n"
        "class Interrupted:\n    def find_spec(self, name, path, target=None):\n"
        "        if name == 'tools.cli':\n            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupted())\nraise SystemExit(entry.main())"
    )
    done = run(code, ROOT, tmp_path, "config", "check", "sim", "--json")
    assert done.returncode == 130
    assert done.stderr == "push: stopped by the operator\n"
    assert json.loads(done.stdout)["error"]["code"] == 130


def test_the_library_alone_says_that_the_application_runs_from_a_checkout(tmp_path):
    shutil.copytree(ROOT / "robot_io", tmp_path / "robot_io", ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [sys.executable, "-P", "-c", ENTRY, "run", "--json"],
        cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=60,
        check=False,
    )  # fmt: skip
    assert done.returncode == 3
    assert "runs from a checkout" in done.stderr
    assert done.stderr.count("\n") == 1
    assert json.loads(done.stdout)["error"]["code"] == 3
