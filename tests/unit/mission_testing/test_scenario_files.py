"""Scenario files: what they mean, what is wrong with them and where, and how failures are told."""

import pytest

from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import read_scenarios


def problems(results):
    return [problem.splitlines()[0] for result in results for _, problem in result.problems]


def test_a_scenario_that_holds(play):
    (result,) = play("""
        - name: it works
          then:
            status: SUCCEEDED
            code: ok
            outputs: {}
            keys: {hotspot: {x: 4 m, y: 5 m, yaw: 0 deg}, room: kitchen}
            duration: 10 s
            within: 1 min
            calls: [get_hotspot, navigate_to: {goal: '(4 m, 5 m, 0 deg)'}]
            only_calls: [get_hotspot: {label: kitchen}, drive to the hotspot]
            called: {navigate_to: 1, get_hotspot: {times: 1, label: kitchen}, turn: 0}
            not_called: [turn]
            nodes: {drive to the hotspot: SUCCESS, /goto_room: SUCCESS}
            trace:
              - "0 s get_hotspot: SUCCESS"
              - "0 s drive to the hotspot: RUNNING"
              - "10 s drive to the hotspot: SUCCESS"
            tree: |
              [+] goto_room (sequence)
                  [+] get hotspot
                  [+] drive to the hotspot
    """)
    assert result.passed, result.problems


@pytest.mark.parametrize(
    ("then", "says"),
    [
        ("status: FAILED", "goto_room is SUCCEEDED, not FAILED"),
        ("code: no_path", "the code is 'ok', not 'no_path'"),
        ("code: nowhere", None),
        ("reason: door", "the reason does not contain 'door'"),
        ("leaf: get_hotspot", "the cause is not 'get_hotspot'"),
        ("keys: {room: hall}", "the key room is kitchen, not hall"),
        ("keys: {rom: hall}", None),
        ("duration: 9 s", "goto_room took 10 s, not 9 s"),
        ("within: 9 s", "goto_room took 10 s, not at most 9 s"),
        ("calls: [navigate_to, get_hotspot]", "'get_hotspot' was not called after"),
        ("calls: [navigate_to: {goal: '(4 m, 5 m, 1 deg)'}]", "'navigate_to' with goal="),
        ("only_calls: [get_hotspot]", "a further call came"),
        ("called: {navigate_to: 2}", "'navigate_to' was started once, not twice"),
        ("called: {navigate_to: {times: 1, goal: '(4 m, 5 m, 1 deg)'}}", "'navigate_to' with goal="),
        ("not_called: navigate_to", "'navigate_to' was started once, not never"),
        ("nodes: {get_hotspot: FAILURE}", "get_hotspot is SUCCESS, not FAILURE"),
        ("trace: [0 s get_hotspot: FAILURE]", None),
        ('trace: ["0 s get_hotspot: FAILURE"]', "the trace differs:"),
        ("tree: nothing", "the tree differs:"),
    ],
)
def test_each_expectation_can_fail(read, play, then, says):
    text = f"- name: it works not\n  then:\n    {then}\n"
    if says is None:
        assert read(text).findings
        return
    (result,) = play(text)
    assert says in problems([result])[0]
    ((position, _),) = result.problems
    assert (position.line, position.column) == (10, 7)
    assert "[+] goto_room (sequence)" in result.report


def test_every_expectation_that_fails_is_told(play):
    results = play("- {name: x, then: {status: FAILED, code: no_path, not_called: navigate_to}}")
    assert len(problems(results)) == 3


def test_what_happens_meanwhile(play):
    results = play("""
        - name: stopped
          when: [{at: 4 s, stop: enough}]
          then: {status: STOPPED, reason: enough, duration: 4.5 s}
        - name: words
          when: [advance: 4 s, stop: the cat is in the way]
          then: {status: STOPPED, reason: the cat is in the way}
        - name: paused
          when:
            - until: navigate_to
            - pause:
            - expect: {status: PAUSED, called: {navigate_to: 1}}
            - advance: 1 h
            - resume:
            - advance: 1 s
            - expect: {status: RUNNING}
          then: {status: SUCCEEDED, called: {navigate_to: 2}}
        - name: it goes on
          when: [at: 3 s]
          then: {status: RUNNING, nodes: {navigate_to: RUNNING}}
        - name: overridden
          when:
            - {at: 1 s, override: by hand}
            - {start: goto_pose, inputs: {x: 1 m, y: 2 m}, refused: by hand}
            - release:
            - advance: 1 s
            - {start: goto_pose, inputs: {x: 1 m, y: 2 m}, as: again}
          then: {status: STOPPED, runs: {again: {status: SUCCEEDED, duration: 10 s}}}
        - name: preempted
          when:
            - {at: 1 s, start: goto_room, inputs: {room: hall}, policy: preempt, priority: 3, as: urgent}
          then: {status: STOPPED, runs: {urgent: {status: SUCCEEDED, calls: [get_hotspot: {label: hall}]}}}
        - name: refused
          given: {inputs: {room: kitchen}}
          when: [{start: goto_room, inputs: {room: hall}, refused: is running}]
          then: {status: SUCCEEDED}
    """)
    assert problems(results) == []


@pytest.mark.parametrize(
    ("when", "says"),
    [
        ("[advance: 5 s, {at: 3 s}]", "at 3 s has passed already"),
        ("[resume: ]", "is not paused"),
        ("[advance: 20 s, pause: ]", "no mission is running"),
        ("[{start: goto_room, inputs: {room: x}}]", "goto_room was refused"),
        (
            "[advance: 20 s, {start: goto_pose, inputs: {x: 0 m, y: 0 m}, refused: x}]",
            "should have been refused",
        ),
        ("[{start: goto_room, inputs: {room: x}, refused: apples}]", "the refusal does not contain 'apples'"),
        ("[{until: navigate_to, is: FAILURE}]", "ended before 'navigate_to' was FAILURE"),
    ],
)
def test_what_cannot_happen_is_told_at_its_place(play, when, says):
    (result,) = play(f"- name: x\n  when: {when}\n  then: {{status: SUCCEEDED}}\n")
    assert says in problems([result])[0]
    assert result.problems[0][0].line == 9


def test_a_skill_without_a_mock_is_told(play):
    (result,) = play(
        "- {name: x, then: {status: SUCCEEDED}}",
        "mission: goto_room\ngiven: {inputs: {room: x}}\nscenarios:\n  ",
    )
    assert "get_hotspot has no mock" in problems([result])[0]


def test_scripts_of_several_steps(play):
    text = """
        - name: steps
          mission: approach_user
          given:
            inputs: {user: "(3 m, 2 m, 0 deg)"}
            skills:
              get_robot_pose: >-
                SUCCESS (pose={x: 0 m, y: 0 m, yaw: 0 deg}), then SUCCESS (pose=(3 m, 0 m, 0 deg))
              propose_approach_pose:
                switch: trial
                cases:
                  1: running 50 ms, then SUCCESS (pose=(1 m, 0 m, 0 deg))
                  2: FAILURE pose_occupied
                default: SUCCESS (pose=(3 m, 0 m, 0 deg))
              navigate_to: >-
                running 2 s saying "off we go", running 1 s, then FAILURE 208 "no way" once,
                then accepted after 1 s, cancel takes 1 s, running 3 s saying "again", then SUCCESS
          when:
            - at: 1 s
            - expect:
                tree: |
                  [>] approach_user
                      [>] parallel
                          [>] approach the person (sequence)
                              [+] set seen -- seen = (x 3.00 m, y 2.00 m, yaw 0 deg)
                              [>] run drive_before
                                  [>] sequence
                                      [+] get robot pose
                                      [>] retry up to 6 times
                                          [>] propose and drive (sequence)
                                              [+] propose approach pose
                                              [>] within 25 s
                                                  [>] navigate to -- off we go
                          [+] when $user_id > 0 -- skipped: $user_id > 0 does not hold (user_id is 0)
          then:
            status: SUCCEEDED
            called: {propose_approach_pose: 3, navigate_to: 2}
            outputs: {pose: [3 m, 0 m, 0 deg]}
    """
    (result,) = play(text, "scenarios:\n")
    assert result.passed, result.problems


def test_a_list_is_an_input(play):
    text = """
        - name: lists
          mission: patrol
          given:
            inputs: {rooms: [kitchen, hall]}
            skills:
              battery_above: SUCCESS
              get_rooms: 'SUCCESS (rooms=[])'
          then:
            called: {get_rooms: {times: 1, rooms: [kitchen, hall]}}
    """
    (result,) = play(text, "scenarios:\n")
    assert result.passed, result.problems


def test_a_switch_that_provides_for_no_case(play):
    (result,) = play("""
        - name: x
          given: {skills: {get_hotspot: {switch: label, cases: {hall: "SUCCESS (pose=(0 m, 0 m, 0 deg))"}}}}
          then: {status: SUCCEEDED}
    """)
    assert "no (further) answer for a call with label 'kitchen'" in problems([result])[0]


def test_examples_make_a_scenario_each(read, play):
    text = """
        - name: it fails with <code> after <time>
          examples:
            - {code: no_path, time: 3 s, script: running 3 s then FAILURE no_path}
            - {code: blocked, time: 0 s, script: FAILURE blocked}
          given: {skills: {navigate_to: <script>}}
          then: {status: FAILED, code: <code>, duration: <time>}
        - name: columns
          examples: {room: [kitchen, hall], x: [1, 2]}
          given: {inputs: {room: <room>}}
          then: {calls: [get_hotspot: {label: <room>}], called: {get_hotspot: 1}}
    """
    assert [s.name for s in read(text).scenarios] == [
        *["it fails with no_path after 3 s", "it fails with blocked after 0 s"],
        *["columns", "columns [room=hall, x=2]"],
    ]
    assert problems(play(text)) == []


def test_missions_of_other_folders_and_files(tmp_path, libraries):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "park.yaml").write_text("mission: park\ndescription: Waits.\ntree:\n  wait: 1 s\n")
    (tmp_path / "sleep.yaml").write_text("mission: sleep\ndescription: Waits.\ntree:\n  run: park\n")
    file = tmp_path / "s.yaml"
    file.write_text(
        "missions: [mine]\nscenarios:\n"
        "  - {name: a, mission: park, then: {status: SUCCEEDED, duration: 1 s}}\n"
        "  - {name: b, mission: sleep.yaml, then: {status: SUCCEEDED, duration: 1 s}}\n"
    )
    found = read_scenarios(file, libraries)
    assert found.findings == ()
    assert all(run_scenario(s).passed for s in found.scenarios)


def test_a_scenario_with_an_unknown_parameter_is_not_played(read):
    found = read("- {name: x, examples: {a: [1, 2]}, then: {status: SUCCEEDED, reason: <b>}}")
    assert len(found.findings) == 1 and not found.scenarios


def test_an_input_of_all_can_be_left_out_for_one(play):
    head = (
        "mission: goto_pose\ngiven:\n  inputs: {x: 1 m, y: 2 m, phi: 90 deg}\n"
        "  skills: {navigate_to: SUCCESS}\nscenarios:\n"
    )
    results = play(
        """
        - {name: with it, then: {called: {navigate_to: {goal: "(1 m, 2 m, 90 deg)"}}}}
        - name: without it
          given: {inputs: {phi: }}
          then: {called: {navigate_to: {goal: "(1 m, 2 m, 0 deg)"}}}
        """,
        head,
    )
    assert problems(results) == []


def test_no_outputs_at_all_can_be_expected(play):
    head = (
        "mission: approach_user\ngiven:\n  inputs: {user: '(1 m, 2 m, 0 deg)'}\n"
        "  skills: {get_robot_pose: 'SUCCESS (pose=(0 m, 0 m, 0 deg))', navigate_to: SUCCESS,\n"
        "    propose_approach_pose: 'SUCCESS (pose=(1 m, 0 m, 0 deg))'}\nscenarios:\n"
    )
    results = play("- {name: x, then: {status: SUCCEEDED, outputs: {}}}", head)
    assert problems(results) == ["approach_user gave the outputs pose, seen, nearest, not none"]


def test_a_refusal_that_does_not_come_is_told_at_its_place(play):
    (result,) = play("- {name: x, then: {refused: busy}}")
    ((position, problem),) = result.problems
    assert "should have been refused" in problem and (position.line, position.column) == (8, 31)


def test_mocks_that_no_call_used_are_told_when_something_fails(play):
    (result,) = play("""
        - name: x
          given: {skills: {get_hotspot: FAILURE, navigate_to: SUCCESS}}
          then: {status: SUCCEEDED}
    """)
    assert "mocks that answered no call: navigate_to" in result.report


def test_a_good_scenario_beside_a_bad_one_is_played(read):
    found = read("- {name: good, then: {status: SUCCEEDED}}\n- {name: bad, then: {status: x}}")
    assert ([s.name for s in found.scenarios], len(found.findings)) == (["good"], 1)


def test_a_mission_by_file_may_call_those_beside_it(play, tmp_path, stage):
    (tmp_path / "caller.yaml").write_text("mission: caller\ntree: {run: second}\n")
    (tmp_path / "second.yaml").write_text("mission: second\ntree: {run: third}\n")
    (tmp_path / "third.yaml").write_text("mission: third\ntree: {wait: 3 s}\n")
    head = "mission: caller.yaml\nscenarios:\n"
    (result,) = play("- {name: x, then: {status: SUCCEEDED, duration: 3 s}}", head)
    assert result.passed, result.problems
    assert stage.load(tmp_path / "caller.yaml") == "caller"
    stage.run("caller").assert_succeeded().assert_duration("3 s")


LOOKS = """\
mission: detect_user
given:
  inputs: {looks: 60}
  skills:
    {turn: SUCCESS, look_for_user: FAILURE no_user_seen, start_tracker: SUCCESS, stop_tracker: SUCCESS}
scenarios:
"""


def test_a_report_of_many_calls_is_short(play):
    (result,) = play("- name: a\n  then: {not_called: turn}\n", LOOKS)
    lines = result.report.splitlines()
    assert any(line.endswith(" more calls") for line in lines) and len(lines) < 80


def test_outputs_of_a_run_that_failed(play):
    results = play("- name: a\n  then: {outputs: {distance: 1 m}}\n", LOOKS)
    assert "a mission that is FAILED gives no outputs" in problems(results)[0]
