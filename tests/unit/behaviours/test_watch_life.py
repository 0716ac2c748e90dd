"""The life of a watched skill: asked again by time and by its keys, until it stops watching."""

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.composites import ReactiveSelector, ReactiveSequence
from florence_bt.behaviours.keys import KeyReference
from florence_bt.behaviours.watched_skill import WatchedSkill
from florence_bt.behaviours.watching import Spot, Watch
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill
from tests.ticking import make_context

AT_HOME = SkillDeclaration(
    "at_home", "Look who is at home", inputs={"room": Port(Kind.TEXT, "where")}, failures={"nobody": "nobody"}
)
AWAY = failure("nobody", "nobody")


@pytest.fixture
def watched(clock):
    skill = ScriptedSkill(AT_HOME, clock, [Step(success()), Step(AWAY)])
    context = make_context(clock, {"at_home": skill}, {"at_home": AT_HOME}, {"room": "hall", "other": 1})
    watch = Watch(context)
    watch.begin()
    node = WatchedSkill(
        "at home",
        context,
        "at_home",
        {"room": KeyReference("room")},
        {},
        Spot(watch),
        keys=("room",),
        every=2.0,
    )
    ask(node, watch)
    context.wake.take()
    return node, skill, context, watch


def ask(node, watch):
    """What a composite does with its condition in a tick."""
    watch.look()
    for asked in watch.steps(node):
        asked.tick_once()


def test_it_is_asked_again_after_its_period_and_keeps_its_answer_until_then(clock, watched):
    node, skill, context, watch = watched
    clock.advance(1.9)
    ask(node, watch)
    assert (node.status, len(skill.runs), context.wake.take()) == (Status.SUCCESS, 1, False)
    clock.advance(0.2)
    assert context.wake.take()
    ask(node, watch)
    assert (node.status, len(skill.runs)) == (Status.FAILURE, 2)


def test_a_key_that_it_takes_has_it_asked_at_once_and_no_other_key_does(watched):
    node, skill, context, watch = watched
    context.keys.write("other", 2)
    assert not context.wake.take()
    context.keys.write("room", "kitchen")
    assert context.wake.take()
    ask(node, watch)
    assert [call["room"] for call in skill.calls] == ["hall", "kitchen"]


def test_whoever_goes_on_after_a_pause_can_have_it_asked(watched):
    node, skill, context, watch = watched
    assert context.watching == [node.ask_again]
    for ask_again in context.watching:
        ask_again()
    ask(node, watch)
    assert len(skill.runs) == 2


def test_when_it_stops_watching_nothing_wakes_it_any_more(clock, watched):
    node, skill, context, _ = watched
    node.stop_watching()
    assert context.watching == []
    context.keys.write("room", "kitchen")
    clock.advance(10.0)
    assert (context.wake.take(), len(skill.runs)) == (False, 1)


@pytest.mark.parametrize(
    ("kind", "ends"), [(ReactiveSequence, Status.FAILURE), (ReactiveSelector, Status.SUCCESS)]
)
def test_a_composite_without_memory_ends_the_watch_when_it_ends(clock, kind, ends):
    answer = success() if kind is ReactiveSequence else AWAY
    skill = ScriptedSkill(AT_HOME, clock, [Step(answer)])
    context = make_context(clock, {"at_home": skill}, {"at_home": AT_HOME})
    watch = Watch(context)
    condition = WatchedSkill("at home", context, "at_home", {"room": "hall"}, {}, Spot(watch))
    later = Scripted(Status.RUNNING, ends)
    root = kind("root", [condition, later], [watch])
    root.tick_once()
    assert (root.status, context.watching) == (Status.RUNNING, [condition.ask_again])
    root.tick_once()
    assert (root.status, context.watching) == (ends, [])
    clock.advance(10.0)
    assert (len(skill.runs), context.wake.take()) == (1, False)


class Scripted(Behaviour):
    """Gives these statuses, one with each tick."""

    def __init__(self, *statuses):
        super().__init__("later")
        self.left = list(statuses)

    def update(self):
        return self.left.pop(0)
