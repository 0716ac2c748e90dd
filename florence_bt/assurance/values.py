"""Finds values for what was not known, so that everything is as it was decided on a way."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping
from typing import Any

from florence_bt.assurance.unknown import Atom, Term, known_part, symbols_in, symbols_of, term_of
from florence_bt.behaviours.expressions import OPERATORS
from florence_bt.core.geometry import Pose2

_TRIALS = 20_000
"""How many combinations of values are tried."""
_STEPS = (0.0, 0.05, 0.25, 0.5, 1.0, 2.0, 5.0)
"""How far from a constant values are tried, either way."""

Values = Mapping[Term, Any]


def find_values(decided: Mapping[Atom, bool], values: Iterable[Any]) -> Values | None:
    """Find values with which every comparison is as it was decided.

    Args:
        decided: Comparison -> whether it holds.
        values: The values of which the types count, those that are not known among them.

    Returns:
        Symbol -> its value; None when none were found.
    """
    witnesses: dict[Term, Any] = {}
    for value in values:
        for item in value if isinstance(value, tuple) else (value,):
            term = term_of(item)
            if term[0] == "?":
                witnesses[term] = known_part(item)
    needed = {symbol for atom in decided for part in atom[1:] for symbol in symbols_of(part)}
    if not needed <= witnesses.keys():
        return None
    numbers, texts = _constants(decided)
    dice = random.Random(0)
    for trial in range(_TRIALS):
        tried = dict(witnesses)
        if trial:
            for symbol in sorted(needed):
                tried[symbol] = _other(witnesses[symbol], numbers, texts, dice)
        if all(_holds(atom, tried) is holds for atom, holds in decided.items()):
            return tried
    return None


def known(value: Any, values: Values) -> Any:
    """Return a value with what was found for what was not known."""
    if isinstance(value, tuple):
        return tuple(known(each, values) for each in value)
    return _value(term_of(value), values) if any(True for _ in symbols_in(value)) else known_part(value)


def _constants(decided: Iterable[Atom]) -> tuple[list[float], list[str]]:
    numbers, texts = {0.0, 1.0}, {"something"}

    def look(term: Term) -> None:
        if term[0] == "=":
            if isinstance(term[1], str):
                texts.add(term[1])
            elif isinstance(term[1], (int, float)):
                numbers.add(float(term[1]))
        elif term[0] != "?":
            for part in term[1:]:
                look(part)

    for _, left, right in decided:
        look(left)
        look(right)
    return sorted(numbers), sorted(texts)


def _other(witness: Any, numbers: list[float], texts: list[str], dice: random.Random) -> Any:
    """Return another value of the type of a witness."""
    if isinstance(witness, str):
        return dice.choice(texts)
    number = dice.choice(numbers) + dice.choice((-1.0, 1.0)) * dice.choice(_STEPS)
    if isinstance(witness, Pose2) and dice.random() < 0.5:
        return Pose2(round(number, 3), 0.0, 0.0)
    if isinstance(witness, Pose2):
        reach = dice.choice((0.1, 1.0, 3.0))
        x, y, yaw = (round(dice.uniform(-most, most), 2) for most in (reach, reach, 3.0))
        return Pose2(x, y, yaw)
    return round(number) if isinstance(witness, int) else round(number, 3)


def _holds(atom: Atom, values: Values) -> bool | None:
    name, left, right = atom
    try:
        return bool(OPERATORS[name](_value(left, values), _value(right, values)))
    except (ArithmeticError, TypeError, ValueError):
        return None


def _value(term: Term, values: Values) -> Any:
    match term[0]:
        case "?":
            return values[term]
        case "=":
            return term[1]
        case "list":
            return tuple(_value(part, values) for part in term[1:])
    result = OPERATORS[term[0]](*(_value(part, values) for part in term[1:]))
    return int(result) if isinstance(result, bool) else result
