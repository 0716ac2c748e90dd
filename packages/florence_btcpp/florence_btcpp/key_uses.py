"""The uses of keys in the elements of a tree, and the calls of other trees."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.model import FAILURE_KEYS
from florence_btcpp.document import Tree
from florence_btcpp.mission_text import read_flow
from florence_btcpp.node_models import (
    NodeModel,
    PortModel,
    category_of,
    known_nodes,
    nav2_nodes,
    nav2_port,
)
from florence_btcpp.script import AssignmentExpr, hints_in, literal_kind, names_in, parse_script
from florence_btcpp.vocabulary import (
    CATEGORIES,
    LOOP_KINDS,
    POST_CONDITIONS,
    PRE_CONDITIONS,
    PREFIX,
    private_key,
)
from florence_btcpp.xml_source import Element

READ, WRITE, UNKNOWN = "read", "write", "unknown"

_BUILTIN_KINDS = {
    "num_attempts": Kind.INTEGER,
    "num_cycles": Kind.INTEGER,
    "number_of_retries": Kind.INTEGER,
    "msec": Kind.INTEGER,
    "delay_msec": Kind.INTEGER,
}
_REFERENCE = re.compile(r"\$(?:([a-z][a-z0-9_]*)|\{([a-z][a-z0-9_]*)\})")
_NO_PORTS = ("ID", "name", "_autoremap")


@dataclass(frozen=True, slots=True)
class KeyUse:
    """One use of a key.

    Attributes:
        key: The key as written, without braces.
        access: ``read``, ``write`` or ``unknown``.
        kind: The kind that the place asks for or gives, None when it is not known.
        port: The node and port that it stands in, when it is not one of a skill of this installation.
        element: The element.
        pointed: Whether a port points to it; else it is a name in a script.
        hint: The kind of what it is compared with, which counts when nothing else gives the kind.
    """

    key: str
    access: str
    kind: Kind | None
    port: tuple[str, str] | None
    element: Element
    pointed: bool = True
    hint: Kind | None = None


def pointer(value: str, attribute: str) -> str | None:
    """Return the key that a value of a port points to: ``{key}``, ``{=}``; None when it is a literal."""
    text = value.strip()
    if len(text) < 3 or not (text.startswith("{") and text.endswith("}")):
        return None
    inner = text[1:-1].strip()
    return attribute if inner == "=" else inner or None


def registration(element: Element) -> str:
    """Return the ID of the node that an element makes."""
    return element.get("ID") if element.tag in CATEGORIES else element.tag


@dataclass(frozen=True)
class Ports:
    """The known ports of nodes.

    Attributes:
        declarations: The skills of this installation, by name.
        skill_of: Registration ID -> name of the skill.
        models: What the files declare, by registration ID.
    """

    declarations: Mapping[str, SkillDeclaration]
    skill_of: Mapping[str, str]
    models: Mapping[str, NodeModel]

    def model(self, name: str) -> NodeModel | None:
        """Return what is declared about a node, by its registration ID."""
        return self.models.get(name) or nav2_nodes().get(name)

    def skill(self, name: str) -> SkillDeclaration | None:
        """Return the skill of this installation that a node is, by its registration ID."""
        return self.declarations.get(self.skill_of.get(name, name))

    def mapped_by_default(self, tree: str) -> dict[str, str]:
        """Return the ports of a tree that go to a key, as its model says, where a call does not say."""
        model = self.models.get(tree)
        if model is None or model.category != "SubTree":
            return {}
        return {
            name: port.default
            for name, port in model.ports.items()
            if port.default and pointer(port.default, name) not in (None, private_key(tree, name))
        }

    def port(self, name: str, port: str) -> PortModel | None:
        """Return what is known about a port; the skills of this installation know best."""
        skill = self.skill(name)
        if skill is not None:
            found, direction = port_of_skill(skill, port)
            return PortModel(direction, found.kind, found.description) if found is not None else None
        model = self.models.get(name)
        if model is not None:
            return model.ports.get(port)
        return nav2_port(name, port)


def port_of_skill(skill: SkillDeclaration, port: str) -> tuple[Port | None, str]:
    """Return the input or output that an attribute stands for, and its direction.

    An output that is called like an input is written with ``out_`` before its name.
    """
    if port in skill.inputs:
        return skill.inputs[port], "in"
    bare = port.removeprefix("out_")
    if port in skill.outputs:
        return skill.outputs[port], "out"
    return (skill.outputs[bare], "out") if bare in skill.outputs and bare in skill.inputs else (None, "in")


def uses_of(element: Element, ports: Ports) -> Iterator[KeyUse]:
    """Yield the keys that an element itself uses, in the order of time; subtree calls are left out."""
    for name in PRE_CONDITIONS:
        yield from script_uses(element.get(name), element)
    yield from _own(element, ports)
    for name in POST_CONDITIONS:
        yield from script_uses(element.get(name), element)


def _own(element: Element, ports: Ports) -> Iterator[KeyUse]:
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


def _set_blackboard(element: Element) -> Iterator[KeyUse]:
    value, target = element.get("value"), element.get("output_key")
    source = pointer(value, "value")
    if source is not None:
        yield KeyUse(source, READ, None, None, element)
    name = pointer(target, "output_key") or target
    if name:
        yield KeyUse(name, WRITE, None, None, element)


def _florence(element: Element) -> Iterator[KeyUse]:
    if element.tag == "FlorenceCatch":
        yield from (KeyUse(key, WRITE, Kind.TEXT, None, element) for key in FAILURE_KEYS)
    for name, value in element.attributes.items():
        key = pointer(value, name)
        if name.startswith("_") or name in _NO_PORTS:
            continue
        if key is not None:
            written = _is_output(element.tag, name)
            number = written and name != "as"
            yield KeyUse(key, WRITE if written else READ, Kind.INTEGER if number else None, None, element)
        elif name in ("when", "while", "code", "values") or value.startswith(PREFIX):
            yield from own_references(value, element)
        if name == "values":
            yield from (KeyUse(key, WRITE, None, None, element) for key in _set_keys(value))


def _is_output(tag: str, port: str) -> bool:
    model = known_nodes().get(tag)
    return model is not None and port in model.ports and model.ports[port].direction == "out"


def _set_keys(text: str) -> list[str]:
    try:
        values = read_flow(f"{{{text}}}")
    except ConfigError:
        return []  # converting it reports the problem
    return list(values) if isinstance(values, dict) else []


def own_references(text: str, element: Element) -> Iterator[KeyUse]:
    """Yield the keys in a text of the mission language."""
    for plain, braced in _REFERENCE.findall(text.replace("$$", "")):
        yield KeyUse(plain or braced, READ, None, None, element)


def _ports(element: Element, ports: Ports) -> Iterator[KeyUse]:
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
                yield KeyUse(key, WRITE, LOOP_KINDS[element.tag], None, element)
            else:
                yield KeyUse(key, READ, _BUILTIN_KINDS.get(attribute), None, element)
            continue
        model = ports.port(name, attribute)
        if model is None:
            yield KeyUse(key, UNKNOWN, None, (name, attribute), element)
            continue
        is_ours = ports.skill(name) is not None
        kind, port = (model.kind, None) if is_ours else (None, (name, attribute))
        if model.direction in ("in", "inout"):
            yield KeyUse(key, READ, kind, port, element)
        if model.direction in ("out", "inout"):
            yield KeyUse(key, WRITE, kind, port, element)


def script_uses(text: str, element: Element) -> Iterator[KeyUse]:
    """Yield the keys of a script; one that cannot be read has none (converting it reports the problem)."""
    try:
        statements = parse_script(text)
    except ConfigError:
        return
    for code in statements:
        hints = dict(hints_in(code))
        kinds = {code.name: literal_kind(code.value)} if isinstance(code, AssignmentExpr) else {}
        for name, written in names_in(code):
            kind = kinds.get(name) if written else None
            hint = None if written else hints.get(name)
            yield KeyUse(name, WRITE if written else READ, kind, None, element, False, hint)


ROOT = "@"
"""Before a key of the outermost blackboard."""


@dataclass(frozen=True, slots=True)
class SubTreeCall:
    """A ``<SubTree>``.

    Attributes:
        element: The element.
        tree: The ID that is called.
        keys: Port -> key of the caller.
        literals: Port -> value written out.
        autoremap: Whether all further keys are those of the caller.
    """

    element: Element
    tree: str
    keys: dict[str, str]
    literals: dict[str, str]
    autoremap: bool


def local_key(key: str, *, is_main: bool) -> str:
    """Return a key as it is called in a tree: in the main tree the outermost blackboard is its own."""
    return key.removeprefix(ROOT) if is_main else key


def literals_of(element: Element) -> Iterator[tuple[str, str, str]]:
    """Yield what is written out in ports of another project's node: registration ID, port, value."""
    if category_of(element.tag) is not None or element.tag == "SubTree":
        return
    for name, value in element.attributes.items():
        if name not in _NO_PORTS and name[:1] != "_" and pointer(value, name) is None:
            yield registration(element), name, value


def events_of(tree: Tree, ports: Ports, *, is_main: bool) -> Iterator[KeyUse | SubTreeCall]:
    """Yield the uses of keys and the calls of a tree, in the order of the file."""
    for element in tree.root.walk():
        for use in uses_of(element, ports):
            yield replace(use, key=local_key(use.key, is_main=is_main))
        if element.tag == "SubTree":
            keys, literals = {}, {}
            given = {**ports.mapped_by_default(element.get("ID")), **element.attributes}
            for name, value in given.items():
                if name in ("ID", "name") or name.startswith("_"):
                    continue
                key = pointer(value, name)
                if key is not None:
                    keys[name] = local_key(key, is_main=is_main)
                else:
                    literals[name] = value
            autoremap = element.get("_autoremap").lower() in ("true", "1")
            yield SubTreeCall(element, element.get("ID"), keys, literals, autoremap)
