"""What counts as contact, and what as its loss: both follow the object, so that a light one is pushed too. Pure.

Found: `force_min_N` (judged in `sensing`), or a mean along the motion of at least 2.5 N over half a second. Lost: below
half the median of the first 0.5 m of contact, between 2 N and `force_min_N`; that threshold only ever falls.
"""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.messages import Vector3
from robot_io.tick import ContactState

BUCKET_NS = 100_000_000
WINDOW = 5
"""Buckets in half a second."""
LEAST_MEAN_N = 2.5
"""Half of the smallest force that the sensor's product sheet calls meaningful; a mean of 0.5 s has 0.2 N of noise."""
RISE = 0.5
"""A contact at least doubles the mean of the half second before; a drifting sensor does not."""
LOST_LEAST_N = 2.0
LEARNED_OVER_M = 0.5
SAMPLE_EVERY_M = 0.01
SAMPLES_AT_LEAST = 3
EARLY_M = 0.3
EARLY_SHARE = 0.5

_NOTHING: Vector3 = (0.0, 0.0, 0.0)


def add(state: ContactState, force: Vector3, received_ns: int) -> ContactState:
    """Return the state with one more force on the slider (unfiltered, N, WORLD frame) in its window."""
    if not state.bucket_count or received_ns - state.bucket_since_ns < BUCKET_NS:
        since = state.bucket_since_ns if state.bucket_count else received_ns
        total = _plus(state.bucket_total, force) if state.bucket_count else force
        return replace(state, bucket_since_ns=since, bucket_total=total, bucket_count=state.bucket_count + 1)
    mean = tuple(value / state.bucket_count for value in state.bucket_total)
    means = (*state.means, *mean)[-2 * WINDOW * 3 :]
    return replace(state, means=means, bucket_since_ns=received_ns, bucket_total=force, bucket_count=1)


def start_window(state: ContactState) -> ContactState:
    """Return the state with an empty window: what was felt before says nothing about the contact now sought."""
    return replace(state, means=(), bucket_since_ns=0, bucket_total=_NOTHING, bucket_count=0)


def mean_force(state: ContactState, buckets_ago: int = 0) -> Vector3 | None:
    """Return the mean force over half a second that ended `buckets_ago` whole buckets ago, or over what there is of it.

    None without any. N, WORLD frame.
    """
    end = len(state.means) // 3 - buckets_ago
    begin = max(end - WINDOW, 0)
    count = end - begin
    if count <= 0:
        return None
    x, y, z = (sum(state.means[3 * begin + axis : 3 * end : 3]) / count for axis in range(3))
    return x, y, z


def along(force: Vector3 | None, direction: tuple[float, float]) -> float:
    """Return the part of a force along a horizontal direction (a unit vector), 0 where there is none."""
    return force[0] * direction[0] + force[1] * direction[1] if force else 0.0


def felt(state: ContactState, direction: tuple[float, float]) -> float:
    """Return the mean force along `direction` over the last half second, N; 0 before there has been one."""
    return along(mean_force(state), direction) if len(state.means) >= 3 * WINDOW else 0.0


def found_by_mean(state: ContactState, direction: tuple[float, float], *, rising: bool) -> bool:
    """Return whether the mean along the motion says contact; `rising`: only if it has at least doubled."""
    now = felt(state, direction)
    before = along(mean_force(state, WINDOW), direction)
    return now >= LEAST_MEAN_N and (before <= RISE * now or not rising)


def force_before(state: ContactState, *, by_mean: bool) -> float:
    """Return the size of the mean force in the half second before the contact now found, N; NaN if there was none.

    by_mean: the contact itself fills the newest half second; otherwise the newest bucket at most.
    """
    mean = mean_force(state, WINDOW if by_mean else 1)
    return math.hypot(*mean) if mean else math.nan


def came_early(travelled_m: float, expected_m: float) -> bool:
    """Return whether a contact after `travelled_m` came over 0.3 m, and half of the way, before it was expected."""
    early_m = expected_m - travelled_m
    return early_m > EARLY_M and early_m > EARLY_SHARE * expected_m


def learn(state: ContactState, force_N: float, progress_m: float, force_min_N: float) -> ContactState:
    """Return the state after one more tick in contact: a sample each centimetre of the first 0.5 m."""
    if progress_m > LEARNED_OVER_M:
        return replace(state, samples=()) if state.samples else state
    if progress_m < SAMPLE_EVERY_M * len(state.samples) or (state.lost_below_N and not state.samples):
        return state
    samples = (*state.samples, force_N)
    if len(samples) < SAMPLES_AT_LEAST:
        return replace(state, samples=samples)
    half = sorted(samples)[len(samples) // 2] / 2
    threshold = min(max(half, LOST_LEAST_N), force_min_N)
    lowest = min(threshold, state.lost_below_N) if state.lost_below_N else threshold
    return replace(state, samples=samples, lost_below_N=lowest)


def lost_below(state: ContactState, force_min_N: float) -> float:
    """Return the force below which the contact is lost, N: the least until the object has been felt for 2 cm."""
    return state.lost_below_N or min(LOST_LEAST_N, force_min_N)


def _plus(a: Vector3, b: Vector3) -> Vector3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
