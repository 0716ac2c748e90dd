"""The kinds of keys and ports, found from all their uses."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_btcpp.document import Document
from florence_btcpp.key_uses import (
    READ,
    KeyUse,
    Ports,
    SubTreeCall,
    literals_of,
    local_key,
    pointer,
)
from florence_btcpp.script import (
    AssignmentExpr,
    NameExpr,
    assigned_value,
    is_fractional,
    kind_of_code,
    parse_script,
)
from florence_btcpp.values import guess_kind, written_value
from florence_btcpp.vocabulary import SCRIPTS

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
        first, second = self.root(one), self.root(other)
        if first != second:
            self._parents[second] = first
            self._kinds.setdefault(first, {}).update(self._kinds.pop(second, {}))
            self._hints.setdefault(first, {}).update(self._hints.pop(second, {}))

    def add(self, member: Member, kind: Kind) -> None:
        """Note that a value of this kind was seen."""
        self._kinds.setdefault(self.root(member), {})[kind] = None

    def hint(self, member: Member, kind: Kind) -> None:
        """Note a kind that counts when no value was seen: that of what it is compared with."""
        self._hints.setdefault(self.root(member), {})[kind] = None

    def kind(self, member: Member) -> Kind | None:
        """Return the kind that fits what was seen, None when nothing was."""
        return _common_kind(self._seen(member))

    def is_same(self, one: Member, other: Member) -> bool:
        """Tell whether two hold the same values."""
        return self.root(one) == self.root(other)

    def join_if_alike(self, one: Member, other: Member) -> bool:
        """Join two unless what was seen of them does not fit together; says whether it does."""
        seen = self._seen(one), self._seen(other)
        both = seen[0] | seen[1]
        if all(seen) and _common_kind(both) is Kind.TEXT and both.keys() != {Kind.TEXT}:
            return False
        if tuple(map(_common_kind, seen)) != _PLAIN:  # a whole number can be given where a number is wanted
            self.join(one, other)
        return True

    def _seen(self, member: Member) -> dict[Kind, None]:
        root = self.root(member)
        return self._kinds.get(root) or self._hints.get(root, {})

    def root(self, member: Member) -> Member:
        """Return the member that stands for all that hold the same values."""
        root = member
        while self._parents.get(root, root) != root:
            root = self._parents[root]
        while self._parents.get(member, member) != root and member != root:
            self._parents[member], member = root, self._parents[member]
        return root


def _common_kind(seen: Collection[Kind]) -> Kind | None:
    """Return the kind that fits all that were seen.

    A quantity stands above plain numbers, which have no unit in the XML; what does not fit together is a
    text.
    """
    special = [kind for kind in seen if kind not in _PLAIN]
    if len(special) == 1 and (special[0] not in (Kind.TEXT, Kind.BOOLEAN, Kind.POSE) or len(seen) == 1):
        return special[0]
    if special:
        return Kind.TEXT
    return Kind.NUMBER if Kind.NUMBER in seen else Kind.INTEGER if seen else None


Mapped = Callable[[str, SubTreeCall], Mapping[str, str]]
"""A caller and a call -> key of the called tree -> key of the caller."""
IsEntry = Callable[[str, str], bool]
"""A tree and a name in one of its scripts -> whether it is a key, and no enumeration value."""


@dataclass(frozen=True)
class _Names:
    """The names in the scripts of a tree."""

    kinds: Kinds
    tree: str
    is_entry: IsEntry

    def key(self, foreign: str) -> str | None:
        return foreign if self.is_entry(self.tree, foreign) else None

    def key_name(self, foreign: str) -> str:
        return foreign

    def kind(self, foreign: str) -> Kind | None:
        return self.kinds.kind(*self.kinds.key(self.tree, foreign)[1:])


class Kinds:
    """The kinds of all keys and ports of a document.

    What a node or script gives or asks for counts first, then what is written out. Keys that hold the same
    values have one kind. A port that is given what does not fit together is a text, and its keys keep theirs.

    Args:
        document: The trees.
        ports: The ports of the nodes.
        events: What happens in each tree.
        mapped: Gives what calls share.
        is_entry: Tells keys from enumeration values.
    """

    def __init__(
        self,
        document: Document,
        ports: Ports,
        events: Mapping[str, list[KeyUse | SubTreeCall]],
        mapped: Mapped,
        is_entry: IsEntry,
    ) -> None:
        self._document = document
        self._ports = ports
        self._classes = Classes()
        self._given: dict[tuple[str, str], Kind] = {}
        self._declared()
        reads: dict[tuple[Member, tuple[str, str]], None] = {}
        for name, found in events.items():
            for event in found:
                if isinstance(event, SubTreeCall):
                    for inner, outer in mapped(name, event).items():
                        self._classes.join(("key", name, outer), ("key", event.tree, inner))
                else:
                    reads.update(self._use(name, event))
        assignments = list(self._assignments())
        for name, code in assignments:
            if isinstance(code.value, NameExpr) and is_entry(name, code.value.name):
                self._classes.join(self.key(name, code.name), self.key(name, code.value.name))
        written_out = list(self._written_out())
        for node, port, text in written_out:  # words make a text of a port, whatever its keys hold
            is_word = guess_kind(text) is Kind.TEXT and written_value(text, Kind.POSE)[1]
            if is_word and self.port_kind(node, port) is None:
                self._classes.add(("port", node, port), Kind.TEXT)
        self._join_reads(reads)
        self._note_values(events)
        for name, code in assignments:
            value = assigned_value(code)
            kind = kind_of_code(value, _Names(self, name, is_entry))
            if kind is not None:
                found_kind = Kind.NUMBER if kind is Kind.INTEGER and is_fractional(value) else kind
                self._classes.add(self.key(name, code.name), found_kind)
        for node, port, text in written_out:
            kind = self.port_kind(node, port)
            if kind is None:
                self._classes.add(("port", node, port), guess_kind(text))
            elif written_value(text, kind)[1]:
                self._given[node, port] = _common_kind((kind, guess_kind(text))) or Kind.TEXT

    def kind(self, tree: str, key: str) -> Kind | None:
        """Return the kind of a key, None when it is not known."""
        return self._classes.kind(("key", tree, key))

    def port_kind(self, node: str, port: str) -> Kind | None:
        """Return the kind of a port of a node that this installation lacks, None when it is not known."""
        return self._given.get((node, port)) or self._classes.kind(("port", node, port))

    def key(self, tree: str, key: str) -> Member:
        """Return a key by its name in a script or port."""
        return "key", tree, local_key(key, is_main=tree == self._document.main)

    def _declared(self) -> None:
        for name, model in self._document.models.items():
            if model.category == "SubTree" and name in self._document.trees:
                for port, about in model.ports.items():
                    if about.kind is not None:
                        self._classes.add(("key", name, port), about.kind)

    def _use(self, tree: str, use: KeyUse) -> Iterator[tuple[tuple[Member, tuple[str, str]], None]]:
        """Note one use of a key; gives the key and the port that reads it, which are joined later."""
        key = ("key", tree, use.key)
        if use.kind is not None:
            self._classes.add(key, use.kind)
        if use.hint is not None:
            self._classes.hint(key, use.hint)
        if use.element.tag == "SetBlackboard" and use.access == READ and use.pointed:
            target = use.element.get("output_key")
            self._classes.join(key, self.key(tree, pointer(target, "output_key") or target))
        if use.port is not None:
            model = self._ports.port(*use.port)
            if model is not None and model.kind is not None:
                self._classes.add(("port", *use.port), model.kind)
            if use.access == READ:
                yield (key, use.port), None
            else:
                self._classes.join(key, ("port", *use.port))

    def _assignments(self) -> Iterator[tuple[str, AssignmentExpr]]:
        for name, tree in self._document.trees.items():
            for element in tree.root.walk():
                for attribute in SCRIPTS.get(element.tag, SCRIPTS[""]):
                    try:
                        statements = parse_script(element.get(attribute)) if element.get(attribute) else []
                    except ConfigError:
                        continue  # converting it reports the problem
                    yield from ((name, c) for c in statements if isinstance(c, AssignmentExpr))

    def _join_reads(self, reads: Collection[tuple[Member, tuple[str, str]]]) -> None:
        known = [read for read in reads if self._classes.kind(("port", *read[1])) is not None]
        for key, port in [*known, *(read for read in reads if read not in set(known))]:
            if not self._classes.join_if_alike(key, ("port", *port)):
                self._given[port] = Kind.TEXT

    def _note_values(self, events: Mapping[str, list[KeyUse | SubTreeCall]]) -> None:
        """Note the kinds of what is written out for keys."""
        for name, found in events.items():
            for event in found:
                if isinstance(event, SubTreeCall):
                    for port, text in event.literals.items():
                        self._note_value(("key", event.tree, port), text)
                elif event.element.tag == "SetBlackboard" and event.access != READ:
                    text = event.element.get("value")
                    if pointer(text, "value") is None:
                        self._note_value(("key", name, event.key), text)

    def _note_value(self, key: Member, text: str) -> None:
        kind = self._classes.kind(key)
        if kind is None or written_value(text, kind)[1]:
            self._classes.add(key, guess_kind(text))

    def _written_out(self) -> Iterator[tuple[str, str, str]]:
        """Yield what is written out for ports of nodes that are not skills of this installation."""
        for tree in self._document.trees.values():
            for element in tree.root.walk():
                for node, port, text in literals_of(element):
                    if self._ports.skill(node) is None:
                        model = self._ports.port(node, port)
                        if model is not None and model.direction == "out":
                            continue  # it has no place in an output, and is left out
                        if model is not None and model.kind is not None:
                            self._classes.add(("port", node, port), model.kind)
                        yield node, port, text
