"""Nav2's own controls: what is done again while a later node runs, and the shapes of the trees that Nav2 ships."""

# ruff: noqa: E501  (XML on one line)

import pytest

from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations


def pipeline(first, last="<B/>"):
    return f"<PipelineSequence>{first}{last}</PipelineSequence>"


@pytest.mark.parametrize(
    ("nodes", "told", "status", "calls", "seconds"),
    [
        (pipeline('<RateController hz="2"><A/></RateController>'), {"b": [2.2]}, "SUCCESS", "abaaaa", 2.2),
        (pipeline("<RateController><A/></RateController>"), {"b": [2.2]}, "SUCCESS", "abaa", 2.2),
        (pipeline('<RateController hz="1"><A/></RateController>'), {"a": ["S", "S", "F"], "b": [9]}, "FAILURE", "abaa", 2.0),
        (pipeline('<RateController hz="1"><A/></RateController>'), {"b": "F"}, "FAILURE", "ab", 0.0),
        (pipeline('<RateController hz="1"><A/></RateController>'), {"a": "F"}, "FAILURE", "a", 0.0),
        (pipeline('<SpeedController min_rate="0.1" max_rate="4"><A/></SpeedController>'), {"b": [0.6]}, "SUCCESS", "abaa", 0.6),
        (pipeline('<C/><RateController hz="1"><A/></RateController>'), {"b": [1.5]}, "SUCCESS", "cabca", 1.5),
        (pipeline("<A/>"), {"b": [0.25]}, "SUCCESS", "abaa", 0.25),
        (pipeline("<GoalUpdatedController><A/></GoalUpdatedController>"), {"b": [5]}, "SUCCESS", "ab", 5.0),
    ],
)  # fmt: skip
def test_earlier_nodes_are_done_again(run_tree, nodes, told, status, calls, seconds):
    end, called, _, now = run_tree(nodes, **told)
    assert (end, "".join(called), now) == (status, calls, seconds)


def test_the_last_node_starts_again_with_what_earlier_ones_write(run_tree):
    first = '<RateController hz="1"><Script code="n := n + 1"/></RateController>'
    nodes = f'<Sequence><Script code="n := 0"/>{pipeline(first, """<B n="{n}"/>""")}</Sequence>'
    end, called, _, now = run_tree(nodes, b=[1.5, 1.5, 0.5])
    assert (end, called, now) == ("SUCCESS", ["b", "b", "b"], 2.5)


def test_it_goes_on_when_they_write_the_same(run_tree):
    first = '<RateController hz="1"><Script code="n := 3"/></RateController>'
    end, called, _, now = run_tree(pipeline(first, '<B n="{n}"/>'), b=[4.5])
    assert (end, called, now) == ("SUCCESS", ["b"], 4.5)


@pytest.mark.parametrize(
    ("retries", "told", "status", "calls"),
    [
        ("-1", {"a": [*"FFFFFFF", "S"]}, "SUCCESS", "ababababababab" + "a"),
        ("-1", {"a": "F", "b": ["S", "S", "F"]}, "FAILURE", "ababab"),
        ("0", {"a": "F"}, "FAILURE", "a"),
        ("1", {"a": "F"}, "FAILURE", "aba"),
        ("{n}", {"a": "F"}, "FAILURE", "ababa"),
        ("{none}", {"a": "F"}, "FAILURE", ""),
    ],
)
def test_a_recovery_is_tried_as_often_as_its_number_says(run_tree, retries, told, status, calls):
    recovery = f'<RecoveryNode number_of_retries="{retries}"><A/><B/></RecoveryNode>'
    end, called, *_ = run_tree(f'<Sequence><Script code="n := 2"/>{recovery}</Sequence>', **told)
    assert (end, "".join(called)) == (status, calls)


PLAN = '<ComputePathToPose goal="{goal}" path="{path}" planner_id="GridBased" error_code_id="{plan_code}"/>'
FOLLOW = '<FollowPath path="{path}" controller_id="FollowPath" error_code_id="{follow_path_error_code}"/>'
HELP = '<Sequence><WouldAControllerRecoveryHelp error_code="{follow_path_error_code}"/><ClearEntireCostmap service_name="local"/></Sequence>'
REPLANNING = {
    "rate": f'<RateController hz="1.0">{PLAN}</RateController>',
    "speed": f'<SpeedController min_rate="0.1" max_rate="1.0" min_speed="0.0" max_speed="0.26">{PLAN}</SpeedController>',
    "goal": f"<GoalUpdatedController>{PLAN}</GoalUpdatedController>",
    "recovery": f'<RateController hz="0.333"><RecoveryNode number_of_retries="1">{PLAN}<ClearEntireCostmap service_name="global"/></RecoveryNode></RateController>',
    "selectors": f'<ControllerSelector selected_controller="{{c}}" default_controller="FollowPath" topic_name="t"/><RateController hz="1.0">{PLAN}</RateController>',
}


@pytest.mark.parametrize("name", REPLANNING)
def test_replanning_trees_of_nav2_keep_it_and_pass_their_check(exchange_with, name):
    exchange = exchange_with(collect_declarations())
    follow = f'<RecoveryNode number_of_retries="1" name="FollowPath">{FOLLOW}{HELP}</RecoveryNode>'
    retries = '<Sequence><WouldAControllerRecoveryHelp error_code="{follow_path_error_code}"/><Wait wait_duration="5.0"/></Sequence>'
    nodes = (
        f'<RecoveryNode number_of_retries="6">{pipeline(REPLANNING[name], follow)}{retries}</RecoveryNode>'
    )
    xml = f'<root BTCPP_format="4"><BehaviorTree ID="Navigate">{nodes}</BehaviorTree></root>'
    library = exchange.library_of(xml)
    errors = [
        f.message for f in check(library.missions(), library, exchange.declarations) if f.severity == "error"
    ]
    assert errors == []
    lost = {f.message.split(":")[0] for f in exchange.imported(xml).findings if f.severity == "warning"}
    assert lost == {"FollowPath"}  # its error code, which skills give on success only
    assert (name == "goal") != ("name: again" in exchange.imported(xml).files["navigate.yaml"])


def test_a_distance_is_not_measured_and_pipelines_in_pipelines_are_sequences(exchange_with):
    exchange = exchange_with({})
    for nodes, said in (
        (pipeline('<DistanceController distance="2"><A/></DistanceController>'), "DistanceController: done again every second"),
        (pipeline(pipeline("<A/>")), "PipelineSequence: another PipelineSequence stands before"),
    ):  # fmt: skip
        xml = f'<root BTCPP_format="4"><BehaviorTree ID="M">{nodes}</BehaviorTree></root>'
        assert [f.message for f in exchange.imported(xml).findings if f.message.startswith(said)]
