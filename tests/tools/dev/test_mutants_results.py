"""What is remembered of earlier sessions, and what makes it worthless."""

import pytest

from tools.dev.mutants import digests
from tools.dev.mutants.find import find_mutants
from tools.dev.mutants.results import Results
from tools.dev.mutants.trial.judge import Verdict

FILES = ["tests/test_a.py", "tests/test_b.py"]
KILLED, SURVIVED = Verdict("killed", "tests/test_a.py::test"), Verdict("survived", "")


def forget():
    for function in (digests.of_file, digests.of_helpers, digests.of_product):
        function.cache_clear()


@pytest.fixture
def project(tmp_path, monkeypatch):
    for name in ("digests", "results"):
        monkeypatch.setattr(f"tools.dev.mutants.{name}.ROOT", tmp_path)
    (tmp_path / "tests").mkdir()
    (tmp_path / "x.py").write_text("A = 1\nB = 2\n")
    for file in (*FILES, "tests/helper.py"):
        (tmp_path / file).write_text("one")
    forget()
    yield tmp_path
    forget()


def after(project, changed):
    """Return what is known of a killed mutant and of one that survived, after a file changed."""
    file = project / "results.jsonl"
    first, second = find_mutants("x.py", (project / "x.py").read_bytes())
    before = Results(file)
    before.add(first, KILLED, FILES)
    before.add(second, SURVIVED, FILES)
    with file.open("a") as out:
        out.write('{"id": "cut off')
    if changed:
        (project / changed).write_text("A = 1\nB = 2\n# more\n")
        forget()
    later = Results(file)
    return later.verdict(first, FILES), later.verdict(second, FILES)


@pytest.mark.parametrize(
    ("changed", "known"),
    [
        (None, (KILLED, SURVIVED)),
        ("x.py", (None, None)),
        ("tests/test_a.py", (None, None)),
        ("tests/test_b.py", (KILLED, None)),
        ("tests/helper.py", (None, None)),
    ],
)
def test_what_is_still_known_after_a_change(project, changed, known):
    assert after(project, changed) == known


def test_a_killer_that_is_gone_kills_nothing(project):
    first, _ = find_mutants("x.py", (project / "x.py").read_bytes())
    results = Results(project / "results.jsonl")
    results.add(first, KILLED, FILES)
    (project / "tests/test_a.py").unlink()
    forget()
    assert Results(project / "results.jsonl").verdict(first, FILES) is None
