"""Trees as public projects have them: version 3, nodes without a model, entries that are written sometimes."""

# ruff: noqa: E501  (XML on one line)

import pytest

from florence_bt.core.declaration import REQUIRED, Kind
from florence_bt.core.geometry import Pose2
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations

V3, V4 = 'main_tree_to_execute="T"', 'BTCPP_format="4" main_tree_to_execute="T"'


def trees(**more):
    """The nodes of the tree T, and further trees behind it."""
    return "".join(f'</BehaviorTree><BehaviorTree ID="{name}">{nodes}' for name, nodes in more.items())


@pytest.fixture
def exchange(exchange_with):
    return exchange_with(collect_declarations())


@pytest.fixture
def findings(exchange):
    """Imports a tree and checks the missions: the errors, the warnings of the check, and the library."""

    def look(nodes, attributes=V4, model=""):
        xml = f'<root {attributes}><BehaviorTree ID="T">{nodes}</BehaviorTree><TreeNodesModel>{model}</TreeNodesModel></root>'
        library = exchange.library_of(xml)
        found = check(library.missions(), library, exchange.declarations)
        return [[f.message for f in found if f.severity == s] for s in ("error", "warning")], library

    return look


def kinds(library, skill):
    declared = library.declarations[skill]
    return {name: port.kind for name, port in {**declared.inputs, **declared.outputs}.items()}


# ---- calls of version 3 ---------------------------------------------------------------------------------

MOVE = '<Fallback><Sequence><MoveBase goal="{target}"/><SetBlackboard output_key="output" value="done"/></Sequence><ForceFailure><SetBlackboard output_key="output" value="failed"/></ForceFailure></Fallback>'
TUTORIAL = '<Sequence><SetBlackboard output_key="move_goal" value="1;2;3"/><SubTree ID="S" target="move_goal" output="move_result"/><Tell message="{move_result}"/></Sequence>'


@pytest.mark.parametrize(("end", "result"), [("S", "done")])
@pytest.mark.parametrize("attributes", [V3, 'BTCPP_format="3"'])
def test_attributes_of_a_subtree_of_version_3_name_entries(run_tree, findings, attributes, end, result):
    nodes = TUTORIAL + trees(S=MOVE)
    status, calls, keys, _ = run_tree(nodes, attributes=attributes, move_base=end)
    assert (status, calls, keys["move_result"]) == ("SUCCESS", ["move_base", "tell"], result)
    (errors, _), library = findings(nodes, attributes)
    assert errors == [] and library.get("t").required_inputs() == ()


def test_entries_of_version_3_through_two_levels(run_tree):
    mid, leaf = '<SubTree ID="Leaf" x="a" y="r"/>', '<SetBlackboard output_key="y" value="{x}"/>'
    nodes = '<Sequence><SetBlackboard output_key="g" value="7"/><SubTree ID="Mid" a="g" r="res"/></Sequence>'
    status, _, keys, _ = run_tree(nodes + trees(Mid=mid, Leaf=leaf), attributes=V3)
    assert (status, keys["res"]) == ("SUCCESS", 7)


def test_what_is_no_entry_of_version_3_stays_a_value_with_a_warning(exchange):
    nodes = '<SubTree ID="S" text="please move, then go"/>' + trees(S='<Tell message="{text}"/>')
    imported = exchange.imported(f'<root {V3}><BehaviorTree ID="T">{nodes}</BehaviorTree></root>')
    assert "with: {text: 'please move, then go'}" in imported.files["t.yaml"].replace('"', "'")
    assert any("version 3 wants an entry" in f.message for f in imported.findings if f.severity == "warning")


@pytest.mark.parametrize(
    "call", ['<SubTreePlus ID="S" text="hello"/>', '<SubTree ID="S" text="hello" other="{x}"/>']
)
def test_where_braces_are_written_the_rest_are_values(findings, call):
    (errors, _), library = findings(
        call + trees(S='<Sequence><Tell message="{text}"/><Tell message="{other}"/></Sequence>'), V3
    )
    assert errors == [] and "text" not in library.get("t").inputs


# ---- ports without a model ------------------------------------------------------------------------------


def test_an_input_is_required_only_where_every_use_gives_it(findings):
    plan = '<Sequence><ComputePathToPose goal="{a}" path="{p}"/><ComputePathToPose start="{a}" goal="{b}" path="{q}"/><FollowPath path="{p}"/><FollowPath path="{q}"/></Sequence>'
    (errors, _), library = findings(plan)
    inputs = library.declarations["compute_path_to_pose"].inputs
    assert errors == [] and inputs["goal"].default is REQUIRED
    assert (inputs["start"].kind, inputs["start"].default) == (Kind.POSE, Pose2(0.0, 0.0, 0.0))


def test_an_input_of_a_tree_too(findings):
    nodes = '<Sequence><SubTree ID="S" a="1"/><SubTree ID="S" b="x"/></Sequence>' + trees(
        S='<Sequence><Act p="{a}"/><Act q="{b}"/></Sequence>'
    )
    (errors, _), library = findings(nodes)
    assert errors == [] and library.get("s").required_inputs() == ()


@pytest.mark.parametrize(
    ("nodes", "expected"),
    [
        ('<Act p="1"/><Act p="fast"/>', {"p": Kind.TEXT}),
        ('<Act p="1"/><Act p="0.5"/>', {"p": Kind.NUMBER}),
        ('<Act p="1"/><Act p="{}"/>', {"p": Kind.TEXT}),
        ('<Script code="i := 1"/><Act p="hello"/><Act p="{i}"/><ScriptCondition code="i &lt; 3"/>', {"p": Kind.TEXT}),
        ('<Script code="a := 1; b := true"/><Act p="{a}"/><Act p="{b}"/><Script code="a += 1"/>', {"p": Kind.TEXT}),
        ('<Script code="i := 1; h := i / 2"/><Act p="{h}"/>', {"p": Kind.NUMBER}),
        ('<SetBlackboard output_key="g" value="5"/><SetBlackboard output_key="h" value="{g}"/><Act p="{h}"/>', {"p": Kind.INTEGER}),
    ],
)  # fmt: skip
def test_the_kind_of_a_port_comes_from_all_its_uses(findings, nodes, expected):
    (errors, _), library = findings(f"<Sequence>{nodes}</Sequence>")
    assert (errors, kinds(library, "act")) == ([], expected)


@pytest.mark.parametrize(
    "use",
    ['<Act n="fast"/>', '<Act n="0.5"/>', '<Act pose="1;2"/>', '<Act flag="maybe"/>', '<Act n="{word}"/>'],
)
def test_a_value_that_does_not_fit_the_model_stays_a_text(findings, use):
    model = '<Action ID="Act"><input_port name="n" type="int"/><input_port name="pose" type="Pose2D"/><input_port name="flag" type="bool"/></Action>'
    (errors, _), _ = findings(f"<Sequence><Script code=\"word := 'x'\"/>{use}</Sequence>", model=model)
    assert errors == []


def test_a_text_with_a_number_in_it_is_handed_over_as_it_is(run_tree, exchange):
    nodes = '<Sequence><Script code="i := 1"/><Repeat num_cycles="3"><Script code="i := i + 1"/></Repeat><Act p="hi"/><Act p="{i}"/></Sequence>'
    status, calls, keys, _ = run_tree(nodes)
    assert (status, len(calls), keys["i"]) == ("SUCCESS", 2, 4)


def test_the_direction_of_a_port_comes_from_all_trees(findings):
    nodes = '<Sequence><Get v="{x}"/><Put w="{y}"/><SubTree ID="S"/></Sequence>' + trees(
        S='<Sequence><Get v="{z}"/><Put w="{z}"/><Put w="4"/></Sequence>'
    )
    (errors, _), library = findings(nodes)
    assert errors == []
    assert list(library.declarations["get"].outputs) == ["v"] and list(
        library.declarations["put"].inputs
    ) == ["w"]


def test_a_node_on_another_branch_writes_nothing(findings):
    nodes = '<Fallback><IsThere part="{part}"/><Grab part="{part}"/></Fallback>'
    (errors, _), library = findings(nodes)
    assert (errors, list(library.get("t").inputs)) == ([], ["part"])


def test_a_new_skill_is_not_called_like_one_that_is_there(findings):
    (errors, _), library = findings('<Sequence><Say what="hello"/><NavigateTo/></Sequence>')
    assert errors == [] and {"skill_say", "skill_navigate_to"} <= set(library.declarations)


# ---- what is never reached ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "nodes",
    [
        "<Sequence><AlwaysFailure/><A/></Sequence>",
        "<Fallback><AlwaysSuccess/><A/></Fallback>",
        "<IfThenElse><AlwaysSuccess/><A/><B/></IfThenElse>",
        '<RetryUntilSuccessful num_attempts="3"><ForceSuccess><A/></ForceSuccess></RetryUntilSuccessful>',
        '<RecoveryNode number_of_retries="2"><ForceSuccess><A/></ForceSuccess><B/></RecoveryNode>',
        "<Fallback><ForceSuccess><A/></ForceSuccess><Sequence><AlwaysFailure/><B/></Sequence></Fallback>",
        '<Sequence><Fallback><A/><Sequence><AlwaysFailure/><Script code="k := 1"/></Sequence></Fallback><ScriptCondition code="k == 1"/></Sequence>',
    ],
)
def test_what_is_never_reached_is_a_warning_in_an_imported_tree(findings, nodes):
    (errors, warnings), library = findings(nodes)
    assert errors == [] and library.get("t").imported_from == "tree.xml"
    assert any("never" in warning for warning in warnings)


# ---- entries that are written sometimes -----------------------------------------------------------------

SOMETIMES = '<Fallback><Sequence><C/><SetBlackboard output_key="k" value="1"/></Sequence><A/></Fallback>'


@pytest.mark.parametrize("call", ['<SubTree ID="S" _autoremap="true"/>', '<SubTree ID="S" k="{k}"/>'])
@pytest.mark.parametrize(
    ("before", "c", "after"), [("5", "S", 1), ("5", "F", 5), (None, "S", 1), (None, "F", 0)]
)
def test_an_entry_that_is_written_sometimes(run_tree, findings, call, before, c, after):
    start = f'<SetBlackboard output_key="k" value="{before}"/>' if before else ""
    nodes = f'<Sequence>{start}{call}<Tell message="{{k}}"/></Sequence>{trees(S=SOMETIMES)}'
    status, calls, keys, _ = run_tree(nodes, c=c)
    assert (status, calls[-1], keys["k"]) == ("SUCCESS", "tell", after)
    assert findings(nodes)[0][0] == []


def test_it_keeps_its_value_from_round_to_round(run_tree):
    nodes = '<Repeat num_cycles="3"><SubTree ID="M" _autoremap="true"/></Repeat>' + trees(
        M='<SubTree ID="S" _autoremap="true"/>', S=SOMETIMES
    )
    status, _, keys, _ = run_tree(nodes, c=["F", "S", "F"])
    assert (status, keys["k"]) == ("SUCCESS", 1)


def test_an_entry_that_only_a_failing_tree_writes(findings):
    nodes = '<Fallback><SubTree ID="S" k="{k}"/><Tell message="{k}"/></Fallback>' + trees(
        S='<Sequence><SetBlackboard output_key="k" value="1"/><AlwaysFailure/></Sequence>'
    )
    assert findings(nodes)[0][0] == []


# ---- entries that nothing writes ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("nodes", "status", "calls"),
    [
        ('<SetBlackboard output_key="x" value="{unset}"/>', "FAILURE", ""),
        ('<SetBlackboard output_key="x" value="{x}"/>', "FAILURE", ""),
        ('<Fallback><SetBlackboard output_key="x" value="{unset}"/><A/></Fallback>', "SUCCESS", "a"),
        ('<Fallback><SetBlackboard output_key="x" value="{unset}"/><A p="{x}"/></Fallback>', "SUCCESS", "a"),
        ('<Sequence><ForceSuccess><SetBlackboard output_key="x" value="{unset}"/></ForceSuccess><SetBlackboard output_key="y" value="{x}"/></Sequence>', "FAILURE", ""),
        ('<Fallback><SubTree ID="S" unset="{u}"/><A/></Fallback>' + trees(S='<SetBlackboard output_key="x" value="{unset}"/>'), "SUCCESS", "a"),
        ('<Fallback><SubTree ID="S" _autoremap="true"/><A/></Fallback>' + trees(S='<SetBlackboard output_key="x" value="{unset}"/>'), "SUCCESS", "a"),
        ('<Sequence><ForceSuccess><SetBlackboard output_key="x" value="{b}"/></ForceSuccess><SetBlackboard output_key="b" value="1"/><SetBlackboard output_key="x" value="{b}"/></Sequence>', "SUCCESS", ""),
        ('<RetryUntilSuccessful num_attempts="2"><Fallback><SetBlackboard output_key="x" value="{b}"/><Sequence><SetBlackboard output_key="b" value="1"/><AlwaysFailure/></Sequence></Fallback></RetryUntilSuccessful>', "SUCCESS", ""),
    ],
)  # fmt: skip
def test_a_copy_of_an_entry_that_nothing_has_set_fails(run_tree, findings, nodes, status, calls):
    end, called, _, _ = run_tree(nodes)
    assert (end, "".join(called)) == (status, calls)
    assert findings(nodes)[0][0] == []


def test_an_entry_that_a_node_needs_too_is_an_input(findings):
    nodes = '<Sequence><SetBlackboard output_key="x" value="{goal}"/><Go to="{goal}"/></Sequence>'
    (errors, _), library = findings(nodes)
    assert (errors, list(library.get("t").inputs)) == ([], ["goal"])


def test_values_of_an_enumeration_are_not_asked_for(findings):
    (errors, _), library = findings(
        '<Sequence><Look color="{c}"/><ScriptCondition code="c == BLUE"/></Sequence>'
    )
    assert errors == [] and "blue" not in library.get("t").inputs


# ---- scripts that are too long --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "code", ["+".join(["1"] * 500), " &amp;&amp; ".join(["a == 1"] * 500), "(" * 900 + "1" + ")" * 900, "!" * 900 + "a", " - ".join(["a"] * 2400)]
)  # fmt: skip
def test_scripts_beyond_what_a_mission_can_have_are_refused_with_a_finding(exchange, code):
    for node in (
        f'<Script code="x := {code}"/>',
        f'<ScriptCondition code="{code}"/>',
        f'<A _skipIf="{code}"/>',
    ):
        imported = exchange.imported(f'<root {V4}><BehaviorTree ID="T">{node}</BehaviorTree></root>')
        assert [f.severity for f in imported.findings if "_skipIf" in node or "replaced" in f.message]


def test_a_script_of_many_statements_is_imported(run_tree):
    code = "; ".join(f"a{n} := {n}" for n in range(300))
    assert run_tree(f'<Script code="{code}"/>')[2]["a299"] == 299
