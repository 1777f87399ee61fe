"""Spoilt frames by the million for everything that reads bytes of others: no crash, little memory, no slow frame.

What must hold of a frame that is read is with each codec. `make test-all SEED=NUMBER` spoils the same ones again.
"""

from __future__ import annotations

import random
import re
import tempfile
import time
from pathlib import Path
from unittest import mock

import joblib
import pytest

from tests.robot_io.mutated import device_codecs, text_and_log_codecs

CODECS = {
    kind.__name__: kind
    for kind in (
        device_codecs.ft300_stream,
        device_codecs.ft300_registers,
        device_codecs.ur_state,
        device_codecs.ur_handshake,
        text_and_log_codecs.rosbridge,
        text_and_log_codecs.gate_frame,
        text_and_log_codecs.cdr,
        text_and_log_codecs.cdr_of_others,
        text_and_log_codecs.mcap,
    )
}
MEMORY = "/dev/shm" if Path("/dev/shm").is_dir() else None
"""A file for each of a million frames is none for a disk."""
MILLION = 1_000_000
SHARES = 4
WARM_UP = 2_000
MOST_KIB = 32 * 1024
"""Of memory more at the worst moment than after the first frames."""
MOST_FRAME_S = 0.1
"""Of processor time for one frame; all are shorter than 10 kB."""


def memory_kib(name: str) -> int:
    """Return a figure of this process from the kernel: VmRSS now, VmHWM the most since `forget_the_most`."""
    found = re.search(rf"{name}:\s+(\d+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return int(found[1])


def forget_the_most() -> None:
    Path("/proc/self/clear_refs").write_text("5")


def no_sleep(_s: float) -> None:
    """Return at once: a Modbus master would wait before each question."""


def take_in(codec: str, seed: int, share: int, count: int) -> tuple[float, int]:
    """Let a codec take in `count` spoilt frames; return the slowest (s) and the memory more than at first (KiB)."""
    draw = random.Random(f"{codec} {seed}/{share}")
    slowest_s, before_kib = 0.0, 0
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder, mock.patch("time.sleep", no_sleep):
        turn = CODECS[codec](Path(folder))
        for number in range(count):
            if number == min(WARM_UP, count // 2):
                forget_the_most()
                before_kib = memory_kib("VmRSS")
            began_s = time.thread_time()
            try:
                turn(draw)
            except Exception as error:
                raise AssertionError(f"{codec}, seed {seed}, share {share}, frame {number}: {error!r}") from error
            slowest_s = max(slowest_s, time.thread_time() - began_s)
    return slowest_s, memory_kib("VmHWM") - before_kib


@pytest.fixture(scope="module")
def seed(pytestconfig) -> int:
    """The seed that `make test-all` prints."""
    return int(pytestconfig.getoption("--hypothesis-seed") or 0)


@pytest.mark.parametrize("codec", CODECS)
def test_some_spoilt_frames(codec, seed):
    assert take_in(codec, seed, 0, 1_000)[0] < MOST_FRAME_S


@pytest.mark.long
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("codec", CODECS)
def test_a_million_spoilt_frames(codec, seed):
    found = joblib.Parallel(n_jobs=-1)(
        joblib.delayed(take_in)(codec, seed, share, MILLION // SHARES) for share in range(1, SHARES + 1)
    )
    slowest_s, most_kib = max(s for s, _ in found), max(kib for _, kib in found)
    print(
        f"{codec}: {MILLION} frames, the slowest {slowest_s * 1e3:.1f} ms, {most_kib} KiB of memory more, seed {seed}"
    )
    assert slowest_s < MOST_FRAME_S
    assert most_kib < MOST_KIB
