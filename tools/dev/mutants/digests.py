"""What a result depends on, as digests: a changed file makes it worthless."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterable
from pathlib import Path

from tools.dev.mutants.targets import PRODUCT, ROOT


@functools.cache
def of_file(path: str) -> str:
    """Return a digest of a file of the checkout as it is now."""
    return hashlib.sha256((ROOT / path).read_bytes()).hexdigest()


@functools.cache
def of_helpers() -> str:
    """Return a digest of all files in tests that are no tests: each may be used by any test."""
    return of_files(name for name in _python_files("tests") if not Path(name).name.startswith("test_"))


@functools.cache
def of_product() -> str:
    """Return a digest of the code that tests run."""
    return of_files(name for folder in PRODUCT for name in _python_files(folder) if not name.startswith("tools/dev/"))


def of_files(names: Iterable[str]) -> str:
    """Return one digest of several files, whatever their order."""
    digest = hashlib.sha256()
    for name in sorted(names):
        digest.update(f"{name} {of_file(name)}\n".encode())
    return digest.hexdigest()


def of_tests(names: Iterable[str]) -> str:
    """Return a digest of test files and of what they may use."""
    return hashlib.sha256(f"{of_files(names)} {of_helpers()}".encode()).hexdigest()


def test_files(places: tuple[str, ...]) -> list[str]:
    """Return the test files at `places`, files or folders, in alphabetical order."""
    return sorted({name for place in places for name in _python_files(place) if Path(name).name.startswith("test_")})


def _python_files(place: str) -> list[str]:
    if (ROOT / place).is_file():
        return [place]
    return [path.relative_to(ROOT).as_posix() for path in (ROOT / place).rglob("*.py")]
