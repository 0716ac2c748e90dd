"""The keys of a running mission under one name each, for watchers: what is where, who uses it, what changed.

The keys of the mission itself are ``/room``; those of a mission that it calls stand behind the path of the
calling node, ``/approach/approach_user/pose``, because every call has keys of its own.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.decorators import CallMission, PreparedDecorator
from florence_bt.behaviours.keys import KeyStore, readable
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.viewers.snapshot import Accesses
from florence_bt.trees.language import model
from florence_bt.trees.language.compile import CompiledTree, origin_of

READ, WRITE = "r", "w"
UNSET = "-"
"""What is shown for a key that has no value."""


@dataclass(frozen=True, slots=True)
class Activity:
    """One change of a key.

    Attributes:
        key: Its name.
        client: The node that wrote it, empty when that is not known.
        kind: ``INITIALISED``, ``WRITE`` or ``UNSET``.
        before: The value before, as text.
        now: The value now, as text.
    """

    key: str
    client: str
    kind: str
    before: str
    now: str


@dataclass(frozen=True)
class Variables:
    """The keys of one compiled tree; where they are changes only when a branch is built.

    Attributes:
        stores: Prefix of the names -> the keys.
        accesses: Node id -> (name, ``r`` or ``w``).
        writers: Name of a key -> the nodes that write it.
        unreached: The nodes whose branches were not built.
    """

    stores: Mapping[str, KeyStore]
    accesses: Accesses
    writers: Mapping[str, list[Behaviour]] = field(default_factory=dict)
    unreached: tuple[PreparedDecorator, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether no branch was built since."""
        return not any(node.reached for node in self.unreached)

    def values(self) -> dict[str, Any]:
        """Every key that has a value, by name, in alphabetical order."""
        found = {
            f"{prefix}{key}": value
            for prefix, store in self.stores.items()
            for key, value in store.as_dict().items()
        }
        return dict(sorted(found.items()))

    def names(self) -> list[str]:
        """Every key that has a value or that a node uses, with the parts of poses behind them."""
        values = self.values()
        names = dict.fromkeys(
            sorted({*values, *(name for used in self.accesses.values() for name, _ in used)})
        )
        listed = []
        for name in names:
            listed.append(name)
            if isinstance(values.get(name), Pose2):
                listed += [f"{name}.{part}" for part in ("x", "y", "yaw")]
        return listed

    def used_by(self, nodes: Iterable[uuid.UUID]) -> list[str]:
        """The keys that some nodes use, in alphabetical order."""
        return sorted({name for node in nodes for name, _ in self.accesses.get(node, ())})


def variables_of(tree: CompiledTree) -> Variables:
    """Find the keys of a tree and who uses them."""
    stores: dict[str, KeyStore] = {"/": tree.keys}
    accesses: dict[uuid.UUID, tuple[tuple[str, str], ...]] = {}
    writers: dict[str, list[Behaviour]] = {}
    unreached = []
    for node, prefix, outer in _with_scopes(tree.root, "/", ""):
        if isinstance(node, CallMission):
            stores[prefix] = node.called_keys
        if isinstance(node, PreparedDecorator) and not node.reached:
            unreached.append(node)
        used = tuple(_accesses(node, outer if isinstance(node, CallMission) else prefix))
        if used:
            accesses[node.id] = used
        for name, how in used:
            if how == WRITE:
                writers.setdefault(name, []).append(node)
    return Variables(stores, accesses, writers, tuple(unreached))


def _with_scopes(node: Behaviour, scope: str, path: str) -> Iterator[tuple[Behaviour, str, str]]:
    """Every node with the prefix of the keys that it works on, and that of its caller's for a call."""
    outer = scope
    if isinstance(node, CallMission):
        # A call without a name of its own is titled "run MISSION".
        scope = f"{path}/{node.name.removeprefix('run ')}/"
    yield node, scope, outer
    below = f"{path}/{node.name}" if node.parent is not None else path
    for index, child in enumerate(node.children):
        twins = [one for one in node.children[:index] if one.name == child.name]
        yield from _with_scopes(child, scope, f"{below}/{len(twins) + 1}" if twins else below)


def _accesses(node: Behaviour, prefix: str) -> Iterator[tuple[str, str]]:
    origin = origin_of(node)
    if origin is None:
        return
    needed = (*model.values_of(origin.node), *origin.node.expressions)
    read = (reference.key for value in needed for reference in model.references(value))
    for key in dict.fromkeys(read):
        yield f"{prefix}{key}", READ
    for key in dict.fromkeys(_written(origin.node)):
        yield f"{prefix}{key}", WRITE


def _written(node: model.Node) -> Iterator[str]:
    match node:
        case model.RunSkill(outputs=outputs) | model.CallMission(outputs=outputs):
            yield from (key.text for _, key in outputs)
        case model.Set(values=values):
            yield from (key.text for key, _ in values)


def changes(
    before: Mapping[str, Any], now: Mapping[str, Any], writers: Mapping[str, list[Behaviour]]
) -> list[Activity]:
    """What happened to the keys between two ticks, in alphabetical order.

    Args:
        before: Values by name.
        now: Values by name.
        writers: The nodes that write each key; one that has just succeeded is taken for the author.
    """
    found = []
    for name in sorted({*before, *now}):
        old, new = before.get(name, UNSET), now.get(name, UNSET)
        if name in before and name in now and (type(old), old) == (type(new), new):
            continue
        kind = "UNSET" if name not in now else "WRITE" if name in before else "INITIALISED"
        authors = [node.name for node in writers.get(name, ()) if node.status is Status.SUCCESS]
        found.append(Activity(name, authors[-1] if authors else "", kind, readable(old), readable(new)))
    return found


def lookup(values: Mapping[str, Any], name: str) -> str:
    """The value of a key, or of a part of a pose (``/user.x``), as text; ``-`` when there is none."""
    full = name if name.startswith("/") else f"/{name}"
    if full in values:
        return readable(values[full])
    key, _, part = full.rpartition(".")
    pose = values.get(key)
    if isinstance(pose, Pose2) and part in ("x", "y", "yaw"):
        return readable(getattr(pose, part))
    return UNSET
