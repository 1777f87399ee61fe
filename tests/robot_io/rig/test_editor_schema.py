"""The schema for editors: it knows every key, and nothing that the program would refuse."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import msgspec
import pytest

from robot_io.rig.config import load_rig, rig_to_toml
from robot_io.rig.editor_schema import rig_schema
from robot_io.rig.files import RIGS_DIR, shipped_rigs

SCHEMA = json.loads(json.dumps(rig_schema()))


def resolved(part):
    return SCHEMA["$defs"][part["$ref"].removeprefix("#/$defs/")] if "$ref" in part else part


def check(value, part, where=""):
    """Check a value by the few words of JSON Schema that the schema uses."""
    part = resolved(part)
    if "anyOf" in part:
        return any(not problems(value, one) for one in part["anyOf"])
    if "enum" in part:
        assert value in part["enum"], where
        return None
    match part.get("type"):
        case "object" if "properties" in part:
            assert part["additionalProperties"] is False, where
            for key, below in value.items():
                assert key in part["properties"], f"{where}.{key}"
                check(below, part["properties"][key], f"{where}.{key}")
        case "array":
            kinds = part.get("prefixItems") or [part["items"]] * len(value)
            assert part.get("minItems", 0) <= len(value) <= part.get("maxItems", len(value)), where
            for n, (item, kind) in enumerate(zip(value, kinds, strict=True)):
                check(item, kind, f"{where}[{n}]")
        case "number" | "integer":
            assert isinstance(value, (int, float)), where
            assert part.get("minimum", value) <= value <= part.get("maximum", value), where
            assert value > part.get("exclusiveMinimum", value - 1), where
        case kind:
            assert isinstance(value, {"string": str, "boolean": bool, "object": dict}[kind]), where
    return None


def problems(value, part):
    try:
        check(value, part)
    except AssertionError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", shipped_rigs())
def test_the_shipped_rigs_are_good_by_it(name):
    check(tomllib.loads((RIGS_DIR / f"{name}.toml").read_text(encoding="utf-8")), SCHEMA)
    whole = tomllib.loads(rig_to_toml(load_rig(name)))
    whole["ft"].pop("declared", None)
    check(whole, SCHEMA)


@pytest.mark.parametrize(
    "text", ["[control]\nk_g = 1", "[control]\nk_f = 3", "[ft]\nlevel = 'real'", "lop = 1", "[path]\norigin_m = [1]"]
)
def test_what_the_program_refuses_is_marked(text):
    assert problems(tomllib.loads(text), SCHEMA)


def test_it_says_what_the_fields_say_and_demands_nothing():
    limits = SCHEMA["$defs"]["LimitsConfig"]["properties"]["max_force_N"]
    assert limits["description"].startswith("Force beyond the tare")
    assert limits["default"] == 150.0
    assert not any("required" in table for table in SCHEMA["$defs"].values())
    assert "null" not in json.dumps(SCHEMA)


def test_the_command_prints_it():
    push = Path(sys.executable).parent / "push"
    done = subprocess.run([push, "config", "schema"], capture_output=True, text=True, timeout=30, check=True)
    assert msgspec.json.decode(done.stdout) == SCHEMA
    done = subprocess.run([push, "config", "schema", "--json"], capture_output=True, text=True, timeout=30, check=True)
    assert msgspec.json.decode(done.stdout) == {"schema": 1, "rig_schema": SCHEMA}
    refused = subprocess.run([push, "config", "schema", "sim"], capture_output=True, text=True, timeout=30, check=False)
    assert refused.returncode == 2
    assert "same for every rig" in refused.stderr
