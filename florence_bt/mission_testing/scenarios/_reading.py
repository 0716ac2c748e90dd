"""What the readers of the parts of a scenario file share: findings, and small pieces of the grammar."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.core.unquoted_commas import unquoted_commas
from florence_bt.mission_testing.known import MissionMaps
from florence_bt.mission_testing.paths import MissionMap, Place, matching
from florence_bt.mission_testing.unmatched import unmatched
from florence_bt.mission_testing.values import read_duration, read_port
from florence_bt.trees.language.findings import ERROR, Finding
from florence_bt.trees.language.loader import MissionLibrary

_WORD = re.compile(r"\w+")
_PARAMETER = re.compile(r"<([a-z][a-z0-9_]*)>")


class Reading:
    """A scenario file that is being read.

    Args:
        file: The file.
        library: The missions that it may use.
        maps: Where the maps of missions are kept.
        declarations: The skills by name.

    Attributes:
        findings: What is wrong with the file.
    """

    def __init__(
        self,
        file: Path,
        library: MissionLibrary,
        maps: MissionMaps,
        declarations: Mapping[str, SkillDeclaration],
    ) -> None:
        self.file = file
        self.library = library
        self.maps = maps
        self.declarations = declarations
        self.findings: list[Finding] = []
        self._added: dict[str, Path] = {}

    def problem(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        """Note an error."""
        place = str(self.file), position.line, position.column
        self.findings.append(Finding(*place, ERROR, message, tuple(valid)))

    def wrong(self, position: Position, error: ConfigError) -> None:
        """Note an error that something else found."""
        self.problem(position, error.problem, error.valid)

    def entries(
        self, source: YamlNode | None, what: str, keys: Collection[str]
    ) -> dict[str, tuple[YamlScalar, YamlNode]]:
        """The entries of a table that has only these keys."""
        found: dict[str, tuple[YamlScalar, YamlNode]] = {}
        for key, value in self.table(source, what, keys):
            if key.text in keys:
                found[key.text] = (key, value)
            else:
                self.problem(key.position, f"{what} has no key {key.text!r}", closest_first(key.text, keys))
        return found

    def table(
        self, source: YamlNode | None, what: str, keys: Collection[str] = (), valid: Iterable[str] = ()
    ) -> Iterator[tuple[YamlScalar, YamlNode]]:
        """The entries of a table, none when nothing was written.

        A text that fell apart at its commas, because it needs quotes there, is noted and put together. (A
        single word behind a comma may be a key without its colon, and so may one of the ``keys``.) What is
        no table is noted, with ``valid`` as what would have worked.
        """
        if isinstance(source, YamlMapping):
            torn = {
                text.key: text
                for text in unquoted_commas(source)
                if text.pieces[0].text not in keys and not _WORD.fullmatch(text.pieces[0].text)
            }
            pieces = {piece for text in torn.values() for piece in text.pieces}
            for key, value in source.entries:
                if key in torn:
                    text = torn[key]
                    message = "a text with a comma needs quotes between { and }"
                    self.problem(text.first.position, message, [text.valid])
                    yield key, replace(text.first, text=text.whole)
                elif key not in pieces:
                    yield key, value
        elif source is not None and not (isinstance(source, YamlScalar) and source.empty):
            self.problem(source.position, f"{what} must be a table (key: value)", valid)

    def items(self, source: YamlNode | None) -> tuple[YamlNode, ...]:
        """The items of a list; a single thing counts as a list of one, nothing as none."""
        if source is None or (isinstance(source, YamlScalar) and source.empty):
            return ()
        return source.items if isinstance(source, YamlSequence) else (source,)

    def text(self, source: YamlNode, what: str) -> str | None:
        """A text."""
        if isinstance(source, YamlScalar) and (source.quoted or not source.empty):
            return source.text
        self.problem(source.position, f"{what} must be a text")
        return None

    def duration(self, source: YamlNode, what: str) -> float | None:
        """A duration in seconds."""
        text = self.text(source, what)
        if text is None:
            return None
        try:
            return read_duration(text)
        except ConfigError as error:
            self.wrong(source.position, error)
            return None

    def whole(self, source: YamlNode, what: str, least: int) -> int | None:
        """A whole number."""
        text = self.text(source, what)
        if text is not None and re.fullmatch(r"\d{1,9}", text) and int(text) >= least:
            return int(text)
        if text is not None:
            self.problem(
                source.position, f"{what} must be a whole number of at least {least}", [f"{max(least, 1)}"]
            )
        return None

    def flag(self, source: YamlNode, what: str) -> bool:
        """True or false."""
        if isinstance(source, YamlScalar) and source.text in ("true", "false"):
            return source.text == "true"
        self.problem(source.position, f"{what} must be true or false", ["true", "false"])
        return False

    def pattern(
        self, key: YamlScalar, places: MissionMap | None, *, skills_only: bool = False, unused: bool = False
    ) -> list[Place] | None:
        """The nodes that a pattern means, None (noted) when it is wrong.

        Args:
            key: The pattern.
            places: The nodes of the mission; None when they are not known.
            skills_only: Whether only nodes that run a skill count.
            unused: Whether the name of a skill that the mission does not use will do.
        """
        if places is None:
            return []
        candidates = places.uses() if skills_only else list(places.places.values())
        try:
            found = matching(key.text, candidates)
        except ConfigError as error:
            self.wrong(key.position, error)
            return None
        if found or (unused and key.text in self.declarations):
            return found
        self.wrong(key.position, unmatched(key.text, places, self.declarations, skills_only=skills_only))
        return None

    def check_input(self, mission: str, name: str, text: str | None) -> None:
        """Read one input of a mission as a caller's is read; None stands for one that is not given.

        Raises:
            ConfigError: The mission has no such input, or the text does not fit.
        """
        ports = self.library.get(mission).inputs
        if name not in ports:
            raise ConfigError(
                f"{mission} has no input {name!r}", valid=closest_first(name, ports) or ("no inputs",)
            )
        if text is not None:
            read_port(text, ports[name])

    def mission(self, source: YamlNode, what: str) -> str | None:
        """The name of a mission that can run."""
        name = self.text(source, what)
        if name is None:
            return None
        if name.endswith((".yaml", ".yml")):
            path = Path(os.path.normpath(self.file.parent / name))
            if not path.exists():
                message = f"there is no file {str(path)!r}: paths are counted from the folder of this file"
                meant = [os.path.relpath(name, self.file.parent)] if Path(name).exists() else []
                self.problem(source.position, message, meant)
                return None
            name = path.stem
            if self._added.setdefault(name, path) != path:
                self.problem(
                    source.position, f"the mission {name!r} is {self._added[name]} in this file already"
                )
            known = self.library.find(name)
            if known is None or known.file != path:
                added = self.library.add_file(path)
                self.library.add_neighbours([added] if added is not None else [])
        try:
            mission = self.library.get(name)
            self.maps.of(mission, self.library, self.declarations)
        except ConfigError as error:
            where = f"{error.file}:{error.line}:{error.column}: " if error.file and error.line else ""
            unknown = name not in self.library and not self.library.unreadable().get(name)
            close = closest_first(name, self.library.names())[:3]
            valid = (*close, "missions: [FOLDER] at the top of this file") if unknown else error.valid
            self.problem(source.position, f"{where}{error.problem}", valid)
            return None
        return name


def plain(source: YamlNode) -> Any:
    """A source as plain texts, lists and tables."""
    match source:
        case YamlScalar():
            return source.text
        case YamlSequence():
            return [plain(item) for item in source.items]
        case YamlMapping():
            return {key.text: plain(value) for key, value in source.entries}


def input_text(source: YamlNode) -> str:
    """An input of a mission as a caller would write it, on one line."""
    match source:
        case YamlScalar():
            return source.text
        case YamlSequence():
            return f"({', '.join(input_text(item) for item in source.items)})"
        case YamlMapping():
            return f"{{{', '.join(f'{key.text}: {input_text(value)}' for key, value in source.entries)}}}"


def fill_in(source: YamlNode, values: Mapping[str, YamlNode], unknown: Any) -> YamlNode:
    """Put the values of an example where ``<name>`` stands.

    Args:
        source: The source.
        values: The values by name. One that stands alone may be a list or a table.
        unknown: Called with the position and the name of each that has no value.
    """
    match source:
        case YamlScalar():
            return _fill_in_text(source, values, unknown)
        case YamlSequence():
            return YamlSequence(
                tuple(fill_in(item, values, unknown) for item in source.items), source.position
            )
        case YamlMapping():
            filled = []
            for key, value in source.entries:
                name = _fill_in_text(key, values, unknown)
                filled.append(
                    (name if isinstance(name, YamlScalar) else key, fill_in(value, values, unknown))
                )
            return YamlMapping(tuple(filled), source.position)


def _fill_in_text(source: YamlScalar, values: Mapping[str, YamlNode], unknown: Any) -> YamlNode:
    names = _PARAMETER.findall(source.text)
    if not names:
        return source
    for name in names:
        if name not in values:
            unknown(source.position, name)
            return source
    alone = _PARAMETER.fullmatch(source.text)
    if alone is not None:
        value = values[alone[1]]
        return (
            YamlScalar(value.text, value.quoted, source.position) if isinstance(value, YamlScalar) else value
        )
    text = _PARAMETER.sub(lambda match: input_text(values[match[1]]), source.text)
    return YamlScalar(text, True, source.position)
