import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Sequence

from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.why import Why, explain
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until

WORK = SkillDeclaration("work", "Work", failures={"broken": "it broke"})
CLEAN = SkillDeclaration("clean", "Clean up")


CLEANED = Step(success(), after=1.0)


def build(clock, work, clean=CLEANED):
    skills = {"work": ScriptedSkill(WORK, clock, [work]), "clean": ScriptedSkill(CLEAN, clock, [clean])}
    context = make_context(clock, skills, {"work": WORK, "clean": CLEAN})
    root = Finally(
        "root",
        context,
        RunSkill("work", context, "work"),
        lambda c: Sequence("clean up", True, [RunSkill("clean", c, "clean"), RunSkill("again", c, "clean")]),
    )
    return root, skills["work"], skills["clean"], context


@pytest.mark.parametrize(
    ("result", "status", "why"),
    [
        (success(), Status.SUCCESS, None),
        (failure("broken", "it broke"), Status.FAILURE, Why("root/work", "broken", "it broke")),
    ],
)
def test_the_clean_up_follows_and_the_status_of_the_body_stands(clock, result, status, why):
    # 0: work; 2: clean; 3: clean again; 4: done
    root, _, clean, context = build(clock, Step(result, after=2.0))
    tick_until(root, clock, context)
    assert (root.status, clock.now(), len(clean.runs)) == (status, 4.0, 2)
    assert explain(root) == why


def test_a_failing_clean_up_changes_nothing(clock):
    root, _, clean, context = build(clock, Step(success()), Step(failure("rejected", "no")))
    tick_until(root, clock, context)
    assert (root.status, len(clean.runs)) == (Status.SUCCESS, 1)


def test_a_stop_cleans_up_beside_the_tree(clock):
    # stop at 1: clean 1-2, again 2-3
    root, work, clean, context = build(clock, Step(None))
    root.tick_once()
    clock.advance(1.0)
    root.stop(Status.INVALID)
    assert (work.active, clean.active, root.status) == (0, 1, Status.INVALID)
    drain(clock, context)
    assert (clock.now(), len(clean.runs), clean.active) == (3.0, 2, 0)


def test_a_stop_during_the_clean_up_lets_it_go_on_where_it_was(clock):
    # 0: work; clean 0-1; stop at 0.5; again 1-2
    root, _, clean, context = build(clock, Step(success()))
    tick_until(root, clock, context, lambda: clock.now() >= 0.5 or bool(clean.runs))
    clock.advance(0.5)
    ids = [node.id for node in root.iterate()]
    root.stop(Status.INVALID)
    assert clean.active == 1
    drain(clock, context)
    assert (clock.now(), len(clean.runs), clean.active) == (2.0, 2, 0)
    assert [node.status for node in root.shown[1].iterate()] == [Status.SUCCESS] * 3
    assert [node.id for node in root.iterate()] == ids


def test_one_that_was_stopped_in_its_clean_up_can_begin_again_meanwhile(clock):
    # 0: work; clean 0-1; stop at 0.5, and the whole anew: clean 0.5-1.5; both end with their second steps
    root, work, clean, context = build(clock, Step(success()))
    root.tick_once()
    clock.advance(0.5)
    root.stop(Status.INVALID)
    root.tick_once()
    tick_until(root, clock, context)
    drain(clock, context)
    assert (root.status, clock.now(), len(work.runs), len(clean.runs)) == (Status.SUCCESS, 2.5, 2, 4)


def test_a_clean_up_that_hangs_ends_with_its_skills_deadline(clock):
    root, _, clean, context = build(clock, Step(None), Step(None))
    root.tick_once()
    root.stop(Status.INVALID)
    drain(clock, context)
    assert (clock.now(), clean.active) == (CLEAN.deadline_s, 0)


def test_stopping_a_finished_tree_does_not_clean_again(clock):
    root, _, clean, context = build(clock, Step(success()))
    tick_until(root, clock, context)
    root.stop(Status.INVALID)
    assert (len(clean.runs), context.runs) == (2, [])


class Breaks(Behaviour):
    """Waits a second on the clock, then has a bug, and another one when it is stopped."""

    def __init__(self, context):
        super().__init__("breaks")
        self._context = context
        self._begun = False

    def update(self):
        if self._begun:
            raise KeyError("a bug")
        self._begun = True
        self._context.clock.call_at(self._context.clock.now() + 1.0, self._context.wake)
        return Status.RUNNING

    def terminate(self, new_status):
        raise KeyError("another bug")


def test_a_bug_in_a_clean_up_that_a_timer_woke_ends_the_clean_up_alone(clock):
    # 0: stop, the clean-up begins beside the tree; 1: a timer wakes it and it breaks; its skill is cancelled
    ends = []
    skills = {
        "work": ScriptedSkill(WORK, clock, [Step(None)]),
        "clean": ScriptedSkill(CLEAN, clock, [Step(None)]),
    }
    declarations = {"work": WORK, "clean": CLEAN}
    context = make_context(
        clock, skills, declarations, on_skill_ended=lambda path, skill, result: ends.append((skill, result))
    )
    root = Finally(
        "root",
        context,
        RunSkill("work", context, "work"),
        lambda c: Parallel(
            "clean up", ParallelPolicy.SuccessOnAll(), [Breaks(c), RunSkill("clean", c, "clean")]
        ),
    )
    root.tick_once()
    root.stop(Status.INVALID)
    drain(clock, context)
    result = dict(ends)["finally"]
    assert (clock.now(), result.code) == (1.0, "internal_error")
    assert result.reason.startswith("KeyError: 'a bug' (in test_cleaning_up.py:")
    assert (skills["clean"].active, context.runs) == (0, [])
