"""What to try: the fault page's next step, the evidence's remedy, and `calibrate frame` only where it can be told."""

import math
from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as but

from robot_io.tick import Phase
from safety.table.fault_advice import advice_of
from tools.report.advice.force_angle import force_angle, tare_error_newtons
from tools.report.advice.what_to_try import what_to_try
from tools.report.run_data import read_run
from tools.report.run_verdict import Verdict
from tools.verdict.evidence import TrustItem

DONE = Verdict("Pushed", "", True, word="done")
FRAME = "push calibrate frame"


@pytest.fixture(scope="module")
def run(runs):
    return read_run(runs / "one" / "run.mcap")


def pushed(run, length_m, *, aside_deg=0.0, start_deg=0.0, per_m=0.7, tare_s=5.0, end_m=0.0, force_N=15.0):
    """Return a push of `length_m` whose force points `aside_deg` aside, and `start_deg` more at its start."""
    along = np.linspace(0.0, length_m, 2000)
    angle = np.radians(aside_deg + start_deg * np.exp(-per_m * along) * np.cos(0.8 * along))
    columns = {name: np.full(len(along), math.nan) for name in run.ticks}
    columns |= {
        "t_s": along / 0.1, "along_m": along, "theta_f": angle, "phase": np.full(len(along), float(Phase.PUSH)),
        "force_x": force_N * np.cos(angle), "force_y": force_N * np.sin(angle), "lateral_m": np.full(len(along), end_m),
    }  # fmt: skip
    control = but(run.last.after.control, end_lateral_m=end_m, residual_N=0.0, phase=int(Phase.DONE))
    last = but(run.last, after=but(run.last.after, control=control))
    rig = but(run.rig, ft=but(run.rig.ft, tare_s=tare_s))
    return replace(run, rig=rig, ticks=columns, last=last)


def test_the_tare_error_is_two_standard_errors_of_the_sensors_noise(run):
    # 1.2 N of noise at 100 Hz: 0.12 N after 1 s, twice that is stated.
    one = but(run.rig, ft=but(run.rig.ft, tare_s=1.0))
    assert tare_error_newtons(one) == pytest.approx(0.24)
    assert tare_error_newtons(but(one, ft=but(one.ft, tare_s=4.0))) == pytest.approx(0.12)


def test_a_long_push_with_a_turned_sensor_asks_for_its_frame(run):
    lines = what_to_try(pushed(run, 18.0, aside_deg=3.0, start_deg=-15.0, end_m=-0.33), DONE)
    assert FRAME in lines[0]
    assert "+3.0 degrees" in lines[0]
    # (1 + k_f) / k_y with 0.3/0.2: 6.5 m a radian, 0.113 m a degree; at 15 N 0.433 m a newton.
    assert "0.11 m beside the line" in lines[1]
    assert "0.43 m" in lines[1]


@pytest.mark.parametrize("length_m", [1.5, 3.0])
def test_a_short_push_does_not_whatever_it_reads(run, length_m):
    """A push of 3 m with a sensor turned by 3 degrees reads -4 to -5: its start is not over."""
    lines = what_to_try(pushed(run, length_m, aside_deg=3.0, start_deg=-15.0, end_m=0.2), DONE)
    assert FRAME not in " ".join(lines)
    assert "push further" in lines[0]


def test_a_short_tare_may_explain_what_is_seen(run):
    """0.24 N of 15 N are 0.9 degrees."""
    lines = what_to_try(pushed(run, 18.0, aside_deg=0.7, end_m=-0.11, tare_s=1.0), DONE)
    assert FRAME not in " ".join(lines)
    assert "ft.tare_s=5" in lines[0]
    assert FRAME in what_to_try(pushed(run, 18.0, aside_deg=1.2, end_m=-0.14, tare_s=1.0), DONE)[0]


def test_an_angle_that_the_offset_does_not_confirm_is_not_the_frame(run):
    """A settled push with 1 degree of error ends 0.11 m to the other side; the floor can turn the force for a while."""
    for end_m in (0.0, 0.33, -0.02):
        assert FRAME not in " ".join(what_to_try(pushed(run, 18.0, aside_deg=3.0, end_m=end_m), DONE))


def test_a_push_on_its_line_is_left_alone(run):
    assert what_to_try(pushed(run, 18.0), DONE) == []


def test_a_push_too_short_has_no_angle(run):
    assert force_angle(pushed(run, 0.8, aside_deg=3.0)) is None


def test_the_closed_forms_are_not_applied_to_other_laws(run):
    other = pushed(run, 18.0, aside_deg=3.0, end_m=-0.33)
    other.rig = but(other.rig, control=but(other.rig.control, law="force-integral"))
    assert what_to_try(other, DONE) == []


def test_a_fault_brings_the_next_step_of_its_page(run):
    stopped = Verdict("Safety stop", "", False, (), "F50-stop", "safety stop")
    lines = what_to_try(pushed(run, 6.0), stopped)
    assert advice_of("F50-stop").next_step in lines[0]
    assert lines[0].startswith("F50-stop: ")


def test_evidence_against_the_run_brings_its_remedy(run):
    items = (
        TrustItem("residual", "against", 9.0, 5.0, "N", "it reads 9 N"),
        TrustItem("log", "for", None, None, "", ""),
    )
    lines = what_to_try(pushed(run, 6.0), Verdict("Pushed", "", False, items, word="not trusted"))
    assert "ft.tare_s" in lines[0]


def test_every_evidence_that_can_speak_against_a_run_has_a_remedy():
    import re
    from pathlib import Path

    from tools.report.advice.what_to_try import BY_EVIDENCE
    from tools.verdict import evidence

    names = set(re.findall(r'_item\(\s*"(\w+)"', Path(evidence.__file__).read_text()))
    only_unknown = {"preflight", "pose", "calibration"}
    assert names - set(evidence.LINE) - only_unknown == set(BY_EVIDENCE)
