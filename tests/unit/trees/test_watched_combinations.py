"""Every wrapper of the language round a condition: it is watched through, or the check refuses it.

A combination is a condition below one or two wrappers, as the first node of a node without memory. Either the
check has an error with a place in the file, or: the later node is started once; the change of the condition
reaches the tree, and stops the later node, when the wrappers let it through; nothing spins or is left.
"""

import itertools

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import ScriptedRun, Step
from florence_bt.trees.checks.lint import check
from tests.sweeps import sweep
from tests.unit.trees.language import DECLARATIONS, ENDLESS, Play, takes
from tests.unit.trees.test_watched_skills import AWAY

WRAPPERS = {
    # name: (text, what becomes of the answer)
    "plain": ("{sequence: [G]}", None),
    "timeout": ("{timeout: 50 s, do: G}", None),
    "retry": ("{retry: 3, do: G}", None),
    "retry with a pause": ("{retry: 2, do: {selector: [G, {sequence: [{wait: 200 ms}, {fail: no}]}]}}", None),
    "repeat": ("{repeat: 3, do: G}", None),
    "once": ("{once: G}", None),
    "delay": ("{sequence: [{wait: 300 ms}, G]}", None),
    "succeed": ("{succeed: G}", True),
    "failure": ("{sequence: [G, {fail: no}]}", False),
    "invert": ("{invert: G}", "not"),
    "finally": ("{sequence: [G], finally: {clean: }}", None),
    "slow finally": ("{sequence: [G], finally: {wait: 1 s}}", None),
    "parallel": ("{parallel: [G, {condition: $yes}]}", None),
    "any": ("{parallel: [G, {fail: no}], policy: any}", None),
    "if": ("{if: G, then: {condition: $yes}, else: {fail: no}}", None),
    "watching if": ("{if: G, then: {condition: $yes}, else: {fail: no}, memory: false}", None),
    "branch": ("{if: $yes, then: G}", None),
    "switch": ("{switch: $mode, cases: {a: G}}", None),
    "sequence": ("{sequence: [{condition: $yes}, G, {condition: $yes}]}", None),
    "selector": ("{selector: [{fail: no}, G]}", None),
    "watching sequence": ("{sequence: [G, {condition: $yes}], memory: false}", None),
    "watching selector": ("{selector: [G, {fail: no}], memory: false}", None),
    "when": ("{sequence: [G], when: $yes}", None),
    "while": ("{sequence: [G], while: $yes}", None),
    "action before": ("{sequence: [{other: }, G]}", None),
    "pause before": ("{sequence: [{wait: 400 ms}, G]}", None),
}
GUARDS = {
    "instant": "{is_home: }",
    "reports": "{door: }",
    "slow": "{measure: , every: 1 s}",
    "key": "{condition: $home}",
    "called": "{run: sub}",
    "called with an output": "{run: sub_out, out: {d: near}}",
}
PLACES = {
    "sequence": ("{sequence: [G, {work: }], memory: false}", True),
    "selector": ("{selector: [G, {work: }], memory: false}", False),
    "if": ("{if: G, then: {work: }, else: {fail: no, code: away}, memory: false}", True),
    "below parallel": ("{parallel: [{sequence: [G, {work: }], memory: false}, {work: }], policy: any}", True),
    "second": ("{sequence: [{condition: $yes}, G, {work: }], memory: false}", True),
}
HEAD = """inputs: {yes: {type: boolean, default: true}, mode: {type: text, default: a}}
keys: {home: {type: boolean, default: true}}
"""
CALLED = {
    "sub": "tree: {sequence: [{is_home: }]}",
    "sub_out": (
        "outputs: {d: {type: integer}}\ntree: {sequence: [{set: {d: 3}}, {retry: 2, do: {is_home: }}]}"
    ),
}
CHANGES_AT = 10.5
REFUSED = {"once", "finally", "slow finally"}


class House:
    """Whether somebody is at home, for every kind of condition."""

    def __init__(self, play, home):
        self._play, self._calls = play, []
        self.home = home
        self.asked = 0

    def start(self, inputs, after=0.0):
        self.asked += 1
        return ScriptedRun(self._play.clock, Step(success() if self.home else AWAY, after=after), inputs)

    def change(self):
        self.home = not self.home
        self._play.keys.write("home", self.home)
        for call in tuple(self._calls):
            call()

    def watch(self, inputs, callback):
        self._calls.append(callback)
        return lambda: self._calls.remove(callback)


class Slow:
    """Takes time to answer."""

    def __init__(self, house, seconds):
        self._house, self._seconds = house, seconds

    def start(self, inputs):
        return self._house.start(inputs, self._seconds)


def through(home, effects):
    """The answer of a condition, seen through wrappers, the innermost first."""
    for effect in effects:
        home = not home if effect == "not" else home if effect is None else effect
    return home


def checked(play):
    return check(play.library.get("m"), play.library, play.context.declarations)


def prepared(tmp_path, wrappers, guard, place):
    """The mission, whether somebody is at home at first, and whether the change ends the later node."""
    text, wanted = PLACES[place]
    for name in reversed(wrappers):
        text = text.replace("G", WRAPPERS[name][0])
    tree = text.replace("G", GUARDS[guard])
    effects = [WRAPPERS[name][1] for name in wrappers]
    fitting = [home for home in (True, False) if through(home, effects) is wanted]
    if not fitting:
        return None
    home = fitting[0]
    head = HEAD.replace(
        "{type: boolean, default: true}}\n", f"{{type: boolean, default: {str(home).lower()}}}}}\n"
    )
    play = Play(
        tmp_path, f"{head}tree: {tree}", others=CALLED, work=[ENDLESS], other=[takes(0.2)], measure=[takes(0)]
    )
    house = House(play, home)
    play.skills.update(is_home=Slow(house, 0.0), measure=Slow(house, 0.3), door=house)
    return play, house, through(not home, effects) is not wanted


def works(play):
    return [moment for moment, skill in play.started if skill == "work"]


def holds(tmp_path, wrappers, guard, place):
    ready = prepared(tmp_path, wrappers, guard, place)
    if ready is None:
        return
    play, house, ends = ready
    errors = [finding for finding in checked(play) if finding.severity == "error"]
    if errors:
        assert all(found.line > 0 and found.column > 0 for found in errors)
        assert REFUSED & set(wrappers) or any("never" in found.message for found in errors)
        return
    cleans = bool({"finally", "slow finally"} & set(wrappers))
    if ends and REFUSED & set(wrappers):
        assert "action before" in wrappers, "what only asks can have no clean-up and no once"
    if "once" in wrappers:
        ends = False  # the action and what follows it are done once: that is what the author says
    runs = 2 if place == "below parallel" else 1
    assert play.at(CHANGES_AT) == "running"
    assert len(works(play)) == runs and all(moment < 5.0 for moment in works(play))
    others, cleaned = len(play.skills["other"].runs), len(play.skills["clean"].runs)
    assert cleaned == (1 if "finally" in wrappers and cleans else 0)
    house.change()
    if play.context.wake.take():
        play.tick()
    play.at(CHANGES_AT + 5.0)
    assert len(works(play)) == runs, "the later node was started for nothing"
    assert (play.root.status is not Status.RUNNING) == (ends and runs == 1)
    stopped = sum(skill == "work" for _, skill, _ in play.ended)
    assert stopped == (1 if ends else 0)
    assert len(play.skills["other"].runs) == others, "the action before was done for nothing"
    assert len(play.skills["clean"].runs) == cleaned * (2 if ends else 1), "a clean-up runs once for each run"
    play.root.stop(Status.INVALID)
    assert not play.context.runs and not play.context.watching


@pytest.fixture(autouse=True)
def door(monkeypatch):
    reporting = DECLARATIONS["is_home"].__class__(
        "door", "Ask", failures={"away": "no"}, instant=True, reports_changes=True
    )
    monkeypatch.setitem(DECLARATIONS, "door", reporting)


@pytest.mark.parametrize(("guard", "place"), sweep(itertools.product(GUARDS, PLACES), every=4))
def test_below_one_wrapper(tmp_path, guard, place):
    for wrapper in WRAPPERS:
        holds(tmp_path, (wrapper,), guard, place)


@pytest.mark.parametrize(
    ("outer", "place"), sweep(itertools.product(WRAPPERS, ["sequence", "selector"]), every=5)
)
def test_below_two_wrappers(tmp_path, outer, place):
    for inner in WRAPPERS:
        holds(tmp_path, (inner, outer), "instant" if place == "sequence" else "reports", place)
