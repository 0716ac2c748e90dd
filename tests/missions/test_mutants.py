"""Missions that are broken on purpose: their scenarios notice each of these mistakes, and say which."""

from pathlib import Path

import pytest

from florence_bt.mission_testing import mission_tester
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.language.loader import BUILT_IN
from tests.sweeps import sweep

FOLDER = Path(__file__).parents[2] / "scenarios"
NEARBY_DISTANCE = '"${max(1.2 m, $safe_distance)}"'
ROUND_SEARCH = """with: {window: $window, looks: $looks, step: "${360 deg / $looks}"}
                out: {user: user, distance: distance, user_id: user_id}
"""
LOOK_AGAIN = 'x: "${distance($back, $user)}"'
STORE = """          - succeed:
              set_user_position: {user: $user}
"""
MUTANTS = [
    (
        "goto_pose",
        "x: $x, y: $y",
        "x: $y, y: $x",
        "'navigate_to' with goal=(x 1.50 m, y 2.00 m, yaw 90 deg) was not called as number 1",
    ),
    ("goto_pose", "yaw: $phi", "yaw: 0 deg", "yaw 90 deg) was not called as number 1"),
    ("goto_pose", "default: 0 deg", "default: 90 deg", "yaw 0 deg) was started never"),
    (
        "goto_room",
        "label: $room",
        "label: kitchen",
        "'get_hotspot' with label=hall",
    ),
    (
        "goto_room",
        "goal: $hotspot",
        "goal: {x: 4 m, y: 5 m, yaw: 30 deg}",
        "'navigate_to' with goal=(x -1.00 m, y 0.50 m, yaw -90 deg) was not called as number 2",
    ),
    (
        "detect_user",
        "on: [no_user_seen]",
        "on: [no_user_seen, turn_failed]",
        "'turn' was started",
    ),
    (
        "detect_user",
        "on: [no_user_seen]",
        "on: [no_user_seen, server_lost]",
        "'start_tracker' was started",
    ),
    (
        "detect_user",
        "on: [no_image]",
        "on: [no_image, no_user_seen]",
        "'turn' was started",
    ),
    ("detect_user", "retry: 3", "retry: 4", "'look_for_user' was started"),
    (
        "detect_user",
        "          - stop_tracker:\n",
        "",
        "'stop_tracker' was started",
    ),
    (
        "detect_user",
        "          - wait: $settle\n            name: settle\n",
        "",
        "detect_user took ",
    ),
    (
        "detect_user",
        "            when: not ($look_first and $look == 1)\n",
        "",
        "detect_user took ",
    ),
    ("detect_user", "on: [collision_ahead]", "on: [turn_failed]", "'turn' was started"),
    ("detect_user", "-($turned + 1) * $step", "-$turned * $step", "'turn' with angle=-1.571"),
    ("detect_user", 'way: "${-$step}"', "way: $step", "'turn' with angle=-0.7854"),
    ("detect_user", "                  when: $way == $step\n", "", "'turn' with angle=-0.785"),
    ("detect_user", "when: not ($look_first and", "when: not (true and", "detect_user took "),
    ("detect_user", "$look_first and $look == 1", "$look_first", "'turn' was started"),
    ("detect_user", "$look == 1", "$look == 2", "detect_user took "),
    ("detect_user", "$look == 1", "$look <= 2", "detect_user took "),
    ("detect_user", "default: true", "default: false", "detect_user took "),
    ("detect_user", "default: 300 ms", "default: 1 s", "detect_user took "),
    (
        "detect_user",
        "on: [no_user_seen]",
        "on: [no_user_seen, no_image]",
        "'look_for_user' was started",
    ),
    (
        "detect_user",
        "      finally:\n        stop_tracker:\n",
        "",
        "'stop_tracker' was started",
    ),
    ("detect_user", "{window: $window}", "{window: 5 s}", "'look_for_user' with window=2"),
    ("detect_user", "way: $step, turned", "way: 45 deg, turned", "'turn' with angle=1.571"),
    ("detect_user", "min: 1, max: 72", "min: 1, max: 71", "72 is above the maximum of 71"),
    ("drive_before", "retry: 6", "retry: 7", "trial: 7 is above the maximum of 6"),
    ("drive_before", "retry: 6", "retry: 5", "'propose_approach_pose' was started"),
    ("drive_before", "timeout: 25 s", "timeout: 27 s", "drive_before took "),
    ("drive_before", "timeout: 25 s", "timeout: 23 s", "drive_before "),
    ("drive_before", "trial: $trial", "trial: 1", "'propose_approach_pose' with trial=2"),
    ("drive_before", "on: [unreachable]", "on: [blocked]", "drive_before is FAILED"),
    (
        "drive_before",
        "[unreachable]",
        "[unreachable, rejected]",
        "'navigate_to' was started",
    ),
    ("drive_before", "robot: $robot", "robot: $user", "robot=(x 1.00 m, y 2.00 m, yaw 0 deg)"),
    ("come_closer", "$distance + 4 cm", "$distance + 2 cm", "drive_straight"),
    ("come_closer", "12 cm) / $part", "12 cm)", "drive_straight"),
    ("come_closer", "repeat: 3", "repeat: 4", "'drive_straight' was started"),
    ("approach_user", "timeout: $limit", "timeout: 120 s", "approach_user took "),
    (
        "goto_user",
        "get_views: {room: $room}",
        "get_views: {room: kitchen}",
        "'get_views' with room=hall",
        "the room is the one where the user was last",
    ),
    (
        "goto_user",
        "      until: success\n",
        "",
        "goto_user cannot end with the code 'nobody_met'",
    ),
    (
        "goto_user",
        "add: {reached: 1}",
        "add: {reached: 0}",
        "2 of 2 places",
        "nobody is in the room",
    ),
    (
        "goto_user",
        ", when: $got_there",
        "",
        "the robot got to 2 of 2",
        "a place that the robot does not get to is not one that it looked from",
    ),
    ("goto_user", "                until:\n", "                finally:\n", "goto_user "),
    ("go_near", "trial: 4, safe", "trial: 1, safe", "'propose_approach_pose' with user=(x 4.00 m"),
    ("go_near", "safe_distance: 1 m", "safe_distance: 0.5 m", "'propose_approach_pose' with user=(x 4.00 m"),
    ("go_near", "{goal: $near}", "{goal: $goal}", "'navigate_to' with goal=(x 3.00 m"),
    ("go_near", "        - set: {got_there: false}\n", "", "there is no output 'got_there'"),
    ("go_near", "{got_there: false}", "{got_there: true}", "the output got_there is true, not false"),
    ("goto_user", "            finally:\n              stop_tracker:\n", "", "'stop_tracker'"),
    (
        "goto_user",
        "[unreachable, not_found,",
        "[not_found,",
        "not 'nobody_met'",
        "after collision_ahead of a turn it looks from another place",
    ),
    (
        "goto_user",
        "[unreachable, not_found,",
        "[unreachable,",
        "goto_user is FAILED",
        "what the hotspot does not show is looked at from another place",
    ),
    (
        "goto_user",
        "not_found, user_moved_on]",
        "not_found]",
        "'user_moved_on', not 'nobody_met'",
        "after user_moved_on of the approach the user is looked for from another place",
    ),
    (
        "goto_user",
        ROUND_SEARCH,
        ROUND_SEARCH.replace("window: $window, ", ""),
        "'look round/**/look_for_user' with window=2",
        "the inputs reach the called missions",
    ),
    (
        "goto_user",
        ROUND_SEARCH,
        ROUND_SEARCH.replace(", looks: $looks", ""),
        "'navigate_to' was started once",
        "the inputs reach the called missions",
    ),
    (
        "goto_user",
        "look_for_user: {window: $window}",
        "look_for_user: {}",
        "'watch out on the way/**/look_for_user' with window=2",
        "the inputs reach the called missions",
    ),
    ("goto_user", "seen_at: $user", "seen_at: {x: 3 m, y: 2 m, yaw: 0 deg}", "'meet_user' with seen_at"),
    ("goto_user", "distance: $distance,", "distance: 2 m,", "'meet_user' with seen_at"),
    (
        "goto_user",
        ", safe_distance: $safe_distance}",
        "}",
        "'meet_user' with safe_distance=0.8",
        "the inputs reach the called missions",
    ),
    ("meet_user", "$distance > 1.6 m", "$distance >= 1.6 m", "was started twice, not once"),
    ("meet_user", "$distance > 1.6 m", "$distance > 1.7 m", "was started once, not twice"),
    (
        "meet_user",
        "$seen_at) >= 1 m",
        "$seen_at) >= 0.4 m",
        "'set_user_position' with user=(x 3.50 m",
        "a user who stands half a metre further on is approached there",
    ),
    (
        "meet_user",
        "$seen_at) >= 1 m",
        "$seen_at) >= 2 m",
        "'follow_user'",
        "who has left before the robot was near, and is seen 1.1 m from there, is followed first",
    ),
    (
        "meet_user",
        "{user: user, user_id: id}",
        "{user_id: id}",
        "'set_user_position' with user=(x 3.50 m",
        "a user who stands half a metre further on is approached there",
    ),
    (
        "meet_user",
        "{user: user, user_id: id}",
        "{user: user}",
        "'follow_user' with user_id=8",
        "who stands a metre further on has walked on, and so has somebody else there",
    ),
    ("meet_user", STORE, "", "'set_user_position' is a skill that meet_user does not use"),
    (
        "meet_user",
        STORE,
        STORE.replace("- succeed:\n              ", "- "),
        "set_user_position, not SUCCEEDED",
        "a place that is not stored keeps nobody from being approached",
    ),
    (
        "meet_user",
        "user_id: $id, safe_distance: $safe_distance}",
        "user_id: $id}",
        "'stop before them/**/propose_approach_pose' with safe_distance=2",
        "the look from nearby is at 2 m when the robot is to stop at 2 m",
    ),
    (
        "meet_user",
        "{user: $user, user_id: $id, safe_distance: $safe_distance}",
        "{user: $user, safe_distance: $safe_distance}",
        "'drive_back' was started",
        "who walks on during the approach is followed until they stand, and approached at 0.5 m",
    ),
    (
        "meet_user",
        "on: [user_moved_on]",
        "on: [user_lost]",
        "meet_user is FAILED",
        "who walks on during the approach is followed until they stand, and approached at 0.5 m",
    ),
    (
        "meet_user",
        "retry: 4",
        "retry: 3",
        "'follow_user' was started",
        "who walks on again and again is followed three times",
    ),
    ("meet_user", "  finally:\n    stop_tracker:\n", "", "'stop_tracker'"),
    (
        "make_sure",
        NEARBY_DISTANCE,
        "1.2 m",
        "'approach_user' with safe_distance=1.21",
    ),
    ("make_sure", NEARBY_DISTANCE, "$safe_distance", "'approach_user' with user=(x 3.00 m"),
    ("make_sure", ", limit: 45 s", "", "'approach_user' with user=(x 3.00 m"),
    ("make_sure", "on: [no_image]", "on: [no_user_seen]", "'look_for_user' was started"),
    ("make_sure", "        not_found:\n", "        no_image:\n", "make_sure is FAILED"),
    ("make_sure", "            - start_tracker:\n", "", "'start_tracker'"),
    ("catch_up", "timeout: 90 s", "timeout: 10 min", "catch_up "),
    (
        "catch_up",
        "max(0.9 m, $safe_distance)}",
        "$safe_distance}",
        "'follow_user' with user_id=7, distance=0.9",
    ),
    ("catch_up", "max(0.9 m, $safe_distance)}", "0.9 m}", "'follow_user' with distance=1.5"),
    ("catch_up", " + 0.3 m", "", "timed_out"),
    (
        "catch_up",
        "            - condition: distance($user, $before) < 0.2 m\n",
        "",
        "'look_for_user' was started",
    ),
    ("catch_up", "        user_lost:\n", "        timed_out:\n", "catch_up is FAILED"),
    ("catch_up", "            - start_tracker:\n", "", "'start_tracker'"),
    (
        "catch_up",
        "            repeat: forever\n            do: {wait: 10 s}\n",
        "            wait: 1 s\n",
        "catch_up is",
    ),
    ("look_again", "$user) >= 0.5 m", "$user) > 0.5 m", "look_again is SUCCEEDED"),
    ("look_again", LOOK_AGAIN, LOOK_AGAIN.replace("$back", "$stood"), "'look_for_user'"),
    ("look_again", "drive_back: {distance: 0.4 m,", "drive_back: {distance: 0.3 m,", "'drive_back'"),
    (
        "look_again",
        "when: distance($back, $stood) > 5 cm",
        "when: distance($back, $stood) > 5 m",
        "drive_straight",
    ),
    ("look_again", "              code: user_moved_on\n", "", "the code is 'unexpected_success'"),
    ("look_again", "any: {fail:", "no_image: {fail:", "'no_user_seen', not 'user_moved_on'"),
    ("approach_user", "$user) >= 0.6 m", "$user) > 0.6 m", "approach_user is SUCCEEDED"),
    (
        "approach_user",
        "        on: [not_found, no_image]\n",
        "        on: [no_image]\n",
        "no_user_seen",
    ),
    (
        "approach_user",
        "        on: [not_found, no_image]\n",
        "        on: [not_found]\n",
        "no_image",
    ),
    ("approach_user", "\n        when: $user_id > 0\n", "\n", "look_for_user"),
    (
        "approach_user",
        "            when: $user_id > 0\n",
        "",
        "'get_robot_pose' was started",
    ),
    ("approach_user", " >= 6 deg", " >= 5 deg", "turn"),
    ("approach_user", '                when: $posture == "lying"\n', "", "'turn'"),
    ("goto_user", "default: 5 s", "default: 4 s", "'look_for_user' with window=5"),
    ("patrol", "            unreachable: {app", "            bumper: {app", "patrol is FAILED: "),
    ("patrol", "            not_found: {app", "            failed: {app", "patrol is FAILED: "),
    ("patrol", "get_rooms: {rooms: $rooms}", "get_rooms:", "'get_rooms' with rooms="),
    (
        "patrol",
        '{report: "$room: could not be reached. "}',
        '{report: "$room: nobody was seen. "}',
        "kitchen: could not be reached. hall: nobody was seen.",
    ),
    ("find_user", "[unreachable, not_found]", "[not_found]", "find_user is FAILED: "),
    ("find_user", "[unreachable, not_found]", "[unreachable]", "find_user is FAILED: "),
    ("find_user", "      until: success\n", "", "find_user "),
    (
        "find_user",
        "$report$room: could not",
        "$room: could not",
        "the reason does not contain 'kitchen: could not be reached. hall:",
    ),
    (
        "find_user",
        "    - set_user_position: {user: $user}\n",
        "",
        "'set_user_position' is a skill that find_user does not use",
    ),
    ("follow_me", "x: $x, y: $y", "x: $y, y: $x", "x=1.5, y=-0.2, user_id=0 was not called"),
    ("follow_me", "angle: 45 deg", "angle: 90 deg", "'turn' with angle=0.785"),
    (
        "follow_me",
        "window: 1.5 s, user_id: $user_id",
        "window: 1.5 s",
        "'look_for_user' with window=1.5, user_id=7",
    ),
    ("follow_me", "timeout: 2 min", "timeout: 1 h", "'say' was started"),
    (
        "follow_me",
        "search_for_user: {user_id: $user_id, max_lin_speed: $max_lin_speed",
        "search_for_user: {user_id: $user_id",
        "'search_for_user' with",
    ),
    ("catch_up", "            between: {search_for_user: {user_id: $seen_id}}\n", "", "'search_for_user'"),
    ("follow_me", "      on: [user_lost]\n", "", "follow_me cannot end with the code 'blocked'"),
    (
        "follow_me",
        "distance: $desired_follow_distance",
        "distance: 1 m",
        "'follow_user' with user_id=7, distance=1.2",
    ),
    ("follow_me", "  finally:\n    stop_tracker:\n", "", "'stop_tracker'"),
    ("approach_me", "        y: $y", "        y: $x", "'approach_person' with x=1.5, y=-0.2"),
    (
        "approach_me",
        "p2r_orientation: $desired_p2r_orientation",
        "p2r_orientation: $desired_r2p_orientation",
        "p2r_orientation=1.57",
    ),
    ("approach_me", "        max_ang_speed: $max_ang_speed\n", "", "max_ang_speed=0.5"),
    ("approach_me", "  finally:\n    stop_tracker:\n", "", "'stop_tracker'"),
    ("patrol", "  memory: false\n", "", "'go_home' with dock=dock"),
    ("patrol", "{charge: $charge}", "{charge: 0.2}", "'battery_above' with charge=0.3"),
    ("go_home", "  between: {wait: $pause}\n", "", "go_home took "),
    ("go_home", "wait: $pause", "wait: 30 s", "go_home took "),
    ("go_home", "{room: $dock}", "{room: dock}", "'goto_room' with room=home"),
    (
        "remind",
        "on: [no_answer, not_found]",
        "on: [no_answer]",
        "'find_user' was started",
    ),
    ("remind", "  between: {wait: $pause}\n", "", "remind took "),
    ("remind", "      - say: {text: $text}\n", "", "'say' is a skill that remind does not use"),
    ("remind", "{time_limit: $time_limit}", "{time_limit: 30 s}", "'wait_for_answer' with time_limit=20"),
    (
        "night_check",
        "$height < 0.5 m",
        "$height <= 0.5 m",
        "call_for_help was started, but",
    ),
    ("night_check", "$distance > 2.5 m", "$distance >= 2.5 m", "'approach_user' was started"),
    ("night_check", "safe_distance: 1.5 m", "safe_distance: 0.5 m", "'approach_user' with user="),
    (
        "night_check",
        "      finally:\n        name: take the speed limit back\n        set_speed_limit: {speed: 0}\n",
        "",
        "'set_speed_limit' with speed=0",
    ),
    ("night_check", "code: user_lying", "code: failed", "night_check cannot end with"),
]
"""The mission, a text in it, what stands in its place, and what the scenarios must say of that; where many
long scenarios stand before it, also the name of the one that says it."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mission", "text", "broken", "says", "scenario"),
    sweep([(*mutant, "")[:5] for mutant in MUTANTS], every=4),
)
def test_a_mistake_is_noticed_and_named(tmp_path, monkeypatch, mission, text, broken, says, scenario):
    monkeypatch.setattr(mission_tester, "MAX_EVENTS", 5_000)
    source = (BUILT_IN / f"{mission}.yaml").read_text()
    assert text in source
    (tmp_path / f"{mission}.yaml").write_text(source.replace(text, broken, 1))
    read = read_scenarios(FOLDER / f"{mission}.yaml", Libraries((tmp_path,)))
    found = [finding.message for finding in read.findings]
    for each in (each for each in read.scenarios if scenario in each.name):
        if any(says in problem for problem in found):
            return
        found += [problem for _, problem in run_scenario(each).problems]
    assert any(says in problem for problem in found), found
