"""Which changes are made to a piece of source, and which pieces are left alone."""

import ast

import pytest

from tools.dev.mutants.find import find_mutants


def changes(body, first="def f(a, b, c):\n"):
    """Return what the one line of a function's body becomes; `first` is line 1."""
    source = f"{first}    {body}\n".encode()
    return [mutant.after for mutant in find_mutants("x.py", source) if mutant.line == 2]


@pytest.mark.parametrize(
    ("body", "after"),
    [
        ("return a < b", ["return a <= b", "return True", "return False"]),
        ("return a >= b", ["return a > b", "return True", "return False"]),
        ("return a is not None", ["return a is None", "return True", "return False"]),
        ("return a not in b", ["return a in b", "return True", "return False"]),
        ("return a + b", ["return a - b", "return None"]),
        ("return a - (b)", ["return a + (b)", "return None"]),
        ("return a // b", ["return a * b", "return None"]),
        ("return a << b", ["return a >> b", "return None"]),
        ("return -a", ["return a", "return None"]),
        ("return not a", ["return a", "return True", "return False"]),
        ("return a and b and c", ["return b and c", "return a and c", "return a and b", "return True", "return False"]),
        ("return (a or b) and c", ["return c", "return (a or b)", "return (b) and c", "return (a) and c"]),
        ("return min(a, b)", ["return max(a, b)", "return None"]),
        ("return abs(a)", ["return a", "return None"]),
        ("return a[0]", ["return a[1]", "return None"]),
        ("return 3", ["return 4"]),
        ("return 500", ["return 750", "return 333"]),
        ("return 0.5", ["return 0.75", "return 0.3333333333333333"]),
        ("return 0.0", ["return 1.0"]),
        ("return True", ["return False"]),
        (r"return b'\x09a'", [r"return b'\x08a'"]),
        ("return b if a else c", ["return b if (not a) else c", "return None"]),
        ("return a(b, x=c)", ["return a(b)", "return None"]),
        ("return a(x=b, y=c)", ["return a(y=c)", "return a(x=b)", "return None"]),
        ("a.stop()", ["pass"]),
        ("a.x = b", ["pass"]),
        ("a = b", ["pass"]),
        ("a += b", ["pass", "a -= b"]),
        ("raise ValueError(1 + 1)", ["pass"]),
        ("return [x for x in a if x]", ["return [x for x in a if (not x)]", "return None"]),
    ],
)
def test_what_a_line_becomes(body, after):
    found = changes(body)
    assert set(after) <= set(found)
    if " and c" not in body or "(" not in body:
        assert sorted(found) == sorted(after)


@pytest.mark.parametrize(
    "body",
    ["new = a", "'words'", "return None", "assert a < 1", "x: dict[int, 3]", "return 'a'", "import os"],
)
def test_what_is_left_alone(body):
    assert changes(body) == []


def test_words_annotations_decorators_and_documentation_are_left_alone():
    source = '''
"""Module."""
@slow(3)
def f(a: Annotated[int, 3]) -> Literal[4]:
    """Say 5."""
    raise ValueError(f"{a + 1} of {7}")
'''
    assert [m.after for m in find_mutants("x.py", source.encode())] == ["pass"]


def test_a_mutant_says_where_it_is_even_after_letters_of_two_bytes():
    source = 'K = "µµ", 1  # µ\n\n\nclass Gate:\n    LIMIT = 2\n\n    def step(self):\n        self.n = 1\n'.encode()
    named = {(m.line, m.function, m.before, m.after) for m in find_mutants("a/b.py", source)}
    assert named == {
        (1, "", 'K = "µµ", 1 # µ', 'K = "µµ", 2 # µ'),
        (5, "", "LIMIT = 2", "LIMIT = 3"),
        (8, "Gate.step", "self.n = 1", "self.n = 2"),
        (8, "Gate.step", "self.n = 1", "pass"),
    }
    assert find_mutants("a/b.py", source)[0].name == 'a/b.py:1: K = "µµ", 1 # µ -> K = "µµ", 2 # µ'


def test_every_mutant_can_be_compiled_and_differs_from_the_others():
    source = b"def f(a):\n    for i in a:\n        if i == 1:\n            break\n        yield g(i, x=1,\n y=2)\n"
    made = [mutant.apply(source) for mutant in find_mutants("x.py", source)]
    assert len(made) > 8
    assert len({ast.dump(ast.parse(text)) for text in [source, *made]}) == len(made) + 1
