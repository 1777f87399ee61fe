"""The report of a run: true to its log, self-contained, safe with what a log says, made of any whole log."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import itertools
import json
import math
import re
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from robot_io.errors import LogDamaged
from robot_io.log.channels import Kind
from robot_io.log.recovery import recover
from robot_io.mcap.read import read_log, read_summary
from robot_io.rig.config import RigConfig, load_rig, rig_from_toml, rig_to_toml
from robot_io.tick import TICK_CDR, ControlTick, Phase
from tests.push_runs import FAST_TARE
from tools.cli import main
from tools.commands import run_outputs
from tools.laws import law_label
from tools.log.run_log import RunLog
from tools.report import process as report_process
from tools.report.page import page, run_mark, write_report
from tools.report.process import ReportProcess
from tools.report.run_data import read_run
from tools.report.run_facts import reader_facts
from tools.report.run_summary import baseline_of, differences, tiles
from tools.report.run_verdict import verdict

ROOT = Path(__file__).resolve().parents[3]
EVIL = "<script>alert(1)</script>\"'&$(x) \\frac{ \x1b[31m"


@pytest.fixture(scope="session")
def ran(tmp_path_factory) -> tuple[Path, str]:
    """A short run as a user makes it: its folder, and what it printed on stdout."""
    out = tmp_path_factory.mktemp("report") / "run"
    command = ["run", "sim", "--fast", "--distance-m", "0.2", "--seed", "3", *FAST_TARE, "--out", str(out), "--json"]
    code = "import sys; from tools.cli import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", code, *command], cwd=ROOT, capture_output=True, text=True, check=True, timeout=80
    )
    assert f"report: {out / 'report.html'}" in done.stderr
    return out, done.stdout


@pytest.fixture(scope="session")
def ticks(ran) -> list[ControlTick]:
    return [TICK_CDR.decode(m.payload) for m in read_log(ran[0] / "run.mcap") if m.topic == "/control/tick"]


def rig_of(folder: Path) -> RigConfig:
    return rig_from_toml((folder / "config.toml").read_text())


def write_log(path: Path, rig: RigConfig, ticks: list[ControlTick], **facts: str) -> Path:
    """Write a log of these ticks and nothing else: no world, no motion capture."""
    log = RunLog(path, config_text=rig_to_toml(rig), metadata={"seed": "3", **facts}, wall_offset_ns=0)
    for tick in ticks:
        log.record(Kind.CONTROL_TICK, tick.input.now_ns, TICK_CDR.encode(tick))
    log.finish({})
    return path


def hardware(rig: RigConfig, name: str = "mine") -> RigConfig:
    real = {field: replace(getattr(rig, field), level="hardware") for field in ("ft", "arm", "base")}
    return replace(rig, name=name, **real)


class Page(HTMLParser):
    """What a browser would see of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: dict[str, str] = {}
        self._open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in self._open:
            while self._open.pop() != tag:
                pass

    def handle_data(self, data: str) -> None:
        if self._open:
            self.words[self._open[-1]] = self.words.get(self._open[-1], "") + data

    @property
    def pictures(self) -> dict[str, str]:
        """What each figure shows in words, by its name."""
        found = {}
        for tag, attrs in self.tags:
            if tag == "svg" and "data-name" in attrs:
                assert attrs["role"] == "img"
                found[attrs["data-name"] or ""] = attrs["aria-label"] or ""
        return found


FIGURES = {"trajectory", "force", "speed", "tracking", "timing", "safety"}


def assert_self_contained(text: str) -> Page:
    """Nothing is fetched, and no script but the page's own, named by its hash, may run."""
    seen = Page(text)
    assert not {tag for tag, _ in seen.tags} & {"link", "iframe", "object", "embed", "form", "a", "img", "base"}
    scripts = re.findall(r"<script>(.*?)</script>", text, re.S)
    assert len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    policy = next(a["content"] for tag, a in seen.tags if a.get("http-equiv") == "Content-Security-Policy")
    parts = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    assert parts == {
        "default-src": "'none'",
        "style-src": "'unsafe-inline'",
        "script-src": f"'sha256-{digest}'",
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    for tag, attrs in seen.tags:
        assert not [name for name in attrs if name.startswith("on")], tag
        assert not {"src", "srcset", "action", "data"} & set(attrs), tag
        assert all((attrs.get(name) or "#").startswith("#") for name in ("href", "xlink:href")), tag
        assert tag != "script" or set(attrs) <= {"id", "type"}
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)
    assert "http://" not in text.replace("http://www.w3.org/2000/svg", "")
    assert "https://" not in text
    return seen


def test_a_run_ends_in_a_report_and_says_so_the_same_everywhere(ran):
    out, stdout = ran
    told = json.loads(stdout)
    assert stdout.count("\n") == 1
    assert told["report"] == str(out / "report.html")
    assert json.loads((out / "summary.json").read_text()) == told
    seen = assert_self_contained((out / "report.html").read_text())
    assert set(seen.pictures) == FIGURES
    assert len(set(seen.pictures.values())) == 6
    assert seen.words["h1"] == f"Pushed {told['distance_m']:.2f} m"
    assert f"{told['lateral_error_m']:+.3f} m" in seen.words["dd"]
    assert ("meta", {"name": "color-scheme", "content": "light dark"}) in seen.tags
    for fact in ("control.distance_m", "seed", "single-point-push", "packets ok", str(told["loop"]["ticks"])):
        assert fact in " ".join(seen.words.values()), fact


def test_the_numbers_are_those_of_the_log(ran, ticks):
    run = read_run(ran[0] / "run.mcap")
    assert run.tick_count == len(ticks) == len(run.ticks["t_s"])
    assert run.last is not None
    assert TICK_CDR.encode(run.last) == TICK_CDR.encode(ticks[-1])
    pushing = [i for i, tick in enumerate(ticks) if tick.after.control.phase == Phase.PUSH]
    middle = pushing[len(pushing) // 2]
    one = ticks[middle]
    row = {name: values[middle] for name, values in run.ticks.items()}
    assert row["t_s"] == pytest.approx((one.input.now_ns - ticks[0].input.now_ns) * 1e-9)
    assert row["phase"] == Phase.PUSH
    assert row["lateral_m"] == pytest.approx(one.after.control.lateral_m, abs=1e-12)
    assert row["along_m"] == pytest.approx(one.after.control.contact_from_m + one.after.control.progress_m, abs=1e-12)
    assert row["theta_p"] == one.after.control.theta_p
    raw = [
        math.dist(reading.force, tick.after.control.bias_force)
        for tick in ticks
        if tick.after.control.tared
        for reading in tick.input.ft.readings[-1:]
    ]
    assert np.nanmax(run.ticks["force_raw"]) == pytest.approx(max(raw))
    assert dict(tiles(run))["maximum force"] == f"{max(raw):.1f} N"
    assert run.slider_source == "world"
    assert run.slider["x_m"][-1] - run.slider["x_m"][0] == pytest.approx(0.2, abs=0.03)
    assert run.modes[0].begin_s == 0.0
    assert run.modes[-1].end_s >= run.ticks["t_s"][-1]


def test_positions_and_forces_are_in_the_frame_of_the_path(ran, ticks, tmp_path):
    rig = rig_of(ran[0])
    turned = replace(rig, path=replace(rig.path, direction_deg=90.0, origin_m=(1.0, 2.0)))
    run = read_run(write_log(tmp_path / "run.mcap", turned, ticks))
    middle = len(ticks) // 2
    output, (fx, fy, _) = ticks[middle].output, ticks[middle].after.control.force_world
    # A path along +y: along is y, left is -x.
    assert run.ticks["along_m"][middle] == pytest.approx(output.contact_y - 2.0)
    assert run.ticks["lateral_m"][middle] == pytest.approx(-(output.contact_x - 1.0))
    assert (run.ticks["force_x"][middle], run.ticks["force_y"][middle]) == pytest.approx((fy, -fx))


def test_a_hardware_log_without_a_world_and_with_hostile_names(ran, ticks, tmp_path):
    rig = hardware(rig_of(ran[0]), name=EVIL)
    log = write_log(tmp_path / "run.mcap", rig, ticks, operator=EVIL, level=f"hardware {EVIL}")
    (tmp_path / "summary.json").write_text(json.dumps({"notes": [EVIL], "devices": {"ft300": {EVIL: EVIL}}}))
    write_report(log, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text()
    seen = assert_self_contained(text)
    assert "&lt;script&gt;alert(1)&lt;/script&gt;&quot;" in text
    assert "\x1b" not in text
    assert "alert(1)" in seen.words["dd"] + seen.words["p"]
    assert set(seen.pictures) == FIGURES
    assert "The pose of the object is unknown" in text
    assert "Settings that differ from" in text
    assert baseline_of(rig) == "thing"


@pytest.mark.parametrize(
    "beside", ["[]", "null", "{", '"x"', '{"devices": 3, "notes": {"a": 1}, "replay": 4}', "[" * 99999]
)
def test_a_summary_that_is_none_changes_nothing(ran, ticks, tmp_path, beside):
    log = write_log(tmp_path / "run.mcap", rig_of(ran[0]), ticks[:5])
    (tmp_path / "summary.json").write_text(beside)
    from tools.report.page import read_summary_file

    text = page(read_run(log), read_summary_file(tmp_path / "summary.json"), {}, "0")
    assert "<h3>ft300</h3>" in text


def test_a_law_is_called_by_its_own_name(ran):
    run = read_run(ran[0] / "run.mcap")
    for law, name in (
        ("force", "force feedback"),
        ("open-loop", "open loop"),
        ("mine:Law", "mine:Law"),
    ):
        rig = replace(run.rig, control=replace(run.rig.control, law=law))
        assert law_label(rig) == name


def test_facts_begin_with_what_a_reader_asks(ran):
    run = read_run(ran[0] / "run.mcap")
    rows = reader_facts(run, {"note": "box, 2 kg"})
    assert [name for name, _ in rows][:3] == ["note", "rig", "law"]  # a virtual clock has no date
    assert dict(rows)["law"] == "force feedback, k_f 0.3, k_y 0.2 rad/m"
    assert dict(rows)["push"] == "0.2 m at 0.1 m/s"
    text = (ran[0] / "report.html").read_text()
    assert text.index("force feedback, k_f 0.3") < text.index("message_sum")
    assert "<details>" in text[: text.index("message_sum")]


@pytest.mark.long
@pytest.mark.timeout(400)
@pytest.mark.parametrize(("distance_m", "most_bytes"), [(6, 1_500_000), (60, 4_000_000)])
def test_a_page_is_small(tmp_path, distance_m, most_bytes):
    assert main(["run", "sim", "--fast", "--distance-m", str(distance_m), "--out", str(tmp_path / "run")]) == 0
    assert (tmp_path / "run" / "report.html").stat().st_size <= most_bytes


def test_a_log_without_a_tick(ran, tmp_path):
    log = write_log(tmp_path / "run.mcap", rig_of(ran[0]), [])
    write_report(log, tmp_path / "report.html")
    seen = assert_self_contained((tmp_path / "report.html").read_text())
    assert seen.words["h1"] == "Did not start"
    assert set(seen.pictures) == FIGURES


def test_a_run_that_failed_before_any_contact(ran, ticks, tmp_path):
    start = [tick for tick in ticks if tick.after.control.phase in (Phase.SETTLE, Phase.TARE)][:20]
    failed = start[-1]
    control = replace(failed.after.control, phase=int(Phase.FAILED))
    output = replace(failed.output, finished=True, exit_code=4, faults=("R02",))
    start[-1] = replace(failed, after=replace(failed.after, control=control), output=output)
    log = write_log(tmp_path / "run.mcap", rig_of(ran[0]), start)
    write_report(log, tmp_path / "report.html")
    seen = assert_self_contained((tmp_path / "report.html").read_text())
    assert seen.words["h1"] == "Not ready after 0.00 m"
    assert "R02 the force sensor was not settled while taring" in seen.words["p"]
    assert "R02" in seen.words["td"]


@pytest.mark.parametrize(("seen", "why"), [(True, "The force did not return"), (False, "No contact was felt")])
def test_why_a_push_failed_without_and_after_a_contact(ran, ticks, tmp_path, seen, why):
    last = ticks[-1]
    control = replace(last.after.control, contact_seen=seen, phase=int(Phase.FAILED))
    ended = replace(last, after=replace(last.after, control=control), output=replace(last.output, exit_code=6))
    log = write_log(tmp_path / "run.mcap", rig_of(ran[0]), [*ticks[:-1], ended])
    assert verdict(read_run(log), {}).why.startswith(why)


def test_a_log_that_ends_in_the_middle_of_a_push(ran, ticks, tmp_path):
    pushing = [i for i, tick in enumerate(ticks) if tick.after.control.phase == Phase.PUSH]
    log = write_log(tmp_path / "run.mcap", rig_of(ran[0]), ticks[: pushing[len(pushing) // 2]])
    found = verdict(read_run(log), {})
    assert not found.good
    assert found.line.startswith("Aborted after 0.")
    assert "phase push" in found.why


def test_a_recovered_log(ran, tmp_path):
    whole = (ran[0] / "run.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) * 3 // 4])
    with pytest.raises(LogDamaged):
        write_report(cut, tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()
    recover(cut, tmp_path / "run.mcap")
    write_report(tmp_path / "run.mcap", tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text()
    assert "This log was recovered" in text
    assert "Aborted" in assert_self_contained(text).words["h1"]


def test_numbers_beyond_all_reason_do_not_stop_it(ran, ticks, tmp_path):
    odd = []
    for n, tick in enumerate(ticks[::10]):
        value = (math.nan, math.inf, -math.inf, 1e308)[n % 4]
        control = replace(tick.after.control, force_world=(value, value, 0.0), theta_p=value, held_yaw=value)
        output = replace(tick.output, contact_x=value, faults=(f"${n}\\frac{{$", "\u2603" * 500))
        odd.append(replace(tick, after=replace(tick.after, control=control), output=output))
    log = write_log(tmp_path / "run.mcap", rig_of(ran[0]), odd)
    write_report(log, tmp_path / "report.html")
    assert set(assert_self_contained((tmp_path / "report.html").read_text()).pictures) == FIGURES


def test_settings_are_compared_with_the_shipped_rig_of_that_name():
    rig = load_rig("emulated", ["control.k_f=0.7", "world.slider.mass_kg=9.5"])
    assert baseline_of(rig) == "emulated"
    assert differences(rig, "emulated") == [("control.k_f", "0.3", "0.7"), ("world.slider.mass_kg", "5.1", "9.5")]
    assert differences(load_rig("barrel"), "barrel") == []


def test_the_log_of_another_program_is_refused(ran, tmp_path):
    from robot_io.cdr.cdr_type import CdrType
    from robot_io.mcap.log_file import McapLog
    from robot_io.messages import Pose2D

    for topic, what in (
        ("/control/tick", "Pose2D where a push_msgs/msg/ControlTick"),
        ("/pose", "not the log of a push"),
    ):
        path = tmp_path / f"{topic[1:4]}.mcap"
        log = McapLog(path, config_text="x = 1" if topic == "/pose" else rig_to_toml(rig_of(ran[0])), metadata={})
        log.channel(topic, CdrType(Pose2D, "push_msgs/msg/Pose2D"))
        log.write(topic, 1, CdrType(Pose2D, "push_msgs/msg/Pose2D").encode(Pose2D()))
        log.finish({})
        with pytest.raises(LogDamaged, match=what):
            read_run(path)


# --- the command -------------------------------------------------------------------------------------------------


def json_of(capsys: Any) -> dict[str, Any]:
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    return dict(json.loads(out))


def test_push_report_writes_page_and_figures_and_makes_its_own_again(ran, tmp_path, capsys):
    out = tmp_path / "new"
    for _ in range(2):
        assert main(["report", str(ran[0]), "--out", str(out), "--png", "--json"]) == 0
        told = json_of(capsys)
        assert told["report"] == str(out / "report.html")
    names = {"report.html", "trajectory.png", "force.png", "speed.png", "tracking.png", "timing.png", "safety.png"}
    assert {path.name for path in out.iterdir()} == names
    assert all((out / name).read_bytes().startswith(b"\x89PNG") for name in names - {"report.html"})
    assert (out / "report.html").read_bytes() == (ran[0] / "report.html").read_bytes()  # as `push run` made it


def test_push_report_overwrites_nothing_else(ran, ticks, tmp_path, capsys):
    kept = {"report.html": "mine\n"}
    (tmp_path / "report.html").write_text(kept["report.html"])
    assert main(["report", str(ran[0]), "--out", str(tmp_path), "--json"]) == 2
    assert "report of another run" in json_of(capsys)["error"]["what"]
    assert (tmp_path / "report.html").read_text() == "mine\n"

    other = tmp_path / "other"
    other.mkdir()
    (other / "force.png").write_text("mine\n")
    assert main(["report", str(ran[0]), "--out", str(other), "--png", "--json"]) == 2
    assert json_of(capsys)["error"]["where"] == str(other / "force.png")
    assert [path.name for path in other.iterdir()] == ["force.png"]

    rig = rig_of(ran[0])
    one = read_run(write_log(tmp_path / "a.mcap", rig, ticks[:3]))
    two = read_run(write_log(tmp_path / "b.mcap", replace(rig, description="another"), ticks[:3]))
    assert run_mark(one) != run_mark(two)


@pytest.mark.parametrize(("content", "code"), [(None, 2), (b"nonsense", 8), (b"", 8)])
def test_push_report_of_what_is_no_log(tmp_path, capsys, content, code):
    path = tmp_path / "run.mcap"
    if content is not None:
        path.write_bytes(content)
    assert main(["report", str(path), "--json"]) == code
    assert json_of(capsys)["error"]["code"] == code
    assert not (tmp_path / "report.html").exists()


# --- as the end of a run -----------------------------------------------------------------------------------------


def test_a_report_that_fails_is_said_and_fails_nothing(tmp_path, capsys, monkeypatch):
    (tmp_path / "run.mcap").write_bytes(b"nonsense")
    summary: dict[str, Any] = {"log": str(tmp_path / "run.mcap"), "report": None}
    run_outputs.write_report(summary, tmp_path, None)
    assert summary["report"] is None
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "this is not an MCAP file" in said
    monkeypatch.setattr(report_process, "TIMEOUT_S", 0.001)
    run_outputs.write_report(summary, tmp_path, None)
    assert summary["report"] is None
    assert "took longer than" in capsys.readouterr().err


def reader_of(process: ReportProcess, log: Path, *, at_least: int) -> None:
    """Wait until the process has the log open and has read so many bytes of it."""
    pid, deadline_s = process._process.pid, time.monotonic() + 30.0
    while True:
        for entry in Path(f"/proc/{pid}/fd").iterdir():
            with contextlib.suppress(OSError):
                if entry.readlink() == log:
                    told = Path(f"/proc/{pid}/fdinfo/{entry.name}").read_text()
                    if int(told.split()[1]) >= at_least:
                        return
        assert process._process.poll() is None, "it ended"
        assert time.monotonic() < deadline_s, "it does not read"
        time.sleep(0.01)


@pytest.mark.long
def test_a_log_is_read_while_it_grows(ran, tmp_path):
    whole = (ran[0] / "run.mcap").read_bytes()
    log = tmp_path / "run.mcap"
    process = ReportProcess(log, tmp_path / "report.html")  # before there is a log
    try:
        with log.open("wb", buffering=0) as file:
            for begin, end in itertools.pairwise((0, 5, 100, len(whole) // 2, len(whole) - 3, len(whole))):
                file.write(whole[begin:end])
                if begin:
                    reader_of(process, log, at_least=min(begin, len(whole) // 4))
        assert process.make() == ""
    finally:
        process.drop()
    write_report(log, tmp_path / "again.html")
    assert (tmp_path / "report.html").read_bytes() == (tmp_path / "again.html").read_bytes()


def test_a_log_that_stops_growing_is_truncated(ran, tmp_path):
    whole = (ran[0] / "run.mcap").read_bytes()
    log = tmp_path / "run.mcap"
    log.write_bytes(whole[: len(whole) // 2])
    process = ReportProcess(log, tmp_path / "report.html")
    try:
        reader_of(process, log, at_least=100)
        assert "truncated" in process.make()
    finally:
        process.drop()
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_a_report_nobody_wants_any_more_ends_by_itself(tmp_path):
    process = ReportProcess(tmp_path / "run.mcap", tmp_path / "report.html")
    process._process.stdin.close()
    process._process.stdin = None
    assert process._process.wait(30.0) == 1
    process.drop()
    assert list(tmp_path.iterdir()) == []


def test_the_config_in_the_log_is_what_is_read(ran):
    """`run.mcap` alone is enough: nothing beside it is needed."""
    run = read_run(ran[0] / "run.mcap")
    assert run.config_text.encode() == read_summary(ran[0] / "run.mcap").attachments["config.toml"]
    assert run.rig == rig_of(ran[0])
