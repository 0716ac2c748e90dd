"""Missions to one XML file of BehaviorTree.CPP 4."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.btcpp.nodes_out import NodeWriter
from florence_bt.btcpp.notes import LossNotes
from florence_bt.btcpp.si_values import script_number, si_text
from florence_bt.btcpp.vocabulary import (
    CATEGORIES,
    FORMAT,
    KIND_TYPES,
    KIND_UNITS,
    MARK,
    OUTPUT_PORTS,
    OWN_PORTS,
    private_key,
)
from florence_bt.btcpp.written import write_flow
from florence_bt.btcpp.xml_source import Element
from florence_bt.btcpp.xml_writer import write_xml
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import chain_back, cycles
from florence_bt.trees.language.declared_skills import port_document
from florence_bt.trees.language.findings import ERROR, Finding
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission


@dataclass(frozen=True)
class Exported:
    """What came out of an export.

    Attributes:
        xml: The text of the file.
        trees: The missions in it, the exported one first.
        findings: What BehaviorTree.CPP would do differently (warnings), and which of our nodes it needs
            (notices).
    """

    xml: str
    trees: tuple[str, ...]
    findings: tuple[Finding, ...]


def export_mission(
    name: str, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> Exported:
    """Write a mission, and those that it calls.

    Args:
        name: The mission.
        library: Where the missions are found.
        declarations: The skills by name.

    Raises:
        ConfigError: A mission or a skill does not exist, or a mission has an error that a check would find.
    """
    notes = LossNotes()
    missions = _with_called(name, library)
    declarations = {**declarations}
    root = Element("root", {"BTCPP_format": FORMAT, "main_tree_to_execute": name})
    for mission in missions:
        _check(mission, declarations)
        root.children.append(_tree(mission, library, declarations, notes))
    models = _models(missions, declarations, list(root.children))
    _make_compact(root, missions)
    root.children.append(models)
    return Exported(write_xml(root), tuple(mission.name for mission in missions), tuple(notes.findings))


def _with_called(name: str, library: MissionLibrary) -> list[Mission]:
    found = {name: library.get(name)}
    callees: dict[str, list[str]] = {}
    for caller in (waiting := [name]):
        mission = found[caller]
        calls = [node for node in mission.nodes() if isinstance(node, model.CallMission)]
        callees[caller] = [call.mission.text for call in calls]
        for call in calls:
            called = call.mission.text
            if library.find(called) is None:
                problem = f"there is no mission {called!r}"
                raise _error(mission, call, problem, closest_first(called, library.names()))
            if called not in found:
                found[called] = library.get(called)
                waiting.append(called)
    for caller, cycle in cycles([name], callees.__getitem__).items():
        called = next(each for each in callees[caller] if each in cycle)
        chain = [caller, *chain_back(called, caller, cycle, callees.__getitem__)]
        mission = found[caller]
        call = next(
            node
            for node in mission.nodes()
            if isinstance(node, model.CallMission) and node.mission.text == called
        )
        raise _error(mission, call, f"the mission {caller!r} calls itself: {' -> '.join(chain)}")
    return list(found.values())


def _check(mission: Mission, declarations: Mapping[str, SkillDeclaration]) -> None:
    for finding in mission.findings:
        if finding.severity == ERROR:
            raise finding.as_error()
    for node in mission.nodes():
        if isinstance(node, model.RunSkill) and node.skill not in declarations:
            raise _error(
                mission, node, f"unknown skill {node.skill!r}", closest_first(node.skill, declarations)
            )


def _tree(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration], notes: LossNotes
) -> Element:
    assert mission.tree is not None  # a mission without a tree has an error among its findings
    root = NodeWriter(mission, library, declarations, notes).node(mission.tree)
    attributes = {"ID": mission.name}
    if mission.description:
        attributes["_description"] = mission.description
    if mission.on_restart != "abort":
        attributes[f"{MARK}_on_restart"] = mission.on_restart
    if mission.keys:
        documents = {name: port_document(port) for name, port in mission.keys.items()}
        attributes[f"{MARK}_keys"] = write_flow(documents)[1:-1]
        started = {name: port for name, port in mission.keys.items() if not port.required}
        if started:
            script = Element(
                "Script", {"code": "; ".join(_start(name, port) for name, port in started.items())}
            )
            root = Element("Sequence", {MARK: "keys"}, children=[script, root])
    return Element("BehaviorTree", attributes, children=[root])


def _start(name: str, port: Port) -> str:
    value = port.default
    text = f"'{value}'" if isinstance(value, str) else script_number(value)
    return f"{name} := {text}"


def _models(
    missions: list[Mission], declarations: Mapping[str, SkillDeclaration], trees: list[Element]
) -> Element:
    used: dict[str, Element] = {}
    for tree in trees:
        for element in tree.walk():
            if element.tag in ("Action", "Condition", "Control", "Decorator"):
                used.setdefault(element.get("ID"), element)
    block = Element("TreeNodesModel", {})
    for name in sorted(used):
        if name in OWN_PORTS:
            block.children.append(_own_model(name, used[name].tag))
        else:
            block.children.append(_skill_model(declarations[name], used[name].tag))
    block.children += [_mission_model(mission) for mission in missions]
    return block


def _own_model(name: str, category: str) -> Element:
    element = Element(category, {"ID": name})
    for port, meaning in OWN_PORTS[name].items():
        tag = "output_port" if (name, port) in OUTPUT_PORTS else "input_port"
        element.children.append(Element(tag, {"name": port}, text=meaning))
    return element


def _skill_model(declaration: SkillDeclaration, category: str) -> Element:
    element = Element(category, {"ID": declaration.name})
    element.children.append(Element("description", {}, text=declaration.summary))
    element.children += [_port("input_port", name, port) for name, port in declaration.inputs.items()]
    for name, port in declaration.outputs.items():
        shown = f"out_{name}" if name in declaration.inputs else name
        element.children.append(_port("output_port", shown, port))
    return element


def _mission_model(mission: Mission) -> Element:
    element = Element("SubTree", {"ID": mission.name})
    element.children += [_port("input_port", name, port) for name, port in mission.inputs.items()]
    for name, port in mission.outputs.items():
        if name not in mission.inputs:
            output = _port("output_port", name, port)
            # A call need not ask for it; BehaviorTree.CPP refuses the file unless each has somewhere to go.
            output.attributes["default"] = f"{{{private_key(mission.name, name)}}}"
            element.children.append(output)
    return element


def _make_compact(root: Element, missions: list[Mission]) -> None:
    """Write ``<turn/>`` in place of ``<Action ID="turn"/>`` where BehaviorTree.CPP before 4.9 needs it."""
    names = {mission.name for mission in missions}
    for element in root.walk():
        if element.tag == "ReactiveSequence":
            for child in element.children:
                if child.tag in CATEGORIES and child.tag != "SubTree" and child.get("ID") not in names:
                    child.tag = child.attributes.pop("ID")


def _port(tag: str, name: str, port: Port) -> Element:
    attributes = {"name": name, "type": KIND_TYPES[port.kind]}
    if not port.required and tag == "input_port":
        attributes["default"] = si_text(port.default)
    for end, limit in (("min", port.minimum), ("max", port.maximum)):
        if limit is not None:
            attributes[f"{MARK}_{end}"] = si_text(float(limit) if port.kind is not Kind.INTEGER else limit)
    unit = KIND_UNITS.get(port.kind, "")
    return Element(tag, attributes, text=f"{port.description} {unit}".strip())


def _error(mission: Mission, node: model.Node, problem: str, valid: tuple[str, ...] = ()) -> ConfigError:
    place = node.position
    return ConfigError(problem, file=mission.file, line=place.line, column=place.column, valid=valid)
