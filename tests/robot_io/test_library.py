"""`robot_io` as a library: its wheel beside a package called `control`, and what importing it costs."""

from __future__ import annotations

import ast
import email
import json
import subprocess
import sys
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from tests.how_many import mostly_long

ROOT = Path(__file__).resolve().parents[2]
HEAVY = {"matplotlib", "scipy", "numba", "numpy", "osqp", "joblib"}
STAND_IN = "__version__ = '0.10.2'  # of python-control\n"
NAME_TO_INSTALL = {
    "serial": "pyserial",
    "rtde_receive": "ur-rtde",
    "rtde_control": "ur-rtde",
    "PIL": "pillow",
    "foxglove": "foxglove-sdk",
}
"""Where it is not the name to import."""


def loaded_by(code):
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)"],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    return set(done.stdout.split())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Return the project's wheel, built without a network and without an environment of its own."""
    out = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(out)],
        cwd=ROOT, capture_output=True, text=True, timeout=80, check=True,
    )  # fmt: skip
    [found] = out.glob("*.whl")
    return found


def test_the_wheel_holds_the_library_alone(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"robot_io"}
    in_checkout = (path.relative_to(ROOT) for path in (ROOT / "robot_io").rglob("*") if path.is_file())
    whole = {str(path) for path in in_checkout if "__pycache__" not in path.parts}
    assert {name for name in names if name.startswith("robot_io/")} == whole
    assert {"robot_io/py.typed", "robot_io/rig/emulated.toml", "robot_io/rig/thing.toml"} <= whole


def imported_by(*folders):
    for source in (source for folder in folders for source in (ROOT / folder).rglob("*.py")):
        if source.is_relative_to(ROOT / "tools" / "dev"):  # what only developers run
            continue
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                yield from (name.name.partition(".")[0] for name in node.names)
            elif isinstance(node, ast.ImportFrom):
                yield str(node.module).partition(".")[0]


def needed(requirements, extra=""):
    """Return the names of what is required without an extra, or by one."""
    by = f'extra == "{extra}"' if extra else ";"
    lines = (line.replace("'", '"') for line in requirements)
    return {line.partition(">")[0] for line in lines if (by in line) == bool(extra)}


def test_what_comes_with_it_is_what_it_imports(wheel):
    foreign = set(imported_by("robot_io")) - sys.stdlib_module_names - {"robot_io"}
    foreign.remove("tools")  # by the entry of `push`, once it has found the checkout
    with zipfile.ZipFile(wheel) as content:
        [name] = [name for name in content.namelist() if name.endswith(".dist-info/METADATA")]
        requirements = email.message_from_bytes(content.read(name)).get_all("Requires-Dist")
    assert needed(requirements) == {NAME_TO_INSTALL.get(name, name) for name in foreign}


def test_the_extra_app_is_what_the_application_imports_besides():
    ours = {"robot_io", "control", "safety", "sim_backend", "tools"}
    names = set(imported_by(*(ours - {"robot_io"}))) - sys.stdlib_module_names - ours
    requirements = metadata.requires("single-point-push")
    for_studies, for_viewers, for_its_world = {"numba", "distributed"}, {"foxglove-sdk"}, {"mujoco"}
    with_osqp = {"scipy"}
    names = {NAME_TO_INSTALL.get(name, name) for name in names}
    besides = names - needed(requirements) - for_studies - for_viewers - for_its_world - with_osqp
    assert besides == needed(requirements, "app")
    assert for_studies <= needed(requirements, "cluster")
    assert for_viewers <= needed(requirements, "live")
    assert for_its_world <= needed(requirements, "mujoco")


@pytest.fixture
def site(wheel, tmp_path):
    """Return a folder with a stand-in of python-control, after what `pip install` does with a wheel of pure Python."""
    site = tmp_path / "site"
    (site / "control").mkdir(parents=True)
    (site / "control" / "__init__.py").write_text(STAND_IN, encoding="utf-8")
    with zipfile.ZipFile(wheel) as content:
        content.extractall(site)
    return site


def run_in(site, code):
    """Run `code` where this checkout is not on the path."""
    path = f"import sys\nsys.path[:] = [{str(site)!r}, *(p for p in sys.path if p != {str(ROOT)!r})]\n"
    return subprocess.run(
        [sys.executable, "-P", "-c", path + code], cwd=site, capture_output=True, text=True, timeout=60, check=False
    )


def test_beside_another_control_both_work(site):
    code = (
        "import control, robot_io\nfrom robot_io import Ft300, Ridgeback, Ur10, open_device\n"
        "from robot_io.rig import load_rig\nassert load_rig('thing').name == 'thing'\n"
        "from robot_io.errors import DeviceUnreachable\n"
        "try:\n    Ft300('/dev/absent').open()\nexcept DeviceUnreachable as error:\n    print(error.where)\n"
        "print(control.__version__, robot_io.__file__)"
    )
    done = run_in(site, code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["ft300 /dev/absent", f"0.10.2 {site / 'robot_io' / '__init__.py'}"]
    assert (site / "control" / "__init__.py").read_text(encoding="utf-8") == STAND_IN
    assert {path.name for path in (site / "control").iterdir()} <= {"__init__.py", "__pycache__"}


def test_its_push_says_in_one_sentence_that_the_application_runs_from_a_checkout(site):
    [entries] = site.glob("*.dist-info/entry_points.txt")
    assert "push = robot_io._entry:main" in entries.read_text(encoding="utf-8").splitlines()
    arguments = "sys.argv[1:] = ['run', '--json']\n"
    done = run_in(site, f"{arguments}from robot_io._entry import main\nraise SystemExit(main())")
    assert done.returncode == 3
    assert "runs from a checkout" in done.stderr
    assert done.stderr.count("\n") == 1
    assert json.loads(done.stdout)["error"]["code"] == 3


def test_importing_it_costs_no_device_and_nothing_heavy():
    loaded = loaded_by("import robot_io")
    assert not loaded & (HEAVY | {"serial", "websockets", "robot_io.ft300.driver", "robot_io.ur10.driver"})


@pytest.mark.parametrize(
    "name",
    mostly_long(
        ("Ft300", "Ur10", "Ridgeback", "open_device", "rig.load_rig", "mcap.read_log"), "Ft300", "Ur10", "Ridgeback"
    ),
)
def test_no_part_of_it_needs_what_the_application_needs(name):
    room, _, what = name.rpartition(".")
    loaded = loaded_by(f"from robot_io{'.' if room else ''}{room} import {what}")
    tops = {module.partition(".")[0] for module in loaded}
    assert not tops & (HEAVY | {"control", "safety", "sim_backend", "tools", "wsproto"})


def test_names_that_are_not_there_are_an_attribute_error():
    import robot_io

    with pytest.raises(AttributeError, match="has no attribute 'Ft400'"):
        _ = robot_io.Ft400


def test_every_public_name_is_offered_before_it_is_imported():
    # What an interactive session completes after `robot_io.` and `robot_io.ft300.`
    code = "import robot_io, robot_io.ft300; print(*dir(robot_io), *dir(robot_io.ft300))"
    said = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True
    )
    assert {"Ft300", "Ridgeback", "Ur10", "errors", "messages", "open_device"} <= set(said.stdout.split())
