"""Checks of the flow of keys: is a key written before it is read, on some way or on every way?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from florence_bt.core.errors import closest_first
from florence_bt.trees import model
from florence_bt.trees._facts import Facts, fits
from florence_bt.trees._notes import Notes
from florence_bt.trees.model import Mission, Node, Reference, Value, references
from florence_bt.trees.quantities import with_article
from florence_bt.trees.source import Position


@dataclass(frozen=True, slots=True)
class Written:
    """The keys that have a value at some point.

    Attributes:
        maybe: Those that some way to this point writes.
        surely: Those that every way to this point writes.
    """

    maybe: frozenset[str]
    surely: frozenset[str]

    def plus(self, *keys: str) -> Written:
        """After these keys were written too."""
        return Written(self.maybe | set(keys), self.surely | set(keys))


class KeyChecks:
    """Follows the keys through the tree of a mission.

    Args:
        mission: The mission.
        facts: Its surroundings.
        notes: Receives what is wrong.
    """

    def __init__(self, mission: Mission, facts: Facts, notes: Notes) -> None:
        self._mission = mission
        self._facts = facts
        self._notes = notes
        self._kinds = facts.key_kinds(mission)
        writers = (key.text for node in mission.nodes() for key, _ in facts.writes(node, self._kinds))
        self._known = {*writers, *mission.inputs}

    def check(self) -> None:
        """Check the tree and the declared outputs."""
        if self._mission.tree is None:
            return
        start = Written(frozenset(self._mission.inputs), frozenset(self._mission.inputs))
        self._check_outputs(self._after(self._mission.tree, start))

    def _check_outputs(self, end: Written) -> None:
        for name, port in self._mission.outputs.items():
            position = self._mission.positions.get(name, Position())
            if name not in end.maybe:
                valid = [f"out: {{...: {name}}}", f"set: {{{name}: ...}}"]
                self._notes.error(position, f"no node writes the output {name!r}", valid)
            elif name not in end.surely:
                self._notes.warning(position, f"the mission can succeed without writing the output {name!r}")
            kind = self._kinds.get(name)
            if not fits(kind, port.kind) and kind is not None:
                message = (
                    f"the output {name!r} is {with_article(port.kind)}, but its key is {with_article(kind)}"
                )
                self._notes.error(position, message)

    def _after(self, node: Node, before: Written) -> Written:
        """The keys that have a value when a node has succeeded; what it reads is checked on the way."""
        for value in _read_by(node):
            for reference in references(value):
                self._check_read(reference, before)
        after = self._inside(node, before)
        own = [key.text for key, _ in self._facts.writes(node, self._kinds)]
        if not isinstance(node, model.Retry):
            after = after.plus(*own)
        for text in _told_by(node):
            for reference in references(text):
                self._check_known(reference)
        if node.cleanup is not None:
            # The clean-up can come after any part of the body.
            cleaned = self._after(node.cleanup, Written(after.maybe, before.surely))
            after = Written(after.maybe | cleaned.maybe, after.surely)
        return after

    def _inside(self, node: Node, before: Written) -> Written:
        match node:
            case model.Sequence(children=children):
                for child in children:
                    before = self._after(child, before)
                return before
            case model.Selector(children=children):
                return self._selector(children, before)
            case model.Parallel(children=children, any_is_enough=enough):
                ends = [self._after(child, before) for child in children]
                maybe = before.maybe.union(*(end.maybe for end in ends))
                sure = [end.surely for end in ends] or [before.surely]
                return Written(maybe, frozenset.intersection(*sure) if enough else frozenset.union(*sure))
            case model.Succeed(child=child) | model.Invert(child=child):
                return Written(self._after(child, before).maybe, before.surely)
            case model.Retry(child=child, attempt_key=key):
                return self._after(child, before.plus(key.text) if key else before)
            case model.Repeat(child=child) | model.Timeout(child=child):
                return self._after(child, before)
            case model.Fail():
                # Nothing comes after it, so nothing is missing there.
                return Written(before.maybe, frozenset(self._known))
        return before

    def _selector(self, children: tuple[Node, ...], before: Written) -> Written:
        maybe, ends = before.maybe, []
        for child in children:
            # A child begins after the ones before it have failed, perhaps half-way.
            end = self._after(child, Written(maybe, before.surely))
            maybe |= end.maybe
            ends.append(end.surely)
        return Written(maybe, frozenset.intersection(*ends) if ends else before.surely)

    def _check_read(self, reference: Reference, before: Written) -> None:
        key = reference.key
        if key not in self._known:
            self._check_known(reference)
        elif key not in before.maybe:
            self._notes.error(
                reference.position,
                f"the key {key!r} is read before any node has written it",
                [f"${name}" for name in closest_first(key, before.maybe)],
            )
        elif key not in before.surely:
            self._notes.warning(
                reference.position, f"the key {key!r} may have no value here: not every way writes it"
            )

    def _check_known(self, reference: Reference) -> None:
        if reference.key not in self._known:
            valid = [f"${name}" for name in closest_first(reference.key, self._known)]
            self._notes.error(reference.position, f"no node writes a key {reference.key!r}", valid)


def _read_by(node: Node) -> Iterator[Value]:
    """The values that a node needs when it begins."""
    match node:
        case model.Use(inputs=inputs) | model.Call(inputs=inputs):
            yield from (value for _, value in inputs)
        case model.Set(values=values):
            yield from (value for _, value in values)
        case model.Retry(attempts=value) | model.Repeat(rounds=value):
            yield value
        case model.Timeout(duration=value) | model.Wait(duration=value) | model.Fail(reason=value):
            yield value


def _told_by(node: Node) -> Iterator[Value]:
    """The texts with which a node explains itself; a missing key there does no harm."""
    if node.reasons is not None:
        if node.reasons.always is not None:
            yield node.reasons.always
        yield from node.reasons.by_code.values()
