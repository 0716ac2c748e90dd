"""Changes single values in a robot's configuration; comments and everything else stay as they are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import replace_files
from florence_bt.core.plain_yaml import EmptyFile, YamlMapping, YamlScalar, parse_yaml
from florence_bt.core.text_files import read_bytes


def set_numbers(file: Path, node: str, values: Mapping[str, float]) -> Path:
    """Write parameters of one node into a configuration.

    Args:
        file: The configuration; a copy of it stays beside it, with ``.bak`` after its name.
        node: The node, which gets a section when it has none.
        values: Parameter -> value.

    Returns:
        The copy of the file as it was.

    Raises:
        ConfigError: The file cannot be read or written, or the node's section is not a mapping.
    """
    before = read_bytes(file)
    text = before.decode("utf-8")
    for name, value in values.items():
        text = with_value(text, file, node, name, f"{value:.6g}")
    backup = file.with_name(file.name + ".bak")
    try:
        replace_files({backup: before, file.resolve(): text.encode()})
    except OSError as error:
        raise ConfigError(
            f"cannot be written: {error.strerror}", file=file, valid=["a file in a folder you may write to"]
        ) from error
    return backup


def with_value(text: str, file: Path, node: str, name: str, value_text: str) -> str:
    """Return the text of a configuration with another value of one parameter.

    Args:
        text: The configuration.
        file: Its file, named in errors.
        node: The node, which gets a section when it has none.
        name: The parameter.
        value_text: The value as YAML.

    Raises:
        ConfigError: The text cannot be read, or the node's section is not a mapping.
    """
    lines = text.splitlines(keepends=True)
    try:
        source = parse_yaml(text.encode(), file)
    except EmptyFile:
        return f"{_ended(text)}{node}:\n  {name}: {value_text}\n"
    if not isinstance(source, YamlMapping):
        raise ConfigError("must map node names to their parameters", file=file, valid=[f"{node}: {{...}}"])
    for key, section in source.entries:
        if key.text.removeprefix("/") != node:
            continue
        if isinstance(section, YamlMapping):
            section = section.get("ros__parameters") or section
        if not isinstance(section, YamlMapping):
            raise ConfigError(
                f"{node} must map parameter names to values",
                file=file,
                line=key.position.line,
                column=key.position.column,
                valid=[f"{node}:\n  {name}: {value_text}"],
            )
        for parameter, value in section.entries:
            if parameter.text == name and isinstance(value, YamlScalar):
                line, start = value.position.line - 1, value.position.column - 1
                width = len(value.text) + 2 * value.quoted
                lines[line] = lines[line][:start] + value_text + lines[line][start + width :]
                return "".join(lines)
        return _inserted(lines, section, f"{name}: {value_text}")
    return f"{_ended(text)}\n{node}:\n  {name}: {value_text}\n"


def _inserted(lines: list[str], section: YamlMapping, entry: str) -> str:
    """Add an entry before the first one of a section, which may be on one line in braces."""
    place = section.entries[0][0].position if section.entries else section.position
    line, start = place.line - 1, place.column - 1
    in_braces = lines[line][:start].strip() != ""
    if in_braces:
        comma = ", " if section.entries else ""
        inside = start if section.entries else start + 1
        lines[line] = lines[line][:inside] + entry + comma + lines[line][inside:]
    else:
        lines.insert(line, " " * start + entry + "\n")
    return "".join(lines)


def _ended(text: str) -> str:
    return text if not text or text.endswith("\n") else text + "\n"
