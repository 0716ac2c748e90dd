"""Values of a mission as scripts of BehaviorTree.CPP."""

from __future__ import annotations

from florence_bt.btcpp.script_terms import Inexpressible, script_of, script_text
from florence_bt.btcpp.si_values import script_number
from florence_bt.core.declaration import Kind
from florence_bt.trees.language import model
from florence_bt.trees.language.expressions.syntax import Constant, Term, parts_of
from florence_bt.trees.language.model import Literal, Value
from florence_bt.trees.language.quantities import UNITS, guess_value


def set_script(values: tuple[tuple[Literal, Value], ...]) -> str:
    """The values of a ``set`` as assignments.

    Raises:
        Inexpressible: A value is a pose or a text with keys, or reads a key that another one writes.
    """
    written = {key.text for key, _ in values}
    for _, value in values:
        if written & {reference.key for reference in model.references(value)} and len(values) > 1:
            raise Inexpressible("the values of a set are all found before any is written")
    return "; ".join(f"{key.text} := {value_script(value)}" for key, value in values)


def value_script(value: Value) -> str:
    """A value as the right side of an assignment.

    Raises:
        Inexpressible: It is a pose or a text with keys.
    """
    match value:
        case Literal(text=text, quoted=True):
            return script_text(text)
        case Literal(text=text):
            kind, guessed = guess_value(text)
            return script_text(text) if kind is Kind.TEXT else script_number(guessed)
        case model.Reference(key=key):
            return key
        case model.Expression(term=term):
            return script_of(term)
    raise Inexpressible("a script of BehaviorTree.CPP has no poses, and puts no keys into texts")


def needs_mark(value: Value) -> bool:
    """Whether a script does not tell the whole value, because its numbers have no units."""
    match value:
        case Literal(text=text, quoted=quoted):
            return not quoted and guess_value(text)[0] in (*UNITS, Kind.NUMBER)
        case model.Expression(term=term):
            return term_needs_mark(term)
    return False


def term_needs_mark(term: Term) -> bool:
    """Whether a script does not tell the whole expression."""
    if isinstance(term, Constant):
        return term.kind in UNITS or term.kind is Kind.NUMBER
    return any(term_needs_mark(part) for part in parts_of(term))
