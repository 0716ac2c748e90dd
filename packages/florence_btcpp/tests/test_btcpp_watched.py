"""Imported reactive nodes watch their conditions while an action runs, as they do in BehaviorTree.CPP."""

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.language.compile import compile_mission
from tests.scripted_skill import ScriptedSkill
from tests.ticking import make_context, tick_until

NO = failure("rejected", "it is not")


@pytest.mark.parametrize(
    ("reactive", "before", "after", "status"),
    [
        ("ReactiveSequence", success(), NO, "FAILURE"),
        ("ReactiveFallback", NO, success(), "SUCCESS"),
    ],
)
@pytest.mark.parametrize("condition", ["<Condition ID='BatteryOk'/>", "<SubTree ID='Safe'/>"])
def test_a_condition_that_changes_ends_a_long_action(
    exchange_with, reactive, before, after, status, condition
):
    library = exchange_with({}).library_of(
        f"""<root BTCPP_format="4" main_tree_to_execute="Main">
          <BehaviorTree ID="Main"><{reactive}>{condition}<Action ID="Drive"/></{reactive}></BehaviorTree>
          <BehaviorTree ID="Safe"><Condition ID="BatteryOk"/></BehaviorTree>
        </root>"""
    )
    clock, declarations = ManualClock(), library.with_declared({})
    # Asked at 0 s, 1 s, ...; the answer changes after 10 s.
    battery = ScriptedSkill(declarations["battery_ok"], clock, [Step(before)] * 10 + [Step(after)])
    drive = ScriptedSkill(declarations["drive"], clock, [Step(after=50.0)])
    context = make_context(clock, {"battery_ok": battery, "drive": drive}, declarations)
    tree = compile_mission(library.get("main"), library, {}, context)
    tick_until(tree.root, clock, context)
    assert (tree.root.status.name, clock.now()) == (status, 10.0)
    assert [run.cancelled for run in drive.runs] == [True]
