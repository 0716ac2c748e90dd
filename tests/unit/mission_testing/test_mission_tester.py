"""The stage of a test: mocks, time, and what can be asserted."""

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.mission_testing import MissionTester, MockError, fail, never, raises, succeed
from florence_bt.runtime.executor import RequestRefused
from tests.unit.mission_testing.greeting import GREET, SEEN


def test_a_whole_run(stage):
    play = stage.run("greet")
    play.assert_succeeded(user="(3 m, 2 m, 0 deg)").assert_duration("11 s").assert_duration(12, at_most=True)
    assert (play.status, play.code, play.reason, play.leaf) == ("SUCCEEDED", "ok", "", "")
    assert play.outputs == {"user": Pose2(3.0, 2.0, 0.0)}
    assert play.order == ["get_hotspot", "navigate_to", "look_for_user"]
    goal = Pose2(1.0, 2.0, pytest.approx(1.5707963))
    assert play.inputs("navigate_to") == [{"goal": goal, "precise": False}]
    play.assert_keys({"room": "kitchen", "spot": "(1 m, 2 m, 90 deg)"})
    play.assert_trace("""
        0 s   get_hotspot: SUCCESS
        0 s   navigate_to: RUNNING
        10 s  navigate_to: SUCCESS
        10 s  look_for_user: RUNNING
        11 s  look_for_user: SUCCESS
    """)
    assert play.trace("look around", inner=True) == "10 s  look around: RUNNING\n11 s  look around: SUCCESS"


def test_two_equal_runs_have_equal_traces(stage):
    first, second = stage.run("greet"), stage.run("greet")
    assert first.trace(inner=True) == second.trace(inner=True) != ""


def test_the_time_is_moved_by_hand(stage):
    play = stage.start("greet")
    stage.advance("4 s")
    assert (stage.now, play.status) == (4.0, "RUNNING")
    stage.run_until("look_for_user")
    assert stage.now == 10.0
    stage.run_until("look_for_user", "SUCCESS")
    assert stage.now == 11.0
    assert stage.run_until_done().succeeded


def test_run_until_takes_a_function(stage):
    stage.mock("look_for_user", [fail("no_user_seen", after=5), SEEN])
    stage.start("greet")
    stage.run_until(lambda: len(stage.last_run.calls("look_for_user")) == 2)
    assert stage.now == 15.0


def test_a_script_text_with_counts(stage):
    seen = "SUCCESS (user=(0 m, 0 m, 0 deg), distance=1 m, user_id=1)"
    mock = stage.mock("look_for_user", f"running 3 s, then FAILURE code 1 twice, then {seen}")
    play = stage.run("greet")
    play.assert_succeeded().assert_duration(16)
    assert [call.result.code for call in mock.calls] == ["no_user_seen", "no_user_seen", "ok"]
    assert mock.inputs == [{"window": 2.0, "user_id": 0, "x": 0.0, "y": 0.0}] * 3


def test_the_mock_that_says_more_answers_and_of_equals_the_later(stage):
    stage.mock("*", fail("server_lost"))
    stage.mock("navigate_to", fail("no_path"))
    stage.mock("greet/navigate_to", fail("blocked"))
    stage.mock("get_hotspot", fail("unknown_hotspot"))
    stage.mock("get_hotspot", succeed(pose="(0 m, 0 m, 0 deg)"))
    stage.run("greet").assert_failed("blocked", leaf="navigate_to")


def test_a_function_makes_a_world_with_a_memory(stage):
    seen = []

    def drive(inputs):
        seen.append(inputs["goal"])
        return "running 2 s, then SUCCESS" if len(seen) > 1 else fail("no_path", "the door is shut")

    stage.mock("navigate_to", drive)
    stage.run("greet").assert_failed("no_path", reason="door")
    stage.run("greet").assert_succeeded().assert_duration(3)
    assert len(seen) == 2


def test_a_generator_takes_its_time_and_is_closed_by_a_cancel(stage):
    where = ["hall"]

    def drive(inputs):
        try:
            yield "3 s", "through the door"
            where.append("corridor")
            yield 2
            where.append("kitchen")
        finally:
            where.append("stands")

    stage.mock("navigate_to", drive)
    stage.run("greet").assert_succeeded().assert_duration(6)
    assert where == ["hall", "corridor", "kitchen", "stands"]
    del where[1:]
    play = stage.start("greet")
    stage.advance(1)
    assert "through the door" in play.tree
    stage.advance(3)
    stage.stop("enough")
    play.assert_stopped("enough")
    assert where == ["hall", "corridor", "stands"]
    assert play.calls("navigate_to")[0].cancelled


def test_a_mistake_in_the_function_of_a_mock_is_no_failure_of_the_skill():
    def broken(inputs):
        return inputs["nobody"]

    def breaks_on_the_way(inputs):
        yield 1
        raise LookupError("lost")

    for function, says in (
        (broken, r"raised KeyError: 'nobody' \(test_mission_tester.py:\d+\); for a skill that breaks"),
        (breaks_on_the_way, r"raised LookupError: lost \(test_mission_tester.py:\d+\)"),
    ):
        stage = MissionTester()
        stage.mock("navigate_to", function)
        with pytest.raises(MockError, match=says):
            stage.run("goto_pose", x="1 m", y="2 m")


def test_what_a_function_must_not_say(stage):
    for answer, says in (
        ("SUCCESS twice", "several calls"),
        ({"rom": 1}, "no output"),
        (fail("nope"), "cannot fail"),
    ):
        stage = MissionTester(library=stage.library)
        stage.defaults(get_hotspot="SUCCESS (pose=(1 m, 2 m, 90 deg))")
        stage.mock("navigate_to", lambda inputs, answer=answer: answer)
        with pytest.raises(MockError, match=says):
            stage.run("greet")


def test_a_generator_that_yields_no_duration(stage):
    def drive(inputs):
        yield "soon"

    stage.mock("navigate_to", drive)
    with pytest.raises(MockError, match="not a duration"):
        stage.run("greet")


def test_a_skill_without_a_mock_fails_the_test_and_says_how_to_mock_it(tmp_path):
    stage = MissionTester(scratch=tmp_path)
    with pytest.raises(MockError, match="has no mock") as caught:
        stage.run(stage.load(GREET))
    assert 'florence.mock("get_hotspot", "SUCCESS (pose=' in str(caught.value)
    with pytest.raises(MockError):
        stage.check_mocks()


def test_a_script_that_is_used_up_fails_the_test(stage):
    stage.mock("look_for_user", "FAILURE no_user_seen twice")
    with pytest.raises(MockError, match="answers for only 2 calls"):
        stage.run("greet")


def test_a_success_must_give_what_the_mission_reads(stage):
    stage.mock("get_hotspot", "SUCCESS")
    with pytest.raises(ConfigError, match="without pose"):
        stage.start("greet")
    stage.mock("get_hotspot", lambda inputs: None)
    with pytest.raises(MockError, match="without pose"):
        stage.start("greet")


@pytest.mark.parametrize(
    ("pattern", "script", "says", "valid"),
    [
        ("navigat_to", "SUCCESS", "matches no skill", "navigate_to"),
        ("gret/**/navigate_to", "SUCCESS", "matches no skill", "navigate_to"),
        ("turn", "SUCCESS", "does not use", "defaults"),
        ("look around", "SUCCESS", "not a skill but a node of the tree", "look_for_user"),
        ("look around/*", "FAILURE no_path", "cannot fail with 'no_path'", "no_user_seen"),
    ],
)
def test_a_mock_that_fits_nothing(stage, pattern, script, says, valid):
    stage.mock(pattern, script)
    with pytest.raises(ConfigError) as caught:
        stage.start("greet")
    assert says in caught.value.problem
    assert valid in ", ".join(caught.value.valid)


def test_mocks_of_another_mission_do_not_disturb_once_they_were_used(stage):
    stage.mock("greet/navigate_to", "SUCCESS")
    stage.run("greet").assert_succeeded()
    stage.mock("goto_pose/navigate_to", "FAILURE blocked")
    stage.run("goto_pose", x="1 m", y="2 m").assert_failed("blocked")


def test_a_wrong_script_is_told_at_once(stage):
    for script in ("SUCESS", "FAILURE no_pth", "FAILURE 999", "SUCCESS (x=1)"):
        with pytest.raises(ConfigError):
            stage.mock("navigate_to", script)
    with pytest.raises(ConfigError):
        stage.defaults({"navigate_to": "SUCESS"})


@pytest.mark.parametrize("after", [0, 2])
def test_a_skill_that_raises_ends_the_mission_not_the_test(stage, after):
    stage.mock("navigate_to", raises("a bug in the skill", after=after))
    play = stage.run("greet").assert_failed("internal_error", reason="a bug in the skill")
    assert "Traceback" in play.report()


def test_a_mission_that_waits_for_ever_is_told(stage):
    stage.mock("navigate_to", never())
    stage.run("greet").assert_failed("timed_out").assert_duration(180)
    stage.load("mission: park\ndescription: Waits.\ntree:\n  sequence:\n    - wait: 1 h\n")
    stage.start("park")
    with pytest.raises(AssertionError, match="does not end within 1 min"):
        stage.run_until_done(limit="1 min")
    stage.pause()
    with pytest.raises(AssertionError, match=r"paused; resume\(\) lets it go on"):
        stage.run_until_done()
    stage.resume()
    stage.run_until_done()


def test_a_pause_stands_still_and_starts_the_skill_again(stage):
    play = stage.start("greet")
    stage.advance(4)
    stage.pause("a child")
    play.assert_status("PAUSED")
    stage.advance("1 h")
    stage.resume()
    stage.run_until_done()
    play.assert_succeeded().assert_called("navigate_to", times=2)


def test_the_override_blocks_until_it_is_released(stage):
    play = stage.start("greet")
    stage.override("by hand")
    stage.advance(1)
    play.assert_stopped("by hand")
    with pytest.raises(RequestRefused, match="override"):
        stage.start("greet")
    stage.release()
    stage.run("greet").assert_succeeded()


def test_a_second_mission_is_refused_queued_or_goes_first(stage):
    first = stage.start("greet")
    with pytest.raises(RequestRefused):
        stage.start("greet")
    queued = stage.start("greet", policy="queue")
    urgent = stage.start("goto_pose", {"x": "1 m", "y": "0 m"}, policy="preempt", priority=1)
    for play in (first, urgent, queued):
        stage.run_until_done(play)
    assert [play.status for play in stage.runs] == ["STOPPED", "SUCCEEDED", "SUCCEEDED"]
    assert [len(play.calls()) for play in stage.runs] == [2, 3, 1]
    assert len(stage.calls) == 6


def test_the_tree_is_compared_whole_or_as_far_as_it_was_reached(stage):
    stage.mock("navigate_to", fail("no_path", "no way"))
    play = stage.run("greet")
    play.assert_tree("""
[x] greet (sequence)
    [+] get hotspot
    [x] navigate to -- no way
""")
    play.assert_tree("""
[x] greet (sequence)
    [+] get hotspot
    [x] navigate to -- no way
    [ ] look around
        [ ] look for user
""")


def test_what_cannot_be_loaded(stage, tmp_path):
    with pytest.raises(ConfigError, match="no mission 'gret'"):
        stage.run("gret")
    broken = tmp_path / "broken.yaml"
    broken.write_text("mission: [")
    with pytest.raises(ConfigError, match="not YAML"):
        stage.load(broken)
    shadow = tmp_path / "goto_room.yaml"  # of a shipped mission, which is worth a warning
    shadow.write_text("mission: [")
    with pytest.raises(ConfigError, match="not YAML"):
        stage.load(shadow)
    broken.write_text("mission: broken\ndescription: x\ntree:\n  wate: 1 s\n")
    with pytest.raises(ConfigError, match=r"broken\.yaml:4"):
        stage.load(broken)
    with pytest.raises(ConfigError, match="needs its name"):
        stage.load("tree:\n  wait: 1 s\n")
    with pytest.raises(ConfigError, match="scratch"):
        MissionTester().load(GREET)


def test_a_folder_of_missions(stage, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "park.yaml").write_text("mission: park\ndescription: Waits.\ntree:\n  wait: 1 s\n")
    stage.load(folder)
    stage.run("park").assert_succeeded().assert_duration("1 s")
    MissionTester([folder]).run("park").assert_succeeded()
    MissionTester().run(folder / "park.yaml").assert_succeeded()


def test_inputs_of_the_mission_are_checked_like_those_of_a_caller(stage):
    with pytest.raises(ConfigError, match="no input 'rom'"):
        stage.start("greet", rom="hall")
    stage.run("greet", room="hall").assert_called("get_hotspot", label="hall")
    stage.run("greet", {"room": "hall"}).assert_called("get_hotspot", inputs={"label": "hall"})


@pytest.mark.parametrize("status", ["RUNING", ""])
def test_a_status_that_nodes_do_not_have(stage, status):
    stage.start("greet")
    with pytest.raises(ConfigError):
        stage.run_until("navigate_to", status)
    with pytest.raises(ConfigError, match="no node"):
        stage.run_until("navigat_to")


def test_a_node_that_is_never_reached(stage):
    stage.mock("navigate_to", "FAILURE no_path")
    stage.start("greet")
    with pytest.raises(AssertionError, match="ended before 'look_for_user' was RUNNING"):
        stage.run_until("look_for_user")
    with pytest.raises(AssertionError, match="no mission was started"):
        MissionTester().last_run  # noqa: B018
