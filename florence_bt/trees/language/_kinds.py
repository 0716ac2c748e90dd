"""The kinds of values where nothing says what they must be."""

from __future__ import annotations

from collections.abc import Mapping

from florence_bt.core.declaration import Kind
from florence_bt.trees.language import model
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.model import Expression, Literal, Value
from florence_bt.trees.language.quantities import guess_value


def kind_of(value: Value, kinds: Mapping[str, Kind]) -> Kind | None:
    """The kind of a value where nothing says what it must be; None when it is not known.

    Args:
        value: The value.
        kinds: The kinds of inputs and keys that are known.
    """
    match value:
        case Literal(text=text, quoted=quoted):
            return Kind.TEXT if quoted else guess_value(text)[0]
        case model.Reference(key=key):
            return kinds.get(key)
        case model.Template():
            return Kind.TEXT
        case model.PoseParts():
            return Kind.POSE
        case Expression():
            return check_kinds(value, kinds).kind


def fits(given: Kind | None, wanted: Kind | None) -> bool:
    """Whether a key of one kind can be given where another is wanted; what is not known fits."""
    return (
        given is None or wanted is None or given is wanted or (given, wanted) == (Kind.INTEGER, Kind.NUMBER)
    )
