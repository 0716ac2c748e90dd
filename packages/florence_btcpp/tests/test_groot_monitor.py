"""What Groot2 is answered about a running mission: as BehaviorTree.CPP's own publisher answers."""

from __future__ import annotations

import socket
import struct
from itertools import count
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

msgpack = pytest.importorskip("msgpack", reason="msgpack is not here (extra groot of florence-btcpp)")

from florence_btcpp.groot.protocol import Monitor  # noqa: E402
from florence_btcpp.groot.tree import FAILURE, IDLE, RUNNING, SUCCESS, WatchedNode  # noqa: E402

HEADER = struct.Struct("<BcI")


def node(name, *children, kind="RunSkill", category="Action", remembers=True, status=IDLE):
    """A node with its children, parents first; its identity is made of its name and theirs."""
    ids = tuple(child[0].own_id for child in children)
    own_id = name.encode() + b"(" + b",".join(ids) + b")"
    mine = WatchedNode(own_id, name, kind, category, remembers, ids, status)
    return [mine, *(each for child in children for each in child)]


def sequence(name, *children, **more):
    return node(name, *children, kind="Sequence", category="Control", **more)


def request(kind, *more, number=7, protocol=2):
    return [HEADER.pack(protocol, kind, number), *more]


def monitor_of(nodes, keys=()):
    ticks, leaps = count(5_000_000, 1_000), count(1_000_000, 1 << 50)
    monitor = Monitor(lambda: next(leaps), lambda: next(ticks))
    monitor.show(nodes, dict(keys))
    return monitor


def statuses(monitor):
    _, payload = monitor.answer(request(b"S"))
    return dict(struct.iter_unpack("<HB", payload))


FIND = node("go there", status=RUNNING)
CALLED = node("run find", FIND, kind="CallMission", category="Decorator", status=RUNNING)
AGAIN = node("run find", node("go"), kind="CallMission", category="Decorator")
MISSION = sequence(
    "goto_user",
    node("look", status=SUCCESS),
    sequence("inner", CALLED, AGAIN, remembers=False, status=RUNNING),
    status=RUNNING,
)


def test_the_tree_has_a_number_for_each_node_and_missions_are_subtrees():
    header, xml = monitor_of(MISSION).answer(request(b"T"))
    assert HEADER.unpack(header[:6]) == (2, b"T", 7) and len(header) == 22
    root = ElementTree.fromstring(xml)
    main, first, second = root.findall("BehaviorTree")
    assert (main.get("ID"), main.get("_fullpath")) == ("goto_user", "")
    assert [each.tag for each in main.iter()][1:] == [
        "Sequence",
        "RunSkill",
        "ReactiveSequence",
        "SubTree",
        "SubTree",
    ]
    assert [each.get("name") for each in first.iter("RunSkill")] == ["go there"]
    assert {first.get("ID"), second.get("ID")} == {"find"}
    assert first.get("_fullpath") != second.get("_fullpath")
    numbers = [int(each.get("_uid")) for each in root.iter() if "_uid" in each.attrib]
    assert sorted(numbers) == list(range(1, len(MISSION) + 1))
    models = {each.get("ID"): each.tag for each in root.find("TreeNodesModel")}
    assert models == {"RunSkill": "Action", "Sequence": "Control", "ReactiveSequence": "Control"}


def test_a_node_that_is_idle_again_shows_what_it_was():
    monitor = monitor_of(sequence("main", node("a", status=RUNNING), status=RUNNING))
    assert statuses(monitor) == {1: RUNNING, 2: RUNNING}
    monitor.show(sequence("main", node("a", status=FAILURE), status=RUNNING), {})
    assert statuses(monitor) == {1: RUNNING, 2: FAILURE}
    for _ in range(2):
        monitor.show(sequence("main", node("a"), status=FAILURE), {})
        assert statuses(monitor) == {1: FAILURE, 2: 10 + FAILURE}


def test_keys_are_those_of_their_mission():
    keys = {"/room": "kitchen", "/inner/find/goal": "(1, 2)", "/inner/2/find/goal": "(3, 4)"}
    monitor = monitor_of(MISSION, keys)
    monitor.show(MISSION, {"/room": "bath"})
    _, xml = monitor.answer(request(b"T"))
    names = [each.get("_fullpath") or each.get("ID") for each in ElementTree.fromstring(xml)][:-1]
    _, payload = monitor.answer(request(b"B", ";".join([*names, "unknown"]).encode()))
    assert msgpack.unpackb(payload) == {
        "goto_user": {"room": "bath"},
        names[1]: {"goal": "(1, 2)"},
        names[2]: {"goal": "(3, 4)"},
    }


def test_a_tree_that_grows_keeps_its_numbers_and_is_another_tree():
    monitor = monitor_of(sequence("main", node("a")))
    before, _ = monitor.answer(request(b"T"))
    grown = sequence("main", node("a"))
    main = WatchedNode(
        grown[0].own_id, "main", "Sequence", "Control", True, (*grown[0].child_ids, b"new"), IDLE
    )
    monitor.show([main, grown[1], WatchedNode(b"new", "b", "Wait", "Action", True, (), RUNNING)], {})
    after, xml = monitor.answer(request(b"T"))
    assert before[6:] != after[6:]
    numbers = {each.get("name"): each.get("_uid") for each in ElementTree.fromstring(xml).iter()}
    assert (numbers["main"], numbers["a"], numbers["b"]) == ("1", "2", "3")


def test_a_recording_has_each_change_with_its_time():
    monitor = monitor_of(sequence("main", node("a")))
    _, begun = monitor.answer(request(b"r", b"start"))
    monitor.show(sequence("main", node("a", status=RUNNING), status=RUNNING), {})
    _, payload = monitor.answer(request(b"t"))
    found = [
        (int.from_bytes(payload[at : at + 6], "little"), *struct.unpack_from("<HB", payload, at + 6))
        for at in range(0, len(payload), 9)
    ]
    assert int(begun) == 1_000_000 and found == [(1_000, 1, RUNNING), (2_000, 2, RUNNING)]
    assert monitor.answer(request(b"t"))[1] == b""
    monitor.answer(request(b"r", b"stop"))
    monitor.show(sequence("main", node("a", status=SUCCESS), status=RUNNING), {})
    assert monitor.answer(request(b"t"))[1] == b""


def test_before_the_first_run_and_for_breakpoints_the_answer_is_a_reason():
    empty = Monitor(lambda: 0, lambda: 0)
    assert empty.answer(request(b"T")) == [b"error", b"no mission has run yet"]
    monitor = monitor_of(MISSION)
    assert monitor.answer(request(b"I", b"{}")) == [b"error", b"missions have no breakpoints"]
    assert monitor.answer(request(b"S", protocol=1))[0] == b"error"


@given(
    st.lists(st.binary(max_size=40), max_size=3), st.sampled_from([b"", b"T", b"S", b"B", b"r", b"t", b"D"])
)
def test_whatever_is_asked_is_answered(parts, kind):
    monitor = monitor_of(MISSION)
    asked = request(kind, *parts) if kind else parts
    reply = monitor.answer(asked)
    assert reply and (reply[0] == b"error" or len(reply[0]) == 22)


def free_port():
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        return server.getsockname()[1]


THEIRS = """<root BTCPP_format="4" main_tree_to_execute="main">
  <BehaviorTree ID="main"><Sequence name="main">
    <AlwaysSuccess name="a"/><Inverter name="b"><AlwaysSuccess name="c"/></Inverter><AlwaysFailure name="d"/>
  </Sequence></BehaviorTree></root>"""
OURS = sequence(
    "main",
    node("a", kind="AlwaysSuccess", status=SUCCESS),
    node(
        "b",
        node("c", kind="AlwaysSuccess", status=SUCCESS),
        kind="Inverter",
        category="Decorator",
        status=FAILURE,
    ),
    node("d", kind="AlwaysFailure"),
    status=FAILURE,
)


def test_answers_are_those_of_behaviortree_cpp():
    btcpp = pytest.importorskip("behaviortreepy")
    zmq = pytest.importorskip("zmq")
    if not btcpp.GROOT2_AVAILABLE:
        pytest.skip("this BehaviorTree.CPP is built without Groot2")
    factory = btcpp.BehaviorTreeFactory()
    factory.register_behavior_tree_from_text(THEIRS)
    tree = factory.create_tree("main")
    port = free_port()
    publisher = btcpp.Groot2Publisher(tree, port)
    tree.tick_once()
    monitor = monitor_of(OURS)
    monitor.show([WatchedNode(*each) for each in map(idle, OURS)], {})  # as all nodes are in the end there
    with zmq.Context() as context, context.socket(zmq.REQ) as client:
        client.setsockopt(zmq.RCVTIMEO, 30_000)
        client.setsockopt(zmq.LINGER, 0)
        client.connect(f"tcp://127.0.0.1:{port}")
        for kind, *more in (
            (b"T",),
            (b"S",),
            (b"D",),
            (b"A",),
            (b"X",),
            (b"r", b"stop"),
            (b"?",),
            (b"B", b"main"),
        ):
            client.send_multipart(request(kind, *more))
            theirs, ours = client.recv_multipart(), monitor.answer(request(kind, *more))
            assert theirs[0][:6] == ours[0][:6] and len(theirs) == len(ours), kind
            if kind == b"T":
                assert drawn(theirs[1]) == drawn(ours[1])
            elif kind == b"S":
                assert dict(struct.iter_unpack("<HB", theirs[1])) == statuses(monitor)
            elif kind == b"B":
                assert set(msgpack.unpackb(theirs[1])) == set(msgpack.unpackb(ours[1])) == {"main"}
            else:
                assert theirs[1:] == ours[1:] or theirs[0] == b"error"
    del publisher


def idle(each):
    return each.own_id, each.name, each.kind, each.category, each.remembers, each.child_ids, IDLE


def drawn(xml):
    """Tags and attributes of the tree, without what only ports and models say."""
    (tree,) = ElementTree.fromstring(xml).findall("BehaviorTree")
    return [(each.tag, dict(each.attrib)) for each in tree.iter()]
