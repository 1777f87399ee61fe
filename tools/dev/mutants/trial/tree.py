"""Copies of the checkout in which a file can be changed: everything a test starts there sees the change."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from tools.dev.mutants.targets import ROOT


class Tree:
    """One copy, used by one worker."""

    def __init__(self, root: Path) -> None:
        self.root = root

    @classmethod
    def copy(cls, root: Path) -> Tree:
        """Copy the checkout's files as they are now, except those git ignores, to the new folder `root`."""
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in filter(None, listed.split("\0")):
            if (ROOT / name).is_file():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, root / name)
        (root / ".venv").symlink_to(ROOT / ".venv")
        return cls(root)

    @contextlib.contextmanager
    def changed(self, path: str, source: bytes) -> Iterator[None]:
        """Temporarily replace the content of the file at `path`.

        Its byte code is deleted before and after: Python would trust an old one of the same second and size.
        """
        file = self.root / path
        original = file.read_bytes()
        self._write(file, source)
        try:
            yield
        finally:
            self._write(file, original)

    def _write(self, file: Path, source: bytes) -> None:
        for compiled in file.parent.glob(f"__pycache__/{file.stem}.*.pyc"):
            compiled.unlink()
        file.write_bytes(source)
