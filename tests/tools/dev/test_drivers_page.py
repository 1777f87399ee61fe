"""The page of the library leaves out nothing that is public, and docstrings become Markdown that reads as they do."""

from __future__ import annotations

import importlib
import inspect
import re

import pytest

from robot_io import Ft300, Ridgeback, Ur10
from robot_io.mcap import McapLog
from tools.dev.api_markdown import prose
from tools.dev.drivers_page import page

ROOMS = (
    *("robot_io.ft300", "robot_io.ur10", "robot_io.ridgeback", "robot_io.rig"),
    *("robot_io.log", "robot_io.mcap", "robot_io.cdr"),
)
MODULES = ("robot_io.driver", "robot_io.messages")


@pytest.fixture(scope="module")
def text():
    return page()


@pytest.mark.parametrize("room", ROOMS)
def test_every_name_that_a_room_exports_has_a_place(text, room):
    assert [name for name in importlib.import_module(room).__all__ if f"\n### {name}\n" not in text] == []


@pytest.mark.parametrize("module", MODULES)
def test_every_public_class_of_driver_and_messages_has_a_place(text, module):
    classes = inspect.getmembers(importlib.import_module(module), inspect.isclass)
    names = [name for name, found in classes if found.__module__ == module and not name.startswith("_")]
    assert len(names) > 4
    assert [name for name in names if f"\n### {name}\n" not in text] == []


def test_every_error_is_named_with_its_exit_code(text):
    for name, error in inspect.getmembers(importlib.import_module("robot_io.errors"), inspect.isclass):
        if name != "PushError":
            assert re.search(rf"-- {name} +{error.exit_code} ", text), name


@pytest.mark.parametrize("driver", [Ft300, Ur10, Ridgeback, McapLog])
def test_every_parameter_and_method_of_a_driver_is_described(text, driver):
    _, _, after = text.partition(f"\n### {driver.__name__}\n")
    described = re.split(r"\n##?#? ", after)[0]
    for parameter in inspect.signature(driver).parameters:
        assert re.search(rf"^- `{parameter}`: ..", described, re.M), parameter
    for name, method in vars(driver).items():
        if inspect.isfunction(method) and not name.startswith("_"):
            assert f"\n#### `{name}(" in described, name


def test_every_type_that_the_page_links_to_is_on_it(text):
    headings = {line.strip("# ").lower().replace(" ", "-") for line in text.splitlines() if line.startswith("#")}
    assert set(re.findall(r"\]\(#([^)]+)\)", text)) <= headings


def test_the_same_heading_is_there_once(text):
    headings = [line.strip("# ").lower() for line in text.splitlines() if re.match("##?#? ", line)]
    assert sorted(set(headings)) == sorted(headings)


def test_parameters_become_a_list_and_the_text_behind_it_does_not_belong_to_it():
    doc = "Do it.\n\nmass: in kg, and\n    no other unit.\nforce: in N.\nRaises ValueError.\nother: no."
    assert prose(doc, frozenset({"mass", "force"})) == (
        "Do it.\n\n- `mass`: in kg, and\n  no other unit.\n- `force`: in N.\n\nRaises ValueError.\nother: no.\n"
    )


def test_stars_of_units_stay_stars_and_code_stays_as_it_is():
    assert prose("In N*m, or `a * b * c`, in N*m.") == "In N\\*m, or `a * b * c`, in N\\*m.\n"
    assert prose("An example:\n\n    a = b * c\n    d = a * e") == "An example:\n\n    a = b * c\n    d = a * e\n"
