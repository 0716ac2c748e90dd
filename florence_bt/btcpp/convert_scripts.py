"""Assignments of a script as ``set`` nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from florence_bt.btcpp.script import (
    Assignment,
    Binary,
    Choice,
    Code,
    Name,
    Number,
    Text,
    Truth,
    names_in,
)
from florence_bt.btcpp.script_terms import Scope, condition_text, kind_of_code, value_text
from florence_bt.btcpp.si_values import si_text
from florence_bt.btcpp.values_in import literal_text, text_value
from florence_bt.core.declaration import Kind


class Keys(Scope, Protocol):
    """A scope in which keys are written too."""

    def key_name(self, foreign: str) -> str:
        """Our name of a key that is written."""


def set_nodes(statements: list[Code], keys: Keys, ignored: Callable[[str], None]) -> list[dict[str, Any]]:
    """The statements of a script as nodes, as few as possible.

    A ``set`` writes all its keys at once, so a statement that reads what an earlier one wrote begins a new
    one.

    Args:
        statements: The script.
        keys: The names.
        ignored: Called with what is left out because it does nothing.

    Raises:
        ConfigError: A part has no equivalent. The error has no place.
    """
    nodes: list[dict[str, Any]] = []
    current: dict[str, Any] = {}
    for code in statements:
        if not isinstance(code, Assignment):
            ignored("a statement that assigns nothing is left out")
            continue
        read = {keys.key(name) for name, written in names_in(code) if not written}
        target = keys.key_name(code.name)
        if isinstance(code.value, Choice):
            current = {}
            nodes.append(_choice(code, code.value, keys))
            continue
        if not current or target in current or read & set(current):
            current = {}
            nodes.append({"set": current})
        current[target] = _written(code, keys)
    return nodes or [{"condition": "true"}]


def _choice(code: Assignment, choice: Choice, keys: Keys) -> dict[str, Any]:
    target = keys.key_name(code.name)
    then, otherwise = (
        {"set": {target: _written(Assignment(code.operator, code.name, value), keys)}}
        for value in (choice.then, choice.otherwise)
    )
    return {"if": condition_text(choice.condition, keys), "then": then, "else": otherwise}


def _written(code: Assignment, keys: Keys) -> Any:
    value = code.value
    if code.operator not in (":=", "="):
        value = Binary(code.operator[0], Name(code.name), value)
    kind = keys.kind(code.name)
    match value:
        case Number(value=number) if kind is Kind.TEXT:
            return text_value(si_text(number), None)
        case Number(value=number):
            return literal_text(number, kind)
        case Truth(value=truth):
            return si_text(truth)
        case Text(value=text):
            return text_value(text, None)
        case Name(name=name):
            key = keys.key(name)
            return f"${key}" if key is not None else text_value(name, None)
    return f"${{{value_text(value, keys, kind or kind_of_code(value, keys))}}}"
