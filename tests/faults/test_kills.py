"""Any process of a run killed in the middle of a push: the base stands in time, the log is whole, nothing stays.

`pytest -s` prints what was measured.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from robot_io.log.messages import SAFETY_EVENT
from robot_io.tick import TICK_CDR
from safety.faults import FAULTS
from tests.faults.kill_rounds import Round, pushing, strike, within
from tests.forked_push import forked
from tests.host_watch import repeated_when_the_host_stalls
from tests.how_many import mostly_long
from tests.push_runs import PUSH, QUICK, ROOT, messages, one_error, stands, started, world_of
from tools.report.run_data import read_run
from tools.report.run_verdict import verdict

KILL, STOP = signal.SIGKILL, signal.SIGSTOP
ZERO_MS = 20.0
FROZEN_ZERO_MS = 70.0
REST_MS = 60.0
"""One tick of the base (40 ms), and braking from 0.1 m/s at 2.5 m/s^2, which fits into the next one."""
GATE_GONE_REST_MS = 330.0
"""The base's own timeout of 0.25 s and its tick, 29 ticks of 10 ms, and 4 more per 0.1 m/s."""
ARM_GONE_ZERO_MS = 30.0
"""One tick, and two on the wire."""
AGAIN = 8


def replays(folder: Path) -> None:
    """Check that the log is whole and folds to itself."""
    done = forked(folder / "state", "replay", str(folder), "--json")
    assert done.code == 0, done.out + done.err
    result = done.last_object
    assert result["ticks"] == result["identical"] > 100
    assert result["world"]["states"] == result["world"]["identical"] > 100


def logged_faults(found: Round) -> list[str]:
    """Return the named faults of a log, in order."""
    events = [SAFETY_EVENT.decode(message.payload) for message in messages(found.folder / "run.mcap", "/safety/event")]
    return [event.fault for event in events if event.kind == "fault"]


def check_dead_control(found: Round, *faults: str) -> None:
    """Check everything that does not depend on who died; one of `faults` must be in the log."""
    assert set(faults) & set(logged_faults(found))
    assert found.last_state_ms > found.rest_ms, "the log goes on until the wheels stand"
    replays(found.folder)


@pytest.mark.parametrize("again", mostly_long(range(AGAIN), 0))
def test_control_killed(state, tmp_path, host, again):
    found = within(state, tmp_path, "control", KILL, host, zero_ms=ZERO_MS, rest_ms=REST_MS)
    check_dead_control(found, "F65")
    assert found.ended.code == 5, found.ended.err
    summary = found.ended.last_object
    assert summary["verdict"] == "safety stop"
    assert summary["faults"] == ["F65"]
    assert summary["distance_m"] > 0.0
    assert summary["devices"]["ft300"]["packets_ok"] > 100
    assert [note for note in summary["notes"] if "SIGKILL" in note]
    assert FAULTS["F65"].text in found.ended.err
    assert json.loads((found.folder / "summary.json").read_text()) == summary


@pytest.mark.long
@pytest.mark.parametrize("again", range(AGAIN))
def test_launcher_killed(state, tmp_path, host, again):
    found = within(state, tmp_path, "launcher", KILL, host, zero_ms=ZERO_MS, rest_ms=REST_MS)
    # Its pipe to control breaks a moment before the kernel kills control: where a tick falls in between, control has
    # taken it for the operator's stop (F64), and is killed while it brakes.
    check_dead_control(found, "F65", "F64")
    assert found.ended.code == -KILL


@pytest.mark.long
@pytest.mark.parametrize("again", range(AGAIN))
def test_control_frozen(state, tmp_path, host, again):
    found = within(state, tmp_path, "control", STOP, host, zero_ms=FROZEN_ZERO_MS, rest_ms=REST_MS)
    check_dead_control(found, "F66")
    assert found.ended.code == 5, found.ended.err
    assert found.ended.last_object["faults"] == ["F66"]
    assert FAULTS["F66"].text in found.ended.err


@pytest.mark.parametrize("again", mostly_long(range(AGAIN), 0))
def test_gate_killed_and_the_base_stops_by_its_own_timeout(state, tmp_path, host, again):
    found = within(state, tmp_path, "gate", KILL, host, zero_ms=None, rest_ms=GATE_GONE_REST_MS)
    assert found.zero_ms is None, "nobody else holds the base's connection"
    assert "F67" in logged_faults(found)
    assert found.ended.code == 5, found.ended.err
    assert found.ended.last_object["faults"][0] == "F67"
    replays(found.folder)


@pytest.mark.long
@pytest.mark.parametrize("again", range(AGAIN))
def test_arm_killed(state, tmp_path, host, again):
    found = within(state, tmp_path, "arm", KILL, host, zero_ms=ARM_GONE_ZERO_MS, rest_ms=REST_MS)
    assert "F69" in logged_faults(found)
    assert found.ended.code == 5, found.ended.err
    assert found.ended.last_object["faults"][0] == "F69"
    replays(found.folder)


@pytest.mark.long
@repeated_when_the_host_stalls
def test_arm_frozen(state, tmp_path, host):
    found = strike(state, tmp_path / "run", "arm", STOP, host)
    assert "F24-hold" in logged_faults(found)
    assert found.ended.code == 5, found.ended.err
    replays(found.folder)


@pytest.mark.long
@repeated_when_the_host_stalls
def test_recorder_killed(state, tmp_path, host):
    """Nobody is in danger: the push goes on for a second, then the base holds; what was flushed can be recovered."""
    found = strike(state, tmp_path / "run", "recorder", KILL, host, log="recovered.mcap")
    assert found.ended.code == 5, found.ended.err
    summary = found.ended.last_object
    assert summary["faults"] == ["F63"]
    assert FAULTS["F63"].text in found.ended.err
    assert [note for note in summary["notes"] if "not complete" in note]
    assert 1000.0 < found.gone_ms < 6000.0
    log = found.folder / "run.mcap"
    recovered = [*PUSH, "log", "recover", str(log), "--out", str(tmp_path / "recovered.mcap")]
    done = subprocess.run(recovered, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    ticks = [TICK_CDR.decode(message.payload) for message in messages(tmp_path / "recovered.mcap", "/control/tick")]
    lost_ms = (found.struck_ns - ticks[-1].input.now_ns) / 1e6
    assert lost_ms < 300.0, "it flushes every 250 ms what it drains every 20 ms"


def wait_for_only(run, pids, left, within_s):
    """Wait until no process of a run but those of `left` (with a space between) lives."""
    deadline_s = time.monotonic() + within_s
    while others := {name for name, pid in pids.items() if pid in run.alive() and name not in left.split()}:
        assert time.monotonic() < deadline_s, f"still alive: {others}"
        time.sleep(0.05)


@pytest.mark.long
@repeated_when_the_host_stalls
def test_launcher_frozen(state, tmp_path, host):
    """Nobody holds the operator's keys: held after 0.5 s, stopped after 2 s; 5 s after that only the frozen one is."""
    with pushing(state, tmp_path / "run", host) as (run, pids):
        frozen_ns = time.monotonic_ns()
        run.signal(STOP)
        wait_for_only(run, pids, "launcher", 2.0 + 1.5 + 5.0)
        run.signal(signal.SIGCONT)
        ended = run.wait(10.0)
        run.wait_gone(3.0)
    assert ended.code == 5, ended.err
    assert ended.last_object["faults"] == ["F73-stop"]
    assert ended.last_object["fault_counts"]["F73-hold"] == 1
    log = tmp_path / "run" / "run.mcap"
    ticks = [TICK_CDR.decode(message.payload) for message in messages(log, "/control/tick")]
    first = {row: next(t.input.now_ns for t in ticks if row in t.output.faults) for row in ("F73-hold", "F73-stop")}
    # The last sign of life came up to 0.1 s before the freeze.
    assert 390.0 < (first["F73-hold"] - frozen_ns) / 1e6 < 530.0
    assert 1890.0 < (first["F73-stop"] - frozen_ns) / 1e6 < 2030.0
    assert stands(world_of(log)[1][-1][1])
    replays(tmp_path / "run")


@pytest.mark.long
@pytest.mark.parametrize("frozen", ["control launcher", "control gate launcher"])
@repeated_when_the_host_stalls
def test_several_frozen_at_once(state, tmp_path, host, frozen):
    """5 s after rest nothing lives but the frozen ones, which find their run ended when they go on."""
    with pushing(state, tmp_path / "run", host) as (run, pids):
        for name in frozen.split():
            os.kill(pids[name], STOP)
        wait_for_only(run, pids, frozen.replace("control", ""), 0.35 + 5.0)
        for name in frozen.split()[1:]:
            os.kill(pids[name], signal.SIGCONT)
        ended = run.wait(10.0)
        run.wait_gone(3.0)
    assert ended.code == 5, ended.err
    assert "the control process was killed" in ended.err
    # A gate that is frozen, too, writes nothing any more: the base then stops by its own timeout.
    assert ended.last_object["faults"] == ([] if "gate" in frozen else ["F66"])
    assert stands(world_of(tmp_path / "run" / "run.mcap")[1][-1][1])
    replays(tmp_path / "run")


@pytest.mark.long
@repeated_when_the_host_stalls
def test_launcher_frozen_for_a_moment(state, tmp_path, host):
    """The base holds and goes on by itself."""
    argv = ("run", "emulated", *QUICK, "--distance-m", "0.5", "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, host=host) as run:
        run.wait_for("PUSH ")
        run.signal(STOP)
        time.sleep(1.0)
        run.signal(signal.SIGCONT)
        ended = run.wait()
    assert ended.code == 0, ended.err
    assert ended.last_object["fault_counts"]["F73-hold"] == 1


@pytest.mark.long
@repeated_when_the_host_stalls
def test_launcher_frozen_before_the_start(state, tmp_path, host):
    """Devices are open and nothing has moved: the processes end without it."""
    argv = ("run", "emulated", *QUICK, "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, host=host) as run:
        told = tmp_path / "run" / "processes.json"
        deadline_s = time.monotonic() + 20.0
        while not told.exists():
            assert time.monotonic() < deadline_s, run.err
            time.sleep(0.002)
        run.signal(STOP)
        pids = json.loads(told.read_text())
        wait_for_only(run, pids, "launcher", 12.0)
        run.signal(signal.SIGCONT)
        error = one_error(run.wait(10.0), 3)
    assert "the launcher was frozen for 2 s before the start" in error["what"]


@pytest.mark.long
@repeated_when_the_host_stalls
def test_recorder_frozen(state, tmp_path, host):
    found = strike(state, tmp_path / "run", "recorder", STOP, host, log="recovered.mcap")
    assert found.ended.code == 5, found.ended.err
    assert found.ended.last_object["faults"] == ["F63"]
    assert [note for note in found.ended.last_object["notes"] if "not complete" in note]
    assert 1000.0 < found.gone_ms < 12000.0


@pytest.mark.long
@repeated_when_the_host_stalls
def test_all_devices_gone_at_once(state, tmp_path, host):
    """The emulators killed: every device is lost, as when the robot is switched off."""
    found = strike(state, tmp_path / "run", "emulators", KILL, host)
    assert found.ended.code == 5, found.ended.err
    faults = set(found.ended.last_object["faults"])
    assert faults & {"F30", "F02", "F24-stop", "F69"}
    assert [note for note in found.ended.last_object["notes"] if "emulators" in note]
    assert found.ended.last_object["first_fault"]["id"] == "emulators"
    assert "safety stop after" in found.ended.err
    assert ": the emulators have ended, and with them every emulated device at " in found.ended.err
    from_the_log = verdict(read_run(tmp_path / "run" / "run.mcap"), {})
    assert from_the_log.first_fault == "emulators", from_the_log


@pytest.mark.long
@repeated_when_the_host_stalls
def test_nobody_but_control_ends_the_gate_and_the_recorder(state, tmp_path, host):
    """Whoever signals all processes of a run would cut the base's last zeros, and the log."""
    argv = ("run", "emulated", *QUICK, "--distance-m", "0.2", "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, host=host) as run:
        run.wait_for("APPROACH|PUSH ")
        pids = json.loads((tmp_path / "run" / "processes.json").read_text())
        for name in ("gate", "recorder"):
            for number in (signal.SIGINT, signal.SIGTERM):
                os.kill(pids[name], number)
        ended = run.wait()
        run.wait_gone(3.0)
    assert ended.code == 0, ended.err
    assert ended.last_object["notes"] == []
    replays(tmp_path / "run")


BROKEN_FOLD = """
import sys
if "tools.run.control_process" in sys.orig_argv:
    from tools.run.tick_core import TickCore
    fold = TickCore.fold
    def broken(self, state, inp):
        if state.control.progress_m > 0.1 and not inp.host.loop_error:
            raise ArithmeticError("planted by a test")
        return fold(self, state, inp)
    TickCore.fold = broken
"""


@pytest.mark.long
@repeated_when_the_host_stalls
def test_an_exception_in_the_loop(state, tmp_path, host):
    (tmp_path / "sitecustomize.py").write_text(BROKEN_FOLD)
    argv = ("run", "emulated", *QUICK, "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, host=host, env={"PYTHONPATH": str(tmp_path)}) as run:
        ended = run.wait(60.0)
        run.wait_gone(3.0)
        assert ended.code == 1, ended.err
        summary = ended.last_object
        assert summary["faults"] == ["F68"]
        assert 0.1 < summary["distance_m"] < 0.2
        [note] = [note for note in summary["notes"] if "ArithmeticError: planted by a test" in note]
        assert "Traceback" not in ended.err
        traceback = Path(note.rpartition(" ")[2]).read_text()
        assert 'raise ArithmeticError("planted by a test")' in traceback
    log = tmp_path / "run" / "run.mcap"
    last = TICK_CDR.decode(messages(log, "/control/tick")[-1].payload)
    assert (last.output.faults, last.output.exit_code, last.output.finished) == (("F68",), 1, True)
    events = [SAFETY_EVENT.decode(message.payload) for message in messages(log, "/safety/event")]
    assert "F68" in [event.fault for event in events]
    assert "F65" not in [event.fault for event in events], "the zero came first"
    commands, wheels = world_of(log)
    failed_ns = last.input.now_ns
    zero_ns = next(t_ns for t_ns, twist in commands if t_ns >= failed_ns and stands(twist))
    print(f"exception: zero {(zero_ns - failed_ns) / 1e6:.1f} ms after its tick")
    assert (zero_ns - failed_ns) / 1e6 < ZERO_MS
    assert stands(wheels[-1][1])
    replays(tmp_path / "run")


FROZEN_BEFORE_ITS_FIRST_TICK = """
import sys
if "tools.run.control_process" in sys.orig_argv:
    import gc, os, signal
    gc.freeze = lambda: os.kill(os.getpid(), signal.SIGSTOP)
"""


@pytest.mark.long
def test_control_frozen_before_its_first_tick(state, tmp_path):
    """The gate has heard nothing yet that could fall silent; the run ends all the same, and says why."""
    (tmp_path / "sitecustomize.py").write_text(FROZEN_BEFORE_ITS_FIRST_TICK)
    argv = ("run", "emulated", *QUICK, "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, env={"PYTHONPATH": str(tmp_path)}) as run:
        error = one_error(run.wait(40.0), 5)
        run.wait_gone(3.0)
    assert "control process was killed by SIGKILL" in error["what"]


TERMINATED_AS_THE_STREAM_BEGINS = """
import sys
if "tools.run.control_process" in sys.orig_argv:
    import os, signal
    from pathlib import Path
    from robot_io.ft300.driver import Ft300
    start, close = Ft300.start, Ft300.close
    def close_and_say_so(self):
        close(self)
        Path(CLOSED).touch()
    def start_and_be_told_to_end(self):
        start(self)
        Ft300.close = close_and_say_so
        os.kill(os.getpid(), signal.SIGTERM)
    Ft300.start = start_and_be_told_to_end
"""


@pytest.mark.long
def test_control_told_to_end_while_it_opens_the_sensor_leaves_no_stream(state, tmp_path):
    closed = tmp_path / "closed"
    (tmp_path / "sitecustomize.py").write_text(f"CLOSED = {str(closed)!r}\n{TERMINATED_AS_THE_STREAM_BEGINS}")
    argv = ("run", "emulated", *QUICK, "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, env={"PYTHONPATH": str(tmp_path)}) as run:
        ended = run.wait(40.0)
        run.wait_gone(3.0)
    assert ended.code != 0
    assert "Traceback" not in ended.err
    assert closed.exists()


ENDLESS_FOLD = """
import sys
if "tools.run.control_process" in sys.orig_argv:
    from msgspec.structs import replace
    from tools.run.tick_core import TickCore
    fold = TickCore.fold
    def endless(self, state, inp):
        after, output = fold(self, state, inp)
        return after, replace(output, finished=False)
    TickCore.fold = endless
"""


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_second_stop_ends_a_control_that_does_not_end(state, tmp_path, host):
    (tmp_path / "sitecustomize.py").write_text(ENDLESS_FOLD)
    with pushing(state, tmp_path / "run", host, env={"PYTHONPATH": str(tmp_path)}) as (run, pids):
        run.signal(signal.SIGINT)
        run.wait_for("stopping")
        time.sleep(1.5)  # whoever asks again within a second means the same stop
        assert pids["control"] in run.alive()
        run.signal(signal.SIGINT)
        ended = run.wait(10.0)
        run.wait_gone(3.0)
    assert ended.code == 130, ended.err
    assert [note for note in ended.last_object["notes"] if "killed by the operator" in note]
    commands, wheels = world_of(tmp_path / "run" / "run.mcap")
    assert stands(commands[-1][1])
    assert stands(wheels[-1][1])
