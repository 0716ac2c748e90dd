"""The keys of a running mission under one name each, for watchers: what is where, and who uses it.

The keys of the mission itself are ``/room``; those of a mission that it calls stand behind the path of the
calling node, ``/approach/approach_user/pose``, because every call has keys of its own.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour

from florence_bt.behaviours.decorators import CallMission, PreparedDecorator
from florence_bt.behaviours.keys import KeyStore
from florence_bt.runtime.viewers.snapshot import Accesses
from florence_bt.trees.language import model
from florence_bt.trees.language.compile import CompiledTree, origin_of
from florence_bt.trees.language.node_kind import KnownKinds

READ, WRITE = "r", "w"
UNSET = "-"
"""Text for a key that has no value."""


@dataclass(frozen=True)
class Variables:
    """The keys of one compiled tree; where they are changes only when a branch is built.

    Attributes:
        stores: Prefix of the names -> the keys.
        accesses: Node id -> (name, ``r`` or ``w``).
        unreached: The nodes whose branches were not built.
    """

    stores: Mapping[str, KeyStore]
    accesses: Accesses
    unreached: tuple[PreparedDecorator, ...] = ()

    @property
    def complete(self) -> bool:
        """Tell whether no branch was built since."""
        return not any(node.reached for node in self.unreached)

    def values_of(self, names: Iterable[str]) -> dict[str, str]:
        """Return the values of some keys as texts; of those that have none, :data:`UNSET`."""
        values = {
            f"{prefix}{key}": store.shown(key, value)
            for prefix, store in self.stores.items()
            for key, value in store.as_dict().items()
        }
        return {name: values.get(name, UNSET) for name in names}

    def used_by(self, nodes: Iterable[uuid.UUID]) -> list[str]:
        """Return the keys that some nodes use, in alphabetical order."""
        return sorted({name for node in nodes for name, _ in self.accesses.get(node, ())})


def variables_of(tree: CompiledTree) -> Variables:
    """Find the keys of a tree and who uses them."""
    stores: dict[str, KeyStore] = {"/": tree.keys}
    accesses: dict[uuid.UUID, tuple[tuple[str, str], ...]] = {}
    unreached = []
    for node, prefix, outer in _with_scopes(tree.root, "/", ""):
        if isinstance(node, CallMission):
            stores[prefix] = node.called_keys
        if isinstance(node, PreparedDecorator) and not node.reached:
            unreached.append(node)
        used = tuple(_accesses(node, outer if isinstance(node, CallMission) else prefix))
        if used:
            accesses[node.id] = used
    return Variables(stores, accesses, tuple(unreached))


def _with_scopes(node: Behaviour, scope: str, path: str) -> Iterator[tuple[Behaviour, str, str]]:
    """Yield every node with the prefix of the keys that it works on, and that of its caller's for a call."""
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
    for key in dict.fromkeys(reference.key for reference in origin.node.references()):
        yield f"{prefix}{key}", READ
    for key in dict.fromkeys(_written(origin.node)):
        yield f"{prefix}{key}", WRITE


def _written(node: model.Node) -> Iterator[str]:
    """Yield the keys of the mission that a node writes; those that belong to what is below it are none."""
    own = {key for part in node.parts for key in node.own_keys(part)}
    written = node.writes(KnownKinds(of=lambda value: None, outputs=lambda called: {}))
    yield from (key.text for key, _ in written if key.text not in own)
