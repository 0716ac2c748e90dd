"""Properties of a mission: what its author wants to hold whatever happens, read with their places.

Whether what they name is there is checked elsewhere (``checks.properties``), and ``florence verify`` proves
whether they hold.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.core.yaml_reader import written
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.model import Expression, Property, PropertyEvent
from florence_bt.trees.language.reader import Reader
from florence_bt.trees.language.vocabulary import BESIDE_PROPERTY, PROPERTY_WORDS

ENDING = ".properties.yml"
"""Ending of the file beside a mission that says what must hold of it."""
IT = "it"
"""Word for the mission itself in an event."""
_EVENT = re.compile(
    r"(?P<who>[a-z][a-z0-9_]*)"
    r"(?: (?P<how>begins|fails|succeeds|is stopped|ends)(?: with (?P<code>[a-z][a-z0-9_]*))?)?"
)
_WHILE = re.compile(r" while (?=(?:[^\"']|\"[^\"]*\"|'[^']*')*$)")
"""The word between the two sides of a ``never``, outside of quotes."""
EXAMPLES = ("say", "navigate_to fails with no_path", "it ends with battery_low", "$distance < 0.3 m")
"""Forms of what stands behind ``never``."""
_EXAMPLE = "properties:\n  - at_most: {say: 3}"

Parts: TypeAlias = dict[str, Any]
"""Fields of :class:`Property` that only the properties of some words have."""


def read_properties(reader: Reader, source: YamlNode | None) -> tuple[Property, ...]:
    """Read a list of properties; those that cannot be read are left out.

    Args:
        reader: Receives what is wrong.
        source: The list, or None when there is none.
    """
    if source is None:
        return ()
    if not isinstance(source, YamlSequence):
        reader.error(source.position, "a list under `properties` is needed", [_EXAMPLE])
        return ()
    return tuple(each for item in source.items if (each := _property(reader, item)) is not None)


def properties_file(mission: Path) -> Path:
    """Return the file beside a mission that can hold its properties."""
    return mission.with_name(mission.stem + ENDING)


def read_properties_beside(mission: Path) -> tuple[tuple[Property, ...], tuple[Finding, ...]]:
    """Read the file beside a mission.

    Args:
        mission: The file of the mission.

    Returns:
        The properties, none where no file is beside it, and what is wrong with the file.
    """
    file = properties_file(mission)
    if not file.is_file():
        return (), ()
    reader = Reader(file)
    properties: tuple[Property, ...] = ()
    try:
        root = read_yaml(file)
    except ConfigError as error:
        reader.add_error(error)
    else:
        given = root.get("properties") if isinstance(root, YamlMapping) else None
        if given is None:
            reader.error(root.position, "a list under `properties` is needed", [_EXAMPLE])
        properties = read_properties(reader, given)
    return properties, tuple(reader.findings)


def _property(reader: Reader, item: YamlNode) -> Property | None:
    word = next((each for each in PROPERTY_WORDS if isinstance(item, YamlMapping) and item.get(each)), None)
    if not isinstance(item, YamlMapping) or word is None:
        reader.error(item.position, "a property begins with one of its words", PROPERTY_WORDS)
        return None
    allowed = (word, *BESIDE_PROPERTY.get(word, ()), "because")
    for key, _ in item.entries:
        if key.text not in allowed:
            reader.unknown(key.position, f"{key.text!r} does not belong to {word!r}", key.text, allowed)
    about, because = item.get(word), item.get("because")
    assert about is not None
    parts = _READ[word](reader, item, about)
    sentence = reader.text(because, "because") if because is not None else ""
    if parts is None or sentence is None:
        return None
    shown = ", ".join(f"{key.text}: {_shown(value)}" for key, value in item.entries if key.text != "because")
    return Property(word, shown, sentence, reader.yaml.file, item.position, **parts)


def _shown(value: YamlNode) -> str:
    if isinstance(value, YamlMapping):
        return ", ".join(f"{key.text}: {_shown(each)}" for key, each in value.entries)
    return written(value)


# ---- never ------------------------------------------------------------------------------------------------


def _never(reader: Reader, item: YamlMapping, about: YamlNode) -> Parts | None:
    """Read what must not happen, must not hold, or must not be at the same time."""
    if not isinstance(about, YamlScalar) or not about.text.strip():
        reader.error(about.position, "never needs what must not happen", EXAMPLES)
        return None
    between = _WHILE.search(about.text)
    if between is None:
        side = _side(reader, about, about.text, 0)
        return {} if side is None else {"condition" if isinstance(side, Expression) else "first": side}
    left = _side(reader, about, about.text[: between.start()], 0, lasts=True)
    right = _side(reader, about, about.text[between.end() :], between.end(), lasts=True)
    return _together(reader, left, right) if left is not None and right is not None else None


def _side(
    reader: Reader, source: YamlScalar, text: str, offset: int, *, lasts: bool = False
) -> PropertyEvent | Expression | None:
    """Read a side of a ``never``: an expression when it names a key, else an event.

    Args:
        reader: Receives what is wrong.
        source: Where it stands.
        text: The side.
        offset: Where in the scalar it begins.
        lasts: Whether a skill alone means that it runs.
    """
    if "$" in text:
        start = len(text) - len(text.lstrip())
        return reader.expression_in(source, text.strip(), offset + start)
    event = _event(reader, source, text)
    bare = event is not None and event.who == text.strip() != IT
    return replace(event, how="runs") if event is not None and lasts and bare else event


def _together(
    reader: Reader, left: PropertyEvent | Expression, right: PropertyEvent | Expression
) -> Parts | None:
    """Put the two sides of ``while`` together: one of them at least lasts."""
    if isinstance(left, Expression) and isinstance(right, Expression):
        joined = f"{left.text} and {right.text}"
        reader.error(left.position, "two conditions are one", [f"never: {joined}"])
        return None
    if isinstance(left, Expression):
        left, right = right, left
    assert isinstance(left, PropertyEvent)
    if isinstance(right, Expression):
        return {"first": left, "condition": right}
    if right.how != "runs":
        left, right = right, left
    if right.how != "runs" or left.who == IT:
        problem = "of two events one must last: a skill, which runs, or an expression over keys"
        reader.error(left.position, problem, ["say fails while turn", "it ends while $distance < 0.3 m"])
        return None
    return {"first": left, "then": right}


# ---- the other words --------------------------------------------------------------------------------------


def _after(reader: Reader, item: YamlMapping, about: YamlNode) -> Parts | None:
    """Read what must follow something."""
    follows, limit = item.get("eventually"), item.get("within")
    if follows is None:
        problem = "after needs what must follow, under `eventually`"
        reader.error(item.position, problem, ["eventually: say"])
        return None
    first, then = (_event(reader, each, written(each)) for each in (about, follows))
    seconds = reader.duration(limit, "within") if limit is not None else float("inf")
    if first is None or then is None or seconds is None:
        return None
    return {"first": first, "then": then, "within": seconds}


def _at_most(reader: Reader, item: YamlMapping, about: YamlNode) -> Parts | None:
    """Read how often something may happen."""
    pair = _pair(reader, about, "at_most: {say: 3}")
    if pair is None:
        return None
    key, value = pair
    first = _event(reader, key, key.text)
    if not written(value).isdigit():
        reader.error(value.position, "at_most needs a whole number", ["3"])
        return None
    return {"first": first, "most": int(written(value))} if first is not None else None


def _always_before(reader: Reader, item: YamlMapping, about: YamlNode) -> Parts | None:
    """Read what must come before what."""
    pair = _pair(reader, about, "always_before: {start_tracker: look_for_user}")
    if pair is None:
        return None
    key, value = pair
    then, first = _event(reader, key, key.text), _event(reader, value, written(value))
    return {"first": first, "then": then} if first is not None and then is not None else None


def _pair(reader: Reader, about: YamlNode, example: str) -> tuple[YamlScalar, YamlNode] | None:
    if isinstance(about, YamlMapping) and len(about.entries) == 1:
        return about.entries[0]
    word = example.partition(":")[0]
    reader.error(about.position, f"{word} needs one skill and its value", [example])
    return None


def _event(reader: Reader, source: YamlNode, text: str) -> PropertyEvent | None:
    match = _EVENT.fullmatch(text.strip())
    if match is None:
        reader.error(source.position, f"{text.strip()!r} says not what happens", EXAMPLES)
        return None
    how = match["how"] or ("ends" if match["who"] == IT else "begins")
    return PropertyEvent(match["who"], how, match["code"] or "", source.position)


_READ: dict[str, Callable[[Reader, YamlMapping, YamlNode], Parts | None]] = {
    "never": _never,
    "after": _after,
    "at_most": _at_most,
    "always_before": _always_before,
}
