"""Level sim: the same bytes wherever and whenever it runs, light to start, stopped as any run, paced on demand."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
from msgspec.structs import replace

from robot_io.clock import NS_PER_S, SIM_EPOCH_NS
from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.messages import GATE_DECISION
from robot_io.log.world_messages import STATE_CDR
from robot_io.mcap.read import read_log, read_summary
from robot_io.messages import BaseOdometry, BodyTwist
from robot_io.rig.config import rig_to_toml
from robot_io.tick import TICK_CDR, Phase
from sim_backend.sim.ridgeback import SimRidgeback
from tests.push_runs import FAST_TARE, QUICK
from tests.replay.runs import PUSH, ROOT, push
from tools.rig import resolve_rig
from tools.run import paced
from tools.run.lockstep import Lockstep, open_log
from tools.run.tick_core import TickCore

SHORT = ("run", "sim", "--fast", "--distance-m", "0.1", "--no-report", *FAST_TARE)


def log_of(out: Path, *words: str, state: Path, cwd: Path = ROOT, **env: str) -> bytes:
    for _ in range(5):  # on a busy machine git may not answer in its 0.2 s: the log then names no commit
        done = push(*SHORT, *words, "--out", out, state=state, cwd=cwd, **env)
        assert done.returncode == 0, done.stderr
        log = cwd / out / "run.mcap"
        if "commit" in read_summary(log).metadata["run"] or not (ROOT / ".git").exists():
            break
        shutil.rmtree(cwd / out)
    return log.read_bytes()


def test_the_same_seed_gives_the_same_bytes_everywhere(tmp_path):
    first = log_of(tmp_path / "a", "--seed", "3", state=tmp_path / "s1", PYTHONHASHSEED="1", TZ="UTC")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    more = {"PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo", "LC_ALL": "C", "HOME": str(elsewhere), "USER": "nobody"}
    time.sleep(1.0 - time.time() % 1.0)  # another second of the day
    second = log_of(Path("other name"), "--seed", "3", "--json", state=tmp_path / "s2", cwd=elsewhere, **more)
    assert first == second
    assert log_of(tmp_path / "c", "--seed", "4", state=tmp_path / "s1") != first


def test_nothing_of_the_place_the_time_or_the_user_is_in_the_log(tmp_path):
    out = tmp_path / "telltale-folder"
    log_of(out, state=tmp_path / "state", USER="telltale-user")
    summary = read_summary(out / "run.mcap")
    assert summary.start_ns == SIM_EPOCH_NS
    host = os.uname().nodename.encode()
    words = [b"telltale", str(tmp_path).encode(), str(ROOT).encode()]
    for text in (json.dumps(summary.metadata).encode(), *summary.attachments.values()):
        assert not [word for word in (*words, host) if word in text]
    # A short host name is found in any heap of numbers: in messages it counts as a string of CDR only.
    words.append(struct.pack("<I", len(host) + 1) + host + b"\0")
    for message in read_log(out / "run.mcap"):
        assert not [word for word in words if word in message.payload]


HEAVY = (
    "matplotlib", "scipy", "numpy", "osqp", "websockets", "wsproto", "rtde_receive", "rtde_control", "serial",
    "minimalmodbus", "joblib", "numba", "distributed", "mujoco", "asyncio", "multiprocessing", "lz4",
)  # fmt: skip


def test_level_sim_imports_no_figures_solvers_or_wires(tmp_path):
    program = (
        "import sys; from tools.cli import main; code = main(sys.argv[1:]);"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr); sys.exit(code)"
    )
    words = [sys.executable, "-c", program, *SHORT, "--out", str(tmp_path / "run")]
    environment = os.environ | {"XDG_STATE_HOME": str(tmp_path)}
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[-1] == "[]"


@pytest.mark.long
def test_the_operators_stop_ends_a_paced_run_with_130_and_a_whole_log(tmp_path):
    out = tmp_path / "run"
    words = [
        sys.executable,
        "-c",
        PUSH,
        "run",
        "sim",
        "--set",
        "ft.tare_s=1",
        "--out",
        str(out),
        "--no-report",
        "--json",
    ]
    environment = os.environ | {"XDG_STATE_HOME": str(tmp_path), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        words, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:  # until the base moves
            if "APPROACH" in line:
                break
        process.send_signal(signal.SIGINT)
        told, _ = process.communicate(timeout=30)
    summary = json.loads(told.splitlines()[-1])
    assert process.returncode == summary["exit_code"] == 130
    assert summary["verdict"] == "operator stop"
    done = push("replay", out, "--json", state=tmp_path)
    assert done.returncode == 0, done.stderr
    ticks = [TICK_CDR.decode(m.payload) for m in read_log(out / "run.mcap") if m.topic == "/control/tick"]
    assert max(abs(tick.output.command_body.vx) for tick in ticks) > 0.0
    assert ticks[-1].output.command_body.vx == ticks[-1].output.command_body.vy == 0.0
    assert ticks[-1].output.finished


def test_an_exception_in_a_tick_stops_the_base_and_is_named_in_the_log(monkeypatch):
    """As in the loop of a wall-clock run: zero, F68, and the error goes on to whoever runs it."""
    fold = TickCore.fold

    def broken(self, state, inp):
        if state.control.progress_m > 0.01 and not inp.host.loop_error:
            raise ArithmeticError("planted by a test")
        return fold(self, state, inp)

    monkeypatch.setattr(TickCore, "fold", broken)
    ticks, sent = [], []

    class Kept:
        def record(self, kind, time_ns, payload):
            if kind == Kind.GATE_SENT:
                sent.append(CHANNELS[Kind.GATE_SENT].cdr_type.decode(payload).twist.linear)

        def tick(self, time_ns, payload, tick):
            ticks.append(tick)

    one = Lockstep(resolve_rig("sim", ()), 0, Kept())
    with pytest.raises(ArithmeticError, match="planted by a test"):
        one.run(lambda *_: None)
    *_, before, last = ticks
    assert before.output.command_body != BodyTwist()
    assert (last.output.faults, last.output.exit_code, last.output.finished) == (("F68",), 1, True)
    assert last.output.command_body == BodyTwist()
    assert last.before == ()
    assert one.notes.fault_counts == {"F68": 1}
    assert (sent[-2].x > 0.04, sent[-1].x, sent[-1].y) == (True, 0.0, 0.0)


def test_a_latch_of_the_gate_is_in_the_log_and_the_run_replays(tmp_path, monkeypatch):
    """As in a wall-clock run. Odometry of 0.2 m/s, three in a row, where 1.3 times 0.15 m/s is the most allowed."""
    drain, began_ns = SimRidgeback.drain, []

    def too_fast(self):
        samples = list(drain(self))
        for i, sample in enumerate(samples):
            if isinstance(sample.value, BaseOdometry) and (began_ns or sample.value.twist.vx > 0.04):  # it pushes
                began_ns.append(sample.received_ns)
                samples[i] = replace(sample, value=BaseOdometry(BodyTwist(0.2, 0.0, 0.0)))
        return tuple(samples)

    monkeypatch.setattr(SimRidgeback, "drain", too_fast)
    rig = resolve_rig("sim", ())
    log = open_log(tmp_path / "run.mcap", rig_to_toml(rig), 0, in_contact=False)
    ended = Lockstep(rig, 0, log).run(lambda *_: None)
    log.finish({})
    assert ended["exit_code"] == 5
    found = list(read_log(tmp_path / "run.mcap"))
    (decision,) = [m for m in found if m.topic == "/gate/decision"]
    latch = GATE_DECISION.decode(decision.payload)
    assert (latch.verdict, latch.latched, latch.text) == (10, True, "the base is faster than the envelope")
    assert 0 <= decision.log_time_ns - SIM_EPOCH_NS + NS_PER_S - began_ns[2] < 10_000_000  # the tick that saw the third
    events = [CHANNELS[Kind.SAFETY_EVENT].cdr_type.decode(m.payload) for m in found if m.topic == "/safety/event"]
    assert [e.fault for e in events if e.text.startswith("gate: ")] == ["F35"]
    sent = [CHANNELS[Kind.GATE_SENT].cdr_type.decode(m.payload).twist.linear.x for m in found if m.topic == "/gate/sent"
            and m.log_time_ns >= decision.log_time_ns]  # fmt: skip
    assert set(sent) == {0.0}
    done = push("replay", tmp_path / "run.mcap", "--json", state=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


class SlowlyWaiting:
    """An event loop on a clock of its own: to wait takes as long as is waited."""

    def __init__(self) -> None:
        self.now_ns = 100 * NS_PER_S
        self.waits_ns: list[int] = []

    def call_at(self, deadline_ns: int, callback) -> None:
        self.due = (deadline_ns, callback)

    def run_once(self) -> None:
        deadline_ns, callback = self.due
        self.waits_ns.append(max(0, deadline_ns - self.now_ns))
        self.now_ns = max(self.now_ns, deadline_ns)
        callback(deadline_ns)


def test_pacing_keeps_the_rate_and_never_bursts_after_a_pause(monkeypatch):
    loop = SlowlyWaiting()
    monkeypatch.setattr(paced, "monotonic_ns", lambda: loop.now_ns)
    pace = paced.WallPace(loop, 0.01)
    for _ in range(100):
        loop.now_ns += 2_000_000  # the tick's own work
        pace.wait()
    assert loop.now_ns == 101 * NS_PER_S
    loop.now_ns += NS_PER_S // 2
    loop.waits_ns.clear()
    for _ in range(10):
        pace.wait()
    assert loop.waits_ns[0] == 0
    assert loop.waits_ns[1:] == [10_000_000] * 9


@pytest.mark.long
def test_a_paced_run_takes_as_long_as_it_says(tmp_path):
    began_s = time.monotonic()
    done = push("run", "sim", "--distance-m", "0.05", "--out", tmp_path / "run", *QUICK, state=tmp_path)
    took_s = time.monotonic() - began_s
    assert done.returncode == 0, done.stderr
    summary = read_summary(tmp_path / "run" / "run.mcap")
    duration_s = (summary.end_ns - summary.start_ns) * 1e-9
    assert duration_s > 1.0
    assert 0.99 * duration_s < took_s < 10 * duration_s  # a slow host may take longer, never shorter


@pytest.mark.long
def test_osqp_and_the_closed_form_push_the_same_way(tmp_path):
    tracks = []
    for solver in ("exact", "osqp"):
        out = tmp_path / solver
        log_of(out, "--set", f'world.solver="{solver}"', state=tmp_path / "state")
        states = [STATE_CDR.decode(m.payload) for m in read_log(out / "run.mcap") if m.topic == "/world/state"]
        tracks.append([(s.base.x, s.base.y, s.slider.x, s.slider.y, s.slider.yaw) for s in states])
    exact, osqp = tracks
    assert len(exact) == len(osqp)
    assert exact[0][2] != exact[-1][2]
    worst = max(abs(a - b) for one, two in zip(exact, osqp, strict=True) for a, b in zip(one, two, strict=True))
    assert 0.0 < worst < 1e-6  # zero: the same solver twice


def test_a_disk_that_fills_up_is_a_sentence_and_what_was_written_can_be_saved(tmp_path):
    words = [sys.executable, "-c", PUSH, *SHORT, "--out", str(tmp_path / "run"), "--json"]
    done = subprocess.run(
        words,
        cwd=ROOT,
        env=os.environ | {"XDG_STATE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000)),
    )
    error = json.loads(done.stdout)["error"]
    assert (done.returncode, error["code"]) == (3, 3)
    assert error["where"].endswith("run.mcap")
    assert "unexpected" not in done.stderr
    assert push("log", "recover", tmp_path / "run", state=tmp_path).returncode == 0
    assert push("replay", tmp_path / "run" / "run_recovered.mcap", state=tmp_path).returncode == 0


class Unlogged:
    """A log that keeps nothing."""

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        pass

    def tick(self, time_ns: int, payload: bytes, tick: object) -> None:
        pass


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_ten_minutes_of_pause_with_the_noise_of_all_devices_cost_nothing(seed):
    """In the middle of the push and in the retreat; neither a fault nor a loss nor a resume, and the same verdict."""
    one = Lockstep(resolve_rig("sim", ("control.distance_m=1.0",)), seed, Unlogged())
    left = {Phase.PUSH: 60_000, Phase.RETREAT: 6_000}

    def on_tick(inp, state, _output):
        phase = Phase(state.control.phase)
        due = left.get(phase, 0) > 0 and (phase != Phase.PUSH or state.control.progress_m > 0.5)
        one.paused = due
        if due:
            left[phase] -= 1

    figures = one.run(on_tick)
    assert set(left.values()) == {0}
    assert (figures["exit_code"], figures["fault_counts"], figures["lost_times"]) == (0, {}, 0)
    assert (figures["pauses"], round(figures["paused_s"])) == (2, 660)
    assert abs(figures["lateral_error_m"]) < 0.1
