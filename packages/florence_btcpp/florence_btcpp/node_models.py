"""Ports that nodes declare in ``TreeNodesModel``, and the nodes that are known without one.

``known_nodes.xml`` has the nodes whose meaning the import knows: those of BehaviorTree.CPP, controls of Nav2,
and ours, whose names begin with ``Florence``. ``nav2_nodes.xml`` has the ports that the nodes of Nav2 write.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from florence_bt.core.declaration import Kind
from florence_btcpp.mission_text import Quoted
from florence_btcpp.vocabulary import CATEGORIES, KIND_UNITS
from florence_btcpp.xml_source import Element, read_xml

_PORTS = {"input_port": "in", "output_port": "out", "inout_port": "inout", "bidirectional_port": "inout"}
_UNIT = re.compile(r"\s*\[(m|rad|s|m/s|m;m;rad)\]\s*$")
_INTEGERS = re.compile(
    r"(unsigned( int| long| short)?|(std::)?u?int(8|16|32|64)?(_t)?|(long )?long|short|(std::)?size_t)"
)
_TEXTS = re.compile(r"(std::)?string(_view)?|BT::StringView|const char ?\*|std::.*basic_string.*")
_POSES = re.compile(r"(.*::)?(Pose2D|Pose|PoseStamped|PoseWithCovarianceStamped)(_<.*>)?")


@dataclass(frozen=True, slots=True)
class PortModel:
    """A port of a node.

    Attributes:
        direction: ``in``, ``out`` or ``inout``.
        kind: The kind of its values, None when the type is not given or none of ours.
        description: What it is, without the unit.
        default: The value when none is given, as in the XML, or None.
        type_name: The type as written.
        limits: The attributes ``_florence_min`` and ``_florence_max``, by ``min`` and ``max``.
    """

    direction: str
    kind: Kind | None = None
    description: str = ""
    default: str | None = None
    type_name: str = ""
    limits: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class NodeModel:
    """A node of another project.

    Attributes:
        name: Its registration ID.
        category: ``Action``, ``Condition``, ``Control``, ``Decorator`` or ``SubTree``.
        ports: Its ports by name.
        description: What it does.
    """

    name: str
    category: str
    ports: dict[str, PortModel] = field(default_factory=dict)
    description: str = ""


def read_models(root: Element) -> dict[str, NodeModel]:
    """Read the nodes that a file declares, by registration ID."""
    models = {}
    for block in root.children:
        if block.tag == "TreeNodesModel":
            for element in block.children:
                if element.tag in CATEGORIES and element.get("ID"):
                    models[element.get("ID")] = _model(element)
    return models


def _model(element: Element) -> NodeModel:
    ports = {
        child.get("name"): _port(child)
        for child in element.children
        if child.tag in _PORTS and child.get("name")
    }
    description = next(
        (c.text for c in element.children if c.tag == "description"), element.get("_description")
    )
    return NodeModel(element.get("ID"), element.tag, ports, " ".join(description.split()))


def _port(element: Element) -> PortModel:
    text = " ".join((element.text or element.get("description")).split()).strip('"')
    unit = _UNIT.search(text)
    kind = kind_of_type(element.get("type"), unit[1] if unit else "")
    default = element.attributes.get("default")
    limits = tuple(
        (end, element.get(f"_florence_{end}")) for end in ("min", "max") if element.get(f"_florence_{end}")
    )
    return PortModel(_PORTS[element.tag], kind, _UNIT.sub("", text), default, element.get("type"), limits)


def kind_of_type(type_name: str, unit: str = "") -> Kind | None:
    """Return the kind for a C++ type and a unit, None when there is not one."""
    with_unit = next((kind for kind, text in KIND_UNITS.items() if text == f"[{unit}]"), None)
    name = type_name.strip().removeprefix("BT::")
    if name.startswith("std::vector<") and name.endswith(">"):
        item = kind_of_type(name[len("std::vector<") : -1], unit)
        return item.list if item is not None and item.item is None else None
    if name in ("double", "float", "long double"):
        return with_unit or Kind.NUMBER
    if not name:
        return with_unit
    if name == "bool":
        return Kind.BOOLEAN
    if _INTEGERS.fullmatch(name):
        return Kind.INTEGER
    if _TEXTS.fullmatch(name):
        return Kind.TEXT
    return Kind.POSE if _POSES.fullmatch(name) else None


@cache
def known_nodes() -> Mapping[str, NodeModel]:
    """Return the nodes whose meaning the import knows, with all their ports."""
    return read_models(read_xml(Path(__file__).with_name("known_nodes.xml")))


def category_of(tag: str) -> str | None:
    """Return ``Action``, ``Condition``, ``Control`` or ``Decorator``; None for a node of unknown meaning."""
    model = known_nodes().get(tag)
    return model.category if model is not None else None


def ports_of(tag: str) -> list[str]:
    """Return the ports of a node whose meaning is known."""
    return list(known_nodes()[tag].ports) if tag in known_nodes() else []


NAV2_ERROR_PORTS = {"error_code_id": (Kind.INTEGER, "0"), "error_msg": (Kind.TEXT, Quoted(""))}
"""The ports of how an action ended -> kind and value at the start, as Nav2's bt_navigator gives them."""
_NAV2_POSES = ("goal", "start", "pose", "current_pose", "ref_pose", "target_pose", "input_goal")
"""Ports of Nav2's nodes that are read and hold a pose."""


@cache
def nav2_nodes() -> Mapping[str, NodeModel]:
    """Return the nodes of Nav2 with the ports that they write."""
    return read_models(read_xml(Path(__file__).with_name("nav2_nodes.xml")))


def nav2_port(node: str, port: str) -> PortModel | None:
    """Return a port of a node of Nav2; one that is not among those written is read. None for other nodes."""
    if node not in nav2_nodes():
        return None
    written = nav2_nodes()[node].ports.get(port)
    if written is not None:
        return replace(written, type_name="")
    return PortModel("in", Kind.POSE if port in _NAV2_POSES else None)
