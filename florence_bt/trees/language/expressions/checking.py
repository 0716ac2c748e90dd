"""The kinds of expressions, found without running them: metres cannot be added to seconds.

What is not known (a key that nothing writes) fits everywhere, so that one mistake is reported once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.core.units import UNITS
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.literals import POSE_PARTS
from florence_bt.trees.language.quantities import NUMERIC_KINDS, example_of, with_article

PLAIN = (Kind.INTEGER, Kind.NUMBER)
"""Numbers without a unit."""

_OF_POSES = {"distance": Kind.LENGTH, "bearing": Kind.ANGLE}
"""Function of poses -> the kind of its value."""

_PRODUCTS: dict[frozenset[Kind], Kind] = {frozenset((Kind.SPEED, Kind.DURATION)): Kind.LENGTH}
_QUOTIENTS: dict[tuple[Kind, Kind], Kind] = {
    (Kind.LENGTH, Kind.DURATION): Kind.SPEED,
    (Kind.LENGTH, Kind.SPEED): Kind.DURATION,
}


def common_kind(left: Kind, right: Kind) -> Kind | None:
    """Return the kind of a sum or a comparison, None when there is none."""
    if left is right:
        return left
    return Kind.NUMBER if left in PLAIN and right in PLAIN else None


def product_kind(left: Kind, right: Kind) -> Kind | None:
    """Return the kind of a product of two numeric kinds, None when there is none."""
    if left in PLAIN and right in PLAIN:
        return common_kind(left, right)
    if left in PLAIN:
        return right
    if right in PLAIN:
        return left
    return _PRODUCTS.get(frozenset((left, right)))


def quotient_kind(left: Kind, right: Kind) -> Kind | None:
    """Return the kind of a quotient of two numeric kinds, None when there is none."""
    if right in PLAIN:
        return Kind.NUMBER if left in PLAIN else left
    if left is right and left in NUMERIC_KINDS:
        return Kind.NUMBER
    return _QUOTIENTS.get((left, right))


@dataclass(frozen=True, slots=True)
class KindProblem:
    """A part of an expression that cannot be computed.

    Attributes:
        position: Where.
        message: What is wrong, one sentence.
        valid: What would have worked.
    """

    position: Position
    message: str
    valid: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Checked:
    """The facts about an expression.

    Attributes:
        kind: What it gives; None when that is not known.
        problems: Everything that is wrong, from left to right.
    """

    kind: Kind | None
    problems: tuple[KindProblem, ...]


def check_kinds(
    expression: syntax.Expression, kinds: Mapping[str, Kind | None], wanted: Kind | None = None
) -> Checked:
    """Find the kind of an expression and what is wrong with it.

    Args:
        expression: The expression.
        kinds: The kinds of the keys, as far as they are known.
        wanted: What the expression must give; None when anything will do.
    """
    checker = _Checker(kinds, expression.term)
    kind = checker.kind(expression.term)
    if wanted is not None and not checker.problems and not _fits(expression.term, kind, wanted):
        message = f"{syntax.print_term(expression.term)!r} is {_article(kind)}; {_article(wanted)} is needed"
        checker.add(syntax.start_of(expression.term), message, *_instead(expression.term, kind, wanted))
    return Checked(kind, tuple(checker.problems))


_NEAR = {Kind.LENGTH: "0.1 m", Kind.ANGLE: "5 deg", Kind.SPEED: "0.05 m/s"}
"""Measured quantity -> a difference that an author could mean by "the same"."""


def exact_comparisons(
    expression: syntax.Expression, kinds: Mapping[str, Kind | None], measured: Collection[str]
) -> Iterator[KindProblem]:
    """Yield where measured values are asked to be the same to the last digit, which they hardly ever are.

    Args:
        expression: The expression, whose kinds are right.
        kinds: The kinds of the keys, as far as they are known.
        measured: The keys that skills write.
    """
    checker = _Checker(kinds, expression.term)
    for term in syntax.walk(expression.term):
        if not isinstance(term, syntax.Binary) or term.operator not in ("==", "!=", "in"):
            continue
        kind = checker.kind(term.left) or checker.kind(term.right)
        left, right = syntax.print_term(term.left), syntax.print_term(term.right)
        near = "<" if term.operator == "==" else ">="
        valid = [f"distance({left}, {right}) {near} {_NEAR[Kind.LENGTH]}"] if term.operator != "in" else []
        if kind in _NEAR and term.operator != "in":
            if not is_measured(term, measured):
                continue
            difference = f"{left} - {right}" if not _is_zero(term.right) else left
            valid = [f"abs({difference}) {near} {_NEAR[kind]}"]
        elif kind is not Kind.POSE:
            continue
        message = (
            f"{term.operator!r} is about the last digit, and two {_MEASURED[kind]} are hardly ever the same"
        )
        yield KindProblem(syntax.start_of(term), message, tuple(valid))


def foreign_texts(expression: syntax.Expression, texts: Mapping[str, Sequence[str]]) -> Iterator[KindProblem]:
    """Yield where a key is compared with a text that it never has.

    Args:
        expression: The expression, whose kinds are right.
        texts: The keys that can only have certain texts, with these.
    """
    for term in syntax.walk(expression.term):
        if not isinstance(term, syntax.Binary) or term.operator not in ("==", "!=", "in"):
            continue
        key, other = term.left, term.right
        if isinstance(other, syntax.Key) and term.operator != "in":
            key, other = other, key
        if not isinstance(key, syntax.Key) or key.key not in texts:
            continue
        allowed = texts[key.key]
        for text in other.items if isinstance(other, syntax.Listed) else (other,):
            if isinstance(text, syntax.Constant) and text.value not in allowed:
                message = f"{syntax.print_term(key)} is never {text.text!r}"
                yield KindProblem(syntax.start_of(text), message, closest_first(text.text, allowed))


def has_threshold(expression: syntax.Expression, measured: Collection[str]) -> bool:
    """Tell whether an expression asks on which side of a value something measured is.

    Args:
        expression: The expression.
        measured: The keys that skills write.
    """
    ordered = (
        term
        for term in syntax.walk(expression.term)
        if isinstance(term, syntax.Binary) and term.operator in ("<", "<=", ">", ">=")
    )
    return any(is_measured(term, measured) for term in ordered)


_MEASURED = {Kind.POSE: "poses", **{kind: f"measured {kind.value}s" for kind in _NEAR}}


def is_measured(term: syntax.Term, measured: Collection[str]) -> bool:
    """Tell whether a quantity comes from a pose or a skill, and not from what somebody wrote."""
    return any(
        isinstance(part, syntax.PosePart)
        or (isinstance(part, syntax.Function) and part.name in _OF_POSES)
        or (isinstance(part, syntax.Key) and part.key in measured)
        for part in syntax.walk(term)
    )


class _Checker:
    def __init__(
        self,
        kinds: Mapping[str, Kind | None],
        whole: syntax.Term,
        found: dict[int, Kind | None] | None = None,
    ) -> None:
        self.problems: list[KindProblem] = []
        self._found = found if found is not None else {}
        self._kinds = kinds
        self._whole = whole

    def add(self, position: Position, message: str, *valid: str) -> None:
        self.problems.append(KindProblem(position, message, valid))

    def kind(self, term: syntax.Term) -> Kind | None:
        match term:
            case syntax.Constant(kind=kind):
                return kind
            case syntax.Key(key=key):
                return self._kinds.get(key)
            case syntax.PosePart(part=part) if part not in POSE_PARTS:
                self._no_part(term)
                return None
            case syntax.PosePart(pose=pose, part=part):
                self._need(pose, Kind.POSE, f".{part}")
                return Kind.ANGLE if part == "yaw" else Kind.LENGTH
            case syntax.Item(items=items, index=index):
                self._need(index, Kind.INTEGER, "[ ]")
                return self._list(items, "[ ]")
            case syntax.Listed(items=items):
                return self._listed(items)
            case syntax.Binary(operator="in", left=left, right=right):
                self._contained(term, left, right)
                return Kind.BOOLEAN
            case syntax.Unary(operator="not", operand=operand):
                self._need(operand, Kind.BOOLEAN, "not")
                return Kind.BOOLEAN
            case syntax.Unary(operand=operand):
                return self._number(operand, "-")
            case syntax.Function():
                return self._function(term)
            case syntax.Binary(operator="and" | "or"):
                self._joined(term)
                return Kind.BOOLEAN
            case syntax.Binary(operator="+" | "-", left=left, right=right):
                return self._alike(term, left, right)
            case syntax.Binary(operator="*" | "/"):
                return self._scaled(term)
            case syntax.Binary():
                if not self._shared(term):
                    self._compared(term)
                return Kind.BOOLEAN

    def _need(self, term: syntax.Term, wanted: Kind, what: str) -> None:
        kind = self.kind(term)
        if kind is not None and kind is not wanted:
            message = (
                f"{what!r} needs {_article(wanted)}, but {syntax.print_term(term)!r} is {_article(kind)}"
            )
            self.add(syntax.start_of(term), message, *_instead(term, kind, wanted))

    def _no_part(self, term: syntax.PosePart) -> None:
        """Say what a value is that has no such part, and what has parts."""
        kind, whole = self.kind(term.pose), syntax.print_term(term.pose)
        if kind is Kind.POSE:
            valid = [f".{part}" for part in closest_first(term.part, POSE_PARTS)]
            self.add(term.position, f"{whole} is a pose, which has no part {term.part!r}", *valid)
            return
        what = f"{whole} is {_article(kind)}" if kind is not None else f"nobody says what {whole} is"
        of_its_own = f"${term.part}, given by its skill: out: {{{term.part}: {term.part}}}"
        message = f"{whole} has no part {term.part!r}: {what}, and only a pose has parts (.x, .y, .yaw)"
        self.add(term.position, message, whole, of_its_own)

    def _joined(self, term: syntax.Binary) -> None:
        """Check that operands of ``and`` and ``or`` are true or false; say what ``$a == 3 or 4`` means."""
        operands = _operands(term, term.operator)
        meant = [self._as_comparison(operand, number, operands) for number, operand in enumerate(operands)]
        for operand, comparison in zip(operands, meant, strict=True):
            if comparison is None:
                self._need(operand, Kind.BOOLEAN, term.operator)
        wrong = next((n for n, comparison in enumerate(meant) if comparison is not None), None)
        if wrong is not None:
            whole = [comparison or operand for operand, comparison in zip(operands, meant, strict=True)]
            self._incomplete(term, term.operator, operands[wrong], whole)

    def _as_comparison(
        self, operand: syntax.Term, number: int, operands: list[syntax.Term]
    ) -> syntax.Term | None:
        """Return the comparison that is meant by an operand such as ``4`` beside ``$a == 3``."""
        kind = self._silently(operand)
        if kind is None or kind is Kind.BOOLEAN:
            return None
        before = [_nearest(each, "right") for each in operands[:number][::-1]]
        after = [_nearest(each, "left") for each in operands[number + 1 :]]
        near = next((each for each in (*before, *after) if each is not None), None)
        if near is None:
            return None
        meant = self._completed(operand, kind, near.comparison, behind=any(before))
        if meant is None or not near.inverted:
            return meant
        return syntax.Unary("not", meant, meant.position)

    def _completed(
        self, operand: syntax.Term, kind: Kind, near: syntax.Binary, *, behind: bool
    ) -> syntax.Binary | None:
        """Return a comparison like one nearby with another operand, if that can be compared.

        Args:
            operand: The operand.
            kind: Its kind.
            near: The comparison nearby.
            behind: Whether the operand stands behind it.
        """
        if near.operator == "in":
            items = self._silently(near.right)
            alike = items is not None and items.item is kind
            return syntax.Binary("in", operand, near.right, near.position) if alike else None
        # A constant is compared with a term that is none, a key with what is on its other side.
        constant = isinstance(operand, syntax.Constant)
        to_left = not isinstance(near.left, syntax.Constant) if constant else behind
        held = near.left if to_left else near.right
        if not _common(operand, kind, held, self._silently(held))[1]:
            return None
        left, right = (held, operand) if to_left else (operand, held)
        return syntax.Binary(near.operator, left, right, near.position)

    def _shared(self, term: syntax.Binary) -> bool:
        """Say what is meant by ``$a == (3 or 4)``; says whether the comparison is of that kind."""
        for side, held in ((term.right, term.left), (term.left, term.right)):
            if not (isinstance(side, syntax.Binary) and side.operator in ("and", "or")):
                continue
            operands, held_kind = _operands(side, side.operator), self._silently(held)
            kinds = [self._silently(operand) for operand in operands]
            if held_kind in (None, Kind.BOOLEAN) or not all(
                kind is not None and _common(operand, kind, held, held_kind)[1]
                for operand, kind in zip(operands, kinds, strict=True)
            ):
                continue
            whole = [syntax.Binary(term.operator, held, operand, term.position) for operand in operands]
            self._incomplete(term, side.operator, operands[0], list(whole))
            return True
        return False

    def _silently(self, term: syntax.Term) -> Kind | None:
        """Return the kind of a term that is checked elsewhere."""
        if id(term) not in self._found:
            checker = _Checker(self._kinds, self._whole, self._found)
            kind = checker.kind(term)
            self._found[id(term)] = kind if not checker.problems else None
        return self._found[id(term)]

    def _incomplete(
        self, term: syntax.Term, operator: str, wrong: syntax.Term, meant: list[syntax.Term]
    ) -> None:
        """Report a value where a comparison is needed.

        Args:
            term: The term with ``and`` or ``or``.
            operator: The word.
            wrong: The value.
            meant: The comparisons and other operands that are meant.
        """
        compared = {part.operator for part in meant if isinstance(part, syntax.Binary)}
        # No value equals two others, and every value differs from one of two.
        joined_by = (
            {"==": "or", "!=": "and"}.get(next(iter(compared)), operator) if len(compared) == 1 else operator
        )
        joined = meant[0]
        for part in meant[1:]:
            joined = syntax.Binary(joined_by, joined, part, syntax.start_of(term))
        message = f"{syntax.print_term(wrong)!r} beside {operator!r} is compared with nothing"
        self.add(
            syntax.start_of(wrong), message, syntax.print_term(syntax.replaced(self._whole, term, joined))
        )

    def _number(self, term: syntax.Term, what: str) -> Kind | None:
        kind = self.kind(term)
        if kind is None or kind in NUMERIC_KINDS:
            return kind
        message = (
            f"{what!r} needs a number or a quantity, but {syntax.print_term(term)!r} is {_article(kind)}"
        )
        valid = (f"{syntax.print_term(term)}.x",) if kind is Kind.POSE else ()
        self.add(syntax.start_of(term), message, *valid)
        return None

    def _list(self, term: syntax.Term, what: str) -> Kind | None:
        """Return the kind of the items of what must be a list."""
        kind = self.kind(term)
        if kind is not None and kind.item is None:
            message = f"{what!r} needs a list, but {syntax.print_term(term)!r} is {_article(kind)}"
            self.add(syntax.start_of(term), message)
        return kind.item if kind is not None else None

    def _listed(self, items: tuple[syntax.Term, ...]) -> Kind | None:
        """Return the kind of a list that is written out; its items are of one kind."""
        common: Kind | None = None
        for item in items:
            kind = self.kind(item)
            if kind is not None and kind.item is not None:
                message = f"a list has no lists in it, but {syntax.print_term(item)!r} is {_article(kind)}"
                self.add(syntax.start_of(item), message)
                return None
            together, fit = _common(items[0], common, item, kind)
            if not fit:
                self._unlike(item, "[ ]", items[0], common, item, kind)
                return None
            common = together
        return common.list if common is not None else None

    def _contained(self, term: syntax.Binary, left: syntax.Term, right: syntax.Term) -> None:
        kind, item = self.kind(left), self._list(right, "in")
        if kind is not None and item is not None and not _common(left, kind, right, item)[1]:
            message = f"{syntax.print_term(left)!r} is {_article(kind)}, but the items of "
            message += f"{syntax.print_term(right)!r} are of the kind {item.value}"
            self.add(term.position, message)

    def _function(self, term: syntax.Function) -> Kind | None:
        if term.name in _OF_POSES:
            for argument in term.arguments:
                self._need(argument, Kind.POSE, term.name)
            return _OF_POSES[term.name]
        if term.name == "count":
            self._list(term.arguments[0], "count")
            return Kind.INTEGER
        if term.name == "abs":
            return self._number(term.arguments[0], "abs")
        return self._alike(term, *term.arguments)

    def _alike(
        self, term: syntax.Binary | syntax.Function, left: syntax.Term, right: syntax.Term
    ) -> Kind | None:
        """Check two numbers of one kind: sums, minimum, maximum."""
        what = term.operator if isinstance(term, syntax.Binary) else term.name
        if what == "+" and Kind.TEXT in (self._silently(left), self._silently(right)):
            message = f"'+' adds numbers, and puts no texts together ({syntax.print_term(term)!r})"
            self.add(
                syntax.start_of(left), message, f'"{_in_text(left)}{_in_text(right)}"', "append: {key: text}"
            )
            return None
        if what == "-" and self._silently(left) is self._silently(right) is Kind.POSE:
            message = f"{what!r} needs numbers or quantities, but {syntax.print_term(left)!r} is a pose"
            self.add(
                syntax.start_of(left),
                message,
                f"distance({syntax.print_term(left)}, {syntax.print_term(right)})",
            )
            return None
        before = len(self.problems)
        kinds = self._number(left, what), self._number(right, what)
        if len(self.problems) > before:
            return None
        kind, fit = _common(left, kinds[0], right, kinds[1])
        if not fit:
            self._unlike(term, what, left, kinds[0], right, kinds[1])
        return kind

    def _scaled(self, term: syntax.Binary) -> Kind | None:
        before = len(self.problems)
        left, right = self._number(term.left, term.operator), self._number(term.right, term.operator)
        if len(self.problems) > before or left is None or right is None:
            return None
        kind = (product_kind if term.operator == "*" else quotient_kind)(left, right)
        if kind is None:
            verb = "multiplied with" if term.operator == "*" else "divided by"
            message = f"{_article(left)} cannot be {verb} {_article(right)} ({syntax.print_term(term)!r})"
            self.add(term.position, message, *_scalings(term, left, right))
        return kind

    def _compared(self, term: syntax.Binary) -> None:
        left, right = self.kind(term.left), self.kind(term.right)
        ordered = term.operator not in ("==", "!=")
        for side, kind in ((term.left, left), (term.right, right)):
            if ordered and kind is not None and kind not in NUMERIC_KINDS:
                shown = f"{syntax.print_term(side)!r} is {_article(kind)}"
                message = f"{term.operator!r} needs numbers or quantities, but {shown}"
                self.add(syntax.start_of(side), message, *_as_equal(term, left, right))
                return
        if not _common(term.left, left, term.right, right)[1]:
            self._unlike(term, term.operator, term.left, left, term.right, right)

    def _unlike(
        self,
        term: syntax.Term,
        what: str,
        left: syntax.Term,
        kind: Kind | None,
        right: syntax.Term,
        other: Kind | None,
    ) -> None:
        one = f"{syntax.print_term(left)!r} is {_article(kind)}"
        two = f"{syntax.print_term(right)!r} is {_article(other)}"
        message = f"{one} and {two}: {what!r} needs two of one kind"
        valid = (*_instead(right, other, kind), *_instead(left, kind, other))
        self.add(term.position, message, *valid)


def _common(
    left: syntax.Term, kind: Kind | None, right: syntax.Term, other: Kind | None
) -> tuple[Kind | None, bool]:
    """Return the one kind of two values, and whether they have one; a plain 0 is of every numeric kind."""
    if kind is None or other is None:
        return kind or other, True
    if _is_zero(left) and other in NUMERIC_KINDS:
        return other, True
    if _is_zero(right) and kind in NUMERIC_KINDS:
        return kind, True
    common = common_kind(kind, other)
    return common, common is not None


def _fits(term: syntax.Term, kind: Kind | None, wanted: Kind) -> bool:
    if kind is None or kind is wanted or (kind, wanted) == (Kind.INTEGER, Kind.NUMBER):
        return True
    return _is_zero(term) and wanted in NUMERIC_KINDS


def _operands(term: syntax.Term, operator: str) -> list[syntax.Term]:
    """Return the operands of a chain of one operator, from left to right."""
    if isinstance(term, syntax.Binary) and term.operator == operator:
        return [*_operands(term.left, operator), *_operands(term.right, operator)]
    return [term]


@dataclass(frozen=True, slots=True)
class _Near:
    """A comparison at an edge of a term.

    Attributes:
        comparison: It.
        inverted: Whether ``not`` stands before it.
    """

    comparison: syntax.Binary
    inverted: bool = False


def _nearest(term: syntax.Term, edge: str) -> _Near | None:
    """Return the comparison at the left or right edge of a term."""
    match term:
        case syntax.Binary(operator="and" | "or", left=left, right=right):
            return _nearest(right if edge == "right" else left, edge)
        case syntax.Binary(operator="==" | "!=" | "<" | "<=" | ">" | ">=" | "in"):
            return _Near(term)
        case syntax.Unary(operator="not", operand=syntax.Binary() as operand):
            found = _nearest(operand, edge)
            return (
                _Near(operand, inverted=True) if found is not None and found.comparison is operand else found
            )
    return None


def _in_text(term: syntax.Term) -> str:
    """Write a term as a part of a text with keys in it."""
    match term:
        case syntax.Binary(operator="+", left=left, right=right):
            return _in_text(left) + _in_text(right)
        case syntax.Constant(text=text):
            return text
        case syntax.Key(key=key):
            return f"${{{key}}}"
    return "..."


def _as_equal(term: syntax.Binary, left: Kind | None, right: Kind | None) -> tuple[str, ...]:
    """Return a comparison of texts in place of one that asks which is greater; none is."""
    sides = [
        f'"{side.text}"'
        if kind is not Kind.TEXT and isinstance(side, syntax.Constant)
        else syntax.print_term(side)
        for side, kind in ((term.left, left), (term.right, right))
    ]
    return tuple(operator.join(sides) for operator in (" == ", " != "))


def _is_zero(term: syntax.Term) -> bool:
    return isinstance(term, syntax.Constant) and term.kind in PLAIN and term.value == 0


def _instead(term: syntax.Term, kind: Kind | None, wanted: Kind | None) -> tuple[str, ...]:
    """Return what could be written in place of a term to make it of the wanted kind."""
    if wanted is None or kind is None:
        return ()
    text = syntax.print_term(term)
    if (
        isinstance(term, syntax.Constant)
        and wanted is Kind.BOOLEAN
        and term.text.lower() in ("true", "false")
    ):
        return (term.text.lower(),)
    if isinstance(term, syntax.Constant) and kind in PLAIN and wanted in UNITS:
        return tuple(f"{text} {unit}" for unit in UNITS[wanted])
    if wanted is Kind.BOOLEAN and isinstance(term, syntax.Constant):
        return (f"$key == {text}",)
    if wanted is Kind.BOOLEAN and kind in NUMERIC_KINDS:
        zero = f"0 {next(iter(UNITS[kind]))}" if kind in UNITS else "0"
        return (f"{text} > {zero}",)
    if wanted is Kind.BOOLEAN:
        return (f'{text} == "{example_of(kind)}"',) if kind is Kind.TEXT else ()
    if kind is Kind.POSE and wanted in (Kind.LENGTH, Kind.ANGLE):
        return (f"{text}.yaw",) if wanted is Kind.ANGLE else (f"{text}.x", f"{text}.y")
    if wanted is Kind.TEXT and isinstance(term, syntax.Constant):
        return (f'"{term.text}"',)
    return ()


def _scalings(term: syntax.Binary, left: Kind, right: Kind) -> tuple[str, ...]:
    if left in PLAIN:
        return ()
    return (f"{syntax.print_term(term.left)} {term.operator} 2", *_FAMILY[term.operator])


_FAMILY = {"*": ("speed * duration",), "/": ("length / duration", "length / length")}


def _article(kind: Kind | None) -> str:
    if kind is Kind.BOOLEAN:
        return "true or false"
    return with_article(kind) if kind is not None else "unknown"
