"""Called missions, and what stands behind `when`, are built when a run reaches them."""

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.why import path_of
from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRequest, RunIds, RunStatus
from florence_bt.runtime.viewers.snapshot import snapshot_of
from florence_bt.runtime.viewers.variables import variables_of
from florence_bt.trees.drawings.ascii import draw_rows, tree_rows
from florence_bt.trees.language.compile import compile_mission
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until

SUB = """mission: sub
inputs: {by: {type: angle}}
keys: {n: {type: integer, default: 2}}
tree:
  repeat: $n
  do: {turn: {angle: $by}}
"""
FALLS_BACK = """
keys: {far: {type: boolean, default: false}}
tree:
  selector:
    - name: first
      sequence: [{turn: {angle: 1 rad}}]
    - when: $far
      name: far off
      sequence: [{wait: 1 s}, {turn: {angle: 4 rad}}]
    - name: second
      sequence: [{run: sub, with: {by: 2 rad}}, {run: sub, name: once more, with: {by: 3 rad}}]
"""
FAILS, SUCCEEDS = Step(failure("blocked", "a chair"), after=1.0), Step(success(), after=1.0)


@pytest.fixture
def built(monkeypatch):
    """The names of the nodes that were built, in order."""
    names = []
    init = Behaviour.__init__

    def count(self, name):
        names.append(name)
        init(self, name)

    monkeypatch.setattr(Behaviour, "__init__", count)
    return names


class Bench:
    def __init__(self, workshop, tree=FALLS_BACK, moves=(SUCCEEDS,), sub=SUB, as_reached=True):
        workshop.write(tree)
        workshop.write(sub, "sub")
        self.library, self.declarations = workshop.library(), workshop.declarations
        self.as_reached = as_reached
        self.begin(moves)

    def begin(self, moves):
        """A new run of the mission."""
        self.clock = ManualClock()
        self.skills = {
            name: ScriptedSkill(declaration, self.clock, list(moves) if name == "turn" else [Step()])
            for name, declaration in self.declarations.items()
        }
        self.context = make_context(self.clock, self.skills, self.declarations)
        self.tree = compile_mission(
            self.library.get("m"), self.library, {}, self.context, as_reached=self.as_reached
        )
        self.root = self.tree.root

    def run(self, **options):
        tick_until(self.root, self.clock, self.context, **options)
        if self.root.status is not Status.RUNNING:
            drain(self.clock, self.context)
        return self.root.status

    def dump(self):
        return draw_rows(tree_rows(self.root, lambda node: None, lambda node: None))

    def ids(self):
        return {path_of(node): node.id for node in self.root.iterate()}


def test_a_run_builds_what_it_reaches(workshop, built):
    bench = Bench(workshop)
    built.clear()
    bench.begin([SUCCEEDS])
    assert bench.run() is Status.SUCCESS
    assert sorted(built) == ["first", "m", "once more", "run sub", "second", "turn", "when $far"]


def test_what_is_reached_later_is_built_then(workshop, built):
    bench = Bench(workshop, moves=[FAILS, SUCCEEDS])
    built.clear()
    assert bench.run() is Status.SUCCESS
    assert built == ["turn", "repeat $n times", "turn", "repeat $n times"]
    assert [call["angle"] for call in bench.skills["turn"].calls] == [1.0, 2.0, 2.0, 3.0, 3.0]


@pytest.mark.parametrize("moves", [[SUCCEEDS], [FAILS, SUCCEEDS], [FAILS, SUCCEEDS, FAILS]])
def test_the_dump_is_that_of_a_tree_built_at_once(workshop, moves):
    late, whole = (Bench(workshop, moves=moves, as_reached=each) for each in (True, False))
    assert late.dump() == whole.dump()
    assert late.run() is whole.run()
    assert late.dump() == whole.dump()


def test_a_node_has_its_id_before_it_is_built(workshop):
    bench = Bench(workshop, moves=[FAILS, SUCCEEDS])
    before = bench.ids()
    assert len(set(before.values())) == len(before), "no two nodes have the same"
    nodes = {node.own_id: node for node in snapshot_of(bench.root, {}, {})}
    assert all(nodes[child].parent_id == each.own_id for each in nodes.values() for child in each.child_ids)
    bench.run()
    assert bench.ids() == before


def test_runs_of_one_version_do_not_meet(workshop):
    bench = Bench(workshop, moves=[FAILS, SUCCEEDS])
    first = bench.root
    bench.run(done=lambda: len(bench.skills["turn"].calls) == 3)
    bench.begin([SUCCEEDS])
    assert bench.run() is Status.SUCCESS
    unreached = bench.root.children[2].children
    assert [call.children[0].status for call in unreached] == [Status.INVALID, Status.INVALID]
    assert first.children[2].children[0].children[0].status is not Status.INVALID
    assert path_of(unreached[0].children[0]) == "m/second/run sub/repeat $n times"


def test_a_stop_in_front_of_a_branch(workshop):
    bench = Bench(workshop)
    ticker = Ticker(bench.root, record=True)
    ticker.tick()
    ticker.stop()
    assert all(node.status is Status.INVALID for node in bench.root.iterate())


def test_the_keys_of_a_mission_are_found_when_it_is_reached(workshop):
    bench = Bench(workshop, moves=[FAILS, SUCCEEDS])
    variables = variables_of(bench.tree)
    assert variables.complete
    assert variables.values_of(["/second/sub/n"]) == {"/second/sub/n": "-"}
    bench.run(done=lambda: len(bench.skills["turn"].calls) == 2)
    assert not variables.complete
    assert variables_of(bench.tree).values_of(["/second/sub/n"]) == {"/second/sub/n": "2"}


def test_an_error_where_no_run_comes_is_told_at_the_start(workshop):
    with pytest.raises(ConfigError, match="unknown skill 'mve'"):
        Bench(workshop, sub=SUB.replace("turn", "mve"))


def test_what_nobody_watches_in_a_condition_is_built_when_it_is_reached(workshop, built):
    tree = """
tree:
  memory: false
  sequence:
    - {run: sub, with: {by: 2 rad}}
    - {wait: 5 s}
"""
    sub = SUB.replace("repeat: $n\n  do: {turn: {angle: $by}}", "once: {when: $n == 2, turn: {angle: $by}}")
    whole = Bench(workshop, tree, sub=sub, as_reached=False)
    late = Bench(workshop, tree, sub=sub)
    built.clear()
    assert late.run() is whole.run() is Status.SUCCESS
    assert "turn" in built
    assert late.dump() == whole.dump()
    kinds = [[type(node).__name__ for node in bench.root.iterate()] for bench in (late, whole)]
    assert kinds[0] == kinds[1]
    assert "RunSkill" in kinds[0], "and none that is asked as a condition"


def test_the_last_tree_of_a_run_shows_all_of_it(workshop):
    workshop.write(FALLS_BACK)
    workshop.write(SUB, "sub")
    clock = ManualClock()
    skills = {name: ScriptedSkill(each, clock, [SUCCEEDS]) for name, each in workshop.declarations.items()}
    executor = Executor(workshop.library(), skills, workshop.declarations, clock, RunIds("T"))
    run = executor.trigger(MissionRequest("m"))
    while not run.status.final:
        assert clock.run_next()
    assert run.status is RunStatus.SUCCEEDED
    assert run.tree.splitlines()[-7:] == [
        "    [ ] second (sequence)",
        "        [ ] run sub",
        "            [ ] repeat $n times",
        "                [ ] turn",
        "        [ ] once more",
        "            [ ] repeat $n times",
        "                [ ] turn",
    ]
