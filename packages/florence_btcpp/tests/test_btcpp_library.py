"""BehaviorTree.CPP itself loads and ticks what is exported."""

# ruff: noqa: E501  (missions on one line)

import xml.etree.ElementTree as ET

import pytest
from florence_btcpp.exporter import export_mission

from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from packages.florence_btcpp.tests.test_btcpp_round_trip import HEAD, NODES, SKILLS

library = pytest.importorskip("behaviortreepy")

OWN_CONTROLS = "Sequence"
"""In the place of ``Florence`` nodes, which can be registered in C++ only."""


class Peer:
    """An exported tree in BehaviorTree.CPP.

    Its Python bindings know no ports: those of skills are taken off, so keys stay unwritten there.
    """

    def __init__(self, xml: str) -> None:
        self.calls: list[str] = []
        self.fails: set[str] = set()
        root = ET.fromstring(xml)
        self._factory = library.BehaviorTreeFactory()
        names = {model.get("ID") for model in root.findall("TreeNodesModel/*")}
        controls = {model.get("ID") for model in root.findall("TreeNodesModel/Control")}
        for models in root.findall("TreeNodesModel"):
            for model in list(models):
                self._register(model, models)
        for tree in root.findall("BehaviorTree"):
            for element in tree.iter():
                _strip(element, names, controls)
        self.tree = self._factory.create_tree_from_text(ET.tostring(root, encoding="unicode"))

    def run(self) -> str:
        """Tick to the end; every skill ends at once."""
        for _ in range(1000):
            status = self.tree.tick_exactly_once()
            if status in (library.NodeStatus.SUCCESS, library.NodeStatus.FAILURE):
                return str(status.name)
        raise AssertionError("the tree does not end")

    def _register(self, model: ET.Element, models: ET.Element) -> None:
        name = model.get("ID")
        if model.tag == "Control":
            models.remove(model)
        elif model.tag == "Action":
            self._factory.register_simple_action(name, lambda node: self._tick(name))
        elif model.tag == "Condition":
            self._factory.register_simple_condition(name, lambda node: self._tick(name))
        elif model.tag == "Decorator":
            self._factory.register_simple_decorator(name, lambda status, node: status)

    def _tick(self, name: str):
        self.calls.append(name)
        return library.NodeStatus.FAILURE if name in self.fails else library.NodeStatus.SUCCESS


def _strip(element: ET.Element, names: set[str], controls: set[str]) -> None:
    if element.tag not in ("Action", "Condition", "Decorator", "Control", *names):
        return
    for attribute in list(element.attrib):
        if attribute not in ("ID", "name") and not attribute.startswith("_"):
            del element.attrib[attribute]
    if element.tag == "Control" or element.tag in controls:
        element.tag = OWN_CONTROLS
        element.attrib.pop("ID", None)


@pytest.mark.parametrize("name", sorted(file.stem for file in BUILT_IN.glob("*.yaml")))
def test_own_missions_load(name):
    Peer(export_mission(name, MissionLibrary.load(), collect_declarations()).xml)


@pytest.mark.parametrize("node", [node for node in NODES if "finally" not in node])
def test_every_kind_of_node_loads(tmp_path, node):
    (tmp_path / "m.yaml").write_text(f"{HEAD}tree: {node}\n")
    Peer(export_mission("m", MissionLibrary.load([tmp_path]), SKILLS).xml)


TICKED = [
    ("{sequence: [{beep: }, {turn: }, {look: }]}", {"turn"}, "FAILURE", ["beep", "turn"]),
    ("{selector: [{turn: }, {beep: }, {look: }]}", {"turn"}, "SUCCESS", ["turn", "beep"]),
    ("{retry: 3, do: {turn: }}", {"turn"}, "FAILURE", ["turn"] * 3),
    ("{repeat: 2, do: {turn: }}", set(), "SUCCESS", ["turn"] * 2),
    ("{invert: {turn: }}", set(), "FAILURE", ["turn"]),
    ("{succeed: {turn: }}", {"turn"}, "SUCCESS", ["turn"]),
    ("{sequence: [{set: {number: 2}}, {if: $number > 1, then: {beep: }, else: {turn: }}]}", set(), "SUCCESS", ["beep"]),
    ("{sequence: [{set: {mode: slow}}, {switch: $mode, cases: {fast: {beep: }, slow: {turn: }}}]}", set(), "SUCCESS", ["turn"]),
    ("{sequence: [{set: {number: 2}}, {beep: , when: $number == 3}, {turn: }]}", set(), "SUCCESS", ["turn"]),
    ("{parallel: [{beep: }, {turn: }, {look: }], policy: {succeed: 2, fail: 2}}", {"beep"}, "SUCCESS", ["beep", "turn", "look"]),
]  # fmt: skip


@pytest.mark.parametrize(("node", "fails", "status", "calls"), TICKED)
def test_it_does_the_same_there(tmp_path, node, fails, status, calls):
    (tmp_path / "m.yaml").write_text(f"{HEAD}tree: {node}\n")
    peer = Peer(export_mission("m", MissionLibrary.load([tmp_path]), SKILLS).xml)
    peer.fails = fails
    assert (peer.run(), peer.calls) == (status, calls)
