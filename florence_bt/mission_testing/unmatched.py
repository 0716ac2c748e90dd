"""Why a pattern matches nothing of a mission, in words that help the author of a test."""

from __future__ import annotations

from collections.abc import Collection
from difflib import get_close_matches

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.mission_testing.paths import MAX_SHOWN, MissionMap, closest_paths, matching
from florence_bt.trees.language import model


def unmatched(
    text: str, places: MissionMap, skills: Collection[str], *, skills_only: bool, what: str = ""
) -> ConfigError:
    """The error for a pattern that matches nothing.

    Args:
        text: The pattern.
        places: The nodes of the mission.
        skills: The names of all skills.
        skills_only: Whether only nodes that run a skill count.
        what: What the pattern is for, such as ``the mock ``; for messages.
    """
    candidates = places.uses() if skills_only else list(places.places.values())
    if text in skills:
        used = dict.fromkeys(place.skill for place in places.uses() if place.skill)
        valid = closest_first(text, used) or ("no skills",)
        return ConfigError(f"{what}{text!r} is a skill that {places.mission} does not use", valid=valid)
    others = matching(text, places.places.values()) if skills_only else []
    if others:
        origin = others[0].origin
        called = isinstance(origin.node, model.CallMission) if origin is not None else False
        inside = [use for use in candidates if any(use.path.startswith(f"{o.path}/") for o in others)]
        kind = "a mission that is called" if called else "a node of the tree"
        return ConfigError(
            f"{what}{text!r} is no skill but {kind}",
            valid=list(dict.fromkeys(use.short for use in inside))[:MAX_SHOWN],
        )
    kind = "skill" if skills_only else "node"
    close = dict.fromkeys([*_called_like(text, places), *closest_paths(text, candidates)])
    message = f"{what}{text!r} matches no {kind} of {places.mission}"
    return ConfigError(message, valid=list(close)[:MAX_SHOWN])


def _called_like(text: str, places: MissionMap) -> list[str]:
    """The called mission whose name looks like this; it may be mocked whole."""
    nodes = [place.origin.node for place in places.places.values() if place.origin is not None]
    names = dict.fromkeys(node.mission.text for node in nodes if isinstance(node, model.CallMission))
    return get_close_matches(text, names, n=1, cutoff=0.8)
