"""Values of which only is known where they come from, and what was decided about them.

A comparison with such a value can be true and false: both are explored, and what was decided stays so as long
as the value is there. Values compute as terms: two equal terms are equal, whatever they are. What is known of
a term that is compared with constants is kept as limits, so that nothing is below 1 and above 2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from florence_bt.assurance.choices import Choices
from florence_bt.assurance.snapshot import Unchanging
from florence_bt.behaviours.expressions import OPERATORS, Unknown
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.geometry import Pose2

Term = tuple[Any, ...]
"""``("?", number)`` for a value that something gave, ``("=", value)`` for a constant, and else the name of an
operation with the terms that it is made of."""
Atom = tuple[str, Term, Term]
"""``<`` or ``==`` of two terms."""
_NEGATED = {"!=": "==", ">=": "<", "<=": "<"}
_MAX_DEPTH = 8
"""Terms that are built higher become new values: what is known of them is forgotten."""
_NOT_NEGATIVE = frozenset({"distance", "abs", "count"})
_WITNESSES: dict[Kind, Any] = {
    Kind.TEXT: "something",
    Kind.BOOLEAN: True,
    Kind.INTEGER: 1,
    Kind.ANGLE: 0.5,
    Kind.POSE: Pose2(1.0, 0.0, 0.0),
}


class Facts(Unchanging):
    """The decisions about values that are not known.

    Args:
        choices: Decides what is open.

    Attributes:
        decided: Comparison -> whether it holds.
        count: How many values there were.
        taken_as: What was taken as it stands because its value is needed, such as a number of rounds.
    """

    def __init__(self, choices: Choices) -> None:
        self.decided: dict[Atom, bool] = {}
        self.count = 0
        self.choices: Choices = choices
        self.texts: dict[Term, tuple[str, ...]] = {}

    def new(self, kind: Kind, witness: Any, choices: tuple[str, ...] = ()) -> Any:
        """Make a value that is not known.

        Args:
            kind: What it is; one of no list and no boolean.
            witness: What stands for it where its value is needed.
            choices: The texts that it can be; empty for any.
        """
        self.count += 1
        term: Term = ("?", self.count)
        if choices:
            self.texts[term] = choices
        return unknown(self, term, witness)

    def holds(self, name: str, left: Any, right: Any) -> bool:
        """Decide a comparison; one that was decided before, or follows, stays as it is."""
        if name in (">", "<="):
            left, right = right, left
        holds = self._decide("==" if name in ("==", "!=") else "<", term_of(left), term_of(right))
        return holds is not (name in _NEGATED)

    def _decide(self, name: str, left: Term, right: Term) -> bool:
        if left == right:
            return name == "=="
        if name == "==" and repr(right) < repr(left):
            left, right = right, left
        atom = (name, left, right)
        known = self.decided.get(atom)
        if known is None:
            known = self._follows(name, left, right)
        if known is None:
            known = self.choices.take(2) == 0
            self.decided[atom] = known
        return known

    def _follows(self, name: str, left: Term, right: Term) -> bool | None:
        """Return what follows from what was decided; None: nothing does."""
        if name == "<" and (self.decided.get(("<", right, left)) or self.decided.get(_equal(left, right))):
            return False
        if name == "==" and (self.decided.get(("<", left, right)) or self.decided.get(("<", right, left))):
            return False
        for term, other in ((left, right), (right, left)):
            if other[0] == "=" and term[0] != "=":
                if isinstance(other[1], str):
                    return self._text_follows(term, other[1])
                if isinstance(other[1], (int, float)):
                    return self._limits(term).answer(name, float(other[1]), term is left)
        return None

    def _text_follows(self, term: Term, text: str) -> bool | None:
        denied = set()
        for (name, left, right), holds in self.decided.items():
            other = right if left == term else left if right == term else None
            if name == "==" and other is not None and other[0] == "=":
                if holds:
                    return bool(other[1] == text)
                denied.add(other[1])
        possible = set(self.texts.get(term, ())) - denied
        if term in self.texts:
            return text in possible and (True if possible == {text} else None)
        return None

    def _limits(self, term: Term) -> _Limits:
        limits = _Limits(0.0 if term[0] in _NOT_NEGATIVE else -math.inf)
        for (name, left, right), holds in self.decided.items():
            if left == term and right[0] == "=":
                limits.learn(name, float(right[1]), below=True, holds=holds)
            elif right == term and left[0] == "=":
                limits.learn(name, float(left[1]), below=False, holds=holds)
        return limits

    def forget(self, live: set[Term]) -> None:
        """Forget what was decided about values that nothing holds any more."""
        for atom in [atom for atom in self.decided if not set(symbols_of(atom)) <= live]:
            del self.decided[atom]
        for term in [term for term in self.texts if term not in live]:
            del self.texts[term]


def _equal(left: Term, right: Term) -> Atom:
    return ("==", right, left) if repr(right) < repr(left) else ("==", left, right)


class _Limits:
    """The limits of a number, as far as they follow from comparisons with constants."""

    def __init__(self, low: float) -> None:
        self.low, self.high = low, math.inf
        self.low_open = self.high_open = False

    def learn(self, name: str, constant: float, *, below: bool, holds: bool) -> None:
        """Take a comparison: ``term < constant`` (below) or ``constant < term``, or equality."""
        if name == "==":
            if holds:
                self._at_least(constant, False)
                self._at_most(constant, False)
        elif below is holds:
            self._at_most(constant, below)
        else:
            self._at_least(constant, not below)

    def answer(self, name: str, constant: float, below: bool) -> bool | None:
        """Return whether a comparison holds for every number within the limits, or for none; else None."""
        above = constant > self.high or (constant == self.high and self.high_open)
        under = constant < self.low or (constant == self.low and self.low_open)
        if name == "==":
            return False if above or under else None
        if below:  # term < constant
            if above or constant > self.high:
                return True
            return False if constant <= self.low else None
        if under or constant < self.low:
            return True
        return False if constant >= self.high else None

    def _at_least(self, constant: float, is_open: bool) -> None:
        if constant > self.low or (constant == self.low and is_open):
            self.low, self.low_open = constant, is_open

    def _at_most(self, constant: float, is_open: bool) -> None:
        if constant < self.high or (constant == self.high and is_open):
            self.high, self.high_open = constant, is_open


class _Known(Unknown):
    """The base of all values that are not known."""

    __slots__ = ()

    facts: Facts
    term: Term

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Known) and other.term == self.term

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self.term)

    def operate(self, name: str, operands: Sequence[Any]) -> Any:
        """Decide a comparison; of everything else make a term."""
        if name in ("<", ">", "<=", ">=", "==", "!="):
            return self.facts.holds(name, *operands)
        values = [known_part(each) for each in operands]
        if name == "in" and not isinstance(operands[1], _Known):
            return bool(operands[1]) and self.facts.holds("==", _Truth(self._term("in", operands)), 1)
        if name in ("in", "list", "item", "count", "not"):
            return OPERATORS[name](*(operands if name == "list" else values))
        if name == "/" and isinstance(operands[1], _Known) and self.facts.holds("==", operands[1], 0.0):
            raise ZeroDivisionError
        term = self._term(name, operands)
        if name == "distance" and term[1] == term[2]:
            return 0.0
        try:
            witness = OPERATORS[name](*values)
        except ArithmeticError:
            witness = 1.0
        return unknown(self.facts, self._bounded(term), witness)

    def _term(self, name: str, operands: Sequence[Any]) -> Term:
        return (name, *map(term_of, operands))

    def _bounded(self, term: Term) -> Term:
        if _depth(term) <= _MAX_DEPTH:
            return term
        self.facts.count += 1
        return ("?", self.facts.count)


class _Truth:
    """A truth value that is not known: a number, which is 1 when it is so."""

    def __init__(self, term: Term) -> None:
        self.term = term


class _Int(_Known, int):
    facts: Facts
    term: Term


class _Float(_Known, float):
    facts: Facts
    term: Term


class _Text(_Known, str):
    facts: Facts
    term: Term


class _Pose(_Known, Pose2):
    facts: Facts
    term: Term


def unknown(facts: Facts, term: Term, witness: Any) -> Any:
    """Make the value for a term.

    Args:
        facts: What is decided about it.
        term: Where it comes from.
        witness: What stands for it where its value is needed; its type is the type of the value.
    """
    made: Any
    if isinstance(witness, Pose2):
        made = _Pose(witness.x, witness.y, witness.yaw)
    elif isinstance(witness, str):
        made = _Text(witness)
    else:
        made = _Int(witness) if isinstance(witness, int) else _Float(witness)
    for name, value in (("facts", facts), ("term", term)):
        object.__setattr__(made, name, value)
    return made


def is_unknown(value: Any) -> bool:
    """Tell whether a value is not known."""
    return isinstance(value, _Known)


def term_of(value: Any) -> Term:
    """Return the term of a value."""
    if isinstance(value, tuple):
        return ("list", *map(term_of, value))
    return value.term if isinstance(value, (_Known, _Truth)) else ("=", value)


def known_part(value: Any) -> Any:
    """Return what stands for a value where it is needed."""
    match value:
        case _Pose():
            return Pose2(value.x, value.y, value.yaw)
        case _Text():
            return str.__str__(value)
        case _Int():
            return int.__int__(value)
        case _Float():
            return float.__float__(value)
        case tuple():
            return tuple(known_part(each) for each in value)
    return value


def witness_for(port: Port) -> Any:
    """Return a value that fits a port."""
    if not port.required and port.default is not None:
        return port.default
    if port.kind.item is not None:
        return ()
    if port.choices:
        return port.choices[0]
    value = _WITNESSES.get(port.kind, 1.0)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        low, high = port.minimum, port.maximum
        value = max(value, low) if low is not None else value
        value = min(value, high) if high is not None else value
    return value


def symbols_in(value: Any) -> Iterator[Term]:
    """Yield what a value is made of that is not known."""
    if isinstance(value, _Known):
        yield from symbols_of(value.term)
    elif isinstance(value, tuple):
        for each in value:
            yield from symbols_in(each)


def symbols_of(term: Term) -> Iterator[Term]:
    """Yield what a term, or a comparison, is made of that is not known."""
    if term[0] == "?":
        yield term
    elif term[0] != "=":
        for part in term[1:]:
            yield from symbols_of(part)


def _depth(term: Term) -> int:
    return 0 if term[0] in ("?", "=") else 1 + max(map(_depth, term[1:]))
