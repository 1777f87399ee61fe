"""A floor whose friction varies from place to place: a seeded random field, unbounded and stateless.

Every corner of a square lattice has a value derived only from its place and the seed; between corners the field is
interpolated. Runs with different seeds differ as runs in a real room do; with the same seed they are equal.
"""

from __future__ import annotations

from math import floor

_MASK = (1 << 64) - 1


class FrictionField:
    """Friction at a place relative to the floor's mean: between 1 - strength and 1 + strength, mean 1.

    strength: 0 to below 1. patch_m: distance of the lattice's corners, about the size of a patch.
    """

    def __init__(self, strength: float, patch_m: float, seed: int) -> None:
        self._strength = strength
        self._per_m = 1.0 / patch_m
        self._seed = seed
        self._corners: dict[tuple[int, int], float] = {}

    def at(self, x: float, y: float) -> float:
        """Return the relative friction at a place (m, WORLD)."""
        u, v = x * self._per_m, y * self._per_m
        i, j = floor(u), floor(v)
        u, v = u - i, v - j
        low = self._corner(i, j) * (1.0 - u) + self._corner(i + 1, j) * u
        high = self._corner(i, j + 1) * (1.0 - u) + self._corner(i + 1, j + 1) * u
        return 1.0 + self._strength * (low * (1.0 - v) + high * v)

    def _corner(self, i: int, j: int) -> float:
        """Return the value of a lattice corner, in [-1, 1)."""
        value = self._corners.get((i, j))
        if value is None:
            mixed = _mix(_mix(_mix(self._seed & _MASK) ^ (i & _MASK)) ^ (j & _MASK))
            value = (mixed >> 11) / (1 << 52) - 1.0
            self._corners[(i, j)] = value
        return value


def _mix(value: int) -> int:
    """Scramble 64 bits (the finaliser of the splitmix64 generator, Steele, Lea and Flood 2014)."""
    value = (value + 0x9E3779B97F4A7C15) & _MASK
    value = ((value ^ (value >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    value = ((value ^ (value >> 27)) * 0x94D049BB133111EB) & _MASK
    return value ^ (value >> 31)
