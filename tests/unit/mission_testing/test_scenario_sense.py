"""What can never hold is found before anything is played; what can hold is left alone."""

import pytest

from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios

HEAD = """\
mission: goto_room
given:
  inputs: {room: kitchen}
  skills: {get_hotspot: "SUCCESS (pose=(4 m, 5 m, 0 deg))", navigate_to: running 10 s then SUCCESS}
scenarios:
"""


@pytest.fixture(scope="module")
def findings(tmp_path_factory):
    libraries = Libraries()
    file = tmp_path_factory.mktemp("sense") / "some.yaml"

    def findings(scenario):
        file.write_text(f"{HEAD}  - {{name: x, {scenario}}}\n")
        return read_scenarios(file, libraries).findings

    return findings


@pytest.mark.parametrize(
    ("scenario", "says", "valid"),
    [
        ("then: {status: FAILED, code: @no_pth}", "goto_room cannot end with the code 'no_pth'", "no_path"),
        ("then: {code: @user_unknown}", "cannot end with the code 'user_unknown'", "unknown_hotspot"),
        ("then: {status: SUCCEEDED, code: @no_path}", "SUCCEEDED cannot end with the code", "ok"),
        ("then: {status: FAILED, code: @ok}", "cannot end with the code 'ok'", ""),
        ("when: [stop: ], then: {status: STOPPED, code: @no_path}", "cannot end with the code", "stopped"),
        ("then: {status: @STOPPED}", "nothing under 'when' does that", "stop: enough"),
        ("when: [at: 3 s], then: {status: @PAUSED}", "nothing under 'when' does that", "pause"),
        ('then: {trace: [@"0 s navigate_to: DONE"]}', "no status 'DONE'", "SUCCESS"),
        ('then: {trace: [@"navigate_to: SUCCESS"]}', "not a line of a trace", "4.2 s"),
        ('then: {trace: [@"0 s navigat_to: SUCCESS"]}', "matches no node", "navigate_to"),
        ('then: {trace: [@"3 m navigate_to: SUCCESS"]}', "not a unit of a duration", "3 min"),
        ("then: {trace: {of: @turn, lines: []}}", "goto_room does not use", ""),
        ("when: [{at: 1 s, expect: {code: @nothing}}], then: {status: SUCCEEDED}", "'nothing'", "no_path"),
    ],
)
def test_what_can_never_hold(findings, scenario, says, valid):
    (found,) = findings(scenario.replace("@", ""))
    assert says in found.message
    assert (found.line, found.column) == (6, len("  - {name: x, ") + 1 + scenario.index("@"))
    assert valid in ", ".join(found.valid)


@pytest.mark.parametrize(
    "scenario",
    [
        "then: {status: FAILED, code: internal_error}",
        "then: {status: FAILED, code: bad_input}",
        "then: {code: ok}",
        'then: {status: SUCCEEDED, reason: ""}',
        "when: [{start: goto_room, inputs: {room: x}, policy: preempt}], then: {status: STOPPED}",
        "when: [{at: 1 s, override: x}], then: {status: STOPPED, code: stopped, duration: 1 s}",
        "then: {duration: 3 s, within: 3 s}",
        "then: {called: {navigate_to: 0}, not_called: navigate_to}",
        "then: {only_calls: []}",
        "then: {trace: {of: navigate_to, lines: []}}",
        "then: {status: FAILED, outputs: {}}",
    ],
)
def test_what_may_hold_is_left_alone(findings, scenario):
    assert findings(scenario) == ()
