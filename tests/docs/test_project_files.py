"""The files that other programs read of the project: how it is cited, and what is run for each change."""

import re
import tomllib
from pathlib import Path

import robot_io

ROOT = Path(__file__).resolve().parents[2]


def test_the_citation_names_this_version_and_licence():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    fields = dict(re.findall(r"^(\S+): (.+)$", text, re.M))
    assert fields["cff-version"] == "1.2.0"
    assert (fields["title"], fields["license"]) == (project["name"], project["license"])
    assert fields["version"] == robot_io.__version__
    assert {"message", "type"} <= set(fields)
    assert "Robust Single-Point Pushing with Force Feedback" in text


def test_a_change_is_checked_by_the_two_commands_and_nothing_is_dialled():
    text = (ROOT / ".github/workflows/check.yml").read_text(encoding="utf-8")
    assert re.findall(r"^\s+- run: (.+)$", text, re.M) == ["make check", "make test"]
    assert "3.11" in text
    assert "3.12" in text
    assert not re.search(r"://|\d+\.\d+\.\d+\.\d+", text)


def test_the_readme_says_where_it_runs():
    text = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    [sentence] = [one for one in re.split(r"(?<=\.) ", text) if "macOS" in one]
    assert "Windows" in sentence
