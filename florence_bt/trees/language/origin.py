"""Which node of which mission file a behaviour was built from."""

from __future__ import annotations

from dataclasses import dataclass

from py_trees.behaviour import Behaviour

from florence_bt.trees.language.model import Mission, Node


@dataclass(frozen=True, slots=True)
class Origin:
    """What a behaviour was built from.

    Attributes:
        mission: The mission whose file it stands in.
        node: The node of that file.
    """

    mission: Mission
    node: Node


def give_origin(behaviour: Behaviour, origin: Origin) -> None:
    """Note what a behaviour was built from."""
    behaviour.__dict__["origin"] = origin


def origin_of(behaviour: Behaviour) -> Origin | None:
    """What a behaviour was built from, None when it is only a part of what a node became."""
    origin = behaviour.__dict__.get("origin")
    return origin if isinstance(origin, Origin) else None
