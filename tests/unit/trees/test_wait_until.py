"""``wait_until``: a pause that a condition ends."""

# ruff: noqa: E501  (missions on one line)

import pytest
from py_trees.common import Status

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure
from tests.unit.trees.language import Play, takes

AWAY = takes(0.0, failure("away", "not there"))
SETS = "sequence: [{wait: 2 s}, {set: {n: 1}}, {wait: 2 s}, {set: {n: 2}}, {wait: 9 s}]"


@pytest.mark.parametrize(
    ("wait", "end"),
    [
        ("wait_until: $n == 2", ("success", 4.0)),
        ("wait_until: $n == 0", ("success", 0.0)),
        ("wait_until: $n == 2, timeout: 3 s", ("timed_out", 3.0)),
        ("wait_until: $n == 2, timeout: 5 s", ("success", 4.0)),
        ("wait_until: {selector: [{condition: $n == 7}, {condition: $n == 1}]}", ("success", 2.0)),
        ("wait_until: 1 / $n == 1", ("bad_expression", 0.0)),
    ],
)
def test_an_expression_is_waited_for(tmp_path, wait, end):
    text = f"keys: {{n: {{type: integer, default: 0}}}}\ntree: {{parallel: [{{name: w, {wait}}}, {{{SETS}}}], policy: {{succeed: 1, fail: 1}}}}"
    play = Play(tmp_path, text)
    assert (play.run(), play.clock.now()) == end


def test_a_key_without_a_value_is_waited_for(tmp_path):
    play = Play(tmp_path, f"tree: {{parallel: [{{wait_until: $n == 2}}, {{{SETS}}}], policy: any}}")
    assert (play.run(), play.clock.now()) == ("success", 4.0)


@pytest.mark.parametrize(("every", "asked"), [("", [0.0, 1.0, 2.0]), (", every: 300 ms", [0.0, 0.3, 0.6])])
def test_a_skill_is_asked_every_second_or_as_every_says(tmp_path, every, asked):
    play = Play(tmp_path, f"tree: {{wait_until: {{is_home: {every}}}}}", is_home=[AWAY, AWAY, takes(0.0)])
    assert play.run() == "success"
    assert [when for when, _ in play.started] == pytest.approx(asked)


@pytest.mark.parametrize("moment", [0.0, 0.5, 1.0])
def test_it_can_be_stopped_at_every_moment(tmp_path, moment):
    play = Play(tmp_path, "tree: {wait_until: {is_home: }, timeout: 9 s, finally: {clean: }}", is_home=[AWAY])
    assert play.at(moment) == "running"
    asked = len(play.started)
    play.root.stop(Status.INVALID)
    play.clock.advance(20.0)
    assert [skill for _, skill in play.started[asked:]] == ["finally", "clean"]
    assert play.context.runs == []


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        (
            "{wait_until: {turn: {angle: 1 rad}}}",
            "wait_until: 'turn' does something, and only a condition can be waited for",
        ),
        ("{wait_until: {is_charged: }, timeout: 5 m}", "timeout: 'm' is not a unit of a duration"),
        ("{wait_until: {is_charged: }, timeout: 5 min}", ""),
        ("{wait_until: {is_charged: }}", ""),
        ("{wait_until: $n == 1}", "no node writes a key 'n'"),
        ("{wait_until: {fail: x}}", "wait_until: 'fail' never succeeds"),
        ("{wait_until: true}", "wait_until: 'true' succeeds at once"),
        ("{wait_until: }", "wait_until needs an expression"),
        ("{wait_until: '25:00'}", "wait_until: '25:00' is no time of day | 22:00"),
        ("{wait_until: 22:00}", "there is no skill and no kind of node 'look_up_time'"),
        ("{wait_until: $done}", "no node writes a key 'done' | done under inputs:"),
        ("{selector: [{wait_until: {is_charged: }}, {wait: 1 s}]}", ""),
        ("{retry: 2, on: [low], do: {wait_until: {is_charged: }}}", "cannot fail with 'low'"),
    ],
)
def test_what_the_check_says(workshop, tree, line):
    found = workshop.lines(f"description: d\ntree: {tree}\n")
    assert any(line in each for each in found) if line else found == [], found


CLOCK = {"look_up_time": "SUCCESS (date=9)", "time_reached": "FAILURE too_early for 10 s, then SUCCESS"}


@pytest.mark.parametrize(
    ("tree", "time", "end"),
    [
        ("{wait_until: 22:00}", "22:00", "10 s"),
        ('{wait_until: "7:05"}', "7:05", "10 s"),
        ("{wait_until: {time: $bedtime}}", "23:30", "10 s"),
        ("{wait_until: {time: 21:00}, timeout: 20 s}", "21:00", "10 s"),
        ('{for_each: ["06:00"], as: at, do: {wait_until: {time: $at}}}', "06:00", "10 s"),
        (
            "{parallel: [{wait_until: 22:00 or $done}, {sequence: [{wait: 4 s}, {set: {done: true}}]}]}",
            "22:00",
            "4 s",
        ),
        ("{parallel: [{wait_until: 22:00 or $done}, {wait: 4 s}]}", "22:00", "10 s"),
    ],
)
def test_a_time_of_day_is_waited_for_also_one_in_a_key_or_what_comes_sooner(florence, tree, time, end):
    for skill, script in CLOCK.items():
        florence.mock(skill, script)
    florence.load(f"""\
mission: wait
inputs: {{bedtime: {{type: text, default: "23:30"}}}}
keys: {{done: {{type: boolean, default: false}}}}
tree: {tree}
""")
    played = florence.run("wait")
    played.assert_succeeded().assert_duration(end).assert_called("look_up_time", time=time)


@pytest.mark.parametrize(
    ("wait", "line"),
    [
        ("22:00 or $dne", "no node writes a key 'dne' | $done"),
        ("22:00 or 23:00", "wait_until: '23:00' is no time of day | \"23:00\""),
        ("25:00 or $done", "wait_until: '25:00' is no time of day | 22:00"),
        ("{time: 9:5}", "wait_until: '9:5' is no time of day | 22:00"),
        ("{time: $p}", "time: a text is needed, but $p is a pose"),
        ("{time: }", "time has no value"),
    ],
)
def test_what_the_check_says_of_times(workshop, wait, line):
    look_up = SkillDeclaration(
        "look_up_time", "", {"time": Port(Kind.TEXT, "")}, {"date": Port(Kind.NUMBER, "")}
    )
    reached = SkillDeclaration("time_reached", "", {"date": Port(Kind.NUMBER, "")}, instant=True)
    workshop.declarations = {**workshop.declarations, "look_up_time": look_up, "time_reached": reached}
    head = "inputs: {p: {type: pose}}\nkeys: {done: {type: boolean, default: false}}\n"
    found = workshop.lines(f"{head}tree: {{sequence: [{{wait_until: {wait}}}, {{fail: $done}}]}}\n")
    assert any(line in each for each in found), found


def about_times(workshop, tree):
    """The findings of a tree that are about times of the day."""
    return [line for line in workshop.lines(f"tree: {tree}\n") if "time of day" in line]


@pytest.mark.parametrize("time", ["0:00", "00:00", "9:05", "09:05", "19:00", "20:00", "23:59"])
@pytest.mark.parametrize("form", ['"{}"', "{{time: '{}'}}", '"{} or $done"'])
def test_every_time_of_a_day_is_one(workshop, time, form):
    assert about_times(workshop, f"{{wait_until: {form.format(time)}}}") == []


@pytest.mark.parametrize("time", ["24:00", "24:01", "23:60", "12:99", "99:00"])
@pytest.mark.parametrize("form", ['"{}"', "{{time: '{}'}}", '"{} or $done"'])
def test_what_is_no_time_of_a_day_is_refused(workshop, time, form):
    (line,) = about_times(workshop, f"{{wait_until: {form.format(time)}}}")
    assert f"wait_until: '{time}' is no time of day | 22:00" in line


@pytest.mark.parametrize(
    ("meant", "time"),
    [
        ("8 pm", "20:00"),
        ("12 pm", "12:00"),
        ("12 am", "00:00"),
        ("12:30 a.m.", "00:30"),
        ("11:59 PM", "23:59"),
        ("1 am", "01:00"),
        ("20.15", "20:15"),
        ("20 Uhr", "20:00"),
        ("7 o'clock", "07:00"),
        ("at 20:15:30", "20:15"),
        ("Monday 08:00", "08:00"),
    ],
)
def test_a_time_that_is_written_in_another_way_is_proposed_as_hours_and_minutes(workshop, meant, time):
    (line,) = workshop.lines(f'tree: {{wait_until: "{meant}"}}\n')
    assert f'is no time of day | "{time}"' in line


@pytest.mark.parametrize(
    ("wait", "proposed"), [("until 9:05", "9:05"), ("till 23:59", "23:59"), ("at 00:00", "00:00")]
)
def test_a_wait_until_a_time_of_day_is_proposed(workshop, wait, proposed):
    (line,) = workshop.lines(f"tree: {{wait: {wait}}}\n")
    assert f"wait: '{wait}' is a time of day | wait_until: {proposed}" in line
    (line,) = workshop.lines("tree: {wait: until 24:00}\n")
    assert "is a time of day" not in line
