"""What people see of a mission: dumps and reasons."""

import re

import pytest

USER = "(3 m, 2 m, 180 deg)"


NOBODY_ON_THE_WAY = {"watch out on the way/**/look_for_user": "running 20 s, then FAILURE no_user_seen"}


def mock_all(robot, scripts):
    for path, script in scripts.items():
        robot.mock(path, script)


def names_with(mark, tree):
    """The names of the nodes with a mark, from the top down, without their kinds and messages."""
    lines = (line.strip() for line in tree.splitlines())
    return [re.split(r" -- | \(", line[4:])[0] for line in lines if line.startswith(f"[{mark}]")]


def test_a_running_mission_shows_the_way_to_what_runs_what_was_done_and_what_is_left(robot):
    mock_all(robot, NOBODY_ON_THE_WAY)
    robot.mock("look round/**/look_for_user", 'running 5 s, then FAILURE no_user_seen "nobody"')
    play = robot.start("goto_user")
    robot.run_until(lambda: len(play.calls("look_for_user")) == 3)
    running = names_with(">", play.tree)
    assert running[0] == "goto_user" and running[-1] == "look for user"
    way = ["try one place after the other", "find the user", "look round", "search in a circle"]
    assert [name for name in running if name in way] == way
    assert "attempt 2 of 8; the last one failed: nobody" in play.tree, "the second of eight looks"
    assert {"get user room", "get views", "go there", "set how_many"} <= set(names_with("+", play.tree))
    assert "set how_many -- how_many = 1" in play.tree, "what was set"
    assert "watch out on the way" in names_with("x", play.tree)
    assert {"what is said if they cannot be met", "run meet_user"} <= set(names_with(" ", play.tree))


def test_a_search_from_nearby(robot):
    robot.mock("look from nearby", "running 5 s, then FAILURE no_user_seen")
    play = robot.start("goto_user")
    robot.run_until("look from nearby")
    assert "[+] find the user (finally)\n" in play.tree
    assert "[+] if distance($user, $seen_at)" not in play.tree
    assert "[-] watch whether they walk on\n" in play.tree


def test_a_search_from_nearby_that_is_not_needed(robot):
    robot.mock("look_for_user", f"running 1 s, then SUCCESS (user={USER}, distance=1 m, user_id=7)")
    robot.mock("get_robot_pose", "SUCCESS (pose=(2.5 m, 2 m, 0 deg))")
    play = robot.run("goto_user").assert_succeeded()
    skipped = "[+] when $distance > 1.6 m -- skipped: $distance > 1.6 m does not hold (distance is 1 m)"
    assert skipped in play.tree


def test_a_failed_mission_tells_its_reason_first(robot):
    robot.mock("look_for_user", "running 5 s, then FAILURE no_user_seen")
    reason = "nobody was met in the kitchen: the robot got to 1 of 1 places to look from"
    play = robot.run("goto_user").assert_failed("nobody_met", reason=reason)
    assert play.tree.count(reason) == 1
    assert play.tree.splitlines()[0] == "[x] goto_user (sequence)"
    assert play.leaf == "goto_user/try one place after the other"


SKILLS = (
    "get_user_room",
    "get_views",
    "navigate_to",
    "stop_tracker",
    "turn",
    "start_tracker",
    "look_for_user",
    "get_robot_pose",
    "propose_approach_pose",
)


@pytest.mark.parametrize("at", ["at once", "after 1 s"])
@pytest.mark.parametrize("skill", SKILLS)
def test_a_failure_of_any_skill_names_it_and_leaves_the_tracker_off(robot, skill, at):
    took = "running 1 s, then " if at == "after 1 s" else ""
    if skill == "turn":
        robot.mock("look_for_user", "running 1 s, then FAILURE no_user_seen")
    if skill == "stop_tracker":  # a tracker that does not stop after the watch is no matter
        mock_all(robot, NOBODY_ON_THE_WAY)
    robot.mock(skill, f'{took}FAILURE server_lost "nobody answers"')
    play = robot.run("goto_user").assert_failed("server_lost", reason="nobody answers")
    assert play.leaf.endswith(skill)
    tracker = [name for name in play.order if name in ("start_tracker", "stop_tracker")]
    searched = skill not in ("get_user_room", "get_views")
    assert tracker[-1:] == (["stop_tracker"] if searched else [])
    assert all(call.ended is not None for call in play.calls())


@pytest.mark.parametrize("skill", ["navigate_to", "look_for_user", "get_robot_pose", "propose_approach_pose"])
def test_a_failure_in_the_approach_names_the_skill_there(robot, skill):
    robot.mock("look_for_user", f"running 1 s, then SUCCESS (user={USER}, distance=1 m, user_id=7)")
    robot.mock(f"stop before them/**/{skill}", 'running 1 s, then FAILURE server_lost "nobody answers"')
    play = robot.run("goto_user").assert_failed("server_lost", reason="nobody answers")
    assert "/approach_user/" in play.leaf and play.leaf.endswith(skill)
    assert play.order[-1] == "stop_tracker"
    assert all(call.ended is not None for call in play.calls())


LEFT = """\
mission: left
tree:
  sequence:
    - selector:
        - name: first
          sequence:
            - stop_tracker:
            - turn: {angle: 45 deg}
        - name: second
          timeout: 2 s
          do: {look_for_user: {}}
        - {name: third, parallel: [{look_for_user: {}}, {wait: 1 s}], policy: any}
    - repeat: 2
      do:
        sequence:
          - start_tracker:
          - wait: 1 s
"""


def test_branches_that_were_left_keep_their_last_result_and_reason(robot):
    # 0: first fails, second; 2: time-out, third; 3: the wait is over; 4: second round of the repeat
    robot.mock("look_for_user", 'running 10 s saying "looking", then SUCCESS')
    robot.mock("turn", 'FAILURE collision_ahead "a chair"')
    play = robot.start(robot.load(LEFT))
    robot.advance("2.5 s")
    assert (
        play.tree
        == """\
[>] left (sequence)
    [>] selector
        [x] first (sequence)
            [+] stop tracker
            [x] turn -- a chair
        [x] second -- look for user was not done within 2 s (it was at look for user: looking)
            [-] look for user -- looking
        [>] third (parallel)
            [>] look for user -- looking
            [>] wait 1 s
    [ ] repeat 2 times
        [ ] sequence
            [ ] start tracker
            [ ] wait 1 s"""
    )
    robot.mock("start_tracker", "SUCCESS once, then running 1 s then SUCCESS")
    robot.advance("2 s")
    # What begins again has not reached what stands below it.
    assert (
        play.tree
        == """\
[>] left (sequence)
    [+] selector
        [x] first (sequence)
            [+] stop tracker
            [x] turn -- a chair
        [x] second -- look for user was not done within 2 s (it was at look for user: looking)
            [-] look for user -- looking
        [+] third (parallel)
            [-] look for user -- looking
            [+] wait 1 s
    [>] repeat 2 times -- round 2 of 2
        [>] sequence
            [>] start tracker
            [ ] wait 1 s"""
    )
