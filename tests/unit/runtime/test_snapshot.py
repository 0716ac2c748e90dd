"""A tree as plain data: ids, types, the path of the last tick, statistics, streams."""

from __future__ import annotations

import py_trees
from py_trees.behaviours import Failure, Running, Success, TickCounter
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence

from florence_bt.behaviours.branching import Switch
from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import Invert
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.core.clock import ManualClock
from florence_bt.runtime.viewers.snapshot import NodeType, detail_of, snapshot_of, statuses, type_of


def tree() -> Selector:
    return Selector(
        "root",
        False,
        [
            Sequence(
                "steps", True, [Success("first"), TickCounter("second", 1, Status.SUCCESS), Success("third")]
            ),
            py_trees.decorators.Inverter("not", Failure("fails")),
        ],
    )


def test_the_ids_describe_the_tree() -> None:
    root = tree()
    root.tick_once()
    nodes = snapshot_of(root, {}, {})
    by_id = {node.own_id: node for node in nodes}
    assert [node.name for node in nodes] == [
        "root",
        "steps",
        "first",
        "second",
        "third",
        "not",
        "fails",
    ]
    assert nodes[0].parent_id is None and len(by_id) == len(nodes)
    for node in nodes:
        for child in node.child_ids:
            assert by_id[child].parent_id == node.own_id
    assert by_id[nodes[0].tip_id].name == "second"  # type: ignore[index]
    assert nodes[2].tip_id is None and by_id[nodes[1].current_child_id].name == "second"  # type: ignore[index]
    assert [node.type for node in nodes] == [3, 2, 1, 1, 1, 6, 1]
    assert [node.additional_detail for node in nodes[:3]] == ["", "WithMemory", ""]
    assert [node.status for node in nodes] == [2, 2, 3, 2, 1, 1, 1]
    assert nodes[1].class_name == "py_trees.composites.Sequence" and nodes[1].blackbox_level == 4


def test_the_active_path_is_that_of_the_last_tick() -> None:
    """First tick: first, second (running). Second tick: only second, because the sequence remembers."""
    root = tree()
    root.tick_once()
    active = [node.name for node in snapshot_of(root, {}, {}) if node.is_active]
    assert active == ["root", "steps", "first", "second"]
    known = statuses(root)
    root.tick_once()
    active = [node.name for node in snapshot_of(root, {}, known) if node.is_active]
    assert active == ["root", "steps", "second", "third"]
    root.stop(Status.INVALID)
    assert not any(node.is_active for node in snapshot_of(root, {}, {}))


def test_what_a_stock_visitor_calls_visited_is_active_without_memory() -> None:
    root = Selector(
        "root", False, [Sequence("a", False, [Success("b"), Failure("c"), Success("d")]), Running("e")]
    )
    visitor = py_trees.visitors.SnapshotVisitor()
    stock = py_trees.trees.BehaviourTree(root)
    stock.visitors.append(visitor)
    known: dict[object, Status] = {}
    for _ in range(3):
        stock.tick()
        active = {node.own_id for node in snapshot_of(root, {}, known) if node.is_active}  # type: ignore[arg-type]
        assert active == set(visitor.visited)
        known = dict(statuses(root))


def test_a_parallel_tells_its_policy() -> None:
    children = [Success("a"), Success("b")]
    parallel = CountingParallel("p", children, succeed=1, fail=1, wanted=[children[1]])
    assert type_of(parallel) is NodeType.PARALLEL and detail_of(parallel) == "OnSelected(1)"
    assert detail_of(Parallel("q", ParallelPolicy.SuccessOnAll(), [Success("c")])) == "OnAll"


def test_own_composites_are_drawn_as_what_they_do() -> None:
    both = [Success("a"), Success("b")]
    counting = CountingParallel("p", list(both), succeed=1, fail=2)
    assert type_of(counting) is NodeType.PARALLEL and detail_of(counting) == "Succeed(1), Fail(2)"
    assert detail_of(CountingParallel("q", [Success("c")], succeed=1)) == "Succeed(1)"
    context = TreeContext(ManualClock(), lambda: None, {}, {})
    tidy = Finally("f", context, Success("d"), lambda context: Success("e"))
    assert type_of(tidy) is NodeType.SEQUENCE
    assert type_of(Sequence("s", True, [Success("g")])) is NodeType.SEQUENCE
    assert type_of(Selector("o", True, [Success("h")])) is NodeType.SELECTOR
    assert type_of(Switch("w", context, 1, [((1,), Success("i"))])) is NodeType.SELECTOR
    assert type_of(Invert("n", Success("j"))) is NodeType.DECORATOR
    assert type_of(Success("k")) is NodeType.BEHAVIOUR
