"""Interfaces from their definitions, without a build: classes with the fields, types and constants of ROS.

For tests of what reads and fills messages by their fields. They cannot be sent.
"""

from __future__ import annotations

import ast
import re
import sys
from types import ModuleType
from typing import Any

import pytest

_TYPES = {"bool": "boolean", "float32": "float", "float64": "double", "byte": "octet", "char": "uint8"}
_PLAIN = {
    *_TYPES,
    "string",
    "wstring",
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
}
_PARTS = {"msg": ("",), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}
_LINE = re.compile(
    r"(?P<item>[\w/]+)(?:<=(?P<text>\d+))?(?:\[(?P<array>(?:<=)?\d*)\])?\s+(?P<name>\w+)\s*(?:=\s*(?P<value>\S+))?"
)


def make_interfaces(patch: pytest.MonkeyPatch, package: str, **definitions: str) -> None:
    """Install a package for one test.

    Args:
        patch: Takes it away again.
        package: Its name.
        definitions: Such as ``srv_SetDose`` -> its text; a message stands before those that use it.
    """
    modules = {kind: ModuleType(f"{package}.{kind}") for kind in _PARTS}
    patch.setitem(sys.modules, package, ModuleType(package))
    for module in modules.values():
        patch.setitem(sys.modules, module.__name__, module)
    for title, text in definitions.items():
        kind, _, name = title.partition("_")
        parts = dict(zip(_PARTS[kind], re.split(r"^---$", text, flags=re.MULTILINE), strict=True))
        made = {
            part: _message(package, kind, f"{name}_{part}" if part else name, each)
            for part, each in parts.items()
        }
        whole = made[""] if kind == "msg" else type(name, (), made)
        setattr(modules[kind], name, whole)


def _message(package: str, kind: str, name: str, text: str) -> type:
    fields: dict[str, str] = {}
    constants: dict[str, Any] = {}
    for line in filter(None, (each.partition("#")[0].strip() for each in text.splitlines())):
        match = _LINE.fullmatch(line)
        assert match is not None, line
        if match["value"] is not None:
            constants[match["name"]] = ast.literal_eval(match["value"])
        else:
            fields[match["name"]] = _written(package, match["item"], match["text"], match["array"])

    def begin(self: Any) -> None:
        for field, written in fields.items():
            setattr(self, field, _default(written))

    listed = classmethod(lambda cls: dict(fields))
    content = {"__init__": begin, "get_fields_and_field_types": listed, "__module__": f"{package}.{kind}._it"}
    return type(f"Metaclass_{name}", (type,), constants)(name, (), content)


def _written(package: str, item: str, bound: str | None, array: str | None) -> str:
    kind = _TYPES.get(item, item) if item in _PLAIN else item if "/" in item else f"{package}/{item}"
    kind += f"<{bound}>" if bound else ""
    if array is None:
        return kind
    if array.isdigit():
        return f"{kind}[{array}]"
    return f"sequence<{kind}, {array[2:]}>" if array else f"sequence<{kind}>"


def _default(written: str) -> Any:
    fixed = re.fullmatch(r"(.+)\[(\d+)\]", written)
    if fixed is not None:
        return [_default(fixed[1]) for _ in range(int(fixed[2]))]
    if written.startswith("sequence<"):
        return []
    if "/" in written:
        package, name = written.split("/")
        module = sys.modules.get(f"{package}.msg") or __import__(f"{package}.msg", fromlist=[name])
        return getattr(module, name)()
    return (
        ""
        if "string" in written
        else False
        if written == "boolean"
        else 0.0
        if written in ("float", "double")
        else 0
    )
