"""Reads typed values of a YAML file; an error has file, line, column and what would have worked.

Every file that a person writes is read by it: settings, maps, hotspots, homes, flats, and, with what is wrong
collected in a list, missions, skills and scenarios (:class:`~florence_bt.trees.language.reader.WordReader`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.core.units import QUANTITY

T = TypeVar("T")
_COUNT = re.compile(r"\d{1,9}")
ValueReader = Callable[[YamlNode, str], Any]
"""Reads the value of a key that it names in errors."""


_BOOLEAN_WORDS = {
    "yes": "true",
    "on": "true",
    "true": "true",
    "no": "false",
    "off": "false",
    "false": "false",
}
"""People's words for true and false."""


def missing_key(name: str) -> str:
    """Return the problem of a key that must be there and is not."""
    return f"{name!r} is missing"


class YamlReader:
    """Reads parts of one file.

    Args:
        file: The file, named in errors.
        problems: Receives what is wrong and can be passed over: keys that are not known, or missing, and what
            :meth:`value` reads. Without it the first of them is raised.
    """

    def __init__(self, file: Path, problems: list[ConfigError] | None = None) -> None:
        self.file = file
        self._problems = problems

    def note(self, error: ConfigError) -> None:
        """Note something that is wrong and can be passed over."""
        if self._problems is None:
            raise error
        self._problems.append(error)

    def value(self, entries: Mapping[str, YamlNode], name: str, read: ValueReader, default: T) -> T:
        """Read the value of a key; the default when it is not there, and when it is wrong, which is noted."""
        if name not in entries:
            return default
        try:
            value: T = read(entries[name], name)
        except ConfigError as error:
            self.note(error)
            return default
        return value

    def mapping(
        self, source: YamlNode, names: Collection[str], needed: Sequence[str] = ()
    ) -> dict[str, YamlNode]:
        """Read the values of a mapping by key.

        Args:
            source: The part of the file.
            names: The keys that are known here.
            needed: Those of them that must be there.
        """
        if not isinstance(source, YamlMapping):
            raise self.error("a mapping is needed here", source, valid=names)
        for key, _ in source.entries:
            if key.text not in names:
                self.note(self.unknown(f"{key.text!r} is not known here", key, key.text, names))
        for name in needed:
            if source.key(name) is None:
                self.note(self.error(missing_key(name), source, valid=[f"{name}: ..."]))
        return {key.text: value for key, value in source.entries if key.text in names}

    def values(self, entries: Mapping[str, YamlNode], readers: Mapping[str, ValueReader]) -> dict[str, Any]:
        """Read the typed values of a mapping by key.

        Args:
            entries: What :meth:`mapping` found.
            readers: What reads the value of each key, called with the value and the key.
        """
        return {name: readers[name](value, name) for name, value in entries.items()}

    def sequence(self, source: YamlNode, name: str) -> tuple[YamlNode, ...]:
        """Read the items of a list."""
        if not isinstance(source, YamlSequence):
            raise self.error(f"{name} must be a list", source)
        return source.items

    def text(self, source: YamlNode, name: str) -> str:
        """Read a text that is not empty, as it is written."""
        if not isinstance(source, YamlScalar) or source.empty or not source.text.strip():
            raise self.error(f"{name} must be text", source, valid=[f"{name}: ..."])
        return source.text

    def choice(self, source: YamlNode, name: str, known: Collection[str]) -> str:
        """Read one of a few words; an error names the nearest, and of a few that are like none all."""
        text = written(source)
        if text in known:
            return text
        meant = _BOOLEAN_WORDS.get(text.lower(), "")
        near = (meant,) if meant in known else closest_first(text, known)
        raise self.error(f"{name} cannot be {text!r}", source, near if len(near) < len(known) else known)

    def flag(self, source: YamlNode, name: str) -> bool:
        """Read true or false."""
        return self.choice(source, name, ("true", "false")) == "true"

    def count(self, source: YamlNode, name: str) -> int:
        """Read a whole number of at least 0."""
        text = self.text(source, name)
        if not _COUNT.fullmatch(text):
            raise self.error(f"{name} must be a whole number of at least 0", source, ["1"])
        return int(text)

    def number(self, source: YamlNode, name: str, valid: Iterable[str] = ()) -> float:
        """Read a finite number; ``valid`` is what would have worked."""
        text = source.text if isinstance(source, YamlScalar) else ""
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self.error(f"{name} must be a finite number, not {text!r}", source, valid)
        return number

    def quantity(
        self, source: YamlNode, name: str, units: Mapping[str, float], valid: Sequence[str]
    ) -> float:
        """Read a number with its unit.

        Args:
            source: The part of the file.
            name: The key, for errors.
            units: The size of each unit; the unit "" is that of a bare number, which otherwise is an error.
            valid: What would have worked.
        """
        match = QUANTITY.fullmatch(source.text.strip()) if isinstance(source, YamlScalar) else None
        if match is None or match[2] not in units:
            text = source.text if isinstance(source, YamlScalar) else ""
            raise self.error(f"{name} must be a number with its unit, not {text!r}", source, valid)
        number = float(match[1]) * units[match[2]]
        if not math.isfinite(number):
            raise self.error(f"{name} must be finite", source, valid)
        return number

    def unknown(
        self, problem: str, source: YamlNode | Position, name: str, known: Collection[str]
    ) -> ConfigError:
        """Make the error to raise about a name that there is not, with those that are like it first."""
        return self.error(problem, source, closest_first(name, known))

    def error(self, problem: str, source: YamlNode | Position, valid: Iterable[str] = ()) -> ConfigError:
        """Make the error to raise about a part of the file."""
        position = source if isinstance(source, Position) else source.position
        return ConfigError(problem, file=self.file, line=position.line, column=position.column, valid=valid)


def written(source: YamlNode) -> str:
    """Show what stands there, in short."""
    match source:
        case YamlScalar(text=text):
            return text
        case YamlSequence():
            return "[...]"
        case YamlMapping():
            return "{...}"
