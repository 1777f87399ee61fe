"""The line an operator sees, also before anything is known."""

from __future__ import annotations

import io

from tools.live_line import LiveLine
from tools.rig import resolve_rig

STATUS = {
    "phase": "PUSH",
    "mode": "PUSHING",
    "progress_m": 1.25,
    "lateral_m": -0.02,
    "force_N": [14.0, 3.0, 0.1],
    "theta_p": 0.1,
    "speed": 0.1,
    "faults": [],
}


def shown(monkeypatch, *statuses):
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)
    live = LiveLine(resolve_rig("sim"))
    for status in statuses:
        live.show(status)
    return stream.getvalue()


def test_figures_of_a_push(monkeypatch):
    line = shown(monkeypatch, STATUS)
    assert "PUSH" in line
    assert "1.25/2.00 m" in line
    assert "-0.020 m" in line
    assert "14.3/150 N" in line


def test_what_is_not_known_yet_is_no_error(monkeypatch):
    """Before the first pose the position is NaN, which JSON carries as null."""
    line = shown(monkeypatch, {**STATUS, "phase": "SETTLE", "progress_m": None, "lateral_m": None})
    assert "SETTLE" in line
    assert "nan" in line


def test_a_fault_is_a_line_of_its_own_in_words_and_said_once(monkeypatch):
    faulty = {**STATUS, "faults": ["F50-slow"], "mode": "SLOW"}
    text = shown(monkeypatch, STATUS, faulty, faulty)
    assert text.count("F50-slow the force is above the slow limit -> SLOW\n") == 1
