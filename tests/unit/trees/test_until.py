"""``until``: what ends a node with success; and loops without a number of rounds."""

# ruff: noqa: E501  (missions on one line)

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import failure
from tests.unit.trees.dumps import ascii_tree
from tests.unit.trees.language import BROKEN, ENDLESS, Play, measured, takes

BLIND = failure("blind", "nothing is seen")
LOOKING = "tree: {work: , until: {measure: , out: {distance: d}}, finally: {clean: }}"


def skills(play):
    return [skill for _, skill in play.started]


# How the work ends | how each look ends | when and how it is over | what was started when
@pytest.mark.parametrize(
    ("work", "looks", "end", "started"),
    [
        (ENDLESS, [takes(2.0, BLIND), measured(1.0, after=2.0)], ("success", 4.0), [0.0, 2.0]),
        (takes(3.0), [takes(2.0, BLIND)], ("until_not_met", 3.0), [0.0, 2.0]),
        (takes(3.0, BROKEN), [takes(2.0, BLIND)], ("broken", 3.0), [0.0, 2.0]),
        # A look that fails too soon is not begun again before a second is over.
        (takes(2.5), [takes(0.25, BLIND)], ("until_not_met", 2.5), [0.0, 1.0, 2.0]),
        (takes(2.5), [takes(0.0, BLIND)], ("until_not_met", 2.5), [0.0, 1.0, 2.0]),
        (takes(2.5), [takes(0.0, failure("bad_input", "x"))], ("bad_input", 0.0), [0.0]),
        (takes(1.0), [measured(1.0, after=1.0)], ("success", 1.0), [0.0]),
    ],
)
def test_both_run_and_the_goal_is_tried_again(tmp_path, work, looks, end, started):
    play = Play(tmp_path, LOOKING, work=[work], measure=looks)
    assert (play.run(), play.clock.now()) == end
    assert [when for when, skill in play.started if skill == "measure"] == started
    assert skills(play).count("clean") == 1


def test_what_is_so_at_the_start_lets_nothing_begin(tmp_path):
    play = Play(tmp_path, "keys: {n: {type: integer, default: 3}}\ntree: {work: , until: $n == 3}")
    assert (play.run(), play.started) == ("success", [])


def test_an_expression_is_looked_at_when_a_key_changes(tmp_path):
    text = """\
keys: {n: {type: integer, default: 0}}
tree:
  parallel:
    - {work: , until: $n == 2}
    - sequence: [{wait: 2 s}, {set: {n: 1}}, {wait: 2 s}, {set: {n: 2}}, {other: }]
"""
    play = Play(tmp_path, text, work=[ENDLESS], other=[takes(3.0)])
    assert (play.run(), play.ended[0][:2]) == ("success", (4.0, "work"))


def test_the_last_step_of_the_node_may_be_what_is_waited_for(tmp_path):
    text = (
        "keys: {n: {type: integer, default: 0}}\ntree: {sequence: [{work: }, {set: {n: 1}}], until: $n == 1}"
    )
    assert Play(tmp_path, text, work=[takes(1.0)]).run() == "success"


@pytest.mark.parametrize(("every", "asked"), [("", [0.0, 1.0, 2.0]), (", every: 400 ms", [0.0, 0.4, 0.8])])
def test_a_skill_that_answers_at_once_is_asked_again(tmp_path, every, asked):
    away = takes(0.0, failure("away", "not there"))
    play = Play(
        tmp_path,
        f"tree: {{work: , until: {{is_home: {every}}}}}",
        work=[ENDLESS],
        is_home=[away, away, takes(0.0)],
    )
    assert play.run() == "success"
    assert [when for when, skill in play.started if skill == "is_home"] == pytest.approx(asked)
    assert play.ended[-1][:2] == (pytest.approx(asked[-1]), "work")


def test_a_key_that_is_missing_may_still_come(tmp_path):
    text = """\
tree:
  parallel:
    - {work: , until: $n == 1}
    - sequence: [{wait: 2 s}, {set: {n: 1}}]
"""
    play = Play(tmp_path, text, work=[ENDLESS])
    assert (play.run(), play.clock.now()) == ("success", 2.0)


def test_the_failure_has_a_name_and_a_reason(tmp_path):
    text = "keys: {n: {type: integer, default: 0}}\ntree: {work: , until: $n == 1, code: nobody, on_failure: {nobody: {other: }}}"
    play = Play(tmp_path, text, work=[takes(1.0)])
    assert (play.run(), skills(play)) == ("success", ["work", "other"])
    play = Play(tmp_path, text.replace("on_failure: {nobody: {other: }}", "name: all"), work=[takes(1.0)])
    assert (play.run(), play.why.reason) == ("nobody", "work was done before $n == 1")


@pytest.mark.parametrize("moment", [0.0, 0.5, 1.0, 1.5, 2.0, 2.5])
def test_it_can_be_stopped_at_every_moment(tmp_path, moment):
    play = Play(tmp_path, LOOKING, work=[ENDLESS], measure=[takes(1.0, BLIND), takes(0.5, BLIND), takes(9.0)])
    assert play.at(moment) == "running"
    play.root.stop(Status.INVALID)
    play.clock.advance(20.0)
    assert skills(play).count("clean") == 1
    assert play.context.runs == []


def test_repeat_forever_ends_with_until_or_a_failure(tmp_path):
    text = "keys: {n: {type: integer, default: 0}}\ntree: {repeat: forever, do: {sequence: [{work: }, {set: {n: '${$n + 1}'}}]}, until: $n == 4}"
    play = Play(tmp_path, text, work=[takes(1.0)])
    assert (play.run(), skills(play)) == ("success", ["work"] * 4)
    play = Play(
        tmp_path, "tree: {repeat: forever, do: {work: }}", work=[takes(1.0), takes(1.0), takes(1.0, BROKEN)]
    )
    assert (play.run(), skills(play)) == ("broken", ["work"] * 3)


def test_below_a_watched_condition(tmp_path):
    text = """\
keys: {n: {type: integer, default: 0}}
tree:
  parallel:
    - selector:
        - {condition: $n > 5, until: $n > 2}
        - {work: }
      memory: false
    - sequence: [{wait: 2 s}, {set: {n: 3}}]
"""
    play = Play(tmp_path, text, work=[ENDLESS])
    assert (play.run(), play.clock.now(), skills(play)) == ("success", 2.0, ["work"])


def test_the_dump(tmp_path):
    play = Play(
        tmp_path,
        "tree: {sequence: [{work: , until: {measure: , out: {distance: d}}}]}",
        work=[ENDLESS],
        measure=[takes(9.0)],
    )
    play.at(1.0)
    assert ascii_tree(play.root).splitlines() == [
        "[>] m (sequence)",
        "    [>] work until measure (until)",
        "        [>] work",
        "        [>] measure",
    ]


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ("{turn: {angle: 1 rad}, until: {navigate_to: {goal: {x: 1 m, y: 1 m, yaw: 0}}}}", "both need the base at the same time"),
        ("{turn: {angle: 1 rad}, until: {fail: x}}", "3:38 error until: 'fail' never succeeds"),
        ("{turn: {angle: 1 rad}, until: {set: {n: 1}}}", "'turn' is never reached: 'set n' succeeds at once"),
        ("{turn: {angle: 1 rad}, until: {wait: 5 s}}", ""),
        ("{turn: {angle: 1 rad}, until: {look_for_user: }}", ""),
        ("{turn: {angle: 1 rad}, until: {is_charged: }}", ""),
        ("{turn: {angle: 1 rad}, until: seen}", "3:37 error until: 'seen' is neither a key nor a node"),
        ("{turn: {angle: 1 rad}, until: $seen}", "no node writes a key 'seen'"),
        ("{turn: {angle: 1 rad}, until: {is_charged: , finally: {stop_tracker: }}}", "the clean-up would run after each question"),
        ("{turn: {angle: 1 rad}, until: {once: {is_charged: }}}", "is asked only once"),
        ("{turn: {angle: 1 rad}, while: 1 < 2, until: {is_charged: }, code: x}", "code: it is not clear whether that is about 'while' or 'until'"),
        ("{sequence: [{repeat: forever, do: {turn: {angle: 1 rad}}}, {wait: 1 s}]}", "'wait 1 s' is never reached"),
        ("{sequence: [{repeat: forever, do: {turn: {angle: 1 rad}}, until: {is_charged: }}, {wait: 1 s}]}", ""),
        ("{repeat: forever, do: {set: {n: 1}}}", "rounds without end are more than the 5000"),
        ("{repeat: for ever, do: {turn: {angle: 1 rad}}}", "repeat: a whole number is needed, not 'for ever'"),
        ("{sequence: [{turn: {angle: 1 rad}, until: {look_for_user: , out: {user: u}}}, {navigate_to: {goal: $u}}]}", ""),
        (
            "{sequence: [{look_for_user: , out: {user: u}, until: {is_charged: }}, {navigate_to: {goal: $u}}]}",
            "the key 'u' may have no value here",
        ),
    ],
)  # fmt: skip
def test_what_the_check_says(workshop, tree, line):
    found = workshop.lines(f"description: d\ntree: {tree}\n")
    assert any(line in each for each in found) if line else found == [], found
