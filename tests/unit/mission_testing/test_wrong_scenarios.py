"""What is wrong with a scenario file is told with its place."""

import pytest

from florence_bt.trees.language.findings import MAX_FINDINGS

WRONG = [
    ("{@than: {status: SUCCEEDED}}", "no key 'than'", "then"),
    ("{then: {status: @SUCCEDED}}", "status cannot be 'SUCCEDED'", "SUCCEEDED"),
    ("{then: {leaf: @navigat_to}}", "matches no node", "drive to the hotspot"),
    ("{then: {called: {@turn_: 1}}}", "matches no skill", ""),
    ("{then: {called: {turn: @-1}}}", "whole number", ""),
    ("{then: {calls: [navigate_to: {@gaol: 1}]}}", "no input 'gaol'", "goal"),
    ("{then: {calls: [navigate_to: {goal: @1}]}}", "a pose is needed", ""),
    ("{then: {outputs: {@pose: 1}}}", "no output 'pose'", "no outputs"),
    ("{then: {duration: @3}}", "needs a unit", "3 s"),
    ("{then: {nodes: {navigate_to: @DONE}}}", "status cannot be 'DONE'", "SUCCESS"),
    ("{then: {trace: {@off: turn}}}", "no key 'off'", "of"),
    ("{mission: @goto_rom, then: {}}", "no mission 'goto_rom'", "goto_room"),
    ("{given: {inputs: {@rom: 1}}}", "no input 'rom'", "room"),
    ("{given: {skills: {navigate_to: @SUCESS}}}", "'SUCESS'", "SUCCESS"),
    ("{given: {skills: {navigate_to: running 3 s then @FALURE}}}", "'FALURE'", "FAILURE"),
    ("{given: {skills: {navigate_to: FAILURE @no_pth}}}", "'no_pth'", "no_path"),
    ("{given: {skills: {get_hotspot: @SUCCESS}}}", "without pose", "pose"),
    ("{given: {skills: {@turn: SUCCESS}}}", "a skill that goto_room does not use", "navigate_to"),
    ("{given: {skills: {@navigat_to: SUCCESS}}}", "matches no skill", "navigate_to, drive to the hotspot"),
    (
        "{given: {skills: {@/goto_room: SUCCESS}}}",
        "not a skill but a node of the tree",
        "drive to the hotspot",
    ),
    ("{given: {inputs: @{room: }}}", "needs the input room", ""),
    ("{given: {skills: {navigate_to: running @-3 s then SUCCESS}}}", "cannot be '-3 s'", "3 s"),
    (
        "{given: {skills: {navigate_to: @running 3 s, then FAILURE no_path twice, then SUCCESS}}}",
        "text with a comma needs quotes between { and }",
        'navigate_to: "running 3 s, then FAILURE no_path twice, then SUCCESS"',
    ),
    (
        "{given: {skills: {get_hotspot: @SUCCESS (pose=(4 m, 5 m, 0 deg)), navigate_to: SUCCESS}}}",
        "text with a comma needs quotes",
        'get_hotspot: "SUCCESS (pose=(4 m, 5 m, 0 deg))"',
    ),
    ("{then: {status: STOPPED, reason: @I said, do not}}", "text with a comma", 'reason: "I said, do not"'),
    ("{given: {skills: {navigate_to: SUCCESS @room}}}", "cannot follow", "then SUCCESS"),
    ("{given: {skills: {@a//b: SUCCESS}}}", "not a pattern", ""),
    ("{given: {skills: {@a/ /b: SUCCESS}}}", "not a pattern", ""),
    ("{given: {skills: {navigate_to: @{failure: no_path}}}}", "script must be text", "FAILURE no_path"),
    ("{given: {skills: {navigate_to: @[FAILURE, SUCCESS]}}}", "script must be text", "then SUCCESS"),
    ("{given: {skills: {navigate_to: @}}}", "script must be text", "SUCCESS"),
    ("{given: {skills: {navigate_to: 'SUCCESS always, @FAILURE'}}}", "nothing can follow", ""),
    ("{given: {skills: {get_hotspot: {switch: @room, default: FAILURE}}}}", "no input 'room'", "label"),
    ("{given: {skills: {get_hotspot: @{switch: label}}}}", "has no cases", ""),
    ("{@wait: 3 s, then: {status: SUCCEEDED}}", "no key 'wait'", "when: [{advance: 3 s}]"),
    ("{@inputs: {room: kitchen}, then: {status: SUCCEEDED}}", "no key 'inputs'", "given: {inputs: ...}"),
    ("{@status: SUCCEEDED, then: {code: blocked}}", "no key 'status'", "then: {status: SUCCEEDED}"),
    ("{@stop: enough, then: {status: STOPPED}}", "no key 'stop'", "when: [{stop: enough}]"),
    ("{when: [@stopp]}", "there is no event 'stopp'", "stop"),
    ("{when: [@stop]}", "must be a table", "stop:"),
    ("{when: [@advance 3 s]}", "must be a table", "advance: 3 s"),
    ("{then: {status: @success}}", "status cannot be 'success'", "SUCCEEDED"),
    ("{when: [@at 3 s: stop]}", "there is no event 'at 3 s'", "at: 3 s"),
    ("{when: [{@att: 3 s}]}", "there is no event 'att'", "at"),
    ("{then: @SUCCEEDED}", "then must be a table", "then: {status: SUCCEEDED}"),
    ("{then: {calls: {navigate_to: @3}}}", "the inputs must be a table", "called: {navigate_to: 3}"),
    ("{mission: @nowhere/x.yaml}", "there is no file", ""),
    ("{when: [{at: 3 s, @stopp: x}]}", "there is no event 'stopp'", "stop"),
    ("{when: [{@wait: 3 s}]}", "there is no event 'wait'", "advance: 3 s"),
    ("{when: [@sleep 3 s]}", "there is no event 'sleep 3 s'", "advance: 3 s"),
    ("{when: [{at: 3 s, @cancel: }]}", "there is no event 'cancel'", "stop:"),
    ("{when: [{@run: goto_room, inputs: {room: x}}]}", "there is no event 'run'", "start: goto_room"),
    ("{when: [{stop: x, @pause: y}]}", "'pause' cannot be combined with 'stop'", "of its own"),
    ("{when: [advance: @4]}", "needs a unit", "4 s"),
    ("{when: [@{}]}", "nothing happens here", "stop"),
    ("{when: [expect: @{}]}", "nothing is expected", "status"),
    ("{when: [@[stop]]}", "must be a table", "stop"),
    ("{when: [{until: @drve}]}", "matches no node", "drive to the hotspot"),
    ("{when: [{start: @goto_room}]}", "needs the input room", ""),
    ("{when: [{start: goto_room, inputs: {room: x}, policy: @q}]}", "policy cannot be 'q'", "queue"),
    ("{name: @x <y>, examples: [{z: 1}]}", "no 'y'", "z"),
    ("{examples: @[]}", "no examples", ""),
    ("{examples: @{a: [1], b: [1, 2]}}", "different lengths", ""),
    ("{then: {runs: {@other: {code: ok}}}}", "no run is called 'other'", ""),
    ("@{name: again, then: {code: ok}}", "two scenarios are called 'again'", "another name"),
    ("@{name: x, when: [stop: ]}", "expects nothing", "status"),
    ("@{name: x, then: }", "expects nothing", "status"),
    ("{then: {@not_called: []}}", "not_called expects nothing", ""),
    ("{then: {@keys: {}}}", "keys expects nothing", ""),
    ("{then: {keys: {room: kitchen, @rom: x}}}", "no key 'rom'", "room"),
    ("{then: {keys: {hotspot: @3 m}}}", "a pose is needed", ""),
    ("{then: {@status: FAILED, refused: x}}", "does not run", ""),
    ("{mission: @got_room}", "no mission", "goto_room, go_home, missions: [FOLDER] at the top"),
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


def test_a_script_that_fell_apart_is_told_once_and_read_as_it_was_meant(read):
    found = read("- {name: x, given: {skills: {navigate_to: running 3 s, then FALURE}}, then: {code: ok}}")
    torn, wrong = found.findings
    assert torn.message == "text with a comma needs quotes between { and }"
    assert "'FALURE'" in wrong.message


def test_what_is_expected_of_an_unknown_mission_is_no_further_error(read):
    then = "{status: SUCCEEDED, outputs: {pose: 1}, keys: {room: hall}, called: {turn: 1}}"
    (finding,) = read(f"- {{name: x, mission: nowhere, then: {then}}}").findings
    assert "no mission 'nowhere'" in finding.message


def test_a_single_word_without_its_colon_is_no_piece_of_a_text(play):
    (result,) = play("""
        - {name: x, when: [{at: 3 s, pause}, {at: 4 s, resume}], then: {status: SUCCEEDED, duration: 14 s}}
    """)
    assert result.passed, result.problems


def test_the_file_of_a_mission_is_looked_for_from_the_scenario_file(read, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path.parent)
    mission = tmp_path.parent / "mine" / "some_mission.yaml"
    mission.parent.mkdir(exist_ok=True)
    mission.write_text("mission: some_mission\ntree: {wait: 1 s}\n")
    text = "mission: mine/some_mission.yaml\nscenarios: [{name: x, then: {code: ok}}]\n"
    (finding,) = read(text, "").findings
    assert "mine/some_mission.yaml': paths are counted from the folder of this file" in finding.message
    assert finding.valid == ("../mine/some_mission.yaml",)
    assert not read(text.replace("mine/", "../mine/"), "").findings


def test_a_wrong_scenario_behind_many_others_is_not_played(read):
    found = read("".join(f"- {{name: x {n}, then: {{status: SUCCEDED}}}}\n" for n in range(MAX_FINDINGS + 9)))
    assert not found.scenarios
    assert len(found.findings) == MAX_FINDINGS + 1, "the last says that there are more"


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


def test_everything_that_is_wrong_with_a_script_is_told_at_once(read):
    script = (
        "runing 3 s, then SUCESS twice, then FAILURE nope, then running 5, then FAILURE 0 times, then SUCCESS"
    )
    found = read(
        f'- {{name: x, given: {{skills: {{navigate_to: "{script}"}}}}, then: {{code: ok}}}}'
    ).findings
    told = {each.column: each.message for each in found}
    begin = min(told)
    wrong = ("runing", "SUCESS", "nope", "5, then FAILURE", "0 times")
    assert sorted(told) == [begin + script.index(word) for word in wrong], told
    assert all(word in told[begin + script.index(word)] for word in wrong[:3])


def test_all_outputs_of_a_script_that_are_wrong_are_told(read):
    outputs = "SUCCESS (pose=far, place=kitchen)"
    (finding,) = read(
        f'- {{name: x, given: {{skills: {{get_hotspot: "{outputs}"}}}}, then: {{code: ok}}}}'
    ).findings
    assert "has no output 'place'" in finding.message and "the output 'pose'" in finding.message
