import pytest
from py_trees.common import Status

from florence_bt.behaviours.why import explain, path_of
from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.inputs import parse_inputs
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until


class Bench:
    def __init__(self, workshop, tree, inputs=None, **scripts):
        workshop.write(tree)
        library = workshop.library()
        self.clock = ManualClock()
        self.skills = {
            name: ScriptedSkill(declaration, self.clock, scripts.get(name, [Step()]))
            for name, declaration in workshop.declarations.items()
        }
        self.context = make_context(self.clock, self.skills, workshop.declarations)
        mission = library.get("m")
        self.tree = compile_mission(mission, library, parse_inputs(mission, inputs or {}), self.context)
        self.root = self.tree.root

    def run(self):
        tick_until(self.root, self.clock, self.context)
        drain(self.clock, self.context)
        return self.root.status

    def paths(self):
        return [path_of(node) for node in self.root.iterate()]


SEEN = Step(success(user=Pose2(1, 2, 3), distance=2.0), after=1.0)


def test_keys_flow_from_output_to_input(workshop):
    bench = Bench(
        workshop,
        "outputs: {user: {type: pose}}\n"
        "tree: {sequence: [{look_for_user: , out: {user: user}}, {navigate_to: {goal: $user}}]}\n",
        look_for_user=[SEEN],
    )
    assert bench.run() is Status.SUCCESS
    assert bench.skills["navigate_to"].calls == [{"goal": Pose2(1, 2, 3), "speed": 0.3}]
    assert bench.tree.outputs() == {"user": Pose2(1, 2, 3)}
    assert bench.tree.output_texts() == {"user": "{x: 1 m, y: 2 m, yaw: 171.887 deg}"}


def test_every_kind_of_value(workshop):
    bench = Bench(
        workshop,
        """\
inputs:
  x: {type: length}
  label: {type: text, default: hall}
tree:
  sequence:
    - set: {a: 5 m, c: "5 m", d: "the ${label}!", e: true, f: {x: 1 m, y: 2 m, yaw: 0}}
    - set: {b: $a}
    - set: {goal: {x: $x, y: $a, yaw: 180 deg}}
    - get_hotspot: {label: $d}
    - navigate_to: {goal: $goal, speed: 20 cm/s}
    - turn: {angle: 90 deg}
""",
        {"x": "3 m"},
        get_hotspot=[Step(success(pose=Pose2()))],
    )
    assert bench.run() is Status.SUCCESS
    assert bench.skills["get_hotspot"].calls == [{"label": "the hall!"}]
    assert bench.skills["navigate_to"].calls[0]["goal"] == Pose2(3.0, 5.0, pytest.approx(3.14159265))
    assert bench.skills["navigate_to"].calls[0]["speed"] == pytest.approx(0.2)
    keys = bench.context.keys.as_dict()
    assert (keys["a"], keys["b"], keys["c"], keys["e"], keys["f"]) == (5.0, 5.0, "5 m", True, Pose2(1, 2, 0))


def test_a_called_mission_has_keys_of_its_own(workshop):
    workshop.write(
        """\
inputs: {window: {type: duration, default: 3 s}, name: {type: text}}
outputs: {user: {type: pose}, distance: {type: length}}
tree: {look_for_user: {window: $window}, out: {user: user, distance: distance}}
""",
        "other",
    )
    bench = Bench(
        workshop,
        """\
tree:
  sequence:
    - set: {window: 9 s, who: Ada}
    - run: other
      with: {name: $who}
      out: {distance: far}
""",
        look_for_user=[SEEN],
    )
    assert bench.run() is Status.SUCCESS
    assert bench.skills["look_for_user"].calls == [{"window": 3.0}]
    assert bench.context.keys.as_dict() == {"window": 9.0, "who": "Ada", "far": 2.0}


def test_a_called_mission_starts_fresh_in_every_round(workshop):
    workshop.write(
        "tree: {selector: [{sequence: [{look_for_user: , out: {user: u}}, {navigate_to: {goal: $u}}]},"
        " {navigate_to: {goal: $u}}]}\n",
        "other",
    )
    bench = Bench(
        workshop,
        "tree: {retry: 2, do: {run: other}}\n",
        look_for_user=[SEEN, Step(failure("no_user_seen", "nobody"))],
        navigate_to=[Step(failure("no_path", "no way"))],
    )
    assert bench.run() is Status.FAILURE
    assert explain(bench.root).code == "missing_key"


def test_values_for_a_called_mission_are_checked_when_it_runs(workshop):
    workshop.write("inputs: {far: {type: length, max: 2 m}}\ntree: {wait: 1 s}\n", "other")
    bench = Bench(
        workshop, "inputs: {d: {type: length}}\ntree: {run: other, with: {far: $d}}\n", {"d": "3 m"}
    )
    assert bench.run() is Status.FAILURE
    why = explain(bench.root)
    assert (why.code, why.reason, bench.clock.now()) == (
        "bad_input",
        "far: 3 m is above the maximum of 2 m",
        0.0,
    )


def test_an_output_that_the_called_mission_did_not_write(workshop):
    workshop.write(
        "outputs: {u: {type: pose}}\ntree: {succeed: {look_for_user: , out: {user: u}}}\n", "other"
    )
    bench = Bench(
        workshop,
        "tree: {run: other, out: {u: mine}}\n",
        look_for_user=[Step(failure("no_user_seen", "nobody"))],
    )
    assert bench.run() is Status.FAILURE
    assert explain(bench.root).code == "missing_key"


@pytest.mark.parametrize(
    ("policy", "status", "seconds"), [("all", Status.SUCCESS, 5.0), ("any", Status.SUCCESS, 1.0)]
)
def test_parallel(workshop, policy, status, seconds):
    bench = Bench(
        workshop,
        f"tree: {{parallel: [{{look_for_user: }}, {{wait: 5 s}}], policy: {policy}}}\n",
        look_for_user=[SEEN],
    )
    assert (bench.run(), bench.clock.now()) == (status, seconds)
    assert bench.clock.next_time() is None


def test_a_failing_branch_stops_the_others(workshop):
    bench = Bench(
        workshop,
        "tree: {parallel: [{turn: {angle: 90 deg}}, {look_for_user: }]}\n",
        turn=[Step(None, cancel_takes=0.5)],
        look_for_user=[Step(failure("no_user_seen", "nobody"), after=2.0)],
    )
    assert (bench.run(), bench.clock.now()) == (Status.FAILURE, 2.5)
    assert explain(bench.root).code == "no_user_seen"
    assert bench.skills["turn"].runs[0].cancelled


def test_memory_false_watches_earlier_conditions(workshop):
    # 0: looking once succeeds, turning; 1 (the turn says something): looking fails, the turn is stopped
    bench = Bench(
        workshop,
        "tree: {sequence: [{look_for_user: }, {turn: {angle: 90 deg}}], memory: false}\n",
        look_for_user=[Step(success(user=Pose2(), distance=1.0)), Step(failure("no_user_seen", "gone"))],
        turn=[Step(None, accept_after=1.0)],
    )
    assert bench.run() is Status.FAILURE
    assert (bench.clock.now(), explain(bench.root).reason) == (1.0, "gone")
    assert bench.skills["turn"].active == 0


def test_because_can_quote_the_failure_that_it_explains(workshop):
    bench = Bench(
        workshop,
        "keys: {least: {type: length, default: 0.5 m}}\n"
        'tree: {look_for_user: , because: "no user within $least ($failure_code): $failure_reason"}\n',
        look_for_user=[Step(failure("no_user_seen", "nobody"))],
    )
    bench.run()
    assert explain(bench.root).reason == "no user within 0.5 m (no_user_seen): nobody"


def test_because_in_a_called_mission_uses_its_own_keys(workshop):
    workshop.write(
        "inputs: {who: {type: text}}\n"
        'tree: {look_for_user: , because: {no_user_seen: "$who is not there"}}\n',
        "other",
    )
    bench = Bench(
        workshop,
        "tree: {sequence: [{set: {who: Bob}}, {run: other, with: {who: Ada}}]}\n",
        look_for_user=[Step(failure("no_user_seen", "nobody"))],
    )
    bench.run()
    why = explain(bench.root)
    assert (why.reason, why.code) == ("Ada is not there", "no_user_seen")


def test_names_and_paths_are_unique(workshop):
    bench = Bench(
        workshop,
        "tree: {sequence: [{wait: 1 s}, {wait: 1 s}, {stop_tracker: , name: halt},"
        " {invert: {stop_tracker: }}]}\n",
    )
    assert bench.paths() == [
        *["m/wait 1 s", "m/wait 1 s (2)", "m/halt"],
        *["m/not stop tracker/stop tracker", "m/not stop tracker", "m"],
    ]


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        ("tree: {fly: }\n", "m.yaml:2:8: unknown skill 'fly'"),
        ("tree: {turn: {angel: 5 deg}}\n", "turn has no input 'angel'"),
        ("tree: {turn: {angle: 5}}\n", "2:22: an angle needs a unit"),
        ("tree: {run: gone}\n", "there is no mission 'gone'"),
        ("tree: {run: m}\n", "the mission 'm' calls itself: m -> m"),
        ("tree: {wait: []}\n", "a duration is needed, not a list"),
    ],
)
def test_a_mission_with_errors_is_not_built(workshop, tree, problem):
    with pytest.raises(ConfigError, match=problem):
        Bench(workshop, tree)


def test_two_runs_share_nothing(workshop):
    tree = "tree: {sequence: [{look_for_user: , out: {user: u}}, {navigate_to: {goal: $u}}]}\n"
    first = Bench(workshop, tree, look_for_user=[SEEN])
    second = Bench(workshop, tree, look_for_user=[SEEN])
    first.run()
    assert ("u" in first.context.keys, "u" in second.context.keys) == (True, False)
    assert second.root.status is Status.INVALID


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        ("sequence: [" + ", ".join(["{run: n8}"] * 4) + "]", "nodes with those of the missions"),
        ("run: deep", "nodes are nested"),
    ],
)
def test_what_the_check_calls_too_large_is_not_built(workshop, tree, problem):
    # 4 ** 8 nodes: each mission calls the one before four times.
    workshop.write("tree: {turn: {angle: 1 deg}}\n", "n0")
    for number in range(1, 9):
        calls = ", ".join([f"{{run: n{number - 1}}}"] * 4)
        workshop.write(f"tree: {{sequence: [{calls}]}}\n", f"n{number}")
    chain = "{turn: {angle: 1 deg}}"
    for number in range(60):
        workshop.write(f"tree: {chain}\n", "deep" if number == 59 else f"d{number}")
        chain = f"{{succeed: {{succeed: {{run: d{number}}}}}}}"
    found = [finding.message for finding in workshop.findings(f"tree: {{{tree}}}\n")]
    library = workshop.library()
    mission = library.get("m")
    context = make_context(ManualClock(), {}, workshop.declarations)
    with pytest.raises(ConfigError, match=problem) as caught:
        compile_mission(mission, library, {}, context)
    assert caught.value.problem in found
    assert context.keys.as_dict() == {}


def test_a_mission_that_became_too_large_after_it_was_built_is_not_built_again(workshop):
    workshop.write("tree: {turn: {angle: 1 deg}}\n", "n")
    workshop.write("tree: {sequence: [" + ", ".join(["{run: n}"] * 400) + "]}\n", "m")
    library = workshop.library()

    def build():
        context = make_context(ManualClock(), {}, workshop.declarations)
        return compile_mission(library.get("m"), library, {}, context).root

    assert len(build().children) == len(build().children) == 400
    file = workshop.write("tree: {sequence: [" + ", ".join(["{turn: {angle: 1 deg}}"] * 400) + "]}\n", "n")
    small = library.get("n")
    library.add_file(file)
    with pytest.raises(ConfigError, match="nodes with those of the missions"):
        build()
    large = library.get("n")
    library.put(small)
    assert len(build().children) == 400
    library.put(large)
    with pytest.raises(ConfigError, match="nodes with those of the missions"):
        build()


def test_whether_a_mission_is_small_enough_is_worked_out_once(workshop, monkeypatch):
    workshop.write("tree: {turn: {angle: 1 deg}}\n", "m")
    library, asked = workshop.library(), []
    monkeypatch.setattr(
        "florence_bt.trees.language.compile.too_large", lambda mission, facts: asked.append(mission) or ()
    )
    for _ in range(3):
        compile_mission(library.get("m"), library, {}, make_context(ManualClock(), {}, workshop.declarations))
    assert asked == [library.get("m")]
