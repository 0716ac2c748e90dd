"""Reads a YAML file into a pydantic model; errors name file:line:column."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.core.yaml_reader import YamlReader

Model = TypeVar("Model", bound=BaseModel)
Location = Sequence[str | int]
"""Keys and indices from the root of a file to a value, e.g. ``("furniture", 3, "model")``."""


class ModelReader(YamlReader):
    """Reads a file whose keys and values a pydantic model describes.

    Args:
        file: The file to read.

    Raises:
        ConfigError: The file cannot be read, is not plain YAML, or gives a key twice.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._root = read_yaml(file)
        if not isinstance(self._root, YamlMapping):
            raise self.error("the file holds no mapping (`key: value` lines)", Position())

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
            if first["type"] == "extra_forbidden":
                raise self._unknown_key(model, first["loc"]) from error
            raise self.error_at(first["loc"], _describe(first)) from error

    def _unknown_key(self, model: type[BaseModel], location: Location) -> ConfigError:
        """Make the error to raise about a key that a model has not."""
        *above, key = location
        nodes = list(self._way_to(above))
        there = nodes[-1].key(str(key)) if isinstance(nodes[-1], YamlMapping) else None
        problem = f"{'.'.join(map(str, location))}: there is no key {key!r}"
        return self.unknown(problem, there or nodes[-1], str(key), _keys_at(model, location))

    def error_at(self, location: Location, problem: str, valid: Sequence[str] = ()) -> ConfigError:
        """Make the error to raise about a value of the file."""
        return self.error(problem, self._place_of(location), valid)

    def unknown_at(self, location: Location, what: str, name: str, known: Collection[str]) -> ConfigError:
        """Make the error to raise about a name that does not exist, with the names that do."""
        return self.unknown(f"unknown {what} {name!r}", self._place_of(location), name, known)

    def _place_of(self, location: Location) -> Position:
        """Return where the deepest value on the way to the location begins; its key, if a line above."""
        *above, node = self._way_to(location)
        holder = above[-1] if above else None
        key = holder.key(str(location[len(above) - 1])) if isinstance(holder, YamlMapping) else None
        return key.position if key is not None and key.position.line < node.position.line else node.position

    def _way_to(self, location: Location) -> Iterator[YamlNode]:
        """Yield what lies on the way from the root to a value, as far as it is there."""
        node: YamlNode | None = self._root
        for step in (*location, None):
            if node is None:
                return
            yield node
            if isinstance(node, YamlMapping):
                node = node.get(str(step))
            elif isinstance(node, YamlSequence) and isinstance(step, int) and step < len(node.items):
                node = node.items[step]
            else:
                return


def _plain(source: YamlNode) -> Any:
    match source:
        case YamlScalar():
            return None if source.empty else source.text
        case YamlSequence():
            return [_plain(item) for item in source.items]
        case YamlMapping():
            return {key.text: _plain(value) for key, value in source.entries}


def _keys_at(model: type[BaseModel], location: Location) -> list[str]:
    """Return the keys that a model has where a value stands."""
    for step in location[:-1]:
        field = model.model_fields.get(str(step))
        model = next(_models_in(field.annotation), model) if field is not None else model
    return [field.alias or name for name, field in model.model_fields.items()]


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)


def _describe(error: ErrorDetails) -> str:
    place = ".".join(str(part) for part in error["loc"])
    return f"{place}: {error['msg'].removeprefix('Value error, ')}"
