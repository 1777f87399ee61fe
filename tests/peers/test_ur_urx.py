"""`urx` 0.11 from PyPI, in an environment of its own, against the emulated controller."""

import json
import subprocess
import sys

import pytest

from tests.wire.ur_process import EmulatorProcess

pytestmark = [pytest.mark.long, pytest.mark.timeout(600)]

CLIENT = """
import json, sys, urx
robot = urx.Robot(sys.argv[1], use_rt=True)
start = robot.getj()
seen = {"joints": start, "running": robot.is_running(), "program": robot.is_program_running(),
        "rt": list(map(float, robot.rtmon.q_actual(wait=True))), "force": robot.get_force()}
robot.set_tcp((0, 0, 0.1, 0, 0, 0))
robot.set_digital_out(2, True)
try:
    robot.movej([q + 0.05 for q in start], acc=1.0, vel=0.5)
    seen["moved"] = robot.getj()
except urx.RobotException as error:
    seen["stopped"] = str(error)
seen["out"] = robot.get_digital_out(2, wait=True)
robot.close()
print(json.dumps(seen))
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    home = tmp_path_factory.mktemp("urx")
    steps = (
        [sys.executable, "-m", "venv", home / "venv"],
        [home / "venv" / "bin" / "python", "-m", "pip", "install", "-q", "urx==0.11.0", "numpy"],
    )
    for step in steps:
        done = subprocess.run(step, capture_output=True, text=True, timeout=300, check=False)
        if done.returncode != 0:
            pytest.skip(f"urx cannot be installed here: {done.stderr.strip().splitlines()[-1:]}")
    return home / "venv" / "bin" / "python"


def talk(python, robot) -> dict[str, object]:
    done = subprocess.run(
        [python, "-W", "ignore", "-c", CLIENT, robot.host], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_urx_reads_the_arm_and_moves_it(python) -> None:
    """With PolyScope 3.4, the newest whose packets urx 0.11 knows."""
    with EmulatorProcess(version=[3, 4, 5, 100]) as robot:
        seen = talk(python, robot)
        held = [1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31]
        assert seen["joints"] == seen["rt"] == held
        assert (seen["running"], seen["program"], seen["force"]) == (True, False, 0.0)
        assert seen["moved"] == pytest.approx([q + 0.05 for q in held], abs=1e-4)
        assert seen["out"] == 1
        assert robot.get("controller.tcp_offset") == [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]


def test_urx_takes_a_newer_polyscope_for_stopped_as_it_does_on_the_real_one(python) -> None:
    """It reads all, but not the longer robot mode of 3.5 and later: SintefManufacturing/python-urx issue 41."""
    with EmulatorProcess() as robot:
        seen = talk(python, robot)
    assert seen["joints"] == seen["rt"]
    assert (seen["running"], seen["stopped"]) == (False, "Robot stopped")
