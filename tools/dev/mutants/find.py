"""Find every mutant of a source file, in file order. Annotations, decorators, strings and messages are not changed."""

from __future__ import annotations

import ast
import re

from tools.dev.mutants import changes
from tools.dev.mutants.mutant import Mutant

_ATOMS = (ast.Name, ast.Attribute, ast.Call, ast.Constant, ast.Subscript)


def find_mutants(path: str, source: bytes) -> list[Mutant]:
    """Return all mutants of one file that compile; `path` is only its name.

    Raises SyntaxError if the source itself does not compile.
    """
    finder = _Finder(path, source)
    finder.visit(ast.parse(source))
    unique = {(m.start, m.end, m.text): m for m in finder.found}
    return [m for m in sorted(unique.values(), key=lambda m: (m.start, m.end, m.text)) if _compiles(m.apply(source))]


def _compiles(source: bytes) -> bool:
    try:
        compile(source, "mutant", "exec", dont_inherit=True)
    except SyntaxError:
        return False
    return True


class _Finder(ast.NodeVisitor):
    def __init__(self, path: str, source: bytes) -> None:
        self.path, self.source = path, source
        self.lines = source.splitlines(keepends=True)
        self.offsets = [0]
        for line in self.lines:
            self.offsets.append(self.offsets[-1] + len(line))
        self.found: list[Mutant] = []
        self.names: list[str] = []
        self.in_function = False
        self.assigned: dict[str, int] = {}
        self.statement_line = 1

    # -- text ---------------------------------------------------------------------------------------------------

    def span(self, node: ast.expr | ast.stmt | ast.keyword) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self.offsets[node.lineno - 1] + node.col_offset, self.offsets[node.end_lineno - 1] + node.end_col_offset

    def text(self, node: ast.expr) -> str:
        """Return a node's source, in parentheses where another position may need them."""
        start, end = self.span(node)
        text = self.source[start:end].decode()
        return text if isinstance(node, _ATOMS) else f"({text})"

    def replace(self, start: int, end: int, text: str) -> None:
        line = self.source.count(b"\n", 0, start) + 1
        last = self.source.count(b"\n", 0, max(end - 1, start)) + 1
        low, high = self.offsets[line - 1], self.offsets[last]
        before = self.source[low:high].decode()
        after = (self.source[low:start] + text.encode() + self.source[end:high]).decode()
        function = ".".join(self.names) if self.in_function else ""
        self.found.append(
            Mutant(
                self.path,
                line,
                last,
                self.statement_line,
                function,
                start,
                end,
                text,
                _one_line(before),
                _one_line(after),
            )
        )

    def replace_node(self, node: ast.expr | ast.stmt, text: str) -> None:
        self.replace(*self.span(node), text)

    def replace_between(self, left: ast.expr, right: ast.expr, old: str, new: str) -> None:
        """Replace the operator between two operands; only blanks and parentheses can be beside it."""
        start, end = self.span(left)[1], self.span(right)[0]
        at = self.source.find(old.encode(), start, end)
        if at >= 0:
            self.replace(at, at + len(old), new)

    # -- walk ---------------------------------------------------------------------------------------------------

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.stmt):
            self.statement_line = node.lineno
            if self.in_function and changes.can_be_dropped(node, self.assigned):
                self.replace_node(node, "pass")
        super().visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.names.append(node.name)
        for statement in node.body:
            self.visit(statement)
        self.names.pop()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self.names.append(node.name)
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.visit(default)
        outer = self.in_function, self.assigned
        self.in_function, self.assigned = True, changes.count_assignments(node)
        for statement in node.body:
            self.visit(statement)
        self.in_function, self.assigned = outer
        self.names.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Raise(self, node: ast.Raise) -> None:
        """Skip raised errors: their text and numbers are for people."""

    def visit_Assert(self, node: ast.Assert) -> None:
        """Skip assertions: they help the type checker."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Skip formatted text: it is for people."""

    def visit_Break(self, node: ast.Break) -> None:
        self.replace_node(node, "continue")

    def visit_Continue(self, node: ast.Continue) -> None:
        self.replace_node(node, "break")

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None:
            for text in changes.returned(node.value):
                self.replace_node(node.value, text)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        old, new = changes.ARITHMETIC[type(node.op)]
        self.replace_between(node.target, node.value, f"{old}=", f"{new}=")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        self.condition(node.test)
        self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        self.condition(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self.condition(node.test)
        self.generic_visit(node)

    def visit_match_case(self, node: ast.match_case) -> None:
        if node.guard is not None:
            self.condition(node.guard)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for test in node.ifs:
            self.condition(test)
        self.generic_visit(node)

    def condition(self, test: ast.expr) -> None:
        if changes.can_be_negated(test):
            self.replace_node(test, f"(not {self.text(test)})")

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for i, op in enumerate(node.ops):
            self.replace_between(operands[i], operands[i + 1], *changes.COMPARISONS[type(op)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        word = " and " if isinstance(node.op, ast.And) else " or "
        for dropped in range(len(node.values)):
            kept = [self.text(value) for i, value in enumerate(node.values) if i != dropped]
            self.replace_node(node, word.join(kept))
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if type(node.op) in changes.ARITHMETIC and not changes.is_text(node.left) and not changes.is_text(node.right):
            self.replace_between(node.left, node.right, *changes.ARITHMETIC[type(node.op)])
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        self.replace_node(node, self.text(node.operand))
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name in changes.NAMES:
            end = self.span(node.func)[1]
            self.replace(end - len(name), end, changes.NAMES[name])
        if name == "abs" and len(node.args) == 1:
            self.replace_node(node, self.text(node.args[0]))
        for keyword in node.keywords:
            if keyword.arg is not None:
                self.drop_argument(keyword)
        self.generic_visit(node)

    def drop_argument(self, keyword: ast.keyword) -> None:
        """Drop `name=value` of a call with the comma that goes with it."""
        start, end = self.span(keyword)
        if comma := re.compile(rb"\s*,[ \t]*").match(self.source, end):
            end = comma.end()
        elif comma := re.search(rb",\s*$", self.source[:start]):
            start = comma.start()
        self.replace(start, end, "")

    def visit_Constant(self, node: ast.Constant) -> None:
        for text in changes.constants(node.value):
            self.replace_node(node, text)


def _one_line(text: str) -> str:
    return " ".join(text.split())
