"""Laws of one's own: what is refused before anything moves, what stops a push, and what a real robot asks for first."""

from __future__ import annotations

import logging
import re
import time
from pathlib import Path

import pytest

from control.laws.law import Seen
from robot_io.errors import ConfigError, UsageError
from robot_io.rig.config import load_rig
from robot_io.rig.types import LawFacts
from tests.safety.fold_bench import FoldBench
from tools.cli import main
from tools.commands.run import check_law
from tools.faults.bad_laws import BadLaw
from tools.laws import law_label
from tools.places import law_proof
from tools.rig import resolve_rig
from tools.run.law_clock import LawClock

HEAD = """
import time
import msgspec

class No(msgspec.Struct, frozen=True):
    pass

class Count(msgspec.Struct, frozen=True):
    n: int = 0

class Thawed(msgspec.Struct):
    n: int = 0

class Words(msgspec.Struct, frozen=True):
    word: str = ""

class Good:
    name = "good"
    Settings, State = No, Count
    def __init__(self, control, settings): pass
    def initial(self): return Count()
    def step(self, state, seen): return 0.0, Count(state.n + 1)
"""
BODIES = {
    "Raising": "    def step(self, state, seen): return (1 / (state.n - 30), Count(state.n + 1))\n",
    "Sleeping": "    def step(self, state, seen):\n        time.sleep(0.02 * (state.n == 30))\n"
    "        return 0.0, Count(state.n + 1)\n",
    "Nowhere": "    def step(self, state, seen): return float('nan'), state\n",
    "Halves": "    def step(self, state, seen): return 0.0, Count(state.n + 0.5)\n",
    "NoSteps": "    step = property()\n",
    "Worded": "    State = Words\n    def initial(self): return Words()\n",
    "Thawing": "    State = Thawed\n",
    "Unborn": "    def __init__(self, control, settings): raise KeyError('no such gain')\n",
    "Initial": "    def initial(self): return No()\n",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the current folder, with a module of laws whose name is its own."""
    name = re.sub(r"\W", "_", f"laws_{tmp_path.name}")
    text = HEAD + "".join(f"\nclass {law}(Good):\n{body}" for law, body in BODIES.items())
    (tmp_path / f"{name}.py").write_text(text + "\nnothing = 1\nclass Bare: pass\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return name


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("Missing", "cannot be imported: AttributeError.*name of its class"),
        ("nothing", "is not a class"),
        ("Bare", "lacks `name`, `Settings`, `State`, `initial`, `step`"),
        ("Worded", "neither float, int, bool"),
        ("Thawing", "the State of .* is not a frozen msgspec.Struct"),
        ("Unborn", "failed: KeyError: 'no such gain'"),
        ("Initial", "failed: TypeError: its state is a No, not Count"),
    ],
)
def test_a_law_that_cannot_be_used_is_refused_in_one_sentence(folder, law, words):
    with pytest.raises(ConfigError, match=words):
        resolve_rig("sim", [f'control.law="{folder}:{law}"'])


def test_a_law_that_does_not_exist_names_the_nearest():
    with pytest.raises(ConfigError, match=r"there is no law `force-integrl`.*Did you mean `force-integral`"):
        resolve_rig("sim", ["control.law=force-integrl"])


def test_nothing_is_left_of_a_run_that_was_refused(folder, capsys):
    assert main(["run", "sim", "--fast", "--law", f"{folder}:Unborn", "--out", "out"]) == 2
    assert not Path("out").exists()
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("law", "fault", "words"),
    [
        ("Raising", "F57", "the law: ZeroDivisionError: division by zero"),
        pytest.param("Halves", "F57", "`n` of its state is a float, not int", marks=pytest.mark.long),
        ("Sleeping", "F57-slow", "limit 1 ms"),
        ("Nowhere", "F58", "not a number"),
    ],
)
def test_a_law_that_fails_stops_the_push_and_its_log_replays(folder, capsys, law, fault, words):
    argv = ["run", "sim", "--fast", "--law", f"{folder}:{law}", "--distance-m", "0.3", "--no-report", "--out", "out"]
    assert main(argv) == 5
    told = capsys.readouterr()
    assert fault in told.out
    assert words in told.out
    assert main(["replay", "out", "--law", f"{folder}:{law}"]) == 0


def test_a_law_s_label_is_its_name(folder):
    assert law_label(resolve_rig("sim", [f'control.law="{folder}:Good"'])) == "good"
    assert law_label(resolve_rig("sim")) == "force feedback"
    assert law_label(load_rig("sim", ["control.law=line"])) == "line"


# --- the first use on a robot ----------------------------------------------------------------------------------


def test_a_law_moves_a_real_robot_only_after_an_emulated_run(folder):
    rig = resolve_rig("sim", [f'control.law="{folder}:Good"'])
    with pytest.raises(UsageError, match="has not yet passed an emulated run with its present source"):
        check_law(rig)
    law_proof.save(rig.control.law_facts, "emulated", "out/run.mcap")
    check_law(rig)
    source = Path(f"{folder}.py")
    source.write_text(source.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    with pytest.raises(UsageError, match="--untested-law"):
        check_law(resolve_rig("sim", [f'control.law="{folder}:Good"']))


def test_a_law_without_a_source_never_counts_as_passed(folder):
    law_proof.save(LawFacts("mine"), "emulated", "run.mcap")
    assert not law_proof.has_passed(LawFacts("mine"))


def test_shipped_laws_need_no_proof():
    check_law(resolve_rig("sim", ["control.law=force-integral"]))


# --- the key of before, and settings ---------------------------------------------------------------------------


def test_the_old_key_is_read_with_a_note(tmp_path, caplog):
    rig = tmp_path / "mine.toml"
    rig.write_text('extends = "sim"\n[control]\ncontroller = "open-loop"\n', encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        assert load_rig(rig).control.law == "open-loop"
    assert caplog.messages == [f"{rig}:3: `control.controller` is read as `control.law`, which is its name now"]
    caplog.clear()
    assert load_rig("sim", ["control.controller=line"]).control.law == "line"
    assert caplog.messages == ["--set: `control.controller` is read as `control.law`, which is its name now"]


def test_both_keys_in_one_file_are_a_mistake(tmp_path):
    rig = tmp_path / "mine.toml"
    rig.write_text('extends = "sim"\n[control]\ncontroller = "open-loop"\nlaw = "line"\n', encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mine.toml:3: `control.controller` is called `control.law` now"):
        load_rig(rig)


def test_the_old_flag_is_read_with_a_note(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "sim", "--controller", "open-loop", "--dry-run", "--json"]) == 0
    told = capsys.readouterr()
    assert '"law":"open-loop"' in told.out.replace(" ", "")
    assert "--controller is called --law now" in told.err


def test_another_law_on_the_command_line_begins_with_its_own_defaults(tmp_path):
    rig = tmp_path / "mine.toml"
    table = "[control.law_settings]\nk_i_rad_per_m2 = 0.07\n"
    rig.write_text(f'extends = "sim"\n[control]\nlaw = "force-integral"\n{table}', encoding="utf-8")
    full = {"k_i_rad_per_m2": 0.07, "max_integral_rad": 0.5, "fade_m": 6.0}
    assert resolve_rig(rig).control.law_settings == full
    assert resolve_rig(rig, ["control.law=force-integral"]).control.law_settings == full
    assert resolve_rig(rig, ["control.law=force"]).control.law_settings == {}
    one = ["control.law_settings.k_i_rad_per_m2=0.03", "control.law=force-integral"]
    assert resolve_rig("sim", one).control.law_settings == full | {"k_i_rad_per_m2": 0.03}


# --- the time of a step ----------------------------------------------------------------------------------------

SEEN = Seen(15.0, 0.0, True, 0.0, 0.0, 1.0, 0.1, 0.01)


class Waiting(BadLaw):
    def step(self, state, seen):
        time.sleep(0.002)
        return 0.0, state


def test_a_step_is_timed_and_told_once():
    clock = LawClock(Waiting())
    assert clock.take_ns() == 0
    clock.step(None, SEEN)
    assert clock.take_ns() >= 2_000_000
    assert clock.take_ns() == 0


def test_at_level_sim_only_a_step_beyond_the_limit_is_told():
    clock = LawClock(BadLaw(), 1_000_000_000)
    clock.step(None, SEEN)
    assert clock.take_ns() == 0
    within = LawClock(Waiting(), 1_000_000)
    within.step(None, SEEN)
    assert within.take_ns() >= 2_000_000


def test_a_law_that_raises_is_timed_too():
    class Raising(BadLaw):
        def step(self, state, seen):
            raise ValueError

    clock = LawClock(Raising())
    with pytest.raises(ValueError):
        clock.step(None, SEEN)
    assert clock.take_ns() > 0


def test_the_limit_is_the_rig_s():
    bench = FoldBench(("limits.law_ms=2.5",))
    assert bench.core.safety.law_ns == 2_500_000
