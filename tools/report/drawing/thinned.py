"""Thin a line before it is drawn: no screen shows more, and a page stays small."""

from __future__ import annotations

import itertools

import numpy as np

from tools.report.bounded_series import Floats

MOST_POINTS = 1200


def thinned(x: Floats, y: Floats, most: int = MOST_POINTS) -> tuple[Floats, Floats]:
    """Return at most about `most` points of a line, the least and the greatest y of each stretch among them.

    A stretch without a finite y stays a gap.
    """
    stretches = most // 2
    if len(x) <= 2 * stretches:
        return x, y
    edges = np.linspace(0, len(x), stretches + 1).astype(int)
    kept: list[int] = []
    for begin, end in itertools.pairwise(edges):
        part = y[begin:end]
        if not np.isfinite(part).any():
            kept.append(int(begin))
            continue
        low, high = int(begin + np.nanargmin(part)), int(begin + np.nanargmax(part))
        kept += [low] if low == high else sorted((low, high))
    kept[0], kept[-1] = 0, len(x) - 1
    return x[kept], y[kept]


def thinned_path(x: Floats, y: Floats, most: int = MOST_POINTS) -> tuple[Floats, Floats]:
    """Return at most about `most` points of a curve in the plane, evenly in time; first and last are kept."""
    if len(x) <= most:
        return x, y
    kept = np.unique(np.linspace(0, len(x) - 1, most).astype(int))
    return x[kept], y[kept]
