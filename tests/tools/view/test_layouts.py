"""The layouts for viewers: what they read exists in a real log, and what was promised is on the first screen."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from robot_io.mcap.read import read_summary
from robot_io.tick import Mode, Phase
from tests.push_runs import QUICK, finished
from tools.view import lichtblick
from tools.view.panels import PLOTS, SCENE_TOPICS, SIGNALS_TOPIC, STATES, contents

ROOT = Path(__file__).resolve().parents[3]
FIRST_SCREEN = {
    "force_n",
    "force_along_n",
    "force_across_n",
    "speed_sent",
    "speed_measured",
    "lateral_m",
    "theta_f_rad",
    "theta_p_rad",
    "phase",
    "mode",
}


@pytest.fixture(scope="module")
def schemas(tmp_path_factory) -> dict[str, set[str]]:
    """Return the names of the fields of each topic's message in a log that a run has just written."""
    folder = tmp_path_factory.mktemp("view")
    argv = ("run", "sim", "--fast", *QUICK, "--distance-m", "0.1", "--out", str(folder / "run"))
    assert finished(folder / "state", *argv).code == 0
    channels = read_summary(folder / "run" / "run.mcap").channels
    return {channel.topic: fields_of(channel.schema_text) for channel in channels}


def fields_of(definition: str) -> set[str]:
    """Return the fields of the first message of a ROS 2 definition; constants are none."""
    own = re.split(r"^=+$", definition, flags=re.MULTILINE)[0]
    words = [line.split("#")[0].split() for line in own.splitlines()]
    return {two[1] for two in words if len(two) == 2 and "=" not in two[1]}


@pytest.mark.parametrize("path", lichtblick.paths(lichtblick.layout()))
def test_every_path_of_the_layout_is_in_a_log(path, schemas):
    topic, _, field = path.partition(".")
    assert topic in schemas
    assert not field or field in schemas[topic]


def test_every_field_of_the_blueprint_is_in_a_log(schemas):
    fields = {line.field for plot in PLOTS for line in plot.lines} | set(STATES)
    assert fields <= schemas[SIGNALS_TOPIC]
    assert set(SCENE_TOPICS) <= set(schemas)


def test_the_first_screen_shows_what_was_promised():
    shown = {path.split(".")[1] for path in lichtblick.paths(lichtblick.layout()) if "." in path}
    assert shown == {line.field for plot in PLOTS for line in plot.lines} | set(STATES) == FIRST_SCREEN


def test_every_panel_is_placed_once():
    found = lichtblick.layout()

    def placed(part: object) -> list[object]:
        if isinstance(part, dict):
            assert part["direction"] in ("row", "column")
            assert 0 < part["splitPercentage"] < 100
            return [*placed(part["first"]), *placed(part["second"])]
        return [part]

    assert sorted(map(str, placed(found["layout"]))) == sorted(found["configById"])
    kinds = {panel.split("!")[0] for panel in found["configById"]}
    assert kinds == {"3D", "Plot", "StateTransitions"}


def test_states_have_the_names_of_their_numbers():
    assert STATES["phase"] == tuple(phase.name for phase in sorted(Phase))
    assert STATES["mode"] == tuple(mode.name for mode in sorted(Mode))
    assert min(Phase) == min(Mode) == 0


def test_the_blueprint_was_made_of_these_panels():
    """Else: `python -m tools.dev.rerun_blueprint tools/view/push.rbl`."""
    assert (ROOT / "tools/view/push.rbl.txt").read_text() == contents()
    assert (ROOT / "tools/view/push.rbl").read_bytes().startswith(b"RRF2")
