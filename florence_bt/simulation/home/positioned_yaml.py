"""Reads a YAML file into a pydantic model; errors name file:line:column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml

Model = TypeVar("Model", bound=BaseModel)
Location = Sequence[str | int]


class PositionedYaml:
    """A YAML file together with the place of every value in it.

    Args:
        file: The file to read.

    Raises:
        ConfigError: The file cannot be read, is not plain YAML, or gives a key twice.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        root = read_yaml(file)
        if not isinstance(root, YamlMapping):
            raise ConfigError("the file holds no mapping (`key: value` lines)", file=file, line=1)
        self._root = root

    def parse(self, model: type[Model]) -> Model:
        """Read the file as a model.

        Args:
            model: The pydantic class that says what belongs into the file. It types the values: in the file
                all are texts.

        Raises:
            ConfigError: A value does not fit; the error names the first problem with its line.
        """
        try:
            return model.model_validate(_plain(self._root))
        except ValidationError as error:
            # A key that does not exist explains a key that is missing, not the other way round.
            first = min(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
            raise self.error(first["loc"], _describe(first)) from error

    def error(self, location: Location, problem: str, valid: Sequence[str] = ()) -> ConfigError:
        """Make an error at a value of the file.

        Args:
            location: Keys and indices from the root to the value, e.g. ``("furniture", 3, "model")``.
            problem: What is wrong.
            valid: What would have worked.
        """
        place = self._place_of(location)
        return ConfigError(problem, file=self.file, line=place.line, column=place.column, valid=valid)

    def unknown(self, location: Location, what: str, wanted: str, known: Sequence[str]) -> ConfigError:
        """Make an error for a name that does not exist, with the names that do."""
        return self.error(location, f"unknown {what} {wanted!r}", closest_first(wanted, known))

    def _place_of(self, location: Location) -> Position:
        """Return where the deepest value on the way to the location begins; its key, if a line above."""
        node: YamlNode = self._root
        place = node.position
        for step in location:
            if isinstance(node, YamlMapping) and (key := node.key(str(step))) is not None:
                begin, value = key.position, node.get(str(step))
            elif isinstance(node, YamlSequence) and isinstance(step, int) and step < len(node.items):
                begin, value = node.items[step].position, node.items[step]
            else:
                break
            if value is None:
                break
            node = value
            place = begin if begin.line < node.position.line else node.position
        return place


def _plain(source: YamlNode) -> Any:
    match source:
        case YamlScalar():
            return None if source.empty else source.text
        case YamlSequence():
            return [_plain(item) for item in source.items]
        case YamlMapping():
            return {key.text: _plain(value) for key, value in source.entries}


def _describe(error: ErrorDetails) -> str:
    place = ".".join(str(part) for part in error["loc"])
    return f"{place}: {error['msg'].removeprefix('Value error, ')}"
