"""Small changes of a module's text, each at one place: the operators of Cosmic Ray, and one of our own.

Changes that cannot matter are left out: of annotations, decorators, what only a type checker reads, and
notes in logs.
"""

from __future__ import annotations

import ast
import random
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from cosmic_ray.ast import Visitor, get_ast
from cosmic_ray.mutating import MutationVisitor
from cosmic_ray.operators.operator import Example, Operator
from cosmic_ray.plugins import get_operator, operator_names

_FAMILIES = {
    r"ReplaceBinaryOperator_\w+_(Add|Sub|Mul|Div|FloorDiv)": "arithmetic",
    r"ReplaceUnaryOperator_\w+": "sign",
    r"ReplaceComparisonOperator_Is(Not)?_Is(Not)?": "comparison",
    r"ReplaceComparisonOperator_(Eq|NotEq|Lt|LtE|Gt|GtE)_(Eq|NotEq|Lt|LtE|Gt|GtE)": "comparison",
    r"AddNot|Replace(True|False|And|Or)With\w+": "logic",
    r"Replace(Break|Continue)With\w+|ZeroIterationForLoop": "loop",
    r"NumberReplacer": "number",
    r"ExceptionReplacer": "exception",
}
"""By the operator's name. Others are noticed by any test: names that do not exist, bits of floats."""


_NO_OPERATION = ("parameters", "param", "argument", "star_expr", "dictorsetmaker")
"""Nodes in which a star or slash is no operation: with another one callers get the same, or the module is
none."""
_NOTE = re.compile(r"(.*\.)?(get_logger\(\)|_?log(ger)?)\.(debug|info)")
"""A note in a log that asks nobody to do anything; PIT leaves calls of loggers as they are, too."""


class RemoveStatement(Operator):  # type: ignore[misc]
    """Leaves out a statement that changes something or raises; without others, names would be missing."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
        """Yield where ``node`` is such a statement."""
        if getattr(node, "parent", None) is None or node.parent.type != "simple_stmt":
            return
        if node.type in ("atom_expr", "raise_stmt") or (node.type == "expr_stmt" and not _binds_names(node)):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Return ``pass`` for the statement."""
        statement = get_ast("pass\n").children[0].children[0]
        statement.prefix = node.get_first_leaf().prefix
        return statement

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """Return what it does, as every operator tells."""
        return (Example("a.x = 1\n", "pass\n"), Example("f()\n", "pass\n"))


def _binds_names(statement: Any) -> bool:
    target, operator = statement.children[:2]
    return target.type in ("name", "testlist_star_expr") and (operator == "=" or operator.type == "annassign")


@dataclass(frozen=True, slots=True)
class Mutation:
    """One small change.

    Attributes:
        path: The module, relative to the repository.
        family: What kind of change it is, e.g. ``comparison``.
        line: Where, from 1.
        before: That line as it is, without the space around it.
        after: What stands there then; other lines too, when the change moves them.
        text: The whole module, changed.
    """

    path: str
    family: str
    line: int
    before: str
    after: str
    text: str


def draw(path: str, source: str, count: int, seed: str, lines: Sequence[range] = ()) -> list[Mutation]:
    """Draw mutations of a module: a line, then a family, then one of its changes, each by chance.

    Args:
        path: The module, relative to the repository.
        source: Its text.
        count: How many at most; each line has one at most.
        seed: The same seed draws the same ones.
        lines: Only of these lines; all when empty.
    """
    by_line: dict[int, dict[str, list[tuple[type[Operator], int]]]] = defaultdict(lambda: defaultdict(list))
    for line, family, operator, occurrence in _places(source):
        if not lines or any(line in each for each in lines):
            by_line[line][family].append((operator, occurrence))
    chance = random.Random(seed)
    drawn = chance.sample(sorted(by_line), min(count, len(by_line)))
    mutations = []
    for line in drawn:
        family = chance.choice(sorted(by_line[line]))
        operator, occurrence = chance.choice(by_line[line][family])
        text = MutationVisitor.mutate_code(source, operator(), occurrence)
        mutations.append(Mutation(path, family, line, *_difference(source, text), text))
    return mutations


@cache
def _operators() -> list[tuple[str, type[Operator]]]:
    found: list[tuple[str, type[Operator]]] = []
    for name in operator_names():
        short = name.partition("/")[2]
        family = next((family for form, family in _FAMILIES.items() if re.fullmatch(form, short)), None)
        if family is not None:
            found.append((family, get_operator(name)))
    return [*found, ("statement", RemoveStatement)]


@cache
def _places(source: str) -> tuple[tuple[int, str, type[Operator], int], ...]:
    """Return line, family, operator and the operator's occurrence of each change that may matter."""
    idle, found = _Idle(source), _Positions([(family, kind, kind()) for family, kind in _operators()])
    found.walk(get_ast(source))
    places: list[tuple[int, str, type[Operator], int]] = []
    occurrences: Counter[type[Operator]] = Counter()
    for family, kind, line, column in found.positions:
        if family and not idle.covers(line, column):
            places.append((line, family, kind, occurrences[kind]))
        occurrences[kind] += 1
    return tuple(places)


class _Positions(Visitor):  # type: ignore[misc]
    """Collects where operators change something, of each in the order in which it counts."""

    def __init__(self, operators: Sequence[tuple[str, type[Operator], Operator]]) -> None:
        self._operators = operators
        self.positions: list[tuple[str, type[Operator], int, int]] = []

    def visit(self, node: Any) -> Any:
        stands = node.type == "operator" and node.parent.type in _NO_OPERATION
        for family, kind, operator in self._operators:
            for (line, column), _ in operator.mutation_positions(node):
                self.positions.append(("" if stands else family, kind, line, column))
        return node


class _Idle:
    """The places of a module whose changes nobody can notice, e.g. annotations."""

    def __init__(self, source: str) -> None:
        self._spans: list[tuple[tuple[int, int], tuple[int, int]]] = []
        for node in ast.walk(ast.parse(source)):
            for part in _idle_parts(node):
                end = part.end_lineno, part.end_col_offset
                self._spans.append(((part.lineno, part.col_offset), end))

    def covers(self, line: int, column: int) -> bool:
        return any(start <= (line, column) < end for start, end in self._spans)


def _idle_parts(node: ast.AST) -> Iterator[Any]:
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            yield from node.decorator_list
            yield from (node.returns,) if node.returns else ()
        case ast.ClassDef():
            yield from node.decorator_list
            if any("Protocol" in ast.unparse(base) for base in node.bases):
                yield node
        case ast.arg() if node.annotation:
            yield node.annotation
        case ast.AnnAssign():
            yield node.annotation if node.value is not None else node
        case ast.Expr(value=ast.Constant()):
            yield node
        case ast.Expr(value=ast.Call(func=called)) if _NOTE.fullmatch(ast.unparse(called)):
            yield node
        case ast.If() if ast.unparse(node.test) == "TYPE_CHECKING":
            yield node
        case ast.Assign() if re.match("__all__|log(ger)? =", ast.unparse(node)):
            yield node


def _difference(one: str, two: str) -> tuple[str, str]:
    """Return what stands before and after where two texts differ, in a line each."""
    first, second = one.splitlines(), two.splitlines()
    begin = next(
        (n for n, (a, b) in enumerate(zip(first, second, strict=False)) if a != b),
        min(len(first), len(second)),
    )
    end = 0
    while end < min(len(first), len(second)) - begin and first[-1 - end] == second[-1 - end]:
        end += 1
    return tuple(" ".join(line.strip() for line in text[begin : len(text) - end]) for text in (first, second))  # type: ignore[return-value]
