"""`push sweep`: order and files of the paper's study, resume, worker counts, refusals."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from robot_io.errors import EnvironmentFault, PushError
from tools import cli
from tools.parallel.engine import run_items
from tools.parallel.part import Part
from tools.parallel.store import Store
from tools.sweep import items as sweep_items
from tools.sweep import plan
from tools.sweep.grid import load_grid
from tools.sweep.items import COLUMNS
from tools.sweep.plan import LANE_SOURCES, ROOT

GRID = """
name = "small"
[fixed]
shape = "rectangle"
length_m = 0.4
width_m = 0.6
k_f = 0.3
k_y_rad_per_m = 0.2
[grid]
contact_friction = [0, 0.3, 1.0]
s0_m = [-0.2, 0.1, 0.25]
[time]
dt_s = 0.01
duration_s = 20
record_s = 2
"""
RESULTS = ("results.csv", "states.npz", "summary.json", "trajectories.png", "trajectories.svg")


@pytest.fixture(autouse=True)
def figures_at_low_resolution(monkeypatch):
    """Most of a small study is the drawing of its figures, and most of that the number of their dots."""
    monkeypatch.setattr("tools.sweep.figures.DOTS_PER_INCH", 20)


@pytest.fixture
def grid(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(GRID)
    return path


def push(capsys, *argv):
    """Run `push sweep`; return exit code, the JSON object of the last line of stdout (or None), and stderr."""
    code = cli.main(["sweep", *map(str, argv)])
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    return code, json.loads(out.splitlines()[-1]) if out else None, err


def rows_of(folder):
    with (folder / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.long
def test_the_papers_study_converges_as_the_paper_says(tmp_path, capsys):
    out = tmp_path / "paper"
    code, summary, err = push(capsys, "--out", out, "--json", "--workers", 1)
    assert code == 0
    assert "486 of 486 lanes converged" in err
    assert (summary["schema"], summary["lanes"], summary["steps"], summary["converged"]) == (1, 486, 29_160_000, 486)
    # the distribution found independently for these lanes
    square, circle = summary["shapes"]["square"], summary["shapes"]["circle"]
    assert square["final_abs_y_m"] == pytest.approx({"median": 0.0035, "p90": 0.0165, "max": 0.0350}, abs=1e-4)
    assert circle["final_abs_y_c_m"] == pytest.approx({"median": 0.0018, "p90": 0.0050, "max": 0.0081}, abs=1e-4)
    assert square["final_abs_heading_deg"]["max"] == pytest.approx(0.90, abs=0.01)
    assert square["max_abs_y_m"]["max"] == pytest.approx(4.37, abs=0.01)
    with np.load(out / "states.npz") as file:
        assert file["states"][:, 60, 0].min() > 57


def test_the_papers_study_has_its_order_and_files(tmp_path, capsys):
    out = tmp_path / "paper"
    code, summary, _ = push(capsys, "--out", out, "--json", "--workers", 1, "--dt", 0.1)
    assert (code, summary["lanes"], summary["study"]) == (0, 486, "paper")
    for name in (*RESULTS, "samples.png", "samples.svg"):
        assert (out / name).stat().st_size > 1000
        assert name in summary["files"]
    rows = rows_of(out)
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 486
    tau = {"square": [0.0382598, 0.382598, math.sqrt(0.5)], "circle": [1 / 30, 1 / 3, 0.5]}
    for lane, row in enumerate(rows):
        assert int(row["lane"]) == lane
        assert row["shape"] == ("square", "circle")[lane // 243]
        assert float(row["tau_max"]) == pytest.approx(tau[row["shape"]][lane // 81 % 3], abs=1e-6)
        assert float(row["mu"]) == (0, 0.5, 1)[lane // 27 % 3]
        assert float(row["y0"]) == (-0.4, 0, 0.4)[lane // 9 % 3]
        assert float(row["phi0"]) == (-math.pi / 8, 0, math.pi / 8)[lane // 3 % 3]
        assert float(row["s0"]) == (-0.4, 0, 0.4)[lane % 3]
        counts = [int(row[f"steps_{k}"]) for k in ("sticking", "sliding_left", "sliding_right")]
        assert sum(counts) == int(row["steps"]) == 6000
    with np.load(out / "states.npz") as file:
        states = file["states"]
    assert states.shape == (486, 61, 6)
    assert states[60, 0] == pytest.approx([0, -0.4, math.pi / 8, -0.4, 1, 0])
    for lane in (0, 60, 461):
        assert [float(rows[lane][k]) for k in ("x", "y", "phi", "s", "fx", "fy")] == states[lane, 60].tolist()


def test_one_and_more_workers_and_an_interruption_give_the_same_bytes(tmp_path, grid, capsys, monkeypatch):
    monkeypatch.setattr(sweep_items, "MOST_LANES_PER_ITEM", 2)
    push(capsys, grid, "--out", tmp_path / "one", "--workers", 1)
    push(capsys, grid, "--out", tmp_path / "two", "--workers", 2)

    real, count = sweep_items.run_lane_item, [0]

    def interrupted(item):
        count[0] += 1
        if count[0] == 3:
            raise KeyboardInterrupt
        return real(item)

    monkeypatch.setattr("tools.sweep.plan.run_lane_item", interrupted)
    code, _, err = push(capsys, grid, "--out", tmp_path / "cut", "--workers", 1)
    assert code == 130
    assert "4 of 9 cases done" in err
    assert "--resume" in err
    assert not (tmp_path / "cut" / "results.csv").exists()
    monkeypatch.setattr("tools.sweep.plan.run_lane_item", real)
    code, _, err = push(capsys, grid, "--out", tmp_path / "cut", "--workers", 1, "--resume")
    assert code == 0
    assert "2 of 5 parts are done already" in err
    for name in RESULTS:
        expected = (tmp_path / "one" / name).read_bytes()
        assert (tmp_path / "two" / name).read_bytes() == expected
        assert (tmp_path / "cut" / name).read_bytes() == expected


def test_a_damaged_part_is_run_again(tmp_path, grid, capsys):
    out = tmp_path / "out"
    push(capsys, grid, "--out", out, "--workers", 1)
    expected = (out / "results.csv").read_bytes()
    (out / "parts" / "000000.npz").write_bytes(b"PK\x03\x04 not whole")
    code, _, _ = push(capsys, grid, "--out", out, "--workers", 1, "--resume")
    assert code == 0
    assert (out / "results.csv").read_bytes() == expected


def test_one_changed_byte_anywhere_makes_a_part_unfinished(tmp_path):
    store = Store(tmp_path, "s", "mark", resume=False)
    store.save(0, Part([{"a": 1.5}], {"states": np.arange(3.0)}))
    path = tmp_path / "parts" / "000000.npz"
    whole = path.read_bytes()
    assert store.finished(1) == {0}
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x40]) + whole[place + 1 :])
        assert store.finished(1) == set(), f"byte {place}"
    path.write_bytes(whole)
    assert store.finished(1) == {0}


@pytest.mark.long
def test_a_part_of_another_study_is_run_again(tmp_path, grid, capsys):
    for name, gains in (("one", "0.3,0.2"), ("other", "0.3,0.1")):
        push(capsys, grid, "--out", tmp_path / name, "--gains", gains, "--workers", 1)
    expected = (tmp_path / "one" / "results.csv").read_bytes()
    foreign = (tmp_path / "other" / "parts" / "000000.npz").read_bytes()
    (tmp_path / "one" / "parts" / "000000.npz").write_bytes(foreign)
    push(capsys, grid, "--out", tmp_path / "one", "--gains", "0.3,0.2", "--workers", 1, "--resume")
    assert (tmp_path / "one" / "results.csv").read_bytes() == expected


def test_all_program_text_of_a_lane_is_in_the_fingerprint():
    code = "import sys, tools.sweep.items, sim_backend.physics.batch; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    ours = {name for name in loaded if name.startswith(("sim_backend.physics.", "tools.sweep."))}
    assert ours == {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in LANE_SOURCES}


def test_a_failing_item_is_rows_and_not_an_abort(tmp_path, grid, capsys, monkeypatch):
    monkeypatch.setattr(sweep_items, "MOST_LANES_PER_ITEM", 3)
    from sim_backend.physics import batch

    real = batch.run_batch

    def broken(lanes, timing):
        if any(lane.contact_friction == 0.3 for lane in lanes):
            raise ZeroDivisionError("no such thing")
        return real(lanes, timing)

    monkeypatch.setattr(batch, "run_batch", broken)
    out = tmp_path / "out"
    code, summary, _ = push(capsys, grid, "--out", out, "--workers", 1, "--json")
    assert code == 0
    assert summary["shapes"]["rectangle"]["ended"]["error"] == 3
    codes = [row["code"] for row in rows_of(out)]
    assert codes[3:6] == ["error"] * 3
    assert "error" not in codes[:3] + codes[6:]
    assert rows_of(out)[4]["error"] == "ZeroDivisionError: no such thing"


def test_of_an_item_only_the_failing_case_is_an_error(tmp_path, grid, capsys, monkeypatch):
    from sim_backend.physics import batch

    real = batch.run_batch

    def broken(lanes, timing):
        if any(lane.contact_friction == 0.3 and lane.s0_m == 0.1 for lane in lanes):
            raise ZeroDivisionError("no such thing")
        return real(lanes, timing)

    assert push(capsys, grid, "--out", tmp_path / "well")[0] == 0
    monkeypatch.setattr(batch, "run_batch", broken)
    assert push(capsys, grid, "--out", tmp_path / "out", "--workers", 1)[0] == 0
    well, rows = rows_of(tmp_path / "well"), rows_of(tmp_path / "out")
    assert [row["code"] == "error" for row in rows] == [i == 4 for i in range(9)]
    assert rows[:4] + rows[5:] == well[:4] + well[5:]


@pytest.mark.parametrize("command", [("sweep",), ("bench", "physics")])
def test_without_numba_it_is_one_sentence_and_no_row(tmp_path, capsys, monkeypatch, grid, command):
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.delitem(sys.modules, "sim_backend.physics.batch", raising=False)
    argv = [*command, *([str(grid), "--out", str(tmp_path / "out")] if command == ("sweep",) else [])]
    assert cli.main(argv) == 3
    err = capsys.readouterr().err
    assert "numba is not installed" in err
    assert len(err.strip().splitlines()) == 1
    with pytest.raises(EnvironmentFault):
        sweep_items.run_lane_item(sweep_items.cut(load_grid(grid, {}))[0])


def test_a_case_beyond_the_range_of_numbers_is_an_error_and_no_nan(tmp_path, capsys):
    path = tmp_path / "far.toml"
    path.write_text("[fixed]\ns0_m = 0.1\n[grid]\ntau_max_Nm = [1e-300]\n[time]\nduration_s = 1\nrecord_s = 1\n")
    code, summary, _ = push(capsys, path, "--out", tmp_path / "out", "--json")
    assert code == 0
    assert summary["shapes"]["square"]["ended"]["error"] == 1
    (row,) = rows_of(tmp_path / "out")
    assert row["code"] == "error"
    assert row["x"] == ""
    assert "overflowed" in row["error"]


def test_the_figure_draws_a_lost_push_to_its_very_end():
    from tools.sweep.figures import trajectories
    from tools.sweep.grid import Case

    states = np.full((1, 3, 6), np.nan)
    states[0, 0] = 0.0  # lost before the second record
    figure = trajectories([Case()], states, np.array([[0.3, 0.1]]), "lost")
    assert figure.axes[0].lines[0].get_xydata().tolist() == [[0.0, 0.0], [0.3, 0.1]]


def test_gains_open_loop_and_step_change_every_case(tmp_path, grid, capsys):
    code, summary, _ = push(
        capsys,
        grid,
        "--out",
        tmp_path / "out",
        "--gains=0.1,0.3",
        "--open-loop",
        "--dt",
        0.02,
        "--json",
        "--workers",
        1,
    )
    assert code == 0
    assert summary["shapes"]["rectangle"]["ended"]["edge"] > 0
    rows = rows_of(tmp_path / "out")
    assert {(row["k_f"], row["k_y"], row["controller"]) for row in rows} == {("0.1", "0.3", "open-loop")}
    assert max(int(row["steps"]) for row in rows) <= 1000


def test_every_shipped_law_can_be_swept(tmp_path, capsys):
    text = '[grid]\nlaw = ["force", "open-loop", "line", "force-integral"]\n[time]\nduration_s = 10\n'
    path = tmp_path / "laws.toml"
    path.write_text(text, encoding="utf-8")
    assert push(capsys, path, "--out", tmp_path / "out", "--workers", 1)[0] == 0
    rows = rows_of(tmp_path / "out")
    assert [row["controller"] for row in rows] == ["force", "open-loop", "line", "force-integral"]
    assert [row["k_i"] for row in rows] == ["", "", "", "0.06"]


@pytest.mark.parametrize(
    "text", ['[grid]\nlaw = ["force", "my:Law"]\n', '[fixed]\nlaw = "my:Law"\n[grid]\nk_f = [0.1]\n']
)
def test_a_law_of_ones_own_is_for_push_study(tmp_path, capsys, text):
    path = tmp_path / "laws.toml"
    path.write_text(text, encoding="utf-8")
    code, _, err = push(capsys, path, "--out", tmp_path / "out")
    assert code == 2
    assert "push study" in err
    assert not (tmp_path / "out").exists()
    assert push(capsys, "paper", "--law", "my:Law", "--out", tmp_path / "out")[0] == 2


def test_the_law_s_old_name_in_a_grid_is_read_with_a_note(tmp_path, capsys, caplog):
    path = tmp_path / "laws.toml"
    path.write_text('[grid]\ncontroller = ["open-loop"]\n[time]\nduration_s = 10\n', encoding="utf-8")
    assert push(capsys, path, "--out", tmp_path / "out", "--workers", 1)[0] == 0
    assert [row["controller"] for row in rows_of(tmp_path / "out")] == ["open-loop"]
    assert caplog.messages == [f"{path}:2: `controller` is read as `law`, which is its name now"]


def test_monte_carlo_draws_are_seeded(tmp_path, capsys):
    text = (
        '[grid]\nshape = ["square", "circle"]\n[random]\nsamples = 5\nseed = SEED\n'
        "[random.ranges]\ny0_m = [-0.4, 0.4]\nphi0_rad = [0, 0.1]\n[time]\nduration_s = 10\n"
    )
    starts = []
    for run, seed in enumerate((1, 1, 2)):
        path = tmp_path / f"grid{run}.toml"
        path.write_text(text.replace("SEED", str(seed)))
        assert push(capsys, path, "--out", tmp_path / str(run), "--workers", 1)[0] == 0
        starts.append([(row["shape"], row["y0"]) for row in rows_of(tmp_path / str(run))])
    assert len(starts[0]) == 10
    assert starts[0] == starts[1] != starts[2]
    assert len({y for _, y in starts[0]}) == 5


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("contact_friction = [0, 0.3, 1.0]", "contact_frictions = [0]", "contact_friction"),
        ("contact_friction = [0, 0.3, 1.0]", "contact_friction = []", "no values"),
        ("contact_friction = [0, 0.3, 1.0]", "contact_friction = [0, nan]", "`contact_friction` = nan"),
        ("contact_friction = [0, 0.3, 1.0]", 'contact_friction = [0, "much"]', "contact_friction"),
        ("length_m = 0.4", "length_m = 0.0", "length_m"),
        ("length_m = 0.4", "length_m = nan", "length_m"),
        ("length_m = 0.4", "length_m = 1e200", "length_m"),
        ("[time]", "[random]\nsamples = 3\nranges = 3\n[time]", "ranges"),
        ("[time]", "[random]\nsamples = 3\n[random.ranges]\ns0_m = [0.0, 0.1]\n[time]", "both vary s0_m"),
        (f"{GRID[GRID.index('[grid]') : GRID.index('[time]')]}", "[random]\nsamples = 3\nranges = {}\n", "nothing"),
        ("[time]", "".join(f"{k} = {[0.1] * 1000}\n" for k in ("k_f", "f_max_N", "y0_m")) + "[time]", "cases"),
        ('shape = "rectangle"', 'shape = "star"', "circle"),
        ("length_m = 0.4", "lenght_m = 0.4", "length_m"),
        ("dt_s = 0.01", "dt_s = 0.007", "divide"),
        ("dt_s = 0.01", "dt_s = -1", "dt_s"),
        ("[grid]", "[grid", "TOML"),
    ],
)
def test_a_bad_grid_is_one_sentence_and_makes_nothing(tmp_path, grid, capsys, old, new, said):
    assert old in GRID
    grid.write_text(GRID.replace(old, new))
    code, answer, err = push(capsys, grid, "--out", tmp_path / "out", "--json")
    assert code == 2
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert answer["error"]["code"] == 2
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "argv",
    [
        ["nowhere.toml"],
        ["--gains=0.1"],
        ["--gains=a,b"],
        ["--gains=nan,0.1"],
        ["--dt", "nan"],
        ["--dt", "0"],
        ["--workers", "0"],
        ["--resume"],  # without --out
        ["--engine", "dask"],
        ["--scheduler", "tcp://127.0.0.1:1"],
        ["--engine", "slurm"],
    ],
)
def test_bad_arguments_are_one_sentence(tmp_path, capsys, monkeypatch, argv):
    monkeypatch.chdir(tmp_path)
    code, answer, err = push(capsys, *argv, "--json")
    assert code == 2
    assert answer["error"]["code"] == 2
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_foreign_finished_and_unwritable_folders_are_refused_untouched(tmp_path, grid, capsys):
    foreign = tmp_path / "mine"
    foreign.mkdir()
    (foreign / "results.csv").write_text("precious\n")
    assert push(capsys, grid, "--out", foreign)[0] == 2
    assert push(capsys, grid, "--out", foreign, "--resume")[0] == 2
    assert (foreign / "results.csv").read_text() == "precious\n"
    assert [p.name for p in foreign.iterdir()] == ["results.csv"]

    done = tmp_path / "done"
    assert push(capsys, grid, "--out", done, "--workers", 1)[0] == 0
    code, _, err = push(capsys, grid, "--out", done)
    assert (code, "--resume" in err) == (2, True)
    code, _, err = push(capsys, grid, "--out", done, "--gains=0.1,0.1", "--resume")
    assert (code, "another study" in err) == (2, True)

    assert push(capsys, grid, "--out", grid / "below-a-file")[0] == 2
    assert push(capsys, grid, "--out", "/proc/nowhere")[0] == 2


def test_a_study_that_could_not_begin_does_not_block_the_next(tmp_path, grid, capsys, monkeypatch):
    def without_numba():
        raise EnvironmentFault("numba is not installed")

    out = tmp_path / "out"
    with monkeypatch.context() as patched:
        patched.setattr(plan, "compile_kernel", without_numba)
        assert push(capsys, grid, "--out", out)[0] == 3
        assert push(capsys, grid, "--out", out, "--gains=0.1,0.2")[0] == 3
    assert push(capsys, grid, "--out", out, "--workers", 1)[0] == 0
    assert len(rows_of(out)) == 9


def workers_of(pid):
    """Return the process ids of joblib's workers below `pid`."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    started = {int(child): Path(f"/proc/{child}/cmdline").read_bytes() for child in children}
    return [child for child, words in started.items() if b"popen_loky" in words]


def ignores(pid, number):
    mask = next(line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("SigIgn"))
    return bool(int(mask.split()[1], 16) >> (number - 1) & 1)


@pytest.mark.long
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_leaves_a_resumable_state_and_no_process(tmp_path, capsys, stop):
    path = tmp_path / "long.toml"
    path.write_text(
        'name = "long"\n[grid]\ny0_m = [0.1, 0.2]\n[random]\nsamples = 400\n[random.ranges]\ns0_m = [0, 0.1]\n'
        "[time]\nduration_s = 4000.0\nrecord_s = 100.0\n"
    )
    out = tmp_path / "out"
    root = Path(cli.__file__).resolve().parents[1]
    child = subprocess.Popen(
        [str(Path(sys.executable).parent / "push"), "sweep", str(path), "--out", str(out), "--workers", "2", "--json"],
        cwd=root, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 60
        while len(list(out.glob("parts/*.npz"))) < 2:
            assert child.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        workers = workers_of(child.pid)
        assert len(workers) == 2
        # Not theirs to hear: one that waits for its next item would die of it with a traceback.
        assert all(ignores(pid, signal.SIGINT) for pid in workers)
        if stop == signal.SIGINT:
            os.killpg(child.pid, stop)  # as a terminal does
        else:
            child.send_signal(stop)
        stdout, stderr = child.communicate(timeout=30)
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
    assert child.returncode == 130, stderr
    assert "Traceback" not in stderr
    assert "--resume" in stderr
    assert json.loads(stdout.splitlines()[-1])["error"]["code"] == 130
    deadline = time.monotonic() + 10
    while _group_alive(child.pid):
        assert time.monotonic() < deadline, "a worker outlived the command"
        time.sleep(0.05)
    kept = len(list(out.glob("parts/*.npz")))
    assert 2 <= kept < 30
    assert not (out / "results.csv").exists()
    code, summary, err = push(capsys, path, "--out", out, "--workers", 2, "--resume", "--json")
    assert code == 0
    assert f"{kept} of " in err
    assert summary["lanes"] == 800


def _group_alive(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.long
def test_a_worker_that_dies_is_one_sentence():
    with pytest.raises(PushError, match="worker process died"):
        list(run_items(os._exit, [(0, 1), (1, 1), (2, 1)], 2, local=True))
    assert sorted(run_items(abs, [(0, -1), (1, -2)], 2, local=True)) == [(0, 1), (1, 2)]
