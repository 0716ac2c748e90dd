"""What lasts when a skill has ended: things that are switched on, and off again by another skill."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

_PAIR = (("start_", True), ("stop_", False))
"""How the skills begin that switch something on and off."""
_WORKS_WITH: Mapping[str, str] = dict.fromkeys(
    ("look_for_user", "follow_user", "search_for_user", "user_lying"), "tracker"
)
"""Skill -> the thing that it works with: whoever uses it before switching the thing has found it on."""


class Lasting(NamedTuple):
    """The fate of a thing.

    Attributes:
        first: What was done with it first: ``on``, ``off``, or ``used``.
        on: Whether it is on; None: as it was found.
    """

    first: str
    on: bool | None


Effects = tuple[tuple[str, Lasting], ...]
"""What became of things, by name."""


def effect_of(skill: str, inputs: Mapping[str, Any]) -> Effects:
    """Return what the start of a skill does to a thing; nothing for most."""
    for word, on in _PAIR:
        if skill.startswith(word):
            return ((skill.removeprefix(word), Lasting("on" if on else "off", on)),)
    if skill == "set_speed_limit":
        on = inputs.get("speed") != 0
        return (("speed_limit", Lasting("on" if on else "off", on)),)
    return ((_WORKS_WITH[skill], Lasting("used", None)),) if skill in _WORKS_WITH else ()


def effect_of_failure(skill: str) -> Effects:
    """Return what becomes of a thing that could not be switched on."""
    return tuple((thing, Lasting("on", False)) for thing, each in effect_of(skill, {"speed": 1}) if each.on)


def apply(effects: Effects, known: dict[str, Lasting]) -> None:
    """Note what becomes of things."""
    for thing, new in effects:
        old = known.get(thing, Lasting(new.first, None))
        known[thing] = Lasting(old.first, old.on if new.on is None else new.on)


def left_on(lasting: Mapping[str, Lasting], thing: str, own_skills: Iterable[str]) -> bool:
    """Tell whether a thing is left on that the mission should have switched off.

    One that it found on it may leave on, unless it has the skills for both.

    Args:
        lasting: What became of things.
        thing: The thing.
        own_skills: The skills that the mission itself uses.
    """
    became = lasting.get(thing)
    both = {f"{word}{thing}" for word, _ in _PAIR} <= set(own_skills)
    return became is not None and became.on is True and (both or became.first != "used")
