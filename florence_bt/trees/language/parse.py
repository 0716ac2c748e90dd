"""A mission file: from the source to the model. What a mission refers to is checked elsewhere (``lint``)."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import REQUIRED, Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.trees.language._parse_nodes import NodeParser
from florence_bt.trees.language._reader import Reader
from florence_bt.trees.language._suggestions import keys_meant, section_meant
from florence_bt.trees.language.findings import MAX_FINDINGS
from florence_bt.trees.language.kinds import (
    IDENTIFIER,
    INPUT_KEYS,
    KEY_KEYS,
    MISSION_KEYS,
    ON_RESTART,
    OUTPUT_KEYS,
)
from florence_bt.trees.language.model import Mission, default_of
from florence_bt.trees.language.quantities import (
    NUMERIC_KINDS,
    example_of,
    out_of_range,
    range_of,
    read_value,
    with_article,
)
from florence_bt.trees.language.source import Position, Source, Table, Text, parse_source, read_bytes
from florence_bt.trees.language.values import tree_value

_OTHER_KINDS = {
    "string": "text",
    "str": "text",
    "bool": "boolean",
    "int": "integer",
    "float": "number",
    "double": "number",
    "distance": "length",
    "time": "duration",
    "position": "pose",
    "velocity": "speed",
    "meter": "length",
    "meters": "length",
    "m": "length",
    "cm": "length",
    "second": "duration",
    "seconds": "duration",
    "s": "duration",
    "min": "duration",
    "degree": "angle",
    "degrees": "angle",
    "deg": "angle",
    "rad": "angle",
    "label": "text",
    "room": "text",
    "hotspot": "text",
}
"""What other languages call the types."""


def read_mission(path: Path) -> Mission:
    """Read a mission file.

    Returns:
        The mission; what is wrong with the file's form is in its findings.

    Raises:
        ConfigError: The file cannot be read or is no YAML of the plain kind.
    """
    return _parse(read_bytes(path), path)


def parse_mission(text: str, path: Path) -> Mission:
    """Parse the text of a mission file; ``path`` names it.

    Raises:
        ConfigError: As :func:`read_mission`.
    """
    return _parse(text.encode(), path)


def _parse(data: bytes, path: Path) -> Mission:
    problems: list[ConfigError] = []
    source, reader = parse_source(data, path, problems), Reader(path)
    for error in problems:
        reader.problem(Position(error.line or 1, error.column or 1), error.problem, error.valid)
    if not isinstance(source, Table):
        reader.problem(source.position, "a mission file must be a table", MISSION_KEYS)
        return Mission(path.stem, "", path, findings=tuple(reader.findings))
    for key, _ in source.entries:
        if reader.full:
            break
        if key.text not in MISSION_KEYS:
            valid = section_meant(key.text, MISSION_KEYS)
            reader.problem(key.position, f"unknown key of a mission {key.text!r}", valid)
    description = source.get("description")
    restart = source.get("on_restart")
    inputs, input_positions = read_ports(reader, source.get("inputs"), "an input", INPUT_KEYS)
    outputs, output_positions = read_ports(reader, source.get("outputs"), "an output", OUTPUT_KEYS)
    keys, key_positions = read_ports(reader, source.get("keys"), "a key", KEY_KEYS)
    _check_keys(reader, keys, key_positions, inputs, outputs)
    tree = source.get("tree")
    if tree is None and not _meant(source, "tree"):
        reader.problem(source.position, "the mission has no tree", ["tree: {a node}"])
    return Mission(
        name=_name(reader, source, path),
        description=(reader.text(description, "description") or "") if description is not None else "",
        file=path,
        inputs=inputs,
        outputs=outputs,
        keys=keys,
        on_restart=reader.choice(restart, "on_restart", ON_RESTART, "abort")
        if restart is not None
        else "abort",
        tree=NodeParser(reader).node(tree) if tree is not None else None,
        positions={**key_positions, **output_positions, **input_positions},
        findings=tuple(reader.findings),
        lost=frozenset(keys_meant(tree)) if reader.findings else frozenset(),
        version=hashlib.sha256(data).hexdigest()[:16],
    )


def _meant(table: Table, name: str) -> bool:
    """Whether a key that is unknown, which is noted, was probably meant to be this one."""
    unknown = [key.text for key, _ in table.entries[:MAX_FINDINGS] if key.text not in MISSION_KEYS]
    return any(section_meant(key, MISSION_KEYS)[0].startswith(name) for key in unknown)


def _name(reader: Reader, table: Table, path: Path) -> str:
    source = table.get("mission")
    if source is None and _meant(table, "mission"):
        return path.stem
    if source is None:
        reader.problem(table.position, "the mission has no name", [f"mission: {path.stem}"])
        return path.stem
    name = reader.identifier(source, "mission")
    if name is None:
        return path.stem
    if name.text != path.stem:
        valid = [path.stem] if IDENTIFIER.fullmatch(path.stem) else []
        reader.problem(
            name.position, f"the mission is called {name.text!r} but its file is {path.name}", valid
        )
    return name.text


def read_ports(
    reader: Reader, source: Source | None, what: str, keys: tuple[str, ...]
) -> tuple[dict[str, Port], dict[str, Position]]:
    """A table of ports: of a mission, or of a skill that is declared in a file.

    Args:
        reader: Receives what is wrong.
        source: The table, or None when there is none.
        what: What a port is called in messages, such as ``an input``.
        keys: What a port may say about itself.

    Returns:
        The ports, and where each stands, by name.
    """
    ports, positions = {}, {}
    table = reader.table(source, what.split()[1] + "s")
    for key, item in table.entries if table else ():
        name = reader.identifier(key, what)
        if not isinstance(item, Table):
            written = item.text if isinstance(item, Text) else ""
            kinds = (
                _OTHER_KINDS.get(written, written)
                if _is_kind(written)
                else "|".join(kind.value for kind in Kind)
            )
            valid = [f"{key.text}: {{type: {kinds}}}"]
            reader.problem(key.position, f"{what} is a table with its type", valid)
        elif name is not None:
            positions[name.text] = name.position
            default = item.get("default")
            if default is not None:
                positions[default_of(name.text)] = default.position
            ports[name.text] = _port(reader, name.text, item, keys)
    return ports, positions


def _check_keys(
    reader: Reader,
    keys: Mapping[str, Port],
    positions: Mapping[str, Position],
    inputs: Mapping[str, Port],
    outputs: Mapping[str, Port],
) -> None:
    for name, port in keys.items():
        if name in inputs:
            reader.problem(positions[name], f"{name!r} is an input, which is a key already")
        elif name in outputs and outputs[name].kind is not port.kind:
            kinds = f"{with_article(port.kind)} here and {with_article(outputs[name].kind)} as output"
            reader.problem(positions[name], f"{name!r} is {kinds}", [f"type: {outputs[name].kind.value}"])


def _port(reader: Reader, name: str, fields: Table, keys: tuple[str, ...]) -> Port:
    for key, value in fields.entries:
        if key.text in keys:
            continue
        if key.text in KEY_KEYS and isinstance(value, Text):
            # Outputs are keys too, and these can have a value at the start, and limits.
            message, valid = (
                f"an output has no {key.text}",
                f"keys: {{{name}: {{{key.text}: {value.text}, ...}}}}",
            )
            reader.problem(key.position, message, [valid])
        else:
            reader.unknown(key.position, f"key of {name!r}", key.text, keys)
    kind = _kind(reader, name, fields)
    description = fields.get("description")
    text = reader.text(description, "description") if description is not None else None
    minimum, maximum = (_limit(reader, fields, key, kind) for key in ("min", "max"))
    port = Port(kind, text or "", REQUIRED, minimum, maximum)
    if minimum is not None and maximum is not None and minimum > maximum:
        reader.problem(fields.position, f"the minimum of {name!r} is above its maximum")
    default = fields.get("default")
    if default is None or "default" not in keys:
        return port
    value = _literal(reader, default, kind, f"the default of {name!r}")
    problem = out_of_range(value, port) if value is not None else None
    if problem:
        reader.problem(default.position, f"the default of {name!r}: {problem}", range_of(port))
    return Port(kind, text or "", value, minimum, maximum)


def _kind(reader: Reader, name: str, fields: Table) -> Kind:
    source = fields.get("type")
    known = [kind.value for kind in Kind]
    if source is None:
        if not any(get_close_matches(key.text, ["type"]) for key, _ in fields.entries):
            reader.problem(fields.position, f"{name!r} needs a type", known)
        return Kind.TEXT
    written = source.text if isinstance(source, Text) else "this"
    if written in known:
        return Kind(written)
    if reader.full:
        return Kind.TEXT
    other = _OTHER_KINDS.get(written)
    valid = [other] if other is not None else closest_first(written, known)
    reader.problem(source.position, f"the type of {name!r} cannot be {written!r}", valid)
    return Kind(valid[0])


def _is_kind(text: str) -> bool:
    return text in _OTHER_KINDS or text in {kind.value for kind in Kind}


def _limit(reader: Reader, fields: Table, key: str, kind: Kind) -> Any:
    source = fields.get(key)
    if source is None:
        return None
    if kind not in NUMERIC_KINDS:
        reader.problem(source.position, f"{with_article(kind)} has no {key}")
        return None
    return _literal(reader, source, kind, key)


def _literal(reader: Reader, source: Source, kind: Kind, what: str) -> Any:
    if kind is Kind.POSE and isinstance(source, Table):
        return _pose(reader, source, what)
    if not isinstance(source, Text) or (source.empty and kind is not Kind.TEXT):
        reader.problem(source.position, f"{what} must be a single {kind.value}", [example_of(kind)])
        return None
    try:
        return read_value(source.text, kind)
    except ConfigError as error:
        reader.problem(source.position, f"{what}: {error.problem}", error.valid)
        return None


def _pose(reader: Reader, source: Table, what: str) -> Pose2 | None:
    value = reader.value(source, what)
    if value is None:
        return None
    try:
        pose = tree_value(value, Kind.POSE)
    except ConfigError as error:
        reader.problem(source.position, f"{what}: {error.problem}", error.valid)
        return None
    if isinstance(pose, Pose2):
        return pose
    reader.problem(source.position, f"{what} cannot refer to keys", [example_of(Kind.POSE)])
    return None
