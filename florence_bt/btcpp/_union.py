"""Classes of keys and ports that hold the same values, each with the kinds that were seen."""

from __future__ import annotations

from florence_bt.core.declaration import Kind

Member = tuple[str, str, str]
"""``("key", tree, key)`` or ``("port", node, port)``."""

_PLAIN = (Kind.INTEGER, Kind.NUMBER)


class Classes:
    """A union-find structure."""

    def __init__(self) -> None:
        self._parents: dict[Member, Member] = {}
        self._kinds: dict[Member, dict[Kind, None]] = {}
        self._hints: dict[Member, dict[Kind, None]] = {}

    def join(self, one: Member, other: Member) -> None:
        """Say that two hold the same values."""
        first, second = self._root(one), self._root(other)
        if first != second:
            self._parents[second] = first
            self._kinds.setdefault(first, {}).update(self._kinds.pop(second, {}))
            self._hints.setdefault(first, {}).update(self._hints.pop(second, {}))

    def add(self, member: Member, kind: Kind) -> None:
        """Note that a value of this kind was seen."""
        self._kinds.setdefault(self._root(member), {})[kind] = None

    def hint(self, member: Member, kind: Kind) -> None:
        """Note a kind that counts when no value was seen: that of what it is compared with."""
        self._hints.setdefault(self._root(member), {})[kind] = None

    def kind(self, member: Member) -> Kind | None:
        """The kind that fits what was seen, None when nothing was.

        A quantity stands above plain numbers, which have no unit in the XML; what does not fit together is a
        text.
        """
        root = self._root(member)
        seen = self._kinds.get(root) or self._hints.get(root, {})
        special = [kind for kind in seen if kind not in _PLAIN]
        if len(special) == 1 and (special[0] not in (Kind.TEXT, Kind.BOOLEAN, Kind.POSE) or len(seen) == 1):
            return special[0]
        if special:
            return Kind.TEXT
        return Kind.NUMBER if Kind.NUMBER in seen else Kind.INTEGER if seen else None

    def _root(self, member: Member) -> Member:
        root = member
        while self._parents.get(root, root) != root:
            root = self._parents[root]
        while self._parents.get(member, member) != root and member != root:
            self._parents[member], member = root, self._parents[member]
        return root
