"""Digests of what a result depends on: a changed file invalidates it."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

from tools.dev.mutants.targets import PRODUCT, ROOT


@functools.cache
def of_file(path: str) -> str:
    """Return a digest of a file in the checkout as it is now."""
    return hashlib.sha256((ROOT / path).read_bytes()).hexdigest()


@functools.cache
def of_helpers() -> str:
    """Return a digest of all helper files in tests: any test may use them."""
    return of_files(name for name in _python_files("tests") if not Path(name).name.startswith("test_"))


@functools.cache
def of_product() -> str:
    """Return a digest of the code under test."""
    return of_files(name for folder in PRODUCT for name in _python_files(folder) if not name.startswith("tools/dev/"))


def of_files(names: Iterable[str]) -> str:
    """Return one digest of several files, independent of their order."""
    digest = hashlib.sha256()
    for name in sorted(names):
        digest.update(f"{name} {of_file(name)}\n".encode())
    return digest.hexdigest()


def of_tests(names: Iterable[str]) -> str:
    """Return a digest of test files and the helpers they may use."""
    return hashlib.sha256(f"{of_files(names)} {of_helpers()}".encode()).hexdigest()


def test_files(places: tuple[str, ...]) -> list[str]:
    """Return the test files at `places`, files or folders, in alphabetical order."""
    return sorted({name for place in places for name in _python_files(place) if Path(name).name.startswith("test_")})


def _python_files(place: str) -> list[str]:
    if (ROOT / place).is_file():
        return [place]
    return [path.relative_to(ROOT).as_posix() for path in (ROOT / place).rglob("*.py")]
