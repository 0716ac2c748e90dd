"""What an author wants to hold of a mission, in a file beside it: ``NAME.properties.yml``.

A property is a small automaton. It reads what happens on a way, step by step, and is followed through the
graph of states beside the mission itself. What happens inside of a mission that is called is the business of
that mission: here it begins and ends, like a skill.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from florence_bt.assurance.explorer import Edge, Ending, Graph
from florence_bt.assurance.plan import codes_behind
from florence_bt.assurance.world import Happening
from florence_bt.core.declaration import CodeGroup, Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.trees.language.code_groups import codes_named
from florence_bt.trees.language.loader import PROPERTIES_ENDING
from florence_bt.trees.language.quantities import read_value

WORDS = ("never", "after", "at_most", "always_before")
_EVENT = re.compile(
    r"(?P<who>[a-z][a-z0-9_]*)"
    r"(?: (?P<how>begins|fails|succeeds|is stopped|ends)(?: with (?P<code>[a-z][a-z0-9_]*))?)?"
)
_EXAMPLES = ("say", "navigate_to fails with no_path", "it ends with battery_low")


@dataclass(frozen=True, slots=True)
class PropertyEvent:
    """Something that happens: a skill begins or ends, or the mission (``it``) ends.

    Attributes:
        who: The skill, the called mission, or ``it``.
        how: ``begins``, ``fails``, ``succeeds``, ``ends``, ``is stopped``.
        codes: The codes that count; None: all.
    """

    who: str
    how: str
    codes: frozenset[str] | None = None

    def is_at(self, each: Happening) -> bool:
        """Tell whether it is what happened."""
        if each.skill != self.who or each.what not in ("start", "end"):
            return False
        if each.what == "start":
            return self.how == "begins"
        result = each.result
        if result is None or self.how == "begins":
            return False
        stopped = result.code == "cancelled"
        ways = {
            "fails": not result.succeeded and not stopped,
            "succeeds": result.succeeded,
            "is stopped": stopped,
        }
        return ways.get(self.how, True) and (
            self.codes is None or bool(self.codes & codes_behind(result.code))
        )

    def is_end(self, ending: Ending) -> bool:
        """Tell whether it is an end of the mission."""
        ways = {"fails": "FAILED", "succeeds": "SUCCEEDED", "is stopped": "STOPPED"}
        if self.who != "it" or ways.get(self.how, ending.status) != ending.status:
            return False
        return self.codes is None or bool(self.codes & codes_behind(ending.code))


@dataclass(frozen=True, slots=True)
class Property:
    """Something that an author wants to hold.

    Attributes:
        word: Which of :data:`WORDS`.
        text: As written, for people.
        because: The author's sentence, or empty.
        position: Where it stands.
        first: What it is about.
        then: What must follow or come before, or must not be at the same time.
        within: How long the second may take, in seconds; infinite: as long as it takes.
        most: How often at most.
    """

    word: str
    text: str
    because: str
    position: Position
    first: PropertyEvent
    then: PropertyEvent | None = None
    within: float = float("inf")
    most: int = 0

    @property
    def codes(self) -> frozenset[str]:
        """The codes that it tells from others."""
        return (self.first.codes or frozenset()) | ((self.then.codes if self.then else None) or frozenset())


def properties_beside(
    mission: Path, names: Iterable[str], groups: Mapping[str, CodeGroup]
) -> tuple[Property, ...]:
    """Read the properties of a mission; none when no file is beside it.

    Args:
        mission: The file of the mission.
        names: The skills and missions that it uses.
        groups: The groups of codes.

    Raises:
        ConfigError: The file is wrong.
    """
    file = mission.with_name(mission.stem + PROPERTIES_ENDING)
    if not file.is_file():
        return ()
    reader = _Reader(file, frozenset(names) | {"it"}, groups)
    root = read_yaml(file)
    if not isinstance(root, YamlMapping) or not isinstance(given := root.get("properties"), YamlSequence):
        raise ConfigError(
            f"{file}: a list under `properties` is needed", valid=["properties:\n  - at_most: {say: 3}"]
        )
    return tuple(reader.read(item) for item in given.items)


class _Reader:
    """Reads the properties of one file."""

    def __init__(self, file: Path, names: frozenset[str], groups: Mapping[str, CodeGroup]) -> None:
        self._file = file
        self._names = names
        self._groups = groups

    def read(self, item: YamlNode) -> Property:
        """Read a property."""
        if not isinstance(item, YamlMapping):
            raise self._error(item, "a property begins with one of its words", WORDS)
        word = next((each for each in WORDS if item.get(each) is not None), None)
        if word is None:
            raise self._error(item, "a property begins with one of its words", WORDS)
        about = item.get(word)
        assert about is not None
        because = self._text(item.get("because")) if item.get("because") is not None else ""
        shown = ", ".join(
            f"{key.text}: {self._shown(value)}" for key, value in item.entries if key.text != "because"
        )
        return Property(word, shown, because, item.position, **self._parts(word, about, item))

    def _parts(self, word: str, about: YamlNode, item: YamlMapping) -> dict[str, Any]:
        if word == "never":
            first, _, then = self._text(about).partition(" while ")
            return {"first": self._event(about, first), "then": self._event(about, then) if then else None}
        if word == "after":
            follows = item.get("eventually")
            if follows is None:
                raise self._error(
                    item, "after needs what must follow, under `eventually`", ["eventually: say"]
                )
            limit = item.get("within")
            seconds = read_value(self._text(limit), Kind.DURATION) if limit is not None else float("inf")
            events = [self._event(each, self._text(each)) for each in (about, follows)]
            return {"first": events[0], "then": events[1], "within": seconds}
        if not isinstance(about, YamlMapping) or len(about.entries) != 1:
            raise self._error(about, f"{word} needs one skill and its value", [f"{word}: {{say: 3}}"])
        [(key, value)] = about.entries
        if word == "at_most":
            if not self._text(value).isdigit():
                raise self._error(value, "at_most needs a whole number", ["3"])
            return {"first": self._event(key, key.text), "most": int(self._text(value))}
        return {"first": self._event(value, self._text(value)), "then": self._event(key, key.text)}

    def _event(self, source: YamlNode, text: str) -> PropertyEvent:
        match = _EVENT.fullmatch(text.strip())
        if match is None:
            raise self._error(source, f"{text!r} says not what happens", _EXAMPLES)
        if match["who"] not in self._names:
            known = closest_first(match["who"], self._names)
            raise self._error(source, f"the mission does not use {match['who']!r}", known)
        how = match["how"] or ("ends" if match["who"] == "it" else "begins")
        codes = codes_named(match["code"], self._groups) if match["code"] else None
        return PropertyEvent(match["who"], how, codes)

    def _text(self, source: YamlNode | None) -> str:
        if not isinstance(source, YamlScalar):
            raise self._error(source, "a text is needed", _EXAMPLES)
        return source.text

    def _shown(self, value: YamlNode) -> str:
        if isinstance(value, YamlMapping):
            return ", ".join(f"{key.text}: {self._shown(each)}" for key, each in value.entries)
        return value.text if isinstance(value, YamlScalar) else ""

    def _error(self, source: YamlNode | None, problem: str, valid: Iterable[str]) -> ConfigError:
        line = source.position.line if source is not None else None
        return ConfigError(problem, file=self._file, line=line, valid=valid)


# ---- following a property through the states ------------------------------------------------------------

Memory = tuple[Any, ...]
"""What a property remembers of the way so far."""
BROKEN: Memory = ("broken",)


def way_that_breaks(wanted: Property, graph: Graph) -> tuple[Edge, ...] | None:
    """Return the shortest way on which a property does not hold; None: it holds on all that were explored."""
    start: tuple[int, Memory] = (0, ())
    came: dict[tuple[int, Memory], tuple[tuple[int, Memory], Edge] | None] = {start: None}
    todo = deque([start])
    while todo:
        at = todo.popleft()
        ending = graph.endings.get(at[0])
        if at[1] == BROKEN or (ending is not None and _breaks_at_end(wanted, at[1], ending)):
            return _back(came, at)
        for edge in graph.edges[at[0]]:
            after = (edge.target, _memory_after(wanted, at[1], edge))
            if after not in came:
                came[after] = (at, edge)
                todo.append(after)
    return None


def _back(
    came: Mapping[tuple[int, Memory], tuple[tuple[int, Memory], Edge] | None], at: tuple[int, Memory]
) -> tuple[Edge, ...]:
    way: list[Edge] = []
    while (step := came[at]) is not None:
        at, edge = step
        way.append(edge)
    return tuple(way[::-1])


def _memory_after(wanted: Property, memory: Memory, edge: Edge) -> Memory:
    """Return what is remembered after a step."""
    if wanted.word == "after" and memory and memory != BROKEN:
        late = memory[0] + edge.seconds
        memory = BROKEN if late > wanted.within + 1e-3 else (late,)
    for each in edge.happened:
        if memory == BROKEN:
            break
        memory = _READ[wanted.word](wanted, memory, each)
    return memory


def _read_never(wanted: Property, memory: Memory, each: Happening) -> Memory:
    if wanted.then is None:
        return BROKEN if wanted.first.is_at(each) else memory
    if each.skill not in (wanted.first.who, wanted.then.who):
        return memory
    running = set(memory)
    if each.what == "start":
        running.add((each.skill, each.path))
    elif each.what in ("end", "cancel"):
        running.discard((each.skill, each.path))
    names = [skill for skill, _ in running]
    both = wanted.first.who in names and wanted.then.who in names
    return (
        BROKEN if both and (wanted.first.who != wanted.then.who or len(names) > 1) else tuple(sorted(running))
    )


def _read_after(wanted: Property, memory: Memory, each: Happening) -> Memory:
    assert wanted.then is not None
    if memory:
        return () if wanted.then.is_at(each) or each.what in ("stop", "override") else memory
    return (0.0,) if wanted.first.is_at(each) else memory


def _read_at_most(wanted: Property, memory: Memory, each: Happening) -> Memory:
    if not wanted.first.is_at(each):
        return memory
    count = (memory[0] if memory else 0) + 1
    return BROKEN if count > wanted.most else (count,)


def _read_always_before(wanted: Property, memory: Memory, each: Happening) -> Memory:
    assert wanted.then is not None
    if not memory and wanted.first.is_at(each):
        return BROKEN
    return ("came",) if wanted.then.is_at(each) else memory


_READ = {
    "never": _read_never,
    "after": _read_after,
    "at_most": _read_at_most,
    "always_before": _read_always_before,
}


def _breaks_at_end(wanted: Property, memory: Memory, ending: Ending) -> bool:
    """Tell whether a property does not hold where the mission has ended."""
    match wanted.word:
        case "never":
            return wanted.then is None and wanted.first.is_end(ending)
        case "after":
            assert wanted.then is not None
            begun = bool(memory) or wanted.first.is_end(ending)
            return begun and ending.status != "STOPPED" and not wanted.then.is_end(ending)
        case "always_before":
            return not memory and wanted.first.is_end(ending)
    return False


def codes_of(properties: Iterable[Property]) -> Iterator[str]:
    """Yield the codes that some properties tell apart."""
    for each in properties:
        yield from each.codes
