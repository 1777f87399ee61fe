"""`robot_io` as a library: its wheel beside a package called `control`, and what importing it costs."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HEAVY = {"matplotlib", "scipy", "numba", "numpy", "osqp", "joblib"}


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
    assert {"robot_io/py.typed", "robot_io/rig/emulated.toml", "robot_io/rig/thing.toml"} <= set(names)


def test_beside_another_control_both_work(wheel, tmp_path):
    """What `pip install` does with a wheel of pure Python: its files go beside those of the others."""
    site = tmp_path / "site"
    (site / "control").mkdir(parents=True)
    (site / "control" / "__init__.py").write_text("__version__ = '0.10.2'\n", encoding="utf-8")
    zipfile.ZipFile(wheel).extractall(site)
    code = (
        f"import sys\nsys.path[:0] = [{str(site)!r}]\nsys.path[:] = [p for p in sys.path if p != {str(ROOT)!r}]\n"
        "import control, robot_io\nfrom robot_io import Ft300, Ridgeback, Ur10, open_device\n"
        "from robot_io.rig import load_rig\nassert load_rig('thing').name == 'thing'\n"
        "from robot_io.errors import DeviceUnreachable\n"
        "try:\n    Ft300('/dev/absent').open()\nexcept DeviceUnreachable as error:\n    print(error.where)\n"
        "print(control.__version__, robot_io.__file__)"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["ft300 /dev/absent", f"0.10.2 {site / 'robot_io' / '__init__.py'}"]


def test_importing_it_costs_no_device_and_nothing_heavy():
    loaded = loaded_by("import robot_io")
    assert not loaded & (HEAVY | {"serial", "websockets", "robot_io.ft300.driver", "robot_io.ur10.driver"})


@pytest.mark.parametrize("name", ["Ft300", "Ur10", "Ridgeback", "open_device", "rig.load_rig", "log.read_log"])
def test_no_part_of_it_needs_what_the_application_needs(name):
    room, _, what = name.rpartition(".")
    loaded = loaded_by(f"from robot_io{'.' if room else ''}{room} import {what}")
    tops = {module.partition(".")[0] for module in loaded}
    assert not tops & (HEAVY | {"control", "safety", "sim_backend", "tools", "wsproto"})


def test_names_that_are_not_there_are_an_attribute_error():
    import robot_io

    with pytest.raises(AttributeError, match="has no attribute 'Ft400'"):
        _ = robot_io.Ft400
    assert set(robot_io.__all__) <= {*dir(robot_io), "Ft300", "Ridgeback", "Ur10", "open_device"}
