"""`push bench physics`: how fast the slider's solvers are, and the batch solver against the same arithmetic in C.

The figures hold for this machine at this moment; only the ratios can be compared. Figures for one core are processor
time, which a busy machine affects little; the complete study is wall time.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_io.error_report import say_json, tell
from sim_backend.physics.lanes import Lane, Timing, simulate_lane
from sim_backend.physics.slider_exact import solve_exact
from tools.parallel.engine import default_workers, run_items
from tools.sweep.grid import lane_of
from tools.sweep.items import cut, run_lane_item
from tools.sweep.paper import paper_study

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Run = Callable[[Floats, Timing, Floats, Floats, Floats], None]

C_SOURCE = Path(__file__).with_name("lanes_bench.c")
C_FLAGS = ("-O3", "-march=native", "-ffast-math", "-fPIC", "-c")
ROUNDS = 20
"""Batch and C take turns this many times; the best time of each counts."""
BATCH_STEPS = 1000
PYTHON_STEPS = 4000
OSQP_STEPS = 1500
COMPILE_TIMEOUT_S = 120.0

COLD_COMPILE = (
    "import time; from sim_backend.physics.lanes import Lane, Timing; began = time.perf_counter(); "
    "from sim_backend.physics.batch import run_batch; imported = time.perf_counter(); "
    "run_batch([Lane(True, 0.5, 0.5, 0.3, 0.5, 0.0, 0.0, 0.0)], Timing(steps=1, record_every=1)); "
    "print(imported - began, time.perf_counter() - imported)"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, last on stdout")


def run(args: argparse.Namespace) -> int:
    """Measure and print the figures; return the exit code. Raises EnvironmentFault without numba."""
    import sim_backend.physics.batch  # noqa: F401 - fails before anything is measured if numba is missing

    study = paper_study({})
    lanes = [lane_of(case) for case in study.cases]
    with tempfile.TemporaryDirectory(prefix="push-bench-") as folder:
        compiled = _compile_times(Path(folder))
        c_run, c_reason = build_c(Path(folder))
        figures = _kernels(lanes, c_run)
    figures |= {"c_reason": c_reason, **compiled}
    figures["lane_python_ns_per_step"] = _python_ns(lanes, solve_exact, PYTHON_STEPS)
    figures["closed_form_python_ns_per_call"] = _closed_form_ns()
    from sim_backend.physics.slider_qp import QpSolver

    figures["osqp_ns_per_step"] = _python_ns(lanes, QpSolver(), OSQP_STEPS)
    figures["osqp_over_batch"] = figures["osqp_ns_per_step"] / figures["batch_ns_per_step"]
    figures |= _study_seconds()
    figures["batch_all_cores_ns_per_step"] = figures["study_s"] / figures["study_steps"] * 1e9
    figures = {key: float(f"{value:.4g}") if isinstance(value, float) else value for key, value in figures.items()}
    for key, value in figures.items():
        tell(f"{key:32s} {value if value is not None else '-'}")
    if args.json:
        say_json({"schema": 1, **figures})
    return 0


def build_c(folder: Path) -> tuple[Run | None, str | None]:
    """Compile the C twin; return it as a function like `batch.run_arrays`, or None and the reason."""
    compiler = next((found for name in ("gcc", "cc", "clang") if (found := shutil.which(name))), None)
    if compiler is None:
        return None, "no C compiler (gcc, cc, clang) on the path"
    code, library = folder / "lanes_bench.o", folder / "lanes_bench.so"
    # linked without -ffast-math: with it, loading the library would make this process flush denormals to 0
    for command in ([*C_FLAGS, str(C_SOURCE), "-o", str(code)], ["-shared", str(code), "-o", str(library), "-lm"]):
        done = subprocess.run(
            [compiler, *command], capture_output=True, text=True, timeout=COMPILE_TIMEOUT_S, check=False
        )
        if done.returncode != 0:
            return None, f"{compiler} failed: {' '.join(done.stderr.split())[:200]}"
    function = ctypes.CDLL(str(library)).run_lanes
    array, count = ctypes.c_void_p, ctypes.c_long
    function.argtypes = [array, count, ctypes.c_double, count, count, array, count, array, array]
    function.restype = None

    def run_c(rows: Floats, timing: Timing, states: Floats, finals: Floats, statistics: Floats) -> None:
        function(
            rows.ctypes.data, len(rows), timing.dt_s, timing.steps, timing.record_every,
            states.ctypes.data, timing.records, finals.ctypes.data, statistics.ctypes.data,
        )  # fmt: skip

    return run_c, None


def _kernels(lanes: list[Lane], c_run: Run | None) -> dict[str, Any]:
    """Time the batch and its C twin in turns on the study's lanes; return the times and their largest difference."""
    import numpy as np

    from sim_backend.physics.batch import STATISTICS, parameters, run_arrays

    rows, timing = parameters(lanes), Timing(steps=BATCH_STEPS)

    def arrays() -> tuple[Floats, Floats, Floats]:
        return np.zeros((len(rows), timing.records, 6)), np.zeros((len(rows), 6)), np.zeros((len(rows), STATISTICS))

    runs: dict[str, Run] = {"batch": run_arrays} | ({"c": c_run} if c_run else {})
    outputs = {name: arrays() for name in runs}
    best = dict.fromkeys(runs, float("inf"))
    for _ in range(ROUNDS + 1):  # the first round loads the compiled code
        for name, function in runs.items():
            began = time.process_time()
            function(rows, timing, *outputs[name])
            best[name] = min(best[name], time.process_time() - began)
    per_step = {name: seconds / (len(lanes) * BATCH_STEPS) * 1e9 for name, seconds in best.items()}
    agree = float(np.abs(outputs["batch"][1] - outputs["c"][1]).max()) if c_run else None
    return {
        "batch_ns_per_step": per_step["batch"],
        "c_ns_per_step": per_step.get("c"),
        "batch_over_c": per_step["batch"] / per_step["c"] if c_run else None,
        "batch_minus_c_largest": agree,
    }


def _python_ns(lanes: list[Lane], solve: Any, steps: int) -> float:
    """Return the time per step of a solver in plain Python, on one lane of each shape."""
    chosen = [lanes[121], lanes[364]]
    timing = Timing(steps=steps // len(chosen))
    simulate_lane(chosen[0], Timing(steps=50), solve)
    began = time.process_time()
    for lane in chosen:
        simulate_lane(lane, timing, solve)
    return (time.process_time() - began) / (timing.steps * len(chosen)) * 1e9


def _closed_form_ns() -> float:
    calls = 50_000
    began = time.process_time()
    for _ in range(calls):
        solve_exact(-0.5, 0.2, 1.0, 0.0, 0.1, 0.02, 0.38, 1.0, 0.5)
    return (time.process_time() - began) / calls * 1e9


def _study_seconds() -> dict[str, Any]:
    """Time the complete study on all cores with warm workers, without imports, figures and files."""
    study, workers = paper_study({}), default_workers()
    items = list(enumerate(cut(study)))
    best = float("inf")
    for _ in range(3):  # the first round starts the workers
        began = time.perf_counter()
        for _ in run_items(run_lane_item, items, workers, local=True):
            pass
        best = min(best, time.perf_counter() - began)
    return {"study_s": best, "study_steps": len(study.cases) * study.timing.steps, "study_workers": workers}


def _compile_times(folder: Path) -> dict[str, float]:
    """Time import and compilation in fresh processes: with an empty cache, and with what the first one cached."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    times = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", COLD_COMPILE],
            cwd=Path(__file__).resolve().parents[2], env=environment,
            capture_output=True, text=True, timeout=COMPILE_TIMEOUT_S, check=True,
        )  # fmt: skip
        times.append([float(value) for value in done.stdout.split()])
    return {"import_s": times[1][0], "cold_compile_s": times[0][1], "cached_load_s": times[1][1]}
