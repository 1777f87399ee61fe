"""Which mutants are tried, which tests they meet, and what is said in the end."""

import subprocess

import pytest

from tools.dev.mutants import choose, targets
from tools.dev.mutants.equivalents import BadList, Equivalent, read_equivalents
from tools.dev.mutants.find import find_mutants
from tools.dev.mutants.summary import Summary
from tools.dev.mutants.trial.judge import Verdict
from tools.dev.mutants.trial.reach import Reach

KILLED, SURVIVED = Verdict("killed", "tests/test_x.py::test"), Verdict("survived", "")


@pytest.mark.parametrize("glob", targets.WHOLE)
def test_every_glob_of_the_table_finds_a_file(glob):
    assert list(targets.ROOT.glob(glob))


@pytest.mark.parametrize("path", [*targets.WHOLE_TESTS, *(p for s in targets.SHELLS for p in (s.path, *s.tests))])
def test_every_path_of_the_table_is_there(path):
    assert (targets.ROOT / path).exists()


def test_laws_checks_and_gate_are_whole_and_shells_are_not():
    whole = targets.whole_paths()
    assert {"control/sequence.py", "safety/gate.py", "robot_io/ft300/codec.py"} <= set(whole)
    assert not {shell.path for shell in targets.SHELLS} & set(whole)


def test_the_list_of_equivalents_names_only_mutants_that_there_are():
    listed = read_equivalents(targets.ROOT / "tests" / "mutants_equivalent.toml")
    sources = {entry.path: (targets.ROOT / entry.path).read_bytes() for entry in listed}
    there = {mutant.place for path, source in sources.items() for mutant in find_mutants(path, source)}
    assert [entry for entry in listed if entry.place not in there] == []


def lines(count, path="x.py"):
    return find_mutants(path, "".join(f"A{i} = {i % 9}\n" for i in range(count)).encode())


def test_a_sample_is_the_same_each_time_and_hardly_changes_with_the_code():
    drawn = choose.sample(lines(100), 20)
    assert len(drawn) == 20
    assert drawn == choose.sample(lines(100), 20)
    later = choose.sample(lines(100) + lines(2, "y.py"), 20)
    assert len({m.place for m in drawn} & {m.place for m in later}) >= 16
    assert choose.sample(lines(3), 20) == lines(3)


def test_a_diff_names_the_new_lines():
    diff = "--- a/x.py\n+++ b/x.py\n@@ -3 +3 @@ f\n-a\n+b\n@@ -9,2 +9,3 @@\n+c\n@@ -20,4 +22,0 @@ gone\n-d\n"
    assert choose.lines_of_diff(diff) == {3, 9, 10, 11}


def test_since_takes_lines_that_changed(tmp_path, monkeypatch):
    def git(*words):
        who = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", *who, *words], cwd=tmp_path, check=True, capture_output=True)

    file = tmp_path / "x.py"
    git("init")
    file.write_text("A = 1\nB = 2\nC = 3\n")
    git("add", ".")
    git("commit", "-m", "one")
    file.write_text("A = 1\nB = 5\nC = 3\n")
    monkeypatch.setattr(choose, "ROOT", tmp_path)
    mutants = find_mutants("x.py", file.read_bytes())
    assert [m.after for m in choose.changed_since(mutants, "HEAD")] == ["B = 6"]
    with pytest.raises(choose.UnknownCommit, match="nowhere"):
        choose.changed_since(mutants, "nowhere")


def test_a_mutant_meets_the_tests_of_its_lines_and_one_of_import_meets_all_the_near_ones_first():
    source = b"LIMIT = 3\n\n\ndef f(a):\n    return a > LIMIT\n\n\ndef g(a):\n    a.stop()\n"
    limit, compared, *_, dropped = find_mutants("x.py", source)
    seconds = {"t::slow": 5.0, "t::quick": 0.1, "t::other": 0.01, "t::endless": 11.0}
    reached = {"t::slow": {"x.py": [5]}, "t::quick": {"x.py": [5]}, "t::endless": {"x.py": [5]}}
    reach = Reach([{"seconds": seconds, "reach": reached}])
    assert reach.tests_for(compared) == ["t::quick", "t::slow"]  # with the third it would take more than 12 s
    assert reach.tests_for(dropped) == []
    assert reach.tests_for(limit) == ["t::quick", "t::slow"]
    near = {"t::quick": {"x.py": [5]}}
    assert Reach([{"seconds": seconds, "reach": near}]).tests_for(limit) == ["t::quick", "t::other", "t::slow"]


def entry(mutant, **changed):
    path, function, before, after = mutant.place
    words = {"path": path, "function": function, "before": before, "after": after, "reason": "it is the same"}
    return Equivalent(**(words | changed))


def test_survivors_and_wrong_entries_are_said_and_counted_by_folder():
    first, second, third = lines(3, "control/x.py")
    verdicts = {first: KILLED, second: SURVIVED, third: Verdict("timeout", "")}
    summary = Summary(verdicts, [], [first, second, third])
    assert not summary.clean
    assert summary.lines()[0] == "control/x.py:2: A1 = 1 -> A1 = 2"
    assert [line.split() for line in summary.lines()[1:]] == [
        ["control", "2/3", "killed"],
        ["all", "2/3", "killed,", "0", "equivalent"],
    ]
    assert Summary(verdicts, [entry(second)], [first, second, third]).clean
    assert "2/2 killed, 1 equivalent" in Summary(verdicts, [entry(second)], verdicts).lines()[-1]


def test_an_entry_that_matches_nothing_or_is_killed_is_not_clean():
    first, second = lines(2)
    stale = Summary({first: KILLED}, [entry(first, before="A = 0")], [first, second])
    assert not stale.clean
    assert stale.lines()[0].startswith("listed, but no such mutant: x.py: A = 0")
    killed = Summary({first: KILLED}, [entry(first)], [first, second])
    assert not killed.clean
    assert killed.lines()[0].startswith("listed as equivalent, but a test kills it: x.py: A0 = 0")
    assert Summary({first: KILLED}, [entry(second)], [first, second]).clean  # not tried this time


ENTRY = '[[equivalent]]\npath = "x.py"\nfunction = ""\nbefore = "a"\nafter = "b"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ENTRY, "reason"),
        (ENTRY + 'reason = "same"\n', "reason in a sentence"),
        (2 * (ENTRY + 'reason = "it is the same"\n'), "listed twice"),
        (ENTRY + 'reason = "it is the same"\nline = 3\n', "line"),
        ("[[equivalent", "Expected"),
    ],
)
def test_a_list_without_reasons_is_refused(tmp_path, text, words):
    file = tmp_path / "list.toml"
    file.write_text(text)
    with pytest.raises(BadList, match=words):
        read_equivalents(file)
