"""Reads a YAML file into a pydantic model; what is wrong is told as file:line:column."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from florence_bt.core.errors import ConfigError, closest_first

Model = TypeVar("Model", bound=BaseModel)
Location = Sequence[str | int]


class PositionedYaml:
    """A YAML file together with the place of every value in it.

    Args:
        file: The file to read.

    Raises:
        ConfigError: The file cannot be read, is no YAML, or gives a key twice.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        try:
            root = yaml.compose(file.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"cannot read the file: {error}", file=file) from error
        except yaml.MarkedYAMLError as error:
            raise self._malformed(error) from error
        except yaml.YAMLError as error:
            raise ConfigError(f"no valid YAML: {error}", file=file) from error
        if not isinstance(root, yaml.MappingNode):
            raise ConfigError("the file holds no mapping (`key: value` lines)", file=file, line=1)
        self._root = root
        self._refuse_double_keys(self._root)

    def parse(self, model: type[Model]) -> Model:
        """The file as a model.

        Args:
            model: The pydantic class that says what belongs into the file.

        Raises:
            ConfigError: A value does not fit; the first problem is told with its line.
        """
        try:
            return model.model_validate(self._values())
        except ValidationError as error:
            # A key that does not exist explains a key that is missing, not the other way round.
            first = min(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
            raise self.error(first["loc"], _describe(first)) from error

    def _values(self) -> Any:
        loader = yaml.SafeLoader("")
        try:
            return loader.construct_document(self._root)
        except yaml.MarkedYAMLError as error:
            raise self._malformed(error) from error
        finally:
            loader.dispose()

    def _malformed(self, error: yaml.MarkedYAMLError) -> ConfigError:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (None, None)
        problem = f"no valid YAML: {error.problem or error.context}"
        return ConfigError(problem, file=self.file, line=line, column=column)

    def error(self, location: Location, problem: str, valid: Sequence[str] = ()) -> ConfigError:
        """An error at a value of the file.

        Args:
            location: Keys and indices from the root to the value, e.g. ``("furniture", 3, "model")``.
            problem: What is wrong.
            valid: What would have worked.
        """
        mark = self._mark_at(location)
        return ConfigError(problem, file=self.file, line=mark.line + 1, column=mark.column + 1, valid=valid)

    def unknown(self, location: Location, what: str, wanted: str, known: Sequence[str]) -> ConfigError:
        """An error for a name that does not exist, with the names that do."""
        return self.error(location, f"unknown {what} {wanted!r}", closest_first(wanted, known))

    def _mark_at(self, location: Location) -> yaml.Mark:
        """Where the deepest value on the way to the location begins; its key, when that is a line above."""
        node: yaml.Node = self._root
        mark = node.start_mark
        for step in location:
            pairs: list[tuple[yaml.Node, yaml.Node]] = []
            if isinstance(node, yaml.MappingNode):
                pairs = [(key, value) for key, value in node.value if key.value == str(step)]
            elif isinstance(node, yaml.SequenceNode) and isinstance(step, int):
                pairs = [(value, value) for value in node.value[step : step + 1]]
            if not pairs:
                break
            key, node = pairs[0]
            mark = key.start_mark if key.start_mark.line < node.start_mark.line else node.start_mark
        return mark

    def _refuse_double_keys(self, node: yaml.Node) -> None:
        if isinstance(node, yaml.SequenceNode):
            for child in node.value:
                self._refuse_double_keys(child)
        elif isinstance(node, yaml.MappingNode):
            seen: set[str] = set()
            for key, child in node.value:
                if key.value in seen:
                    mark = key.start_mark
                    problem = f"the key {key.value!r} is given twice"
                    raise ConfigError(problem, file=self.file, line=mark.line + 1, column=mark.column + 1)
                seen.add(key.value)
                self._refuse_double_keys(child)


def _describe(error: ErrorDetails) -> str:
    place = ".".join(str(part) for part in error["loc"])
    return f"{place}: {error['msg'].removeprefix('Value error, ')}"
