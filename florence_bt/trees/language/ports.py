"""Declared inputs, outputs and keys: of a mission, or of a skill that is declared in a file."""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from florence_bt.core.declaration import REQUIRED, Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.trees.language import quantities
from florence_bt.trees.language.literals import read_literal
from florence_bt.trees.language.model import default_of
from florence_bt.trees.language.reader import Reader
from florence_bt.trees.language.vocabulary import KEY_KEYS, LABELLED, by_spelling

_OTHER_KINDS = by_spelling(
    {
        "text": ("string", "str", "label", "room", "hotspot"),
        "boolean": ("bool",),
        "integer": ("int",),
        "number": ("float", "double"),
        "length": ("distance", "meter", "meters", "m", "cm"),
        "duration": ("time", "second", "seconds", "s", "min"),
        "angle": ("degree", "degrees", "deg", "rad"),
        "speed": ("velocity",),
        "pose": ("position",),
        "list of text": ("list", "texts", "strings", "rooms", "array", "text list"),
        "list of pose": ("poses", "list of poses"),
    }
)
"""Other languages' names of the types."""
_OTHER_KEYS = by_spelling(
    {
        "default": ("optional", "value", "initial", "start"),
        "no default, which makes it required": ("required", "mandatory"),
        "min": ("minimum", "at_least", "from"),
        "max": ("maximum", "at_most", "to"),
    }
)
"""Others' words for the keys of a port."""
_SHOWN_KINDS = (*(kind.value for kind in Kind if kind.item is None), Kind.LIST_OF_TEXT.value)
"""The types as they are suggested: one list stands for all."""


def read_ports(
    reader: Reader, source: YamlNode | None, what: str, keys: tuple[str, ...]
) -> tuple[dict[str, Port], dict[str, Position]]:
    """Read a table of ports: of a mission, or of a skill that is declared in a file.

    Args:
        reader: Receives what is wrong.
        source: The table, or None when there is none.
        what: What a port is called in messages, such as ``an input``.
        keys: What a port may say about itself.

    Returns:
        The ports, and where each stands, by name.
    """
    ports, positions = {}, {}
    table = reader.mapping(source, what.split()[1] + "s")
    for key, item in table.entries if table else ():
        name = reader.identifier(key, what)
        if not isinstance(item, YamlMapping):
            written = item.text if isinstance(item, YamlScalar) else ""
            kinds = _OTHER_KINDS.get(written, written) if _is_kind(written) else "|".join(_SHOWN_KINDS)
            valid = [f"{key.text}: {{type: {kinds}}}"]
            reader.error(key.position, f"{what} is a mapping with its type", valid)
        elif name is not None:
            positions[name.text] = name.position
            default = item.get("default")
            if default is not None:
                positions[default_of(name.text)] = default.position
                for number, each in enumerate(default.items if isinstance(default, YamlSequence) else ()):
                    positions[default_of(name.text, number)] = each.position
            ports[name.text] = _port(reader, name.text, item, keys)
    return ports, positions


def _port(reader: Reader, name: str, fields: YamlMapping, keys: tuple[str, ...]) -> Port:
    for key, value in fields.entries:
        if key.text in keys:
            continue
        if key.text in KEY_KEYS and isinstance(value, YamlScalar):
            # Outputs are keys too, and these can have a value at the start, and limits.
            message, valid = (
                f"an output has no {key.text}",
                f"keys: {{{name}: {{{key.text}: {value.text}, ...}}}}",
            )
            reader.error(key.position, message, [valid])
        elif (other := _OTHER_KEYS.get(key.text)) is not None:
            reader.error(key.position, f"unknown key of {name!r} {key.text!r}", [other])
        else:
            reader.unknown(key.position, f"unknown key of {name!r} {key.text!r}", key.text, keys)
    kind = _kind(reader, name, fields)
    description = fields.get("description")
    text = reader.text(description, "description") if description is not None else None
    minimum, maximum = (_limit(reader, fields, key, kind) for key in ("min", "max"))
    names, choices = _names(reader, name, fields, kind), _choices(reader, name, fields, kind)
    port = Port(kind, text or "", REQUIRED, minimum, maximum, names, choices)
    if minimum is not None and maximum is not None and minimum > maximum:
        reader.error(fields.position, f"the minimum of {name!r} is above its maximum")
    default = fields.get("default")
    if default is None or "default" not in keys:
        return port
    value = _literal(reader, default, kind, f"the default of {name!r}")
    problem = quantities.out_of_range(value, port) if value is not None else None
    if problem:
        reader.error(default.position, f"the default of {name!r}: {problem}", quantities.range_of(port))
    return replace(port, default=value)


def _names(reader: Reader, name: str, fields: YamlMapping, kind: Kind) -> str:
    source = fields.get("names")
    if source is None:
        return ""
    if Kind.TEXT not in (kind, kind.item):
        reader.error(source.position, f"only a text names a {' or '.join(LABELLED)}: {name!r} does not")
    return reader.choice(source, "names", LABELLED) or ""


def _choices(reader: Reader, name: str, fields: YamlMapping, kind: Kind) -> tuple[str, ...]:
    source = fields.get("choices")
    if source is None:
        return ()
    if Kind.TEXT not in (kind, kind.item):
        reader.error(source.position, f"only a text has choices: {name!r} is {quantities.with_article(kind)}")
        return ()
    if not isinstance(source, YamlSequence) or not source.items:
        reader.error(source.position, f"the choices of {name!r} are a list", ["choices: [left, right]"])
        return ()
    texts = (reader.text(item, f"a choice of {name!r}") for item in source.items)
    return tuple(dict.fromkeys(text for text in texts if text is not None))


def _kind(reader: Reader, name: str, fields: YamlMapping) -> Kind:
    source = fields.get("type")
    known = [kind.value for kind in Kind]
    if source is None:
        if not any(get_close_matches(key.text, ["type"]) for key, _ in fields.entries):
            reader.error(fields.position, f"{name!r} needs a type", _SHOWN_KINDS)
        return Kind.TEXT
    written = source.text if isinstance(source, YamlScalar) else "this"
    if written in known:
        return Kind(written)
    if reader.full:
        return Kind.TEXT
    other = _OTHER_KINDS.get(written)
    valid = [other] if other is not None else closest_first(written, known)
    reader.error(source.position, f"the type of {name!r} cannot be {written!r}", valid)
    return Kind(valid[0])


def _is_kind(text: str) -> bool:
    return text in _OTHER_KINDS or text in {kind.value for kind in Kind}


def _limit(reader: Reader, fields: YamlMapping, key: str, kind: Kind) -> Any:
    source = fields.get(key)
    if source is None:
        return None
    if kind not in quantities.NUMERIC_KINDS:
        reader.error(source.position, f"{quantities.with_article(kind)} has no {key}")
        return None
    return _literal(reader, source, kind, key)


def _literal(reader: Reader, source: YamlNode, kind: Kind, what: str) -> Any:
    try:
        return read_literal(source, kind)
    except ConfigError as error:
        position = Position(error.line or 1, error.column or 1)
        reader.error(position, f"{what}: {error.problem}", error.valid)
        return None
