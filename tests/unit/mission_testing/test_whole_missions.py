"""Called missions that are mocked whole, and skills that only a file beside the missions declares."""

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing import MissionTester
from florence_bt.mission_testing.coverage import Coverage
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios

SEEN = "running 8 s, then SUCCESS (user=(3 m, 2 m, 180 deg), distance=1.5 m, user_id=1)"
MET = "running 5 s, then SUCCESS (user=(3 m, 2 m, 180 deg), pose=(1 m, 1 m, 0 deg))"
WAVE = """\
skills:
  wave_arm:
    summary: Waves.
    inputs: {times: {type: integer, default: 1}}
    failures: {stuck: the arm is stuck}
"""


@pytest.fixture
def stage():
    stage = MissionTester()
    stage.defaults(
        get_user_room="SUCCESS (room=kitchen)",
        get_views="SUCCESS (poses=[(0 m, 0 m, 0 deg), (1 m, 0 m, 0 deg)])",
        plan_to="SUCCESS (length=5 m)",
        navigate_to="running 10 s, then SUCCESS",
        start_tracker="SUCCESS",
        stop_tracker="SUCCESS",
        look_for_user="running 60 s, then FAILURE no_user_seen",
        set_user_position="SUCCESS",
    )
    return stage


def test_a_called_mission_is_mocked_like_a_skill(stage):
    search = stage.mock("detect_user", SEEN)
    stage.mock("meet_user", MET)
    play = stage.run("goto_user", looks=3).assert_succeeded(pose="(1 m, 1 m, 0 deg)").assert_duration(23)
    play.assert_called("look round/**/detect_user", times=1, looks=3, window="5 s", step="120 deg")
    play.assert_order("detect_user", "meet_user")
    play.assert_trace("10 s detect_user: RUNNING\n18 s detect_user: SUCCESS", "look round/**/detect_user")
    assert search.inputs[0]["settle"] == 0.3 and search.inputs[0]["look_first"] is True


def test_each_call_of_a_mission_is_a_call_of_its_mock(stage):
    stage.mock("look_for_user", f"{SEEN[:-1]}, posture=standing)")
    approach = stage.mock(
        "approach_user",
        "running 5 s, then SUCCESS (pose=(1 m, 1 m, 0 deg), seen=(3 m, 2 m, 180 deg), nearest=3 m)",
    )
    stage.mock("get_robot_pose", "SUCCESS (pose=(1 m, 1 m, 20 deg))")
    play = stage.run("meet_user", seen_at="(3 m, 2 m, 180 deg)", seen_id=1, distance="2 m")
    play.assert_succeeded(pose="(1 m, 1 m, 20 deg)").assert_duration(5 + 8 + 5 + 8 + 8)
    assert play.order[1:] == [
        "approach_user",
        "look_for_user",
        "set_user_position",
        "approach_user",
        "look_for_user",
        "look_for_user",
        "get_robot_pose",
        "stop_tracker",
    ]
    assert [call["safe_distance"] for call in approach.inputs] == [1.2, 0.5]
    play.assert_called("make sure from nearby/**/approach_user", times=1, safe_distance="1.2 m")


def test_paths_tell_one_call_from_the_other(stage):
    stage.mock("detect_user", SEEN)
    stage.mock("look round/**/detect_user", f"running 3 s, then FAILURE no_user_seen once, then {SEEN}")
    stage.mock("meet_user", MET)
    stage.mock("turn", "running 2 s, then SUCCESS")
    stage.run("goto_user").assert_succeeded().assert_duration(10 + 3 + 10 + 2 + 8 + 5)


def test_its_failure_reaches_the_caller(stage):
    stage.mock("detect_user", 'FAILURE tracker_failed "nobody"')
    stage.run("goto_user").assert_failed("tracker_failed", "nobody", leaf="detect_user")


def test_a_stop_cancels_it(stage):
    stage.mock("detect_user", "cancel takes 1 s, never ends")
    play = stage.start("goto_user")
    stage.advance(600)
    stage.stop("enough")
    stage.run_until_done().assert_stopped("enough").assert_duration(601)
    assert play.calls("detect_user")[0].cancelled


@pytest.mark.parametrize(
    ("script", "says"),
    [
        ("FAILURE no_pth", "cannot fail with 'no_pth'"),
        ("SUCCESS (usr=1)", "no output 'usr'"),
        ("SUCCESS", "without user"),
    ],
)
def test_it_can_do_only_what_the_mission_declares(stage, script, says):
    stage.mock("detect_user", script)
    with pytest.raises(ConfigError, match=says):
        stage.start("goto_user")


def test_without_a_mock_it_is_played(stage):
    stage.mock("start_tracker", "SUCCESS")
    stage.mock("look_for_user", "running 1 s, then FAILURE no_user_seen")
    stage.mock("turn", "FAILURE no_scan")
    stage.mock("stop_tracker", "SUCCESS")
    play = stage.run("goto_user")
    play.assert_failed("no_scan")
    stage.mock("detect_usr")
    with pytest.raises(ConfigError, match="'detect_usr' matches no skill") as caught:
        stage.run("goto_user")
    assert caught.value.valid[0] == "detect_user"


HEAD = """\
mission: goto_user
given:
  skills:
    get_user_room: SUCCESS (room=kitchen)
    get_views: "SUCCESS (poses=[(1 m, 1 m, 0 deg)])"
    plan_to: SUCCESS (length=5 m)
    navigate_to: SUCCESS
    start_tracker: SUCCESS
    stop_tracker: SUCCESS
    look_for_user: running 1 s, then FAILURE no_user_seen
    set_user_position: SUCCESS
    meet_user: SUCCESS (user=(3 m, 2 m, 180 deg), pose=(1 m, 1 m, 0 deg))
scenarios:
"""


def read(tmp_path, text, head=HEAD):
    file = tmp_path / "some.yaml"
    file.write_text(head + text)
    libraries = Libraries()
    return read_scenarios(file, libraries), libraries


def test_in_scenarios(tmp_path):
    found, libraries = read(
        tmp_path,
        f"  - name: whole\n    given: {{skills: {{detect_user: '{SEEN}'}}}}\n"
        "    then: {status: SUCCEEDED, duration: 8 s,\n"
        "      called: {look round/**/detect_user: {times: 1, looks: 8}}}\n"
        "  - name: played\n"
        "    given:\n      skills: {turn: FAILURE no_scan}\n"
        "    then: {status: FAILED, code: no_scan, called: {turn: 1}}\n"
        "  - name: another mission\n    mission: goto_pose\n"
        "    given: {inputs: {x: 1 m, y: 1 m}, skills: {navigate_to: SUCCESS}}\n"
        "    then: {status: SUCCEEDED}\n",
    )
    assert found.findings == ()
    results = [run_scenario(each) for each in found.scenarios]
    assert [problem for result in results for problem in result.problems] == []
    coverage = Coverage()
    for result in results[:1]:
        scenario = result.scenario
        coverage.add_mission(scenario.library.get("goto_user"), scenario.library)
        library, _ = libraries.load(tmp_path, ())
        coverage.add_mission(library.get("detect_user"), library)
        coverage.add_runs(result.runs)
    inside, outside = coverage.report(libraries.declarations)
    assert inside.nodes_seen.seen == 0, "what is mocked away is not covered"
    assert next(node for node in outside.nodes if node.title == "look round").seen


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "given: {skills: {detect_user: FAILURE no_pth}}, then: {status: FAILED}",
            "cannot fail with 'no_pth'",
        ),
        ("then: {not_called: detect_user}", "not a skill but a mission that is called"),
        ("given: {skills: {detect_user: FAILURE}}, then: {called: {turn: 1}}", None),
        ("given: {skills: {detect_user: FAILURE}}, then: {leaf: settle}", "matches no node"),
    ],
)
def test_what_is_wrong_is_told(tmp_path, text, says):
    findings = read(tmp_path, f"  - {{name: x, {text}}}\n")[0].findings
    assert (says is None and findings == ()) or any(says in finding.message for finding in findings)


@pytest.fixture
def waving(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "x.skills.yaml").write_text(WAVE)
    (tmp_path / "mine" / "x.yaml").write_text("mission: x\ndescription: x\ntree:\n  wave_arm: {times: 3}\n")
    return tmp_path / "mine" / "x.yaml"


def test_a_skill_that_is_only_declared_is_mocked_like_any_other(waving):
    stage = MissionTester()
    stage.load(waving)
    stage.mock("wave_arm", "running 3 s, then SUCCESS")
    stage.run("x").assert_succeeded().assert_duration(3).assert_called(
        "wave_arm", times=1, inputs={"times": 3}
    )


def test_a_skill_that_is_only_declared_in_scenarios(waving):
    found, libraries = read(
        waving.parent.parent,
        "  - {name: a, given: {skills: {wave_arm: FAILURE stuck}}, then: {status: FAILED, code: stuck}}\n",
        "missions: [mine]\nmission: x\nscenarios:\n",
    )
    assert found.findings == ()
    (scenario,) = found.scenarios
    result = run_scenario(scenario)
    assert result.passed
    coverage = Coverage()
    coverage.add_mission(scenario.library.get("x"), scenario.library)
    coverage.add_runs(result.runs)
    (report,) = coverage.report(libraries.declarations)
    assert (str(report.codes_seen), report.nodes[0].missing) == ("1/1", ("SUCCESS", "STOPPED"))


def test_a_mock_of_a_mission_gives_what_its_caller_takes_and_no_more(tmp_path):
    (tmp_path / "caller.yaml").write_text(
        "mission: caller\ntree:\n  sequence:\n    - run: follow_me\n"
        "    - run: find_user\n      out: {room: room}\n    - say: {text: $room}\n"
    )
    file = tmp_path / "some.yaml"
    head = "mission: caller.yaml\ngiven:\n  skills: {follow_me: SUCCESS, find_user: @, say: SUCCESS}\n"
    scenario = "scenarios:\n  - name: a\n    then: {status: SUCCEEDED, calls: [say: {text: hall}]}\n"
    file.write_text(head.replace("@", "SUCCESS (room=hall)") + scenario)
    found = read_scenarios(file, Libraries())
    assert found.findings == () and run_scenario(found.scenarios[0]).passed
    file.write_text(head.replace("@", "SUCCESS") + scenario)
    (finding,) = read_scenarios(file, Libraries()).findings
    assert finding.valid == ("SUCCESS (room=kitchen)",)
    failing = head.replace("follow_me: SUCCESS", "follow_me: FAILURE not_found").replace("@", "FAILURE")
    file.write_text(failing + scenario)
    (finding, *_) = read_scenarios(file, Libraries()).findings
    assert finding.valid == ("no_user_seen", "user_not_in_view")
