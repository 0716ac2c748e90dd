"""Scenario files: what they mean, what is wrong with them and where, and how failures are told."""

import itertools
import textwrap

import pytest

from florence_bt.testing.scenario_file import Libraries, read_scenarios
from florence_bt.testing.scenario_run import run_scenario

HEAD = """\
mission: goto_room
given:
  inputs: {room: kitchen}
  skills:
    get_hotspot: SUCCESS (pose=(4 m, 5 m, 0 deg))
    navigate_to: cancel takes 500 ms, running 10 s, then SUCCESS
scenarios:
"""


@pytest.fixture(scope="module")
def libraries():
    return Libraries()


@pytest.fixture
def read(tmp_path, libraries):
    def read(text, head=HEAD):
        file = tmp_path / "some.yaml"
        file.write_text(head + textwrap.indent(textwrap.dedent(text), "  " if head else ""))
        return read_scenarios(file, libraries)

    return read


@pytest.fixture
def play(read, libraries):
    def play(text, head=HEAD):
        found = read(text, head)
        assert found.findings == (), found.findings
        seconds = itertools.count()
        return [run_scenario(scenario, libraries, lambda: next(seconds)) for scenario in found.scenarios]

    return play


def problems(results):
    return [problem.splitlines()[0] for result in results for _, problem in result.problems]


def test_a_scenario_that_holds(play):
    (result,) = play("""
        - name: it works
          then:
            status: success
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
    assert result.seconds == 1


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
        ('trace: ["0 s get_hotspot: FAILURE"]', "the trace is another one:"),
        ("tree: nothing", "the tree is another one:"),
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
          when: [advance 4 s, stop the cat is in the way]
          then: {status: STOPPED, reason: the cat is in the way}
        - name: paused
          when:
            - until: navigate_to
            - pause
            - expect: {status: PAUSED, called: {navigate_to: 1}}
            - advance: 1 h
            - resume:
            - advance 1 s
            - expect: {status: RUNNING}
          then: {status: SUCCEEDED, called: {navigate_to: 2}}
        - name: it goes on
          when: [at: 3 s]
          then: {status: RUNNING, nodes: {navigate_to: RUNNING}}
        - name: overridden
          when:
            - {at: 1 s, override: by hand}
            - {start: goto_pose, inputs: {x: 1 m, y: 2 m}, refused: by hand}
            - release
            - advance 1 s
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
        ("[advance 5 s, {at: 3 s}]", "at 3 s has passed already"),
        ("[resume]", "is not paused"),
        ("[advance 20 s, pause]", "no mission is running"),
        ("[{start: goto_room, inputs: {room: x}}]", "goto_room was refused"),
        (
            "[advance 20 s, {start: goto_pose, inputs: {x: 0 m, y: 0 m}, refused: x}]",
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


def test_scripts_as_steps(play):
    text = """
        - name: steps
          mission: approach_user
          given:
            inputs: {user: "(3 m, 2 m, 0 deg)"}
            skills:
              get_robot_pose: {success: {pose: {x: 0 m, y: 0 m, yaw: 0 deg}}}
              propose_approach_pose:
                switch: trial
                cases:
                  1: [{running: 50 ms, success: {pose: [1 m, 0 m, 0 deg]}}]
                  2: FAILURE pose_occupied
                default: SUCCESS (pose=(3 m, 0 m, 0 deg))
              navigate_to:
                - {running: [{for: 2 s, saying: off we go}, 1 s], failure: 208, reason: no way, times: 1}
                - {accept_after: 1 s, cancel_takes: 1 s, running: 3 s, saying: again, success: }
          when:
            - at: 1 s
            - expect:
                tree: |
                  [>] approach_user
                      [>] approach the person (sequence)
                          [+] get robot pose
                          [>] retry up to 3 times
                              [>] propose and drive (sequence)
                                  [+] propose approach pose
                                  [>] navigate to -- off we go
          then:
            status: SUCCEEDED
            called: {propose_approach_pose: 3, navigate_to: 2}
            outputs: {pose: [3 m, 0 m, 0 deg]}
    """
    (result,) = play(text, "scenarios:\n")
    assert result.passed, result.problems


def test_a_switch_that_provides_for_no_case(play):
    (result,) = play("""
        - name: x
          given: {skills: {get_hotspot: {switch: label, cases: {hall: "SUCCESS (pose=(0 m, 0 m, 0 deg))"}}}}
          then: {status: SUCCEEDED}
    """)
    assert "no (further) call with label 'kitchen'" in problems([result])[0]


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
    assert all(run_scenario(s, libraries, lambda: 0.0).passed for s in found.scenarios)


WRONG = [
    ("{@than: {status: SUCCEEDED}}", "no key 'than'", "then"),
    ("{then: {status: @SUCCEDED}}", "no status 'SUCCEDED'", "SUCCEEDED"),
    ("{then: {leaf: @navigat_to}}", "matches no node", "drive to the hotspot"),
    ("{then: {called: {@turn_: 1}}}", "matches no skill", ""),
    ("{then: {called: {turn: @-1}}}", "whole number", ""),
    ("{then: {calls: [navigate_to: {@gaol: 1}]}}", "no input 'gaol'", "goal"),
    ("{then: {calls: [navigate_to: {goal: @1}]}}", "a pose is needed", ""),
    ("{then: {outputs: {@pose: 1}}}", "no output 'pose'", "no outputs"),
    ("{then: {duration: @3}}", "needs a unit", "3 s"),
    ("{then: {nodes: {navigate_to: @DONE}}}", "no status 'DONE'", "SUCCESS"),
    ("{then: {trace: {@off: turn}}}", "no key 'off'", "of"),
    ("{mission: @goto_rom, then: {}}", "no mission 'goto_rom'", "goto_room"),
    ("{given: {inputs: {@rom: 1}}}", "no input 'rom'", "room"),
    ("{given: {skills: {navigate_to: @SUCESS}}}", "'SUCESS'", "SUCCESS"),
    ("{given: {skills: {navigate_to: running 3 s then @FALURE}}}", "'FALURE'", "FAILURE"),
    ("{given: {skills: {navigate_to: FAILURE @no_pth}}}", "'no_pth'", "no_path"),
    ("{given: {skills: {get_hotspot: @SUCCESS}}}", "without pose", "pose"),
    ("{given: {skills: {@turn: SUCCESS}}}", "a skill that goto_room does not use", "navigate_to"),
    ("{given: {skills: {@navigat_to: SUCCESS}}}", "matches no skill", "navigate_to, drive to the hotspot"),
    ("{given: {skills: {@/goto_room: SUCCESS}}}", "no skill but a node of the tree", "drive to the hotspot"),
    ("{given: {inputs: @{room: }}}", "needs the input room", ""),
    ("{given: {skills: {navigate_to: running @-3 s then SUCCESS}}}", "cannot be '-3 s'", "3 s"),
    ("{given: {skills: {navigate_to: SUCCESS @room}}}", "cannot stand behind", "then SUCCESS"),
    ("{given: {skills: {@a//b: SUCCESS}}}", "no pattern", ""),
    ("{given: {skills: {@a/ /b: SUCCESS}}}", "no pattern", ""),
    ("{given: {skills: {navigate_to: @{success: , failure: }}}}", "one ending", "never"),
    ("{given: {skills: {navigate_to: {@sucess: }}}}", "no key 'sucess'", "success"),
    ("{given: {skills: {navigate_to: @[]}}}", "script is empty", "SUCCESS"),
    ("{given: {skills: {navigate_to: [SUCCESS always, @FAILURE]}}}", "nothing can follow", ""),
    ("{given: {skills: {navigate_to: ['FAILURE, again', @SUCCESS]}}}", "nothing can follow", ""),
    ("{given: {skills: {get_hotspot: {switch: @room, default: FAILURE}}}}", "no input 'room'", "label"),
    ("{given: {skills: {get_hotspot: @{switch: label}}}}", "has no cases", ""),
    ("{when: [@stopp]}", "nothing that happens is called 'stopp'", "stop"),
    ("{when: [{at: 3 s, @stopp: x}]}", "nothing that happens is called 'stopp'", "stop"),
    ("{when: [{stop: x, @pause: y}]}", "'pause' cannot stand beside 'stop'", "of its own"),
    ("{when: [advance @4]}", "needs a unit", "4 s"),
    ("{when: [@{}]}", "nothing happens here", "stop"),
    ("{when: [expect: @{}]}", "nothing is expected", "status"),
    ("{when: [@[stop]]}", "a word or a table", "stop"),
    ("{when: [{until: @drve}]}", "matches no node", "drive to the hotspot"),
    ("{when: [{start: @goto_room}]}", "needs the input room", ""),
    ("{when: [{start: goto_room, inputs: {room: x}, policy: @q}]}", "no policy 'q'", "queue"),
    ("{name: @x <y>, examples: [{z: 1}]}", "no 'y'", "z"),
    ("{examples: @[]}", "no examples", ""),
    ("{examples: @{a: [1], b: [1, 2]}}", "different lengths", ""),
    ("{then: {runs: {@other: {code: ok}}}}", "no run is called 'other'", ""),
    ("@{name: again, then: {code: ok}}", "two scenarios are called 'again'", "another name"),
    ("@{name: x, when: [stop]}", "expects nothing", "status"),
    ("@{name: x, then: }", "expects nothing", "status"),
    ("{then: {@not_called: []}}", "not_called expects nothing", ""),
    ("{then: {@keys: {}}}", "keys expects nothing", ""),
    ("{then: {keys: {room: kitchen, @rom: x}}}", "no key 'rom'", "room"),
    ("{then: {keys: {hotspot: @3 m}}}", "a pose is needed", ""),
    ("{then: {@status: FAILED, refused: x}}", "does not run", ""),
    ("{mission: @got_room}", "no mission", "goto_room, missions: [FOLDER] at the top"),
    ("@{name: }", "has no name", ""),
    ("@just a text", "must be a table", ""),
]
"""The place of the error is marked with @."""


@pytest.mark.parametrize(("marked", "says", "valid"), WRONG)
def test_what_is_wrong_is_told_with_its_place(read, marked, says, valid):
    text = f"- {{name: again, then: {{code: ok}}}}\n- {marked}"
    findings = [f for f in read(text.replace("@", "")).findings if says in f.message]
    assert findings, read(text.replace("@", "")).findings
    assert (findings[0].line, findings[0].column) == (9, 5 + marked.index("@"))
    assert valid in ", ".join(findings[0].valid)


@pytest.mark.parametrize(
    "text",
    [
        *("", "- 1", "a: [", "mission: goto_room\n", "when: 1\n", "missions: [nowhere]\nscenarios: []\n"),
        "scenarios:\n  - {name: x, then: {code: ok}}\n",
    ],
)
def test_files_that_are_no_scenarios(read, text):
    found = read(text, "")
    assert found.findings and not found.scenarios


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
    assert problems(results) == ["approach_user gave the outputs pose, not none"]


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
