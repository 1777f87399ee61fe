"""Whether the log of a run is all there, and what the other processes of it say."""

from tools.verdict.witness import Witness, witness_of

MAGIC = b"\x89MCAP0\r\n"
"""As the specification of MCAP gives it: a finished file begins and ends with it."""
SAID = {"complete": True, "ticks": 100, "dropped": {"control": 0, "gate": 0, "world": 0}, "lost": 0, "undecodable": 0}
GATE = {"counters": {"unanswered_checks": 1}}


def written(folder, content=MAGIC + b"anything" + MAGIC):
    path = folder / "run.mcap"
    path.write_bytes(content)
    return path


def test_a_whole_log(tmp_path):
    assert witness_of(written(tmp_path), 100, recorder=SAID, gate=GATE) == Witness("", 0, "", 1)


def test_a_base_without_a_preflight_has_no_such_count(tmp_path):
    assert witness_of(written(tmp_path), 100, recorder=SAID, gate={"counters": {}}).unanswered is None


def test_what_is_missing_is_said(tmp_path):
    def log(content=MAGIC + MAGIC, ticks=100, **said):
        return witness_of(written(tmp_path, content), ticks, recorder={**SAID, **said}, gate=GATE).log

    assert log() == ""
    assert log(complete=False) == "it could not be written to its end"
    assert log(ticks=101) == "it holds 100 of 101 ticks"
    assert log(content=MAGIC + b"cut off") == "its end is not that of a finished log"
    assert log(content=b"") == "it cannot be read: Invalid argument"
    gone = witness_of(tmp_path / "none.mcap", 100, recorder=SAID, gate=GATE)
    assert gone.log == "it cannot be read: No such file or directory"


def test_records_that_are_not_in_the_log_are_counted(tmp_path):
    said = {**SAID, "dropped": {"control": 1, "gate": 2, "world": 0}, "lost": 4, "undecodable": 8}
    assert witness_of(written(tmp_path), 100, recorder=said, gate=GATE).records_missing == 15


def test_processes_that_ended_without_a_word(tmp_path):
    killed = witness_of(
        written(tmp_path), 100, recorder="the recorder process was killed by SIGKILL", gate="the gate ended with code 1"
    )
    assert killed == Witness("the recorder process was killed by SIGKILL", 0, "the gate ended with code 1", None)
