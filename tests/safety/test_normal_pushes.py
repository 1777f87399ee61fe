"""A normal push meets no fault: 200 seeds at level sim, 20 at level emulated, with noise, slip and patches of floor.

Each seed is another object, start, floor and slip, within what `[world]` calls normal: see `normal_pushes`.
"""

from __future__ import annotations

import json
import math
import time
from typing import Any

import pytest

from safety.motion_bounds import PATH_RATIO
from tests.host_watch import UNMEASURED
from tests.push_runs import QUICK, SPOILING_MS, started
from tests.safety.normal_pushes import in_words, pushes, settings_of

SEEDS = 200
EMULATED, EMULATED_TRIES = 20, 60
EMULATED_M = (0.3, 0.4, 0.5)


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_two_hundred_seeds_at_level_sim_meet_no_fault():
    found = pushes(range(SEEDS))
    print(in_words(found))
    assert not [one for one in found if one.faults or one.exit_code], in_words(found)
    # The bounds of motion were chosen by this ratio; what they leave is for slip and lost contacts.
    assert max(one.path_ratio for one in found) < PATH_RATIO
    assert max(one.push_share for one in found) < 1.0
    assert not any(math.isnan(one.worst_lateral_m) for one in found)


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_twenty_seeds_at_level_emulated_meet_no_fault(state, tmp_path, host):
    """A push with a fault is left out where a processor of this host stood still: it has real time to keep."""
    counted = 0
    for seed in range(EMULATED_TRIES):
        began_ns = time.monotonic_ns()
        code, summary, err = emulated_push(state, tmp_path / str(seed), seed)
        now_ns = time.monotonic_ns()
        stall_ms = max(host.worst_ms(began_ns, now_ns), host.worst_wait_ms(began_ns, now_ns))
        faults = summary.get("fault_counts", {})
        print(f"seed {seed}: code {code}, {faults}, host held back {stall_ms:.0f} ms")
        if (code, faults) == (0, {}):
            counted += 1
        assert (code, faults) == (0, {}) or stall_ms > SPOILING_MS, f"seed {seed}: {err}"
        if counted == EMULATED:
            return
    UNMEASURED.add(f"{EMULATED - counted} of {EMULATED} pushes at level emulated without a fault")


def emulated_push(state, folder, seed: int) -> tuple[int, dict[str, Any], str]:
    """Push at level emulated with the settings of a seed; return the exit code, the summary and what was said."""
    settings = settings_of(seed, EMULATED_M[seed // 2 % len(EMULATED_M)])
    words = [word for setting in settings for word in ("--set", setting)]
    argv = ("run", "emulated", *QUICK, *words, "--seed", str(seed), "--out", str(folder), "--json")
    with started(state, *argv) as run:
        ended = run.wait(90.0)
        run.wait_gone(3.0)
    path = folder / "summary.json"
    return ended.code, json.loads(path.read_text()) if path.exists() else {}, ended.err
