"""Checks of names and values: skills, missions, inputs, outputs, kinds, units, limits, hotspots."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Mapping

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees import model
from florence_bt.trees._facts import Facts, fits, kind_of
from florence_bt.trees._notes import Notes
from florence_bt.trees.kinds import NODE_KINDS
from florence_bt.trees.model import Literal, Mission, Node, PoseParts, Reference, Value
from florence_bt.trees.quantities import with_article
from florence_bt.trees.values import port_value, tree_value

HOTSPOT_LABELS = {"get_hotspot": "label"}
"""Skill -> the input that must be the label of a hotspot."""

_COUNT = Port(Kind.INTEGER, "", minimum=1)
_PAUSE = Port(Kind.DURATION, "", minimum=0.0)


class NameChecks:
    """Checks every node of a mission by itself.

    Args:
        mission: The mission.
        facts: Its surroundings.
        hotspots: The labels of all hotspots; None when they are not known.
        notes: Receives what is wrong.
    """

    def __init__(
        self, mission: Mission, facts: Facts, hotspots: Collection[str] | None, notes: Notes
    ) -> None:
        self._mission = mission
        self._facts = facts
        self._hotspots = hotspots
        self._notes = notes
        self._kinds = facts.key_kinds(mission)

    def check(self) -> None:
        """Check all nodes."""
        for node in self._mission.nodes():
            self._check_node(node)
            self._check_writes(node)

    def _check_node(self, node: Node) -> None:
        match node:
            case model.Use():
                self._check_use(node)
            case model.Call():
                self._check_call(node)
            case model.Retry(attempts=attempts):
                self._check_value(attempts, _COUNT, "retry")
            case model.Repeat(rounds=rounds):
                self._check_value(rounds, _COUNT, "repeat")
            case model.Timeout(duration=duration):
                self._check_value(duration, _PAUSE, "timeout")
            case model.Wait(duration=duration):
                self._check_value(duration, _PAUSE, "wait")
            case model.Set(values=values):
                for key, value in values:
                    self._check_value(value, None, key.text)

    def _check_use(self, node: model.Use) -> None:
        declaration = self._facts.declarations.get(node.skill)
        if declaration is None:
            self._unknown_kind(node)
            return
        if not node.table_given:
            self._notes.error(
                node.position,
                f"the inputs of {node.skill} must be a table",
                [f"{node.skill}: {{input: value}}"],
            )
            return
        self._check_inputs(node.skill, node, declaration.inputs, node.inputs)
        self._check_outputs(node.skill, declaration.outputs, node.outputs)
        self._check_hotspot(node)

    def _unknown_kind(self, node: model.Use) -> None:
        names = [*NODE_KINDS, *self._facts.declarations]
        valid = list(closest_first(node.skill, names))
        if node.skill in self._facts.library:
            valid = [f"run: {node.skill}"]
        elif len(valid) == len(names):
            valid = sorted(self._facts.declarations) + list(NODE_KINDS)
        self._notes.error(node.position, f"there is no skill and no kind of node {node.skill!r}", valid)

    def _check_call(self, node: model.Call) -> None:
        name = node.mission.text
        mission = self._facts.library.find(name)
        if mission is None:
            self._notes.unknown(
                node.mission.position, f"there is no mission {name!r}", name, self._facts.library.names()
            )
            return
        self._check_inputs(name, node, mission.inputs, node.inputs)
        self._check_outputs(name, mission.outputs, node.outputs)

    def _check_inputs(
        self, owner: str, node: Node, ports: Mapping[str, Port], given: Iterable[tuple[Literal, Value]]
    ) -> None:
        # A misspelt input is not reported as missing too.
        names = set()
        for name, value in given:
            names |= {name.text, *difflib.get_close_matches(name.text, ports, n=1)}
            if name.text in ports:
                self._check_value(value, ports[name.text], name.text)
            else:
                self._notes.unknown(name.position, f"{owner} has no input {name.text!r}", name.text, ports)
        for missing in (name for name, port in ports.items() if port.required and name not in names):
            about = f" ({ports[missing].description})" if ports[missing].description else ""
            self._notes.error(node.position, f"{owner} needs the input {missing!r}{about}")

    def _check_outputs(
        self, owner: str, ports: Mapping[str, Port], given: Iterable[tuple[Literal, Literal]]
    ) -> None:
        for output, _ in given:
            if output.text not in ports:
                message = f"{owner} has no output {output.text!r}"
                self._notes.unknown(output.position, message, output.text, ports)

    def _check_value(self, value: Value, port: Port | None, what: str) -> None:
        try:
            if port is None:
                tree_value(value, None)
            else:
                port_value(value, port)
        except ConfigError as error:
            self._notes.error(value.position, f"{what}: {error.problem}", error.valid)
            return
        if isinstance(value, Reference) and port is not None:
            self._check_reference(value, port.kind, what)
        elif isinstance(value, PoseParts):
            parts = ((value.x, Kind.LENGTH), (value.y, Kind.LENGTH), (value.yaw, Kind.ANGLE))
            for part, kind in parts:
                if isinstance(part, Reference):
                    self._check_reference(part, kind, what)

    def _check_reference(self, value: Reference, wanted: Kind, what: str) -> None:
        given = kind_of(value, self._kinds)
        if not fits(given, wanted) and given is not None:
            valid = [f"${key}" for key, kind in self._kinds.items() if fits(kind, wanted)]
            message = f"{what}: {with_article(wanted)} is needed, but ${value.key} is {with_article(given)}"
            self._notes.error(value.position, message, valid)

    def _check_writes(self, node: Node) -> None:
        for key, kind in self._facts.writes(node, self._kinds):
            if key.text in self._mission.inputs:
                self._notes.error(
                    key.position, f"the key {key.text!r} is an input of the mission and cannot be written"
                )
            elif not fits(kind, self._kinds.get(key.text)):
                known, new = with_article(self._kinds[key.text]), with_article(kind) if kind else "another"
                self._notes.error(key.position, f"the key {key.text!r} is {known} elsewhere and {new} here")

    def _check_hotspot(self, node: model.Use) -> None:
        if self._hotspots is None:
            return
        for name, value in node.inputs:
            if HOTSPOT_LABELS.get(node.skill) == name.text and isinstance(value, Literal):
                label = value.text
                if label not in self._hotspots:
                    self._notes.unknown(
                        value.position, f"there is no hotspot {label!r}", label, self._hotspots
                    )
