"""One change in one place of one file."""

from __future__ import annotations

from typing import NamedTuple


class Mutant(NamedTuple):
    """The bytes `start` to `end` of a file, replaced by `text`."""

    path: str
    line: int
    last_line: int
    """The lines of the changed expression; a test reaches the mutant when it runs one of them."""
    statement_line: int
    function: str
    """Qualified name, such as `Gate.step`; empty if the code runs at import."""
    start: int
    end: int
    text: str
    before: str
    """The changed lines on one line, as they are in the file."""
    after: str

    @property
    def name(self) -> str:
        """Readable name: location, and source before and after."""
        return f"{self.path}:{self.line}: {self.before} -> {self.after}"

    @property
    def place(self) -> tuple[str, str, str, str]:
        """Identity independent of line numbers: path, function, before, after."""
        return self.path, self.function, self.before, self.after

    def apply(self, source: bytes) -> bytes:
        """Return the source with this change."""
        return source[: self.start] + self.text.encode() + source[self.end :]
