"""Which keys of the blackboard every element reads and writes, in the order of the file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from florence_bt.btcpp.nav2 import Nav2Models
from florence_bt.btcpp.port_models import NodeModel, PortModel
from florence_bt.btcpp.script import Assignment, hints_in, literal_kind, names_in, parse_script
from florence_bt.btcpp.vocabulary import (
    CATEGORIES,
    LOOP_KINDS,
    OUTPUT_PORTS,
    POST_CONDITIONS,
    PRE_CONDITIONS,
    PREFIX,
    category_of,
    private_key,
)
from florence_bt.btcpp.written import read_flow
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError

READ, WRITE, UNKNOWN = "read", "write", "unknown"

_BUILTIN_KINDS = {
    "num_attempts": Kind.INTEGER,
    "num_cycles": Kind.INTEGER,
    "msec": Kind.INTEGER,
    "delay_msec": Kind.INTEGER,
}
_REFERENCE = re.compile(r"\$(?:([a-z][a-z0-9_]*)|\{([a-z][a-z0-9_]*)\})")
_NO_PORTS = ("ID", "name", "_autoremap")


@dataclass(frozen=True, slots=True)
class Use:
    """One use of a key.

    Attributes:
        key: The key as written, without braces.
        access: ``read``, ``write`` or ``unknown``.
        kind: The kind that the place asks for or gives, None when it is not known.
        port: The node and port that it stands in, when the kind must be guessed from all its uses.
        element: The element.
        pointed: Whether a port points to it; else it is a name in a script.
        hint: The kind of what it is compared with, which counts when nothing else tells the kind.
    """

    key: str
    access: str
    kind: Kind | None
    port: tuple[str, str] | None
    element: Element
    pointed: bool = True
    hint: Kind | None = None


def pointer(value: str, attribute: str) -> str | None:
    """The key that a value of a port points to: ``{key}``, ``{=}``; None when it is a literal."""
    text = value.strip()
    if len(text) < 3 or not (text.startswith("{") and text.endswith("}")):
        return None
    inner = text[1:-1].strip()
    return attribute if inner == "=" else inner or None


def registration(element: Element) -> str:
    """The ID of the node that an element makes."""
    return element.get("ID") if element.tag in CATEGORIES else element.tag


@dataclass(frozen=True)
class Ports:
    """What is known about the ports of nodes.

    Attributes:
        declarations: The skills of this installation, by name.
        skill_of: Registration ID -> name of the skill.
        models: What the files declare, by registration ID.
        nav2: The nodes of Nav2.
    """

    declarations: Mapping[str, SkillDeclaration]
    skill_of: Mapping[str, str]
    models: Mapping[str, NodeModel]
    nav2: Nav2Models

    def model(self, name: str) -> NodeModel | None:
        """What is declared about a node, by its registration ID."""
        return self.models.get(name) or self.nav2.find(name)

    def skill(self, name: str) -> SkillDeclaration | None:
        """The skill of this installation that a node is, by its registration ID."""
        return self.declarations.get(self.skill_of.get(name, name))

    def mapped_by_default(self, tree: str) -> dict[str, str]:
        """The ports of a tree that go to a key, in the words of its model, where a call does not say."""
        model = self.models.get(tree)
        if model is None or model.category != "SubTree":
            return {}
        return {
            name: port.default
            for name, port in model.ports.items()
            if port.default and pointer(port.default, name) not in (None, private_key(tree, name))
        }

    def port(self, name: str, port: str) -> PortModel | None:
        """What is known about a port; the skills of this installation know best."""
        skill = self.skill(name)
        if skill is not None:
            found, direction = port_of_skill(skill, port)
            return PortModel(direction, found.kind, found.description) if found is not None else None
        model = self.models.get(name)
        if model is not None:
            return model.ports.get(port)
        nav2 = self.nav2.find(name)
        return self.nav2.port(nav2, port) if nav2 is not None else None


def port_of_skill(skill: SkillDeclaration, port: str) -> tuple[Port | None, str]:
    """The input or output that an attribute stands for, and its direction.

    An output that is called like an input is written with ``out_`` before its name.
    """
    if port in skill.inputs:
        return skill.inputs[port], "in"
    bare = port.removeprefix("out_")
    if port in skill.outputs:
        return skill.outputs[port], "out"
    return (skill.outputs[bare], "out") if bare in skill.outputs and bare in skill.inputs else (None, "in")


def uses_of(element: Element, ports: Ports) -> Iterator[Use]:
    """The keys that one element uses by itself, in the order of time; calls of subtrees are left out."""
    for name in PRE_CONDITIONS:
        yield from script_uses(element.get(name), element)
    yield from _own(element, ports)
    for name in POST_CONDITIONS:
        yield from script_uses(element.get(name), element)


def _own(element: Element, ports: Ports) -> Iterator[Use]:
    match element.tag:
        case "Script" | "ScriptCondition":
            yield from script_uses(element.get("code"), element)
        case "Precondition":
            yield from script_uses(element.get("if"), element)
        case "SetBlackboard":
            yield from _set_blackboard(element)
        case "SubTree":
            return
        case tag if tag.startswith("Florence"):
            yield from _florence(element)
        case _:
            found = list(_ports(element, ports))
            yield from (use for use in found if use.access != WRITE)
            yield from (use for use in found if use.access == WRITE)


def _set_blackboard(element: Element) -> Iterator[Use]:
    value, target = element.get("value"), element.get("output_key")
    source = pointer(value, "value")
    if source is not None:
        yield Use(source, READ, None, None, element)
    name = pointer(target, "output_key") or target
    if name:
        yield Use(name, WRITE, None, ("SetBlackboard", f"{id(element)}"), element)


def _florence(element: Element) -> Iterator[Use]:
    for name, value in element.attributes.items():
        key = pointer(value, name)
        if name.startswith("_") or name in _NO_PORTS:
            continue
        if key is not None:
            written = (element.tag, name) in OUTPUT_PORTS
            yield Use(key, WRITE if written else READ, Kind.INTEGER if written else None, None, element)
        elif name in ("when", "unless", "while", "code", "values") or value.startswith(PREFIX):
            yield from own_references(value, element)
        if name == "values":
            yield from (Use(key, WRITE, None, None, element) for key in _set_keys(value))


def _set_keys(text: str) -> list[str]:
    try:
        values = read_flow(f"{{{text}}}")
    except ConfigError:
        return []  # converting it reports the problem
    return list(values) if isinstance(values, dict) else []


def own_references(text: str, element: Element) -> Iterator[Use]:
    """The keys in a text of the mission language."""
    for plain, braced in _REFERENCE.findall(text.replace("$$", "")):
        yield Use(plain or braced, READ, None, None, element)


def _ports(element: Element, ports: Ports) -> Iterator[Use]:
    name, builtin = registration(element), category_of(element.tag) is not None
    for attribute, value in element.attributes.items():
        if attribute in _NO_PORTS or attribute.startswith("_"):
            continue
        if value.startswith(PREFIX):
            yield from own_references(value, element)
            continue
        key = pointer(value, attribute)
        if key is None:
            continue
        if builtin:
            if attribute == "value" and element.tag in LOOP_KINDS:
                yield Use(key, WRITE, LOOP_KINDS[element.tag], None, element)
            else:
                yield Use(key, READ, _BUILTIN_KINDS.get(attribute), None, element)
            continue
        model = ports.port(name, attribute)
        kind = model.kind if model else None
        guessed = None if kind is not None else (name, attribute)
        if model is None:
            yield Use(key, UNKNOWN, kind, guessed, element)
        if model is not None and model.direction in ("in", "inout"):
            yield Use(key, READ, kind, guessed, element)
        if model is not None and model.direction in ("out", "inout"):
            yield Use(key, WRITE, kind, guessed, element)


def script_uses(text: str, element: Element) -> Iterator[Use]:
    """The keys of a script; a script that cannot be read uses none (converting it reports the problem)."""
    try:
        statements = parse_script(text)
    except ConfigError:
        return
    for code in statements:
        hints = dict(hints_in(code))
        kinds = {code.name: literal_kind(code.value)} if isinstance(code, Assignment) else {}
        for name, written in names_in(code):
            kind = kinds.get(name) if written else None
            hint = None if written else hints.get(name)
            yield Use(name, WRITE if written else READ, kind, None, element, False, hint)
