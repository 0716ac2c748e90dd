"""Literals of XML attributes as values of a mission file."""

from __future__ import annotations

from typing import Any

from florence_bt.btcpp.si_values import guess_kind, quantity_text, read_number, read_truth, si_text
from florence_bt.btcpp.vocabulary import PREFIX
from florence_bt.btcpp.written import Quoted, read_flow
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.quantities import UNITS, guess_value, read_value


def written_value(text: str, kind: Kind | None) -> tuple[Any, str]:
    """A literal as it is written in a mission.

    Args:
        text: The attribute.
        kind: What it must be; None when nothing is known.

    Returns:
        The value, and what is wrong with it (empty when nothing is). A wrong value is kept as a text.
    """
    if text.startswith(PREFIX):
        try:
            return read_flow(text.removeprefix(PREFIX)), ""
        except ConfigError as error:
            return text_value(text, kind), error.problem
    if text.startswith("json:"):
        return text_value(text, kind), "a value in JSON is kept as a text"
    match kind or guess_kind(text):
        case Kind.TEXT:
            return text_value(text, kind), ""
        case Kind.BOOLEAN:
            truth = read_truth(text)
            return (si_text(truth), "") if truth is not None else _wrong(text, Kind.BOOLEAN)
        case Kind.POSE:
            return _pose(text)
        case wanted:
            number = read_number(text)
            if number is not None and not (wanted is Kind.INTEGER and isinstance(number, float)):
                return literal_text(number, wanted), ""
            return _quantity(text, wanted)


def literal_text(number: int | float, kind: Kind | None) -> str:
    """A number with the unit of its kind."""
    if kind in UNITS:
        return quantity_text(float(number), kind)
    text = si_text(number)
    whole = text.lstrip("-").isdecimal()
    return f"{text}.0" if whole and (kind is Kind.NUMBER or isinstance(number, float)) else text


def text_value(text: str, kind: Kind | None) -> str:
    """A text; in quotes where it would be read as something else, and with its dollar signs doubled."""
    escaped = text.replace("$", "$$")
    return (
        escaped
        if (kind is Kind.TEXT or _reads_as_text(text))
        and escaped.strip() == escaped
        and escaped not in ("", "~", "null")
        else Quoted(escaped)
    )


def _reads_as_text(text: str) -> bool:
    try:
        return guess_value(text)[0] is Kind.TEXT
    except ConfigError:  # a number that is too large
        return False


def _quantity(text: str, kind: Kind) -> tuple[Any, str]:
    """A value that is written with its unit, as people do."""
    try:
        read_value(text, kind)
    except ConfigError:
        return _wrong(text, kind)
    return text.strip(), ""


def _pose(text: str) -> tuple[Any, str]:
    numbers = [read_number(part) for part in text.split(";")]
    if len(numbers) != 3 or None in numbers:
        return _wrong(text, Kind.POSE)
    kinds = (("x", Kind.LENGTH), ("y", Kind.LENGTH), ("yaw", Kind.ANGLE))
    pairs = zip(kinds, numbers, strict=True)
    return {name: literal_text(number, kind) for (name, kind), number in pairs if number is not None}, ""


def _wrong(text: str, kind: Kind) -> tuple[Any, str]:
    return text_value(text, None), f"{text!r} is no {kind.value}"
