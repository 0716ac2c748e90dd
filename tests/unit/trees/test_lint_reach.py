"""What can never happen is said: nodes never reached, retries without effect, missions without end."""

import pytest

from florence_bt.trees.checks.lint import check
from florence_bt.trees.checks.reach import RENAMED_CODES

TURN = "{turn: {angle: 5 deg}}"
HOTSPOT = "{get_hotspot: {label: plant}}"


def place_of(tree, at):
    """The line and column at which a text stands for the last time."""
    line = f"tree: {tree.replace('TURN', TURN).replace('HOTSPOT', HOTSPOT)}"
    return f"2:{line.rindex(at) + 1}"


def only(workshop, tree, text):
    """The findings of a tree whose lines hold a text."""
    return [line for line in workshop.lines(f"tree: {tree}\n") if text in line]


@pytest.mark.parametrize(
    ("tree", "at", "problem"),
    [
        (
            "{sequence: [{fail: x}, {wait: 1 s}]}",
            "wait",
            "'wait 1 s' is never reached: 'fail' before it never",
        ),
        ("{sequence: [{invert: {wait: 1 s}}, {wait: 2 s}]}", "wait", "'wait 2 s' is never reached"),
        ("{sequence: [{repeat: forever, do: TURN}, {wait: 2 s}]}", "wait", "'wait 2 s' is never reached"),
        ("{sequence: [{condition: 1 > 2}, {wait: 2 s}]}", "wait", "'wait 2 s' is never reached"),
        ("{sequence: [{retry: 3, do: {fail: x}}, {wait: 2 s}]}", "wait", "'wait 2 s' is never reached"),
        (
            "{sequence: [{selector: [{fail: x}, {fail: y}]}, {wait: 2 s}]}",
            "wait",
            "'wait 2 s' is never reached",
        ),
        ("{sequence: [{parallel: [{fail: x}, TURN]}, {wait: 2 s}]}", "wait", "'wait 2 s' is never reached"),
        ("{sequence: [{run: hopeless}, {wait: 2 s}]}", "wait", "'wait 2 s' is never reached"),
        (
            "{selector: [{wait: 1 s}, TURN]}",
            "turn",
            "'turn' is never tried: 'wait 1 s' before it never fails",
        ),
        ("{selector: [{succeed: TURN}, {wait: 2 s}]}", "wait", "'wait 2 s' is never tried"),
        ("{selector: [{succeed: TURN}, {wait: 2 s}]}", "wait", "'wait 2 s' is never tried"),
        ("{selector: [{set: {a: 1}}, {wait: 2 s}]}", "wait", "'wait 2 s' is never tried"),
        ("{selector: [{run: sure}, {wait: 2 s}]}", "wait", "'wait 2 s' is never tried"),
        ("{selector: [{invert: {fail: x}}, {wait: 2 s}]}", "wait", "'wait 2 s' is never tried"),
        ("{if: 1 < 2, then: TURN, else: {wait: 2 s}}", "wait", "'wait 2 s' is never reached: '1 < 2' always"),
        (
            "{if: false, then: TURN, else: {wait: 2 s}}",
            "turn",
            "'turn' is never reached: 'false' never holds",
        ),
        ("{if: {wait: 1 s}, then: TURN, else: {wait: 2 s}}", "wait", "'wait 1 s' always holds"),
        ("{if: {fail: x}, then: TURN}", "turn", "'turn' is never reached: 'fail' never holds"),
        ("{timeout: 0, do: TURN}", "0", "timeout: 'turn' is stopped at once: it has 0 s"),
        ("{timeout: 0 min, do: TURN}", "0", "timeout: 'turn' is stopped at once: it has 0 s"),
        ("{timeout: '${0 * 3 s}', do: TURN}", "0 *", "timeout: 'turn' is stopped at once: it has 0 s"),
        ("{selector: [TURN, {fail: x}, {wait: 1 s}]}", "fail", "'fail' has no effect in the middle of a"),
        ("{selector: [{fail: x}, {wait: 1 s}]}", "fail", "'fail' has no effect in the middle of a"),
        (
            "{selector: [TURN, {sequence: [{fail: x}], name: no}, {wait: 1 s}]}",
            "sequence",
            "'no' has no effect in the middle of a",
        ),
        ("{retry: 3, do: {wait: 1 s}}", "retry", "the retry has no effect: 'wait 1 s' never fails"),
        ("{retry: 3, do: {succeed: TURN}}", "retry", "the retry has no effect: 'try turn' never fails"),
        (
            "{switch: kitchen, cases: {kitchen: TURN, hall: {wait: 1 s}}}",
            "wait",
            "'wait 1 s' is never reached: the value is always 'kitchen'",
        ),
        (
            "{switch: 1.0, cases: {1: TURN}, default: {wait: 1 s}}",
            "wait",
            "'wait 1 s' is never reached: the value is always '1.0'",
        ),
        ("{retry: 3, do: {run: sure}}", "retry", "the retry has no effect: 'run sure' never fails"),
        ("{retry: 3, do: {once: TURN}}", "retry", "keeps its first result"),
        ("{retry: 3, on: [no_path], do: TURN}", "no_path", "what is retried cannot fail with 'no_path'"),
        (
            "{sequence: [{switch: $b, cases: {true: TURN, false: TURN}, default: {wait: 1 s}}]}",
            "wait",
            "the default is never reached",
        ),
    ],
)
def test_errors(workshop, tree, at, problem):
    workshop.write("tree: {fail: x}\n", "hopeless")
    workshop.write("tree: {sequence: [{wait: 1 s}, {set: {a: 1}}]}\n", "sure")
    head = "inputs: {b: {type: boolean}}\n"
    found = workshop.lines(f"tree: {tree.replace('TURN', TURN)}\n" + head)
    (line,) = [line for line in found if problem in line]
    assert line.startswith(f"{place_of(tree, at)} error ")


@pytest.mark.parametrize(
    ("tree", "at", "problem"),
    [
        ("{if: true, then: TURN}", "true", "if: 'true' always holds"),
        ("{wait: 1 s, when: 1 > 2}", "1 > 2", "when: '1 > 2' never holds"),
        ("{wait: 1 s, when: 1 m > 50 cm}", "1 m >", "when: '1 m > 50 cm' always holds"),
        ("{wait: 1 s, while: true or $x}", "true or", "while: 'true or $x' always holds"),
        ("{repeat: 3, do: {fail: x}}", "repeat", "there is never a second round"),
        ("{repeat: 3, do: {once: TURN}}", "repeat", "the repeat has no effect"),
        ("{wait: 1 s, finally: {fail: x}}", "fail", "finally: 'fail' never succeeds"),
        ("{parallel: [{fail: x}, TURN]}", "fail", "the parallel never succeeds, because 'fail' never does"),
        ("{sequence: [TURN, {wait: 1 s}], memory: false}", "turn", "'turn' takes time and is done only once"),
        (
            "{sequence: [{wait: 2 s}, TURN], memory: false}",
            "wait",
            "'wait 2 s' takes time and is done only once",
        ),
        (
            "{if: {look_for_user: }, then: TURN, memory: false}",
            "look_for_user",
            "'look for user' takes time and is done only once",
        ),
        (
            "{sequence: [{retry: 2, do: {look_for_user: }}, TURN], memory: false}",
            "look_for_user",
            "'look for user' takes time and is done only once",
        ),
        ("{repeat: 6000, do: {condition: 1 < $x}}", "repeat", "nothing below it takes time"),
        ("{fail: x, because: {no_path: y}}", "no_path", "because: 'fail' cannot fail with 'no_path'"),
        (
            "{sequence: [{get_hotspot: {label: a}, every: 2 s}, TURN]}",
            "get_hotspot",
            "'every' has no effect: nobody asks 'get hotspot' again here",
        ),
        (
            "{sequence: [TURN, {turn: {angle: 9 deg}, every: 2 s}], memory: false}",
            "turn",
            "'every' has no effect: nobody asks 'turn' again here",
        ),
        (
            "{sequence: [{is_charged: , every: 2 s}, TURN], memory: false}",
            "is_charged",
            "'every' has no effect: is_charged reports changes",
        ),
    ],
)
def test_warnings(workshop, tree, at, problem):
    found = workshop.lines(f"tree: {tree.replace('TURN', TURN).replace('HOTSPOT', HOTSPOT)}\n")
    (line,) = [line for line in found if problem in line]
    assert line.startswith(f"{place_of(tree, at)} warning ")


@pytest.mark.parametrize(
    "tree",
    [
        "{sequence: [HOTSPOT, TURN], memory: false}",
        "{sequence: [HOTSPOT, {once: {stop_tracker: }}, TURN], memory: false}",
        "{sequence: [{retry: 2, do: HOTSPOT}, TURN], memory: false}",
        "{selector: [{sequence: [HOTSPOT, TURN], finally: {stop_tracker: }}, {wait: 1 s}], memory: false}",
        "{sequence: [{look_for_user: , every: 10 s}, TURN], memory: false}",
        "{selector: [{invert: {sequence: [HOTSPOT, {if: $b, then: HOTSPOT}]}}, TURN], memory: false}",
        "{if: {look_for_user: , every: 10 s}, then: TURN, memory: false}",
        "{sequence: [{is_charged: }, {retry: 2, do: TURN}], memory: false}",
        "{look_for_user: , every: 10 s}",  # perhaps a condition where this mission is called
    ],
)
def test_conditions_that_are_watched_are_no_problem(workshop, tree):
    head = "inputs: {b: {type: boolean}}\n"
    tree = tree.replace("TURN", TURN).replace("HOTSPOT", HOTSPOT)
    assert [line for line in workshop.lines(f"tree: {tree}\n" + head) if "input 'b'" not in line] == []


@pytest.mark.parametrize(
    ("tree", "at", "problem"),
    [
        (
            "{sequence: [{is_charged: , finally: {stop_tracker: }}, TURN], memory: false}",
            "stop_tracker",
            "finally",
        ),
        (
            "{selector: [{invert: {is_charged: , finally: {wait: 1 s}}}, TURN], memory: false}",
            "wait",
            "finally",
        ),
        (
            "{if: {is_charged: , finally: {stop_tracker: }}, then: TURN, memory: false}",
            "stop_tracker",
            "finally",
        ),
        ("{sequence: [{condition: 1 < $x, finally: {wait: 1 s}}, TURN], memory: false}", "wait", "finally"),
        ("{sequence: [{run: asks}, TURN], memory: false}", "run", "(in "),
        ("{sequence: [{once: {is_charged: }}, TURN], memory: false}", "once", "asked only once"),
        ("{sequence: [{retry: 2, do: {once: HOTSPOT}}, TURN], memory: false}", "once", "asked only once"),
        ("{repeat: 6000, do: {set: {x: 1}}}", "repeat", "(spinning)"),
        ("{repeat: 100, do: {repeat: 100, do: {set: {x: 1}}}}", "repeat: 100, do: {repeat", "10000 rounds"),
        ("{retry: 6000, do: {fail: no}}", "retry", "(spinning)"),
    ],
)
def test_errors_of_what_cannot_be_watched_or_never_ends(workshop, tree, at, problem):
    workshop.write("tree: {sequence: [{is_charged: }], finally: {stop_tracker: }}\n", "asks")
    head = "inputs: {x: {type: integer, default: 2}}\n"
    text = f"tree: {tree.replace('TURN', TURN).replace('HOTSPOT', HOTSPOT)}\n"
    lines = [line for line in workshop.lines(text + head) if " error " in line and problem in line]
    assert [line.split(" ")[0] for line in lines[:1]] == [place_of(text.removeprefix("tree: "), at)]


def test_a_loop_that_takes_time_may_have_any_number_of_rounds(workshop):
    tree = "{repeat: 1000000, do: {sequence: [HOTSPOT, {wait: 1 s}]}}".replace("HOTSPOT", HOTSPOT)
    assert workshop.lines(f"tree: {tree}\n") == []


@pytest.mark.parametrize("kind", ["sequence", "selector"])
def test_a_condition_cannot_need_what_a_later_node_uses(workshop, kind):
    tree = (
        f"{{{kind}: [{{navigate_to: {{goal: $g}}, every: 5 s}}, {{stop_tracker: }}, {TURN}], memory: false}}"
    )
    head = "inputs: {g: {type: pose}}\n"
    (line,) = [line for line in workshop.lines(f"tree: {tree}\n" + head) if " error " in line]
    assert "'navigate to' and 'turn' both need the base at the same time" in line


@pytest.mark.parametrize(
    ("every", "problem"),
    [
        ("5", "every: a duration needs a unit: '5'"),
        ("0 s", "every: at least 10 ms are needed | 1 s, 100 ms"),
        ("9.9 ms", "every: at least 10 ms are needed | 1 s, 100 ms"),
        ("$t", "every: "),
        ("[1 s]", "every: a duration is needed"),
        ("2 m", "every: 'm' is not a unit of a duration"),
    ],
)
def test_every_is_a_duration_that_is_written_out(workshop, every, problem):
    (line,) = workshop.lines(
        f"tree: {{sequence: [{{look_for_user: , every: {every}}}, {TURN}], memory: false}}\n"
    )
    assert " error " in line and problem in line


@pytest.mark.parametrize("every", ["10 ms", "0.01 s", "1 h"])
def test_every_ten_milliseconds_is_often_enough(workshop, every):
    tree = f"{{sequence: [{{look_for_user: , every: {every}}}, {TURN}], memory: false}}"
    assert only(workshop, tree, "every:") == []


@pytest.mark.parametrize(
    "tree",
    [
        "{sequence: [TURN, {fail: x}]}",
        "{sequence: [{once: TURN}, {condition: $b}, TURN], memory: false}",
        "{selector: [TURN, {wait: 1 s}]}",
        "{sequence: [{succeed: {fail: x}}, {wait: 1 s}]}",
        "{sequence: [{fail: x, when: $b}, {wait: 1 s}]}",  # skipped counts as success here
        "{selector: [{wait: 1 s, when: $b}, {wait: 2 s}]}",  # and as failure here
        "{selector: [{timeout: 1 s, do: {wait: 1 s, when: not $b}}, {wait: 2 s}]}",
        "{selector: [{wait: 1 s, while: $b}, {wait: 2 s}]}",
        "{selector: [{wait: $d}, {wait: 2 s}]}",  # nothing says that d is not below zero
        "{selector: [{timeout: 1 s, do: {wait: 2 s}}, {wait: 2 s}]}",
        "{selector: [{if: $b, then: TURN}, {wait: 2 s}]}",
        "{selector: [{condition: $b}, {wait: 2 s}]}",
        "{selector: [{switch: $b, cases: {true: {wait: 1 s}}}, {wait: 2 s}]}",
        "{sequence: [{parallel: [{fail: x}, TURN], policy: any}, {wait: 2 s}]}",
        "{sequence: [{parallel: [{fail: x}, TURN], policy: {succeed: 1}}, {wait: 2 s}]}",
        "{retry: 3, do: {parallel: [TURN, {wait: 1 s}]}}",
        "{retry: 3, on: [unexpected_success], do: {invert: TURN}}",
        "{retry: 3, on: [until_not_met, blocked], do: {repeat: 2, do: TURN, until: $b}}",
        "{sequence: [{fail: x, on_failure: {any: {wait: 1 s}}}, {wait: 2 s}]}",
        "{selector: [{fail: x, on_failure: {any: TURN}}, {wait: 2 s}]}",
        "{selector: [{repeat: forever, do: TURN, until: $b}, {wait: 2 s}]}",
        "{retry: 3, on: [guard_failed], do: {wait: 1 s, while: $b}}",
        "{retry: 3, on: [no_case], do: {switch: $b, cases: {true: TURN}}}",
        "{retry: 3, on: [condition_false], do: {condition: $b}}",
        "{retry: 3, on: [skipped], do: {selector: [TURN, {wait: 1 s, when: $b}]}}",
    ],
)
def test_what_can_happen_is_not_said_to_be_impossible(workshop, tree):
    head = "inputs: {b: {type: boolean}, d: {type: duration}}\n"
    found = workshop.lines(f"tree: {tree.replace('TURN', TURN)}\n" + head)
    assert [line for line in found if "reads" not in line and "meanwhile" not in line] == []


@pytest.mark.parametrize(
    ("key", "given"), [("inputs: {d: {type: duration}}", True), ("keys: {d: {type: duration}}", False)]
)
def test_an_input_is_always_there_and_a_key_is_not(workshop, key, given):
    tree = "{sequence: [{retry: 2, on: [missing_key], do: {wait: $d}}, {set: {d: 1 s}}]}"
    found = [line for line in workshop.lines(f"tree: {tree}\n{key}\n") if "missing_key" in line]
    assert len(found) == given and all("cannot fail with 'missing_key'" in line for line in found)


def test_a_skill_that_does_not_exist_brings_no_claims_about_its_ends(workshop):
    tree = "{sequence: [{retry: 2, on: [odd], do: {sing: }}, {run: nowhere, because: {odd: x}}]}"
    found = workshop.lines(f"tree: {tree}\n")
    assert ["there is no" in line for line in found] == [True, True]


@pytest.mark.slow
def test_a_chain_of_a_thousand_missions_and_a_tree_that_doubles_itself(workshop):
    for number in range(1000):
        workshop.write(f"tree: {{run: c{number + 1}}}\n", f"c{number}")
    workshop.write("tree: {wait: 1 s}\n", "c1000")
    for number in range(60):
        run = f"{{run: d{number + 1}}}"
        workshop.write(f"tree: {{sequence: [{run}, {run}]}}\n", f"d{number}")
    workshop.write("tree: {wait: 1 s}\n", "d60")
    library = workshop.library()
    (deep,) = check(library.get("c0"), library, workshop.declarations)
    assert "1001 nodes are nested" in deep.message and (deep.line, deep.column) == (2, 8)
    (wide,) = check(library.get("d0"), library, workshop.declarations)
    assert "the mission has more than a billion nodes" in wide.message
    assert check(library.get("d50"), library, workshop.declarations) == []
    assert len(check(library, library, workshop.declarations)) > 100


def test_resources_are_found_wherever_they_are(workshop):
    workshop.write(f"tree: {TURN}\n", "turns")
    workshop.write("tree: {sequence: [{wait: 1 s}, {run: turns}]}\n", "calls")
    uses = [
        "{run: calls}",
        "{retry: 2, do: {run: turns}}",
        "{if: $b, then: {wait: 1 s}, else: TURN}",
        "{if: TURN, then: {wait: 1 s}}",
        "{switch: $b, cases: {true: {wait: 1 s}}, default: TURN}",
        "{wait: 1 s, finally: TURN}",
        "{wait: 1 s, finally: {run: calls}}",
        "{once: {wait: 1 s, until: TURN}}",
    ]
    for params in uses:
        tree = f"{{parallel: [{params}, {{navigate_to: {{goal: $g}}}}]}}".replace("TURN", TURN)
        found = workshop.lines(f"tree: {tree}\ninputs: {{b: {{type: boolean}}, g: {{type: pose}}}}\n")
        (line,) = [line for line in found if "both need the base at the same time" in line]
        assert line.endswith("| sequence: one after the other")
    (line,) = only(
        workshop, f"{{parallel: [{{sequence: [{{wait: 1 s}}, {TURN}]}}, {{run: calls}}]}}", "both need"
    )
    assert "'sequence' (in 'turn') and 'run calls' both need the base" in line


def test_names_of_a_policy(workshop):
    branches = "{wait: 1 s, name: a}, {wait: 2 s, name: b}, {wait: 3 s, name: b}"
    assert only(workshop, f"{{parallel: [{branches}], policy: [aa]}}", "the policy names 'aa'")[0].endswith(
        "| a"
    )
    assert (
        "but 2 branches have this name"
        in only(workshop, f"{{parallel: [{branches}], policy: [b]}}", "error")[0]
    )
    assert only(workshop, f"{{parallel: [{branches}], policy: [a]}}", "error") == []
    (line,) = only(workshop, f"{{parallel: [{branches}], policy: {{succeed: 4}}}}", "error")
    assert "succeed: 4 branches are asked for, but there are 3 | succeed: 1 to 3" in line
    assert only(workshop, f"{{parallel: [{branches}], policy: {{succeed: 2, fail: 3}}}}", "error") == []


def test_a_skill_on_its_way_out(workshop):
    from dataclasses import replace

    workshop.declarations = {
        **workshop.declarations,
        "turn": replace(workshop.declarations["turn"], deprecated="spin: {angle: ...}"),
    }
    (line,) = only(workshop, TURN, "warning")
    assert line.startswith("2:8 warning turn is deprecated: use spin: {angle: ...}")


@pytest.mark.parametrize("value", ["$n", "$m", "'${min($n, 1)}'", "$t", "'${$n / 2}'"])
def test_cases_for_0_and_1_are_none_for_true_and_false(workshop, value):
    tree = f"{{switch: {value}, cases: {{0: {{wait: 1 s}}, 1: {{wait: 2 s}}}}, default: {{wait: 3 s}}}}"
    inputs = "{n: {type: integer}, m: {type: number}, t: {type: text}}"
    assert [line for line in workshop.lines(f"tree: {tree}\ninputs: {inputs}\n") if "error" in line] == []


def test_true_beside_1_in_a_switch_over_texts(workshop):
    tree = "{switch: $t, cases: {true: {wait: 1 s}, 1: {wait: 2 s}, 1.0: {wait: 3 s}}}"
    assert workshop.lines(f"tree: {tree}\ninputs: {{t: {{type: text}}}}\n") == []


def test_the_old_name_of_a_failure_code_is_reported_with_the_new_one(workshop, monkeypatch):
    monkeypatch.setitem(RENAMED_CODES, "nobody", "no_user_seen")
    tree = "{retry: 2, on: [nobody], do: {look_for_user: , because: {nobody: x}}}"
    found = [line for line in workshop.lines(f"tree: {tree}\n") if "cannot fail with 'nobody'" in line]
    assert len(found) == 2 and all(line.endswith("| no_user_seen") for line in found)
