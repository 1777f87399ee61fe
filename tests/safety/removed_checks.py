"""The checks of the table's rows, taken out by program: what names a row no longer does, all else is as before."""

from __future__ import annotations

import ast
from types import ModuleType

import pytest

import tools.run.tick_core
from safety import gate, supervisor
from safety.checks import (
    agreement_checks,
    arm_checks,
    base_checks,
    clock_checks,
    force_checks,
    host_checks,
    link_checks,
    motion_checks,
    sensor_checks,
    stuck_checks,
    task_checks,
    workspace_checks,
)
from safety.faults import FAULTS
from safety.gate import GateState, Latch
from safety.supervisor import Verdict
from tests.mutants import load, tree_of

CHECKS = {
    "safety.checks.force_checks": force_checks,
    "safety.checks.sensor_checks": sensor_checks,
    "safety.checks.stuck_checks": stuck_checks,
    "safety.checks.arm_checks": arm_checks,
    "safety.checks.base_checks": base_checks,
    "safety.checks.host_checks": host_checks,
    "safety.checks.link_checks": link_checks,
    "safety.checks.clock_checks": clock_checks,
    "safety.checks.task_checks": task_checks,
    "safety.supervisor": supervisor,
    "safety.checks.workspace_checks": workspace_checks,
    "safety.checks.motion_checks": motion_checks,
    "safety.checks.agreement_checks": agreement_checks,
}


_REFUSED_BY_NAME = {"R02", "R03", "R02-dead", "R02-contact"}


def rows_named(node: ast.AST) -> set[str]:
    """Return the rows that a node names, but not those that an `if` inside it names."""
    if isinstance(node, ast.Constant) and node.value in FAULTS:
        return {node.value}
    if isinstance(node, ast.Name) and node.id == "_REFUSALS":
        return _REFUSED_BY_NAME
    return {row for child in ast.iter_child_nodes(node) if not isinstance(child, ast.If) for row in rows_named(child)}


def naming(tree: ast.Module) -> dict[str, list[ast.If]]:
    """Return each row's `if`s: those whose own body (not that of an `if` inside it) names the row."""
    found: dict[str, list[ast.If]] = {row: [] for row in FAULTS}
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        for one in (n for n in ast.walk(function) if isinstance(n, ast.If)):
            for row in set().union(*map(rows_named, one.body)):
                found[row].append(one)
    return found


def places() -> list[tuple[str, str, int]]:
    """Return row, module and number of every `if` that decides over a row."""
    ifs = {module: naming(tree_of(module)) for module in CHECKS}
    return [(row, module, index) for row in FAULTS for module in CHECKS for index in range(len(ifs[module][row]))]


def without(row: str, module: str, index: int | None = None) -> ModuleType:
    """Return a module in which what names a row is never reached: in one place, or in all."""
    tree = tree_of(module)
    found = naming(tree)[row]
    for place in found if index is None else [found[index]]:
        place.test = ast.Constant(False)
    return load(module, tree)


def install(blind: ModuleType, module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the core use a changed module of checks."""
    if module == "safety.supervisor":
        monkeypatch.setattr(tools.run.tick_core, "supervise", blind.supervise)
    else:
        monkeypatch.setattr(CHECKS[module], "check", blind.check)


def remove(row: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take out all that checks for a row, in control and in the gate."""
    for module in CHECKS:
        if naming(tree_of(module))[row]:
            install(without(row, module), module, monkeypatch)
    usual = gate.latched

    def latched(state: GateState, cause: Latch) -> GateState:
        return state if gate.LATCH_FAULT.get(cause) == row else usual(state, cause)

    monkeypatch.setattr(gate, "latched", latched)
    if row == "F68":
        monkeypatch.setattr(
            tools.run.tick_core, "give_up", lambda state, _: (state, Verdict(state.mode, (), (), True, 0))
        )
