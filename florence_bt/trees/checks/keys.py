"""Checks of the flow of keys: written before they are read, on some way or on every way; and read at all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from florence_bt.behaviours.keys import HIDDEN
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import close_matches, closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.checks.key_flow import KeyFlow, State, Written
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Literal, Mission, Node, Property, Reference, Value, references
from florence_bt.trees.language.quantities import with_article
from florence_bt.trees.language.values import fits

_TIMES = ("now", "time", "hour", "date", "today", "weekday")
"""Things that people look for in a key: no mission knows what time it is."""


class KeyChecks:
    """Follows the keys through the tree of a mission.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
        properties: What must hold of the mission: they read keys, too.
    """

    def __init__(
        self,
        mission: Mission,
        analysis: Analysis,
        findings: FindingList,
        properties: Iterable[Property] = (),
    ) -> None:
        self._mission = mission
        self._read_by_properties = {
            key for each in properties if each.condition is not None for key in each.condition.keys
        }
        self._findings = findings
        self._analysis = analysis
        known = analysis.of(mission)
        self._kinds = known.kinds
        self._all = known.all
        self._written = [(node, key) for node in known.all for key, _ in analysis.writes(node, self._kinds)]
        written = {key.text for _, key in self._written}
        wrong = list(_outputs_of_nothing(known.all, analysis))
        self._of_nothing = {key for _, key, _ in wrong}
        # By nodes that cannot be read, and by outputs the wrong way round, which is said there.
        turned_round = {output.text for output, key, given in wrong if key.text in given}
        self._lost = sorted((mission.lost | turned_round) - written)
        names = {**mission.inputs, **mission.keys, **dict.fromkeys([*sorted(written), *self._lost])}
        self._bits = {name: 1 << number for number, name in enumerate(names)}
        by_node: dict[Node, list[str]] = {}
        for node, key in self._written:
            by_node.setdefault(node, []).append(key.text)
        self._flow = KeyFlow(
            self._bits, lambda node: known.of(node).outcomes, lambda node: by_node.get(node, ())
        )

    def check(self) -> None:
        """Check the tree, the declared outputs, and whether what is written is read."""
        if self._mission.tree is None:
            return
        known = self.check_names()
        there = (
            *self._mission.inputs,
            *(key for key, port in self._mission.keys.items() if not port.required),
            *self._lost,
        )
        start = sum(self._bits[name] for name in dict.fromkeys(there))
        self._check_outputs(self._flow.follow(self._mission.tree, Written(start, start), self).success)
        if known and not self._mission.findings:
            # A key that is read under a wrong name, or in an unreadable part, is not reported as unread.
            read = {reference.key for reference in self._wanted()}
            self._check_read_at_all(read | self._read_by_properties | set(self._mission.outputs))

    def check_names(self) -> bool:
        """Check that something writes each key that is read; says whether that is so.

        This holds for a tree of which parts could not be read, too: what they would write counts.
        """
        unknown = [reference for reference in self._wanted() if reference.key not in self._bits]
        for reference in unknown:
            if self._findings.full:
                break
            valid = self._taken(reference.key) or self._instead_of(reference.key)
            self._findings.error(reference.position, f"no node writes a key {reference.key!r}", valid)
        return not unknown

    def _instead_of(self, key: str) -> list[str]:
        """Suggest the keys that look like one that nothing writes; else where it could come from, too."""
        names = [name for name in self._bits if not name.startswith(HIDDEN)]
        valid = [f"${name}" for name in closest_first(key, names)]
        elsewhere = [f"{key} under inputs:", f"set: {{{key}: ...}} before it"]
        return valid if close_matches(key, names) else [*elsewhere, *valid]

    def _taken(self, key: str) -> list[str]:
        """Suggest the ``out`` by which a key gets the output of its name, if a skill or mission has one."""
        if key in model.FAILURE_KEYS:
            return ["a node under on_failure"]
        if key in _TIMES:
            return ['wait_until: "20:00", which waits for a time']
        for node in self._all:
            if isinstance(node, kinds.RunSkill | kinds.CallMission):
                given = self._analysis.output_kinds(node)
                name = node.skill if isinstance(node, kinds.RunSkill) else node.mission.text
                if key in given:
                    return [f"out: {{{key}: {key}}} below {name} of line {node.position.line}"]
                if key == name and given:  # $find_user.room
                    first = next(iter(given))
                    return [
                        f"out: {{{first}: {first}}} below {name} of line {node.position.line}, and ${first}"
                    ]
        return []

    def _wanted(self) -> list[Reference]:
        return [reference for node in self._all for reference in node.references()] + [
            reference
            for node in self._all
            for value in _explanations_of(node)
            for reference in references(value)
            if reference.key not in model.FAILURE_KEYS  # which each failure has
        ]

    def read(self, reference: Reference, before: Written) -> Written:
        """Note that a node reads a key that it needs (see :class:`~.key_flow.ReadObserver`)."""
        key, bit = reference.key, self._bits[reference.key]
        if self._findings.full:
            return before.plus(bit)
        if not before.maybe & bit:
            lines = [line for line in self._lines_that_write(key) if line != reference.position.line]
            valid = [f"the node of line {line} before this one" for line in lines]
            close = close_matches(key, self._names(before.maybe))
            valid += [f"${name}" for name in close] or [f"a default of {key!r} under keys:"]
            message = f"the key {key!r} is read before any node has written it"
            self._findings.in_vain(reference.position, message, valid)
        elif not before.surely & bit:
            message = f"the key {key!r} may have no value here: not every path writes it"
            self._findings.warning(reference.position, message)
        # Reported once on each path.
        return before.plus(bit)

    def _lines_that_write(self, key: str) -> list[int]:
        return sorted({written.position.line for _, written in self._written if written.text == key})[:1]

    def _names(self, keys: int) -> list[str]:
        return [name for name, bit in self._bits.items() if keys & bit and not name.startswith(HIDDEN)]

    def _check_outputs(self, end: State) -> None:
        if end is None:
            for name in self._mission.outputs:
                message = f"the output {name!r} is never given: the mission never succeeds"
                self._findings.in_vain(self._declared_at(name), message)
            return
        for name, port in self._mission.outputs.items():
            position = self._declared_at(name)
            bit = self._bits.get(name, 0)
            if not end.maybe & bit:
                valid = [f"out: {{...: {name}}}", f"set: {{{name}: ...}}"]
                self._findings.error(position, f"no node writes the output {name!r}", valid)
            elif not end.surely & bit:
                self._findings.warning(
                    position, f"the mission can succeed without writing the output {name!r}"
                )
            kind = self._kinds.get(name)
            if not fits(kind, port.kind) and kind is not None:
                message = (
                    f"the output {name!r} is {with_article(port.kind)}, but its key is {with_article(kind)}"
                )
                self._findings.error(position, message, [f"type: {kind.value}"])

    def _check_read_at_all(self, read: set[str]) -> None:
        """Warn of what is written or declared and never read."""
        written = {key.text for _, key in self._written}
        for node, key in self._written:
            if isinstance(node, kinds.OnFailure):
                continue  # nobody has asked for these keys
            known = key.text in read or key.text in self._mission.inputs or key in self._of_nothing
            if not known:
                self._unread(node, key)
        for name in self._mission.inputs:
            if name not in read:
                message = f"nothing reads the input {name!r}"
                self._findings.warning(
                    self._declared_at(name), message, [f"${name} where its value is wanted"]
                )
        for name in self._mission.keys:
            if name not in read and name not in written:
                self._findings.warning(self._declared_at(name), f"nothing reads or writes the key {name!r}")

    def _declared_at(self, name: str) -> Position:
        return self._mission.positions.get(name, Position())

    def _unread(self, node: Node, key: Literal) -> None:
        given = isinstance(node, kinds.RunSkill | kinds.CallMission)
        what = f"output that goes to the key {key.text!r}" if given else f"key {key.text!r}"
        message = f"nothing reads the {what}"
        self._findings.warning(key.position, message, [f"${key.text} in a later node", "leaving it out"])


def _outputs_of_nothing(
    nodes: Iterable[Node], analysis: Analysis
) -> Iterator[tuple[Literal, Literal, Mapping[str, Kind]]]:
    """Yield outputs that a skill or mission lacks, with the key each goes to and those that it has."""
    for node in nodes:
        if isinstance(node, kinds.RunSkill | kinds.CallMission) and node.outputs:
            given = analysis.output_kinds(node)
            yield from ((output, key, given) for output, key in node.outputs if output.text not in given)


def _explanations_of(node: Node) -> Iterator[Value]:
    """Yield the texts with which a node explains itself; a missing key there does no harm."""
    if node.reasons is not None:
        if node.reasons.always is not None:
            yield node.reasons.always
        yield from node.reasons.by_code.values()
