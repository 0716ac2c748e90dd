import pytest

from florence_bt.core.declaration import Kind
from florence_bt.trees.checks.lint import check, read_files
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.values import fits


def test_the_built_in_missions_are_without_findings():
    library = MissionLibrary.load()
    assert len(library.names()) >= 5
    assert library.findings == []
    assert check(library, library, collect_declarations(), ["kitchen", "dock"]) == []


@pytest.mark.parametrize(
    ("tree", "expected"),
    [
        # names
        ("{seqence: [{wait: 1 s}]}", "2:8 error there is no skill and no kind of node 'seqence' | sequence"),
        (
            "{navigate: {}}",
            "2:8 error there is no skill and no kind of node 'navigate' | navigate_to",
        ),
        ("{m: {}}", "2:8 error there is no skill and no kind of node 'm' | run: m"),
        ("{turn: {angel: 5 deg}}", "2:15 error turn has no input 'angel' | angle"),
        ("{turn: }", "2:8 error turn needs the input 'angle' (how far) | "),
        ("{turn: 5 deg}", "2:8 error the inputs of turn must be a mapping | turn: {angle: 5 deg}"),
        ("{look_for_user: , out: {usr: u}}", "2:31 error look_for_user has no output 'usr' | user"),
        ("{run: detekt}", "2:13 error there is no mission 'detekt' | m"),
        # kinds, units and limits
        ("{turn: {angle: 45}}", "2:22 error angle: an angle needs a unit: '45' | 45 deg, 45 °, 45 rad"),
        ("{turn: {angle: 5 m}}", "2:22 error angle: 'm' is not a unit of an angle | 5 deg, 5 °, 5 rad"),
        ("{look_for_user: {window: 1 min}}", "2:32 error window: 1 min is above the maximum of 15 s | "),
        (
            "{look_for_user: {window: {x: 1 m, y: 1 m, yaw: 0}}}",
            "2:32 error window: a duration is needed, not a pose",
        ),
        (
            '{sequence: [{set: {b: 5 deg}}, {turn: {angle: "a $b"}}]}',
            "2:53 error angle: an angle cannot be text with keys in it",
        ),
        ("{wait: 5}", "2:14 error wait: a duration needs a unit: '5' | 5 s, 5 ms, 5 min, 5 h"),
        ("{wait: -1 s}", "2:14 error wait: -1 s is below the minimum of 0 s | "),
        ("{retry: 0, do: {turn: {angle: 5 deg}}}", "2:15 error retry: 0 is below the minimum of 1 | "),
        ("{repeat: many, do: {wait: 1 s}}", "2:16 error repeat: a whole number is needed, not 'many' | 3"),
        ("{timeout: $x, do: {wait: 1 s}}", "2:17 error no node writes a key 'x' | "),
        # structure
        ("{run: m}", "2:13 error the mission calls itself: m -> m | "),
        (
            "{retry: 3, on: [no_user_sen], do: {look_for_user: }}",
            "2:23 error what is retried cannot fail with 'no_user_sen' | no_user_seen",
        ),
        (
            "{parallel: [{turn: {angle: 5 deg}}, {turn: {angle: 6 deg}, name: again}]}",
            "2:44 error 'turn' and 'again' both need the base at the same time | sequence: one after",
        ),
        (
            "{look_for_user: , because: {no_usr_seen: x}}",
            "2:35 warning because: 'look for user' cannot fail with 'no_usr_seen' | no_user_seen",
        ),
        # keys
        (
            "{wait: $pause}",
            "2:14 error no node writes a key 'pause' | pause under inputs:, set: {pause: ...} before it",
        ),
        ('{fail: "no $pause"}', "2:14 error no node writes a key 'pause' | "),
        ('{wait: 1 s, because: "no $pause"}', "2:28 error no node writes a key 'pause' | "),
        (
            "{sequence: [{navigate_to: {goal: $user}}, {look_for_user: , out: {user: user}}]}",
            "2:40 error the key 'user' is read before any node has written it | ",
        ),
        (
            "{sequence: [{set: {n: 5 m}}, {turn: {angle: $n}}]}",
            "2:51 error angle: an angle is needed, but $n is a length | ",
        ),
        (
            "{sequence: [{set: {n: 5 m}}, {set: {n: 5 s}}, "
            "{navigate_to: {goal: {x: $n, y: 1 m, yaw: 0 deg}}}]}",
            "2:43 error the key 'n' is a length elsewhere and a duration here | ",
        ),
    ],
)
def test_findings(workshop, tree, expected):
    found = workshop.lines(f"tree: {tree}\n")
    assert len(found) == 1 and found[0].startswith(expected), found


def test_all_at_once_and_in_order(workshop):
    found = workshop.lines(
        """\
tree:
  sequence:
    - turn: {angle: 45}
    - look_for_user: {windw: 3 s}
      out: {user: user}
    - navigate_to: {goal: $usr}
    - wait: 1
"""
    )
    assert [line.split(" ")[0] for line in found] == ["4:21", "5:23", "7:27", "8:13"]


def test_inputs_and_calls_of_missions(workshop):
    workshop.write(
        """\
inputs:
  far: {type: length, max: 2 m}
  near: {type: length, default: 1 m}
outputs:
  user: {type: pose}
tree: {look_for_user: , out: {user: user}}
""",
        "other",
    )
    found = workshop.lines(
        """\
inputs:
  n: {type: integer, default: 1}
tree:
  sequence:
    - run: other
      with: {nera: 1 m}
      out: {usr: u}
    - run: other
      with: {far: 3 m}
    - run: other
      with: {far: $n}
      out: {user: n}
"""
    )
    assert found == [
        "6:7 error other needs the input 'far' | far: 0.5 m",
        "7:14 error other has no input 'nera' | near",
        "8:13 error other has no output 'usr' | user",
        "10:19 error far: 3 m is above the maximum of 2 m | 2 m and less",
        "12:19 error far: a length is needed, but $n is an integer | ",
        "13:19 error the key 'n' is an input of the mission and cannot be written"
        " | another key, such as new_n",
    ]


def test_recursion_through_others(workshop):
    workshop.write("tree: {run: c}\n", "b")
    workshop.write("tree: {run: a}\n", "c")
    assert workshop.lines("tree: {run: b}\n", "a") == [
        "2:13 error the mission calls itself: a -> b -> c -> a | "
    ]
    # A mission that calls a circle is not itself at fault, and nothing is known of how the circle ends.
    assert workshop.lines("tree: {retry: 2, on: [x], do: {run: b}}\n", "d") == []


def test_hotspot_labels(workshop):
    tree = "tree: {get_hotspot: {label: kichen}}\n"
    assert workshop.lines(tree, hotspots=["kitchen", "hall"]) == [
        "2:29 error there is no hotspot 'kichen' | kitchen"
    ]
    assert workshop.lines(tree, hotspots=None) == []
    assert workshop.lines(tree, hotspots=["kichen"]) == []


@pytest.mark.parametrize(
    ("tree", "warned"),
    [
        # written on every way
        ("{sequence: [{selector: [A, B]}, USE]}", False),
        ("{sequence: [{parallel: [A, C]}, USE]}", False),
        ("{sequence: [{retry: 3, do: A}, USE]}", False),
        ("{sequence: [{selector: [A, {fail: x}]}, USE]}", False),
        ("{sequence: [{selector: [A, {sequence: [C, {fail: x}]}]}, USE]}", False),
        ("{sequence: [{timeout: 5 s, do: A}, USE]}", False),
        ("{selector: [{sequence: [A, USE]}, C]}", False),
        ("{selector: [{sequence: [C, {invert: A}]}, USE]}", False),
        ("{retry: 2, attempt: g, do: {repeat: $g, do: C}}", False),
        # on some
        ("{sequence: [{selector: [A, C]}, USE]}", True),
        ("{sequence: [{succeed: A}, USE]}", True),
        ("{sequence: [{parallel: [A, C], policy: any}, USE]}", True),
        ("{selector: [{sequence: [A, {turn: {angle: 5 deg}}]}, USE]}", True),
        ("{sequence: [A, C], finally: USE}", True),
    ],
)
def test_keys_that_may_be_missing(workshop, tree, warned):
    tree = tree.replace("A", "{look_for_user: , out: {user: u}}").replace(
        "B", "{set: {u: {x: 0, y: 0, yaw: 0}}}"
    )
    tree = tree.replace("C", "{wait: 1 s}").replace("USE", "{navigate_to: {goal: $u}}")
    found = workshop.lines(f"tree: {tree}\n")
    assert ["may have no value" in line for line in found] == [True] * warned, found


def test_declared_outputs_must_be_written(workshop):
    head = "outputs: {user: {type: pose}}\n"
    assert "no node writes the output 'user'" in workshop.lines(head + "tree: {wait: 1 s}\n")[0]
    (line,) = workshop.lines(head + "tree: {succeed: {look_for_user: , out: {user: user}}}\n")
    assert line.startswith("2:11 warning the mission can succeed without writing")
    (line,) = workshop.lines(head + "tree: {look_for_user: , out: {distance: user}}\n")
    assert "the output 'user' is a pose, but its key is a length" in line


def test_an_unknown_skill_does_not_bring_further_findings(workshop):
    (line,) = workshop.lines("tree: {retry: 2, on: [odd], do: {lok_for_user: }}\n")
    assert "lok_for_user" in line


def test_a_broken_node_does_not_bring_findings_about_its_keys(workshop):
    (line,) = workshop.lines(
        "tree: {sequence: [{look_for_user: , out: {user: u}, do: {wait: 1 s}}, {navigate_to: {goal: $u}}]}\n"
    )
    assert "'do' does not belong" in line


def test_parallel_resources_in_called_missions(workshop):
    workshop.write("tree: {turn: {angle: 5 deg}}\n", "other")
    (line,) = workshop.lines("tree: {parallel: [{run: other}, {turn: {angle: 5 deg}}]}\n")
    assert "'run other' and 'turn' both need the base" in line


def test_files_are_read_and_checked(workshop, tmp_path):
    good = workshop.write("tree: {run: helper}\n", "good")
    helper = workshop.write("tree: {wait: 1 s}\n", "helper")
    broken = tmp_path / "broken.yaml"
    broken.write_text("a: [\n")
    library = MissionLibrary.load(built_in=False)

    def found(*files):
        missions, findings = read_files(files, library)
        return [*findings, *check(missions, library, workshop.declarations)]

    assert found(good, helper) == []
    (finding,) = found(good, helper, broken)
    assert (finding.file, finding.severity) == (str(broken), "error")


def test_an_integer_is_a_number_but_not_the_other_way_round():
    assert fits(Kind.INTEGER, Kind.NUMBER)
    assert not fits(Kind.NUMBER, Kind.INTEGER)
    assert not fits(Kind.INTEGER, Kind.LENGTH)


def test_a_question_that_is_asked_again_and_its_branch_run_at_the_same_time(workshop):
    tree = "tree:\n  if: {turn: {angle: 1 deg}}\n  then: {navigate_to: {goal: {x: 0, y: 0, yaw: 0}}}\n"
    clash = "'turn' and 'navigate to' both need the base at the same time"
    assert not any(clash in line for line in workshop.lines(tree))
    (line,) = (line for line in workshop.lines(tree + "  memory: false\n") if " error " in line)
    assert line.endswith(f"{clash} | memory: true, to ask only once")


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        ("{wait: '${5 s / 0}'}", "wait: 5 s / 0 has no value"),
        ("{wait: '${2 s - 5 s}'}", "wait: -3 s is below the minimum of 0 s"),
        ("{set: {a: '${1e200 * 1e200}'}}", "a: 1e200 * 1e200 has no value"),
        ("{condition: 1 / 0 > 2}", "condition: 1 / 0 > 2 has no value"),
        ("{wait: 1 s, when: 1 / 0 > 2}", "when: 1 / 0 > 2 has no value"),
        ("{if: 1 / 0 > 2, then: {wait: 1 s}}", "if: 1 / 0 > 2 has no value"),
        ("{look_for_user: {window: '${10 s * 20}'}}", "window: 3 min 20 s is above the maximum"),
    ],
)
def test_what_an_expression_without_keys_gives_is_known_before_it_runs(workshop, tree, problem):
    lines = workshop.lines(f"tree: {tree}\n")
    assert len([line for line in lines if " error " in line and problem in line]) == 1, lines


@pytest.mark.parametrize(
    ("value", "warned"),
    [("$n + 1", True), ("$first - $last", False), ("$first and $last", False), ("$first / $n", False)],
)
def test_texts_side_by_side_are_no_expression_without_its_braces(workshop, value, warned):
    before, after = "{set: {first: hello, last: world, n: 3}}", "{fail: $all $last $n $first}"
    lines = workshop.lines(f"tree: {{sequence: [{before}, {{set: {{all: {value}}}}}, {after}]}}\n")
    assert any("nothing is computed" in line for line in lines) is warned, lines
