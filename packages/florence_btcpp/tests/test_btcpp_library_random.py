"""Random trees of BehaviorTree.CPP do the same in the library itself and, imported, here."""

import random
import xml.etree.ElementTree as ET
import zlib
from pathlib import Path

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import failure, success
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.loader import MissionLibrary
from packages.florence_btcpp.tests.conftest import ScriptedRun, import_trees, make_context
from tests.sweeps import sweep

library = pytest.importorskip("behaviortreepy")

SKILLS = "ABCD"
CONDITIONS = ("x < 3", "y >= 1", "x == y", "x != 2 && y < 5", "!(x < 2)", "x + y < 4 || y == 0")
SCRIPTS = ("x += 1", "y := x + 2", "x := 0", "x += 1; y -= 2")
ONE_CHILD = {
    "Inverter": {},
    "ForceSuccess": {},
    "ForceFailure": {},
    "RetryUntilSuccessful": {"num_attempts": "2"},
    "Repeat": {"num_cycles": "2"},
    "RunOnce": {"then_skip": "false"},
}
SEVERAL = ("Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback")
MOST_TICKS = 500


def holds(seed: int, skill: str, call: int) -> bool:
    """Whether the n-th call of a skill succeeds."""
    return zlib.crc32(f"{seed}/{skill}/{call}".encode()) % 100 < 60


class Generator:
    """Makes the tree of a seed."""

    def __init__(self, seed: int, *, skips: bool = False) -> None:
        self._skips = skips
        self._random = random.Random(seed)

    def xml(self) -> str:
        root = ET.Element("root", BTCPP_format="4", main_tree_to_execute="M")
        sequence = ET.SubElement(ET.SubElement(root, "BehaviorTree", ID="M"), "Sequence")
        ET.SubElement(sequence, "Script", code="x := 0; y := 0")
        sequence.append(self._node(3))
        return ET.tostring(root, encoding="unicode")

    def _node(self, depth: int) -> ET.Element:
        choose = self._random
        kind = choose.choice([*SEVERAL, *SEVERAL, *ONE_CHILD, "IfThenElse", "Precondition", "Switch2"])
        if depth == 0:
            element = self._leaf()
        elif kind in SEVERAL:
            element = self._with(ET.Element(kind), choose.randint(1, 3), depth)
        elif kind in ONE_CHILD:
            element = self._with(ET.Element(kind, ONE_CHILD[kind]), 1, depth)
        elif kind == "IfThenElse":
            element = ET.Element(kind)
            ET.SubElement(element, "ScriptCondition", code=choose.choice(CONDITIONS))
            self._with(element, 2, depth)
        elif kind == "Precondition":
            given = {"if": choose.choice(CONDITIONS), "else": choose.choice(["FAILURE", "SUCCESS"])}
            element = self._with(ET.Element(kind, given), 1, depth)
        else:
            element = self._with(ET.Element(kind, variable="{x}", case_1="0", case_2="1"), 3, depth)
        if choose.random() < 0.1:
            element.set(choose.choice(["_failureIf", "_successIf"]), choose.choice(CONDITIONS))
        if self._skips and choose.random() < 0.12:
            element.set("_skipIf", choose.choice(CONDITIONS))
        if choose.random() < 0.1:
            element.set(choose.choice(["_onSuccess", "_onFailure", "_post"]), choose.choice(SCRIPTS))
        return element

    def _with(self, element: ET.Element, children: int, depth: int) -> ET.Element:
        element.extend(self._node(depth - 1) for _ in range(children))
        return element

    def _leaf(self) -> ET.Element:
        choose = self._random
        kind = choose.choice(
            [*SKILLS, *SKILLS, "AlwaysSuccess", "AlwaysFailure", "Script", "ScriptCondition"]
        )
        if kind == "Script":
            return ET.Element(kind, code=choose.choice(SCRIPTS))
        if kind == "ScriptCondition":
            return ET.Element(kind, code=choose.choice(CONDITIONS))
        return ET.Element(kind)


def there(xml: str, seed: int) -> tuple[str, list[str], dict[str, int]]:
    """Status, calls and keys in the library."""
    factory, calls = library.BehaviorTreeFactory(), []

    def tick(skill: str):
        calls.append(skill)
        good = holds(seed, skill, calls.count(skill))
        return library.NodeStatus.SUCCESS if good else library.NodeStatus.FAILURE

    for skill in SKILLS:
        factory.register_simple_action(skill, lambda node, skill=skill: tick(skill))
    tree = factory.create_tree_from_text(xml)
    for _ in range(MOST_TICKS):
        status = tree.tick_exactly_once()
        if status != library.NodeStatus.RUNNING:
            break
    board = tree.root_blackboard()
    return status.name, calls, {key: board.get_int(key) for key in "xy"}


class Scripted:
    """A skill that ends at once, as in the library."""

    def __init__(self, name: str, seed: int, clock: ManualClock, calls: list[str]) -> None:
        self._name, self._seed, self._clock, self._calls = name.upper(), seed, clock, calls

    def start(self, inputs):
        self._calls.append(self._name)
        good = holds(self._seed, self._name, self._calls.count(self._name))
        return ScriptedRun(self._clock, 0, success() if good else failure("failed", "said so"))


def imported_from(xml: str, folder: Path):
    (folder / "t.xml").write_text(xml)
    return import_trees(folder / "t.xml", {}, ())


def here(xml: str, seed: int, folder: Path) -> tuple[str, list[str], dict[str, int]]:
    """Status, calls and keys of the imported mission."""
    imported = imported_from(xml, folder)
    missions = folder / "missions"
    missions.mkdir()
    for name, text in imported.files.items():
        (missions / name).write_text(text)
    known = MissionLibrary.load([missions], built_in=False)
    clock, calls = ManualClock(), []
    declarations = dict(known.with_declared({}))
    skills = {name: Scripted(name, seed, clock, calls) for name in declarations}
    context = make_context(clock, skills, declarations)
    mission = known.get("m")
    tree = compile_mission(mission, known, dict.fromkeys(mission.inputs, 0), context)
    for _ in range(MOST_TICKS):
        context.wake.take()
        tree.root.tick_once()
        if tree.root.status.value != "RUNNING":
            break
        while not context.wake.asked and clock.run_next():
            pass
    return tree.root.status.value, calls, {key: tree.keys.as_dict()[key] for key in "xy"}


@pytest.mark.slow
@pytest.mark.parametrize("first", sweep(range(0, 400, 50), every=4))
def test_random_trees_do_the_same(tmp_path, first):
    for seed in range(first, first + 50):
        folder = tmp_path / str(seed)
        folder.mkdir()
        xml = Generator(seed).xml()
        assert here(xml, seed, folder) == there(xml, seed), xml


@pytest.mark.slow
@pytest.mark.parametrize("first", sweep(range(0, 400, 50), every=4))
def test_random_trees_with_skipped_nodes_do_the_same_or_warn(tmp_path, first):
    for seed in range(first, first + 50):
        folder = tmp_path / str(seed)
        folder.mkdir()
        xml = Generator(seed, skips=True).xml()
        status, calls, keys = there(xml, seed)
        status = "SUCCESS" if status in ("SKIPPED", "IDLE") else status  # nothing was to be done
        warned = any(finding.severity == "warning" for finding in imported_from(xml, folder).findings)
        assert warned or here(xml, seed, folder) == (status, calls, keys), xml
