"""Whole files of other projects: what they become, and what is said about what they cannot become."""

# ruff: noqa: E501  (XML and missions on one line)

import pytest

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import read_skills_file

ROOT = '<root BTCPP_format="4" main_tree_to_execute="MainTree">'


def tree(nodes, name="MainTree", more=""):
    return f'{ROOT}\n<BehaviorTree ID="{name}">\n{nodes}\n</BehaviorTree>{more}</root>'


@pytest.fixture
def exchange(exchange_with):
    return exchange_with(collect_declarations())


@pytest.fixture
def told(exchange):
    """What an import says: severity, line and message of each finding."""

    def tell(xml):
        return [(f.severity, f.line, f.message) for f in exchange.imported(xml).findings]

    return tell


def only_lacking(library, exchange):
    """What a check finds beside skills that are declared only, and outputs that nobody reads."""
    found = check(library.missions(), library, exchange.declarations)
    return [
        f.message for f in found if "not implemented" not in f.message and "nothing reads" not in f.message
    ]


def test_first_tutorial_becomes_a_mission_that_passes_its_check(exchange):
    library = exchange.library_of(
        tree(
            '<Sequence name="root"><CheckBattery name="battery_ok"/><OpenGripper/>'
            '<ApproachObject name="approach"/><CloseGripper/></Sequence>'
        )
    )
    mission = library.get("main_tree")
    assert mission.tree.name == "root"
    assert [node.title for node in mission.tree.children] == [
        "battery_ok",
        "open gripper",
        "approach",
        "close gripper",
    ]
    assert only_lacking(library, exchange) == []
    lacking = [f for f in check(mission, library, exchange.declarations) if f.severity == "warning"]
    assert [f.line for f in lacking] == [8, 10, 11, 13]
    assert (
        lacking[0].message
        == "the skill 'check_battery' is declared but not implemented on this robot (no_skill)"
    )


def test_ports_keep_their_types_defaults_and_descriptions(exchange, tmp_path):
    imported = exchange.imported(
        tree(
            '<Sequence><ThinkWhatToSay text="{words}"/><SaySomething message="{words}"/><Go speed="0.5" to="{target}"/></Sequence>',
            more="""<TreeNodesModel>
              <Action ID="ThinkWhatToSay"><output_port name="text" type="std::string">what comes to mind</output_port></Action>
              <Action ID="SaySomething"><input_port name="message"/></Action>
              <Action ID="Go"><input_port name="speed" type="double" default="1.5">how fast [m/s]</input_port>
                 <input_port name="to" type="geometry_msgs::msg::PoseStamped"/><inout_port name="count" type="unsigned int"/></Action>
            </TreeNodesModel>""",
        )
    )
    file = tmp_path / "tree.skills.yaml"
    file.write_text(imported.files["tree.skills.yaml"])
    declared = read_skills_file(file)
    assert not declared.findings
    go = declared.declarations["go"]
    assert go.inputs["speed"].kind is Kind.SPEED and go.inputs["speed"].default == 1.5
    assert go.inputs["speed"].description == "how fast"
    assert go.inputs["to"].kind is Kind.POSE
    assert go.inputs["count"].kind is go.outputs["count"].kind is Kind.INTEGER
    assert declared.declarations["say_something"].inputs["message"].kind is Kind.TEXT
    assert "go: {speed: 0.5 m/s, to: $target}" in imported.files["main_tree.yaml"]
    assert "target: {type: pose}" in imported.files["main_tree.yaml"]


def test_without_models_the_first_of_several_nodes_writes_a_key(exchange):
    imported = exchange.imported(
        tree('<Sequence><Think text="{w}"/><Say message="{w}"/><Go to="{t}"/></Sequence>')
    )
    text = imported.files["main_tree.yaml"]
    assert "- think:\n      out: {text: w}" in text and "- skill_say: {message: $w}" in text
    assert "inputs:\n  t: {type: text}" in text
    notices = [f.message for f in imported.findings if f.severity == "notice"]
    assert any("'w' is read or written; taken as written by the first" in message for message in notices)


def test_nodes_that_are_skills_here_are_those_skills(exchange):
    imported = exchange.imported(
        tree('<Sequence><navigate_to goal="1;2;0.5"/><Turn angle="1.5707963267948966"/></Sequence>')
    )
    assert "navigate_to: {goal: {x: 1 m, y: 2 m, yaw: 0.5 rad}}" in imported.files["main_tree.yaml"]
    assert "turn: {angle: 90 deg}" in imported.files["main_tree.yaml"]
    assert imported.skills == ()


NAV2 = tree("""<RecoveryNode number_of_retries="6" name="NavigateRecovery">
  <PipelineSequence name="NavigateWithReplanning">
    <RateController hz="1.0">
      <RecoveryNode number_of_retries="1" name="ComputePathToPose">
        <ComputePathToPose goal="{goal}" path="{path}" planner_id="GridBased" error_code_id="{plan_code}"/>
        <ClearEntireCostmap name="ClearGlobal" service_name="global_costmap/clear_entirely_global_costmap"/>
      </RecoveryNode>
    </RateController>
    <RecoveryNode number_of_retries="1" name="FollowPath">
      <FollowPath path="{path}" controller_id="FollowPath" error_code_id="{follow_code}"/>
      <ClearEntireCostmap name="ClearLocal" service_name="local_costmap/clear_entirely_local_costmap"/>
    </RecoveryNode>
  </PipelineSequence>
  <ReactiveFallback name="RecoveryFallback">
    <GoalUpdated/>
    <RoundRobin name="RecoveryActions">
      <Spin spin_dist="1.57"/>
      <Wait wait_duration="5.0"/>
      <BackUp backup_dist="0.30" backup_speed="0.05"/>
    </RoundRobin>
  </ReactiveFallback>
</RecoveryNode>""")


def test_a_tree_of_nav2(exchange, told):
    library = exchange.library_of(NAV2)
    mission = library.get("main_tree")
    assert mission.required_inputs() == ("goal",) and mission.inputs["goal"].kind is Kind.POSE
    assert only_lacking(library, exchange) == []
    assert set(library.declarations) == {
        *(
            "back_up",
            "clear_entire_costmap",
            "compute_path_to_pose",
            "follow_path",
            "goal_updated",
            "skill_wait",
            "spin",
        )
    }
    lost = [(line, message.split(":")[0]) for severity, line, message in told(NAV2) if severity == "warning"]
    assert lost == []


def test_version_3(exchange, told):
    xml = """<root main_tree_to_execute="Main">
      <BehaviorTree ID="Main">
        <SequenceStar>
          <RetryUntilSuccesful num_attempts="2"><OpenDoor/></RetryUntilSuccesful>
          <SubTreePlus ID="Move" __autoremap="true" speed="fast"/>
          <Move2/>
          <Action ID="SaySomething" message="{answer}"/>
          <Control ID="Fallback"><Condition ID="DoorOpen"/><BlackboardCheckInt value_A="{a}" value_B="1" return_on_mismatch="FAILURE"><Knock/></BlackboardCheckInt></Control>
        </SequenceStar>
      </BehaviorTree>
      <BehaviorTree ID="Move"><Sequence><SetBlackboard output_key="answer" value="42"/><Drive speed="{speed}"/></Sequence></BehaviorTree>
      <BehaviorTree ID="Move2"><Drive speed="slow"/></BehaviorTree>
    </root>"""
    library = exchange.library_of(xml)
    calls = [n for n in library.get("main").nodes() if type(n).__name__ == "CallMission"]
    assert [call.mission.text for call in calls] == ["move", "move2"]
    assert [(o.text, k.text) for o, k in calls[0].outputs] == [("answer", "answer")]
    assert [(k.text, v.text) for k, v in calls[0].inputs] == [("speed", "fast")]
    assert (
        "warning",
        8,
        "BlackboardCheck: no node of a mission does this; replaced by a node that fails",
    ) in told(xml)


def test_subtrees_have_their_own_keys_and_share_only_what_is_mapped(exchange):
    library = exchange.library_of(
        tree(
            '<Sequence><Script code="goal_x:=1; mine:=2"/>'
            '<SubTree ID="MoveRobot" target="{goal_x}" result="{outcome}" limit="3"/>'
            "<ScriptCondition code=\"outcome=='done'\"/></Sequence>",
            more="""<BehaviorTree ID="MoveRobot"><Sequence><ScriptCondition code="target &lt; limit"/>
            <Script code="mine:=5; result:='done'"/></Sequence></BehaviorTree>""",
        )
    )
    assert set(library.get("move_robot").inputs) == {"target", "limit"}
    assert library.get("move_robot").outputs["result"].kind is Kind.TEXT
    assert only_lacking(library, exchange) == []


def test_a_key_that_goes_in_and_out(exchange, ticks):
    library = exchange.library_of(
        tree(
            '<Sequence><Script code="n:=1"/><SubTree ID="Count" number="{n}"/><SubTree ID="Count" number="{n}"/>'
            '<ScriptCondition code="n==3"/></Sequence>',
            more='<BehaviorTree ID="Count"><Script code="number+=1"/></BehaviorTree>',
        )
    )
    assert only_lacking(library, exchange) == []
    trace, _, keys = ticks("main_tree", library, {}, 1)
    assert keys == {"n": 3} and trace[-1][1][0] == "S"


def test_the_outermost_blackboard_reaches_every_tree(exchange, ticks):
    library = exchange.library_of(
        tree(
            '<Sequence><Script code="goal:=7"/><SubTree ID="A"/></Sequence>',
            more='<BehaviorTree ID="A"><SubTree ID="B"/></BehaviorTree>'
            '<BehaviorTree ID="B"><ScriptCondition code="@goal==7"/></BehaviorTree>',
        )
    )
    assert only_lacking(library, exchange) == []
    assert ticks("main_tree", library, {}, 1)[0][-1][1][0] == "S"


def test_names_that_missions_cannot_have_are_changed_and_told(exchange, told):
    xml = tree(
        '<Sequence name="it&apos;s: a [name]"><Say-Hi to="{My Key}" To="{my_key}" Wait="1"/><Wait/></Sequence>'
    )
    library = exchange.library_of(xml)
    assert only_lacking(library, exchange) == []
    assert set(library.declarations) == {"say_hi", "skill_wait"}
    assert set(library.get("main_tree").inputs) == {"my_key", "my_key_2"}
    assert "nodes are called differently now: Say-Hi -> say_hi, Wait -> skill_wait" in [
        m for _, _, m in told(xml)
    ]


LOST = [
    ('<A _while="{x}==1"/>', "warning", "has no place in a script"),
    ('<A _while="x==1"/>', "warning", "_while that breaks while the node runs: skipped there, a failure here"),
    ('<A _onHalted="x:=1"/>', "warning", "nothing runs only when a node is stopped"),
    ('<A _skipIf="(a &amp; 1) == 1"/>', "warning", "the operator '&' has no equivalent"),
    ("<Script code=\"a := 'x' + 'y'\"/>", "warning", "texts put together with +"),
    ('<RunOnce><A/></RunOnce>', "warning", "later starts are skipped there; here they end like the first"),
    ('<UnsetBlackboard key="x"/>', "warning", "a key keeps its value"),
    ('<SkipUnlessUpdated entry="{x}"><A/></SkipUnlessUpdated>', "warning", "no node of a mission does this"),
    ('<WaitValueUpdate entry="{x}"><A/></WaitValueUpdate>', "warning", "no node of a mission does this"),
    ('<WasEntryUpdated entry="{x}"/>', "warning", "no node of a mission does this"),
    ('<ManualSelector><A/><B/></ManualSelector>', "warning", "no node of a mission does this"),
    ('<LoopInt queue="{q}" value="{v}"><A/></LoopInt>', "warning", "a queue that comes from a key"),
    ('<Mystery hz="1"><A/></Mystery>', "warning", "what it does with the nodes below it is not known"),
    ('<TryCatch catch_on_halt="true"><A/><B/></TryCatch>', "warning", "catch_on_halt"),
    ('<A value="json:{}"/>', "warning", "a value in JSON is kept as text"),
    ('<Parallel success_count="{n}"><A/><B/></Parallel>', "warning", "cannot come from a key"),
    ('<Precondition if="a ? 1 : 0"><A/></Precondition>', "warning", "a ? b : c inside an expression"),
    ('<SubTree ID="Elsewhere" x="{y}"/>', "warning", "the tree 'Elsewhere' is not in this file"),
    ('<navigate_to goal="{g}" colour="red"/>', "warning", "the skill navigate_to has no input or output 'colour'"),
    ('<Sleep msec="soon"/>', "warning", "is not a number of milliseconds"),
    ('<A _uid="3" _fullpath="x"/>', "notice", "what Groot keeps for itself is left out"),
]  # fmt: skip


@pytest.mark.parametrize(("nodes", "severity", "message"), LOST)
def test_what_has_no_equivalent_is_named_with_its_line(told, nodes, severity, message):
    found = told(tree(f"<Sequence>\n{nodes}\n<B/></Sequence>"))
    assert [(s, line) for s, line, text in found if message in text] == [(severity, 4)], found


def test_what_cannot_be_imported_fails_when_it_is_reached(run_tree):
    status, calls, _, _ = run_tree('<Sequence><A/><WasEntryUpdated entry="{x}"/><B/></Sequence>')
    assert (status, calls) == ("FAILURE", ["a"])


BROKEN = [
    ("<Sequence/>", 3, "<Sequence> needs nodes below it"),
    ("<Inverter><A/><B/></Inverter>", 3, "<Inverter> must have exactly one node below it, not 2"),
    ("<A/><B/>", 2, "must have exactly one node below it, not 2"),
    ('<Sequence><SubTree/></Sequence>', 3, "<SubTree> needs an ID"),
    ('<Sequence><Action name="x"/></Sequence>', 3, "<Action> needs an ID"),
    ('<SubTree ID="MainTree"/>', 3, "the tree 'MainTree' calls itself: MainTree -> MainTree"),
    ('<SubTree ID="X"><A/></SubTree>', 3, "<SubTree> cannot have nodes below it"),
    ("<Sleep><A/></Sleep>", 3, "<Sleep> cannot have nodes below it"),
    ("<Inverter>" * 45 + "<A/>" + "</Inverter>" * 45, 3, "nested more than 40 deep"),
]  # fmt: skip


@pytest.mark.parametrize(("nodes", "line", "message"), BROKEN)
def test_what_breaks_the_rules_of_the_format_is_an_error(exchange, nodes, line, message):
    imported = exchange.imported(tree(nodes))
    assert imported.files == {}
    assert [(f.severity, f.line) for f in imported.findings if message in f.message] == [("error", line)]


def test_more_errors_of_the_format(told):
    assert told(f"{ROOT}</root>")[0][::2] == ("error", "the file has no tree")
    models = '<TreeNodesModel><Action ID="A"/></TreeNodesModel>'
    assert told(f"{ROOT.split(' main_')[0]}>{models}</root>")[0][::2] == ("error", "the file has no tree")
    twice = '<BehaviorTree ID="MainTree"><A/></BehaviorTree>'
    assert told(f"{ROOT}{twice}{twice}</root>")[0][2].startswith(
        "the tree 'MainTree' is duplicated (first in"
    )
    assert (
        told(f"{ROOT}<BehaviorTree ID='MainTre'><A/></BehaviorTree></root>")[0][2]
        == "there is no tree 'MainTree' to execute"
    )
    loop = '<BehaviorTree ID="{}"><SubTree ID="{}"/></BehaviorTree>'
    cycle = told(f"{ROOT}{loop.format('MainTree', 'B')}{loop.format('B', 'MainTree')}</root>")
    assert cycle[0][2] == "the tree 'MainTree' calls itself: MainTree -> B -> MainTree"


def test_included_files(exchange, told):
    (exchange.folder / "sub").mkdir()
    inner = '<root BTCPP_format="4"><include path="../tree.xml"/><BehaviorTree ID="Inner"><A/></BehaviorTree></root>'
    (exchange.folder / "sub" / "inner.xml").write_text(inner)
    xml = tree('<SubTree ID="Inner"/>', more='\n<include path="sub/inner.xml"/>')
    assert exchange.library_of(xml).names() == ["inner", "main_tree"]
    for include, severity, message in (
        ('<include path="nowhere.xml"/>', "error", "there is no file"),
        ('<include path="/etc/passwd"/>', "error", "the path '/etc/passwd' of the include is not followed"),
        ("<include/>", "error", "the path '' of the include is not followed"),
        ('<include ros_pkg="p" path="x.xml"/>', "warning", "the package 'p' is not looked for"),
    ):
        found = told(tree("<A/>", more=f"\n{include}"))
        assert [(s, line) for s, line, text in found if message in text] == [(severity, 5)]


def test_included_files_with_too_many_elements_together(exchange):
    for number in range(2):
        nodes = "<A/>" * 2600
        text = f'<root BTCPP_format="4"><BehaviorTree ID="T{number}"><Sequence>{nodes}</Sequence></BehaviorTree></root>'
        (exchange.folder / f"t{number}.xml").write_text(text)
    with pytest.raises(ConfigError, match="all files together have more than 5000 elements"):
        exchange.imported(tree("<A/>", more='<include path="t0.xml"/><include path="t1.xml"/>'))


def test_models_of_further_files(exchange):
    model = exchange.folder / "nodes.xml"
    model.write_text(
        '<root BTCPP_format="4"><TreeNodesModel><Action ID="Go"><output_port name="end" type="int"/></Action></TreeNodesModel></root>'
    )
    text = exchange.imported(tree('<Go end="{e}"/>'), models=[model]).files["main_tree.yaml"]
    assert "go:\n  out: {end: e}" in text


def test_compare_with_enumerations(exchange):
    text = exchange.imported(
        tree('<Sequence><Go _onSuccess="result:=OK"/><ScriptCondition code="result == OK"/></Sequence>')
    ).files["main_tree.yaml"]
    assert "set: {result: OK}" in text and 'condition: $result == "OK"' in text


def test_trees_that_share_more_keys_than_any_program_needs(exchange):
    leaf = "".join(f'<A p="{{k{number}}}"/>' for number in range(300))
    calls = '<SubTree ID="S" _autoremap="true"/>' * 100
    xml = tree(
        f"<Sequence>{calls}</Sequence>",
        more=f'<BehaviorTree ID="S"><Sequence>{leaf}</Sequence></BehaviorTree>',
    )
    with pytest.raises(ConfigError, match="the trees share more than 20000 keys") as caught:
        exchange.imported(xml)
    assert caught.value.line == 3
