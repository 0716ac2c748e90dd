"""Checks of what an author wants to hold of a mission: that the mission uses what its properties name."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import closest_first
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.trees.checks.values import ValueChecks
from florence_bt.trees.kinds.words import TREE_CODES
from florence_bt.trees.language.analysis import Analysis, skills_used_by
from florence_bt.trees.language.findings import Finding, FindingList
from florence_bt.trees.language.model import Mission, Property, PropertyEvent
from florence_bt.trees.language.properties import IT, properties_file, read_properties_beside


def properties_of(mission: Mission, analysis: Analysis) -> tuple[tuple[Property, ...], list[Finding]]:
    """Return what its author wants to hold of a mission, and what is wrong with it.

    Args:
        mission: The mission.
        analysis: Its surroundings.
    """
    beside, findings = read_properties_beside(mission.file)
    properties = (*mission.properties, *beside)
    twice = _in_two_places(mission) if mission.properties and beside else []
    return properties, [*findings, *twice, *_PropertyChecks(mission, analysis).found(properties)]


def _in_two_places(mission: Mission) -> list[Finding]:
    """Report that some properties stand in the mission and others beside it: readers would miss these."""
    notes, other = FindingList(mission.file), properties_file(mission.file).name
    message = f"the mission has properties here and in {other}"
    notes.error(mission.properties[0].position, message, [f"all of them here, without {other}"])
    return notes.findings


class _PropertyChecks:
    """Holds the properties of a mission against the mission."""

    def __init__(self, mission: Mission, analysis: Analysis) -> None:
        self._mission = mission
        self._analysis = analysis
        self._skills = skills_used_by(mission)
        kinds = analysis.of(mission).kinds
        written = {key.text for node in mission.nodes() for key, _ in analysis.writes(node, kinds)}
        self._keys = {*mission.inputs, *mission.keys, *written}
        self._codes: frozenset[str] | None = None

    def found(self, properties: tuple[Property, ...]) -> Iterator[Finding]:
        """Yield what is wrong."""
        for each in properties:
            findings = FindingList(each.file)
            for event in each.events:
                self._check_event(event, findings)
            self._check_condition(each, findings)
            yield from findings.findings

    def _check_event(self, event: PropertyEvent, findings: FindingList) -> None:
        if event.who not in {*self._skills, IT}:
            message = f"the mission does not use {event.who!r}"
            findings.unknown(event.position, message, event.who, [*sorted(self._skills), IT])
        elif event.code and event.code not in self._known_codes():
            message = f"nothing fails with {event.code!r}"
            findings.unknown(event.position, message, event.code, sorted(self._known_codes()))

    def _check_condition(self, wanted: Property, findings: FindingList) -> None:
        condition = wanted.condition
        if condition is None:
            return
        unknown = [key for key in condition.keys if key not in self._keys]
        for key in unknown:
            valid = [f"${name}" for name in closest_first(key, sorted(self._keys))]
            findings.error(condition.position, f"the mission has no key {key!r}", valid)
        if not unknown:
            ValueChecks(self._mission, self._analysis, findings).expression(
                condition, Kind.BOOLEAN, wanted.word
            )

    def _known_codes(self) -> frozenset[str]:
        """Return every code that there is, and every group of codes."""
        if self._codes is None:
            skills = self._analysis.declarations.values()
            declared = (code for skill in skills for code in skill.failures)
            root = self._analysis.of(self._mission).root
            own = (node.code.text for node in self._mission.nodes() if node.code is not None)
            self._codes = frozenset({*declared, *COMMON_CODES, *TREE_CODES, *self._analysis.groups, *own}) | (
                root.outcomes.codes if root is not None else frozenset()
            )
        return self._codes
