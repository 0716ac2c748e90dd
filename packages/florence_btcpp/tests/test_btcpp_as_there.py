"""What BehaviorTree.CPP itself was seen to do with such files (4.8 and 4.11), and what follows from it here."""

# ruff: noqa: E501  (XML and missions on one line)

from xml.etree import ElementTree

import pytest

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary

S, F = "SUCCESS", "FAILURE"
BEEP = {"beep": SkillDeclaration("beep", "Beep."), "boop": SkillDeclaration("boop", "Boop.", instant=True)}


@pytest.fixture
def told(exchange_with):
    """What an import of some nodes says: severity and message, and the mission's text."""

    def tell(nodes, more=""):
        xml = f'<root BTCPP_format="4" main_tree_to_execute="M">\n<BehaviorTree ID="M">{nodes}</BehaviorTree>{more}</root>'
        imported = exchange_with({}).imported(xml)
        return [(f.severity, f.message) for f in imported.findings], imported.files.get("m.yaml", "")

    return tell


@pytest.fixture
def exported(exchange_with, tmp_path):
    """The XML of a mission with its losses, after a look whether it comes back with the same ticks."""

    def export(text, others=(), name="m"):
        folder = tmp_path / "own"
        folder.mkdir(exist_ok=True)
        for each, content in {name: text, **dict(others)}.items():
            (folder / f"{each}.yaml").write_text(f"mission: {each}\n{content}", encoding="utf-8")
        library, exchange = MissionLibrary.load([folder], built_in=False), exchange_with(BEEP)
        assert not [f for f in check(library.missions(), library, BEEP) if f.severity == "error"]
        back, xml = exchange.around(name, library)
        exchange.same_ticks(name, library, back, range(6))
        found = exchange.export(name, library).findings
        return xml, [f.message for f in found if f.severity == "warning"]

    return export


# ---- nothing is dropped in silence --------------------------------------------------------------------

LEFT_OVER = [
    ('<Sequence foo="bar"><A/></Sequence>', "<Sequence> has no attribute 'foo'; 'bar' is left out"),
    ('<Timeout msec="5" mscec="100"><A/></Timeout>', "<Timeout> has no attribute 'mscec'; '100' is left out"),
    ('<A _bogus="1"/>', "<A> has no attribute '_bogus'; '1' is left out"),
    ('<Switch2 variable="{n}" case_1="1" case_2="2" case_3="3"><A/><B/><C/></Switch2>', "<Switch2> has no attribute 'case_3'; '3' is left out"),
]  # fmt: skip


@pytest.mark.parametrize(("nodes", "message"), LEFT_OVER)
def test_an_attribute_that_nothing_reads_is_named(told, nodes, message):
    assert ("warning", message) in told(nodes)[0]


def test_what_a_wrong_attribute_may_have_meant(exchange_with):
    xml = '<root BTCPP_format="4"><BehaviorTree ID="M"><A _skipif="x"/></BehaviorTree></root>'
    (found,) = [f for f in exchange_with({}).imported(xml).findings if "_skipif" in f.message]
    assert found.valid[0] == "_skipIf"


def test_text_between_nodes_is_named(told):
    assert ("notice", "the text in <Sequence> is left out: 'do it'") in told(
        "<Sequence><A/>do it</Sequence>"
    )[0]


def test_what_is_known_is_not_named(told):
    nodes = '<Sequence _uid="3" name="s"><Parallel success_count="1"><A _description="x" port="1"/></Parallel></Sequence>'
    assert [m for s, m in told(nodes)[0] if "attribute" in m] == []


def test_an_unknown_decorator_is_a_declared_skill_and_check_says_so(exchange_with):
    nodes = '<Gate hz="1.5" seen="{seen}"><A/></Gate>'
    model = '<TreeNodesModel><Decorator ID="Gate"><input_port name="hz" type="double"/><output_port name="seen" type="bool"/></Decorator></TreeNodesModel>'
    exchange = exchange_with({})
    library = exchange.library_of(
        f'<root BTCPP_format="4"><BehaviorTree ID="M">{nodes}</BehaviorTree>{model}</root>'
    )
    assert library.declarations["gate"].inputs["hz"].kind is Kind.NUMBER
    found = [f.message for f in check(library.missions(), library, {}) if "'gate'" in f.message]
    assert found == ["the skill 'gate' is declared but not implemented on this robot (no_skill)"]


def test_the_goal_updater_hands_its_goal_on(told):
    found, text = told(
        '<GoalUpdater input_goal="{goal}" output_goal="{newer}"><A goal="{newer}"/></GoalUpdater>'
    )
    assert "- set: {newer: $goal}" in text
    (warning,) = [message for severity, message in found if severity == "warning"]
    assert "newer goals that come by its topic are not received" in warning


# ---- version 4.11 -------------------------------------------------------------------------------------


def test_only_if_and_on_start(run_tree):
    nodes = "<Sequence><Script code='x:=1'/><A _onlyIf='x == 1' _onStart='x := 5'/><B _onlyIf='x == 1' _onStart='x := 9'/></Sequence>"
    status, calls, keys, _ = run_tree(nodes)
    assert (status, "".join(calls), keys["x"]) == (S, "a", 5)


@pytest.mark.parametrize(("main", "end"), [("S", S), ("F", F)])
def test_finally(run_tree, main, end):
    status, calls, _, _ = run_tree("<Finally><A/><B/></Finally>", a=main)
    assert (status, "".join(calls)) == (end, "ab")


def test_finally_cleans_up_after_a_node_that_is_skipped(run_tree):
    nodes = "<Sequence><Script code='x:=1'/><Finally><A _skipIf='x == 1'/><B/></Finally></Sequence>"
    assert "".join(run_tree(nodes)[1]) == "b"


def test_where_finally_differs(told):
    found = [m for _, m in told('<Finally halt_timeout_msec="5"><A/><B/></Finally>')[0]]
    assert [message for message in found if message.startswith("Finally: ")] == [
        "Finally: halt_timeout_msec: a clean-up takes the time that it needs here",
        "Finally: when the second node fails it fails there; here the status of the first one stands",
    ]
    assert not any(
        "fails there" in m for _, m in told("<Finally><A/><ForceSuccess><B/></ForceSuccess></Finally>")[0]
    )


# ---- scripts and models -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("script", "differs"),
    [("a := 9 - 3 - 2", True), ("a := 8 / 2 * 2", True), ("a := 9 - 3 + 2", True), ("a := (9 - 3) - 2", False),
     ("a := 9 + 3 - 2", False), ("a := 2 * 3 - 4 / 5", False)],
)  # fmt: skip
def test_sums_that_older_versions_compute_otherwise_are_named(told, script, differs):
    found, _ = told(f'<Script code="{script}"/>')
    assert any("computed from the left, as since version 4.9" in message for _, message in found) is differs


def test_a_port_of_a_subtree_that_its_model_maps(told):
    more = '<BehaviorTree ID="Sub"><Go to="{target}"/></BehaviorTree><TreeNodesModel><SubTree ID="Sub"><input_port name="target" default="{=}"/></SubTree></TreeNodesModel>'
    _, text = told('<Sequence><SubTree ID="Sub"/><SubTree ID="Sub" target="{other}"/></Sequence>', more)
    assert "with: {target: $target}" in text and "with: {target: $other}" in text


def test_remaps_as_the_first_files_of_version_3_have_them(told):
    more = '<BehaviorTree ID="Sub"><Go to="{target}"/></BehaviorTree>'
    _, text = told('<SubTree ID="Sub"><remap internal="target" external="home"/></SubTree>', more)
    assert "with: {target: $home}" in text


# ---- nodes that are skipped ---------------------------------------------------------------------------

SKIPPED = [
    # Skipped stays skipped through these, so the sequence goes on.
    ("<Inverter><A _skipIf='x == 1'/></Inverter>", S, "z"),
    ("<ForceFailure><A _skipIf='x == 1'/></ForceFailure>", S, "z"),
    ("<Fallback><A _skipIf='x == 1'/><B _skipIf='x &lt; 2'/></Fallback>", S, "z"),
    ("<Inverter><Fallback><A _skipIf='x == 1'/><B _skipIf='x &lt; 2'/></Fallback></Inverter>", S, "z"),
    ("<Fallback><ForceSuccess><A _skipIf='x == 1'/></ForceSuccess><B/></Fallback>", S, "bz"),
    ("<Fallback><Sequence><A _skipIf='x == 1'/></Sequence><B/></Fallback>", S, "bz"),
    ("<Repeat num_cycles='3' _post='y := 1'><A _skipIf='x == 1'/></Repeat>", S, "z"),
    ("<ForceSuccess _onSuccess='x := 7'><A _skipIf='x == 1'/></ForceSuccess>", S, "z"),
    ("<Fallback><A _skipIf='!(x == 2)' _while='x == 1'/><B/></Fallback>", S, "bz"),
    ("<Fallback><A _skipIf='x == 1'/><B _skipIf='x == 2'/></Fallback>", S, "bz"),
]


@pytest.mark.parametrize(("nodes", "end", "calls"), SKIPPED)
def test_a_node_that_is_skipped_is_skipped_as_there(run_tree, nodes, end, calls):
    status, started, keys, _ = run_tree(f"<Sequence><Script code='x:=1'/>{nodes}<Z/></Sequence>")
    assert (status, "".join(started)) == (end, calls)
    assert keys["x"] == 1


UNEVEN = [
    (
        "<Inverter><IfThenElse><A/><B _skipIf='x == 1'/></IfThenElse></Inverter>",
        "is skipped there; here it counts",
    ),
    (
        "<Fallback><Sequence><IfThenElse><A/><B _skipIf='x == 1'/></IfThenElse></Sequence><C/></Fallback>",
        "is skipped there; here it counts",
    ),
    (
        "<Repeat num_cycles='2' _post='x += 1'><Precondition if='x &lt; 3' else='FAILURE'><A _skipIf='x == 1'/></Precondition></Repeat>",
        "scripts are not done there",
    ),
]


@pytest.mark.parametrize(("nodes", "words"), UNEVEN)
def test_where_a_guard_cannot_be_moved_it_is_named(told, nodes, words):
    (warning,) = [message for severity, message in told(nodes)[0] if severity == "warning"]
    assert words in warning


# ---- exports ------------------------------------------------------------------------------------------


def test_every_output_of_a_subtree_has_somewhere_to_go(exported):
    """BehaviorTree.CPP refuses a file with a call that leaves out a port without a default."""
    inner = "inputs: {far: {type: length, default: 1 m}}\noutputs: {seen: {type: integer}}\ntree: {sequence: [{set: {seen: 1}}, {beep: }]}"
    xml, losses = exported("tree: {run: inner}", {"inner": inner})
    assert '<output_port name="seen" type="int" default="{_inner_seen}"' in xml
    assert losses == []


def test_children_of_a_reactive_sequence_are_written_compactly(exported):
    """Versions 4.7 and 4.8 refuse ``<Action ID="...">`` directly below a ReactiveSequence."""
    xml, _ = exported("tree: {sequence: [{boop: }, {beep: , name: loud}], memory: false}")
    assert "<boop/>" in xml and '<beep name="loud"/>' in xml
    assert '<Action ID="beep">' in xml  # the model


def test_numbers_of_keys_keep_their_point(exported):
    """``far := 2`` makes a key for whole numbers there, and ``far := 1.5`` stops the tree later."""
    text = (
        "keys: {far: {type: length, default: 2 m}}\noutputs: {far: {type: length}}\ntree: {set: {far: 3 m}}"
    )
    xml, _ = exported(text)
    assert 'code="far := 2.0"' in xml and 'code="far := 3.0"' in xml


def test_cases_are_written_as_keys_are_compared(exported):
    text = """\
inputs: {found: {type: boolean, default: true}, far: {type: length, default: 2 m}, label: {type: text, default: x}}
tree:
  sequence:
    - {switch: $found, cases: {true: {beep: }, false: {boop: }}}
    - {switch: $far, cases: {50 cm: {beep: }, 2 m: {boop: }}}
    - {switch: $label, cases: {1 m: {beep: }, x: {boop: }}}
"""
    xml, _ = exported(text)
    assert 'case_1="1" case_2="0" _florence_cases="true, false"' in xml
    assert 'case_1="0.5" case_2="2" _florence_cases="50 cm, 2 m"' in xml
    assert 'case_1="1 m" case_2="x">' in xml


def test_a_value_that_is_handed_over_as_a_text_and_computed_with_is_named(exported):
    inner = "inputs: {far: {type: length, default: 1 m}, on: {type: boolean, default: true}, near: {type: length, default: 1 m}}\noutputs: {twice: {type: length}}\ntree: {sequence: [{set: {twice: '${$far * 2}'}}, {beep: , when: $on}, {beep: , when: $near < 2 m}]}"
    outer = "inputs: {far: {type: length, default: 1 m}}\ntree: {run: inner, with: {far: $far, near: 3 m}}"
    _, losses = exported(outer, {"inner": inner})
    assert losses == ["on: BehaviorTree.CPP passes text, and inner computes with it"]


def test_what_would_be_skipped_there_is_named(exported):
    text = "inputs: {n: {type: integer, default: 1}}\ntree: {sequence: [{invert: {beep: , when: $n > 1}}, {selector: [{beep: , when: $n > 1}, {boop: , when: not $n > 0}]}]}"
    _, losses = exported(text)
    assert len(losses) == 2 and all("it is skipped when what is below is skipped" in each for each in losses)


@pytest.mark.parametrize("name", ["goto_user", "detect_user", "approach_user", "goto_room", "goto_pose"])
def test_no_call_of_our_own_missions_lacks_a_port(name, exchange_with):
    library, declarations = MissionLibrary.load(), collect_declarations()
    xml = exchange_with(declarations).export(name, library).xml
    outputs = ElementTree.fromstring(xml).findall(".//SubTree/output_port")
    assert all(port.get("default", "").startswith("{_") for port in outputs)
