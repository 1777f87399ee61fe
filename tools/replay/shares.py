"""Re-run the ticks of a log by several processes, each from one logged whole state to another.

What is shared out is only ever an answer of "identical". Where any share finds anything else, the log is replayed by
one process, so that the result is the same for any number of them. Each share reads the file anew, in constant memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import msgspec

from robot_io.errors import PushError
from robot_io.mcap.read import read_log
from tools.log.derivation import TICK_TOPIC
from tools.parallel.engine import run_items
from tools.replay.ticks import TickReplayer
from tools.replay.verified_log import VerifiedLog
from tools.run.tick_core import TickCore


class Share(msgspec.Struct, frozen=True):
    """Which ticks a process re-runs: from the first whole state at or after a log time (ns) to that after another."""

    files: tuple[Path, ...]
    from_ns: int
    to_ns: int


class Shared(msgspec.Struct, frozen=True):
    """Ticks that were identical, all of them; the states are encoded."""

    ticks: int
    first: int
    skipped: int
    """Periods that were skipped before the first."""
    last: int
    state_before: bytes
    state_after: bytes


def ticks_shared(logs: Sequence[VerifiedLog], jobs: int) -> tuple[int, int] | None:
    """Re-run the ticks of a log; return their count and the last one's number.

    None: they are not all identical, or a checksum breaks; one process has to find out where.
    """
    start_ns, end_ns = logs[0].start_ns, logs[-1].end_ns
    step_ns = (end_ns - start_ns) // jobs + 1
    files = tuple(log.path for log in logs)
    shares = [Share(files, start_ns + n * step_ns, start_ns + (n + 1) * step_ns) for n in range(jobs)]
    work: list[tuple[int, Share | Path]] = list(enumerate((*shares, *files)))
    found = dict(run_items(_run, work, jobs, local=True))
    if None in found.values():
        return None
    in_order = [found[n] for n in range(len(work))]
    parts = [part for part in in_order if isinstance(part, Shared)]
    verified = sum(part for part in in_order if isinstance(part, int))
    seams = all(
        after.first == before.last + 1 + after.skipped and before.state_after == after.state_before
        for before, after in pairwise(parts)
    )
    return (verified, parts[-1].last) if seams and verified == sum(part.ticks for part in parts) else None


def _run(work: Share | Path) -> Shared | str | int | None:
    """Return what a share found, or how many ticks a file holds whose checksums are right; None where one is not.

    A word where no whole state begins in a share.
    """
    try:
        return _share(work) if isinstance(work, Share) else VerifiedLog(work).verify()
    except PushError:  # the one process that then replays all of it says what
        return None


def _share(share: Share) -> Shared | str | None:
    log = VerifiedLog(share.files[0])
    core = TickCore.of(log.usable_rig(), in_contact=log.in_contact)
    replayer = TickReplayer(core, None, log.ticks)
    first: tuple[int, int, bytes] | None = None
    for payload, log_time_ns in _tick_payloads(share.files):
        if first is None and log_time_ns < share.from_ns:
            continue
        tick = log.ticks.decode(payload)
        if first is None and not tick.before:
            continue
        if log_time_ns >= share.to_ns and tick.before:
            break
        if log_time_ns - tick.input.now_ns != log.wall_offset_ns:
            return None
        if first is None:
            first = tick.input.tick, tick.input.host.skipped, msgspec.msgpack.encode(tick.before[0])
        replayer.take(tick, payload)
        if replayer.first is not None or replayer.gaps:
            return None
    if first is None or replayer.state is None:
        return "no whole state"
    after = msgspec.msgpack.encode(replayer.state)
    return Shared(replayer.count, first[0], first[1], replayer.last, first[2], after)


def _tick_payloads(files: Sequence[Path]) -> Iterator[tuple[bytes, int]]:
    for file in files:
        for message in read_log(file):
            if message.topic == TICK_TOPIC:
                yield message.payload, message.log_time_ns
