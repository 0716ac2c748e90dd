"""Missions that are broken on purpose: the scenarios of each notice every one of these mistakes."""

from pathlib import Path

import pytest

from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.mission_testing.scenarios.scenario_run import run_scenario
from florence_bt.trees.language.loader import BUILT_IN

FOLDER = Path(__file__).parents[2] / "scenarios"
ROOM_SEARCH = "with: {window: $window, looks: $looks}\n              out: {user: user}\n    - set"
HERE_SEARCH = "with: {window: $window, looks: $looks}\n              out: {user: user}\n        - name"
MUTANTS = [
    ("goto_pose", "x: $x, y: $y", "x: $y, y: $x"),
    ("goto_pose", "yaw: $phi", "yaw: 0 deg"),
    ("goto_pose", "default: 0 deg", "default: 90 deg"),
    ("goto_room", "label: $room", "label: kitchen"),
    ("goto_room", "goal: $hotspot", "goal: {x: 4 m, y: 5 m, yaw: 30 deg}"),
    ("detect_user", "on: [no_user_seen]", "on: [no_user_seen, collision_ahead]"),
    ("detect_user", "on: [no_user_seen]", "on: [no_user_seen, server_lost]"),
    ("detect_user", "on: [no_picture]", "on: [no_picture, no_user_seen]"),
    ("detect_user", "retry: 3", "retry: 4"),
    ("detect_user", "      - stop_tracker:\n      - turn", "      - turn"),
    ("detect_user", "      - wait: $settle\n        name: settle\n", ""),
    ("detect_user", "  finally:\n    stop_tracker:\n", ""),
    ("detect_user", "{window: $window}", "{window: 5 s}"),
    ("detect_user", "{angle: $step}", "{angle: 45 deg}"),
    ("detect_user", "min: 1, max: 72", "min: 1, max: 71"),
    ("approach_user", "retry: 3", "retry: 4"),
    ("approach_user", "timeout: $limit", "timeout: 120 s"),
    ("approach_user", "robot: $robot", "robot: $user"),
    ("approach_user", "trial: $trial", "trial: 1"),
    ("approach_user", "timed_out]", "timed_out, rejected]"),
    ("approach_user", "dock, timed_out]", "dock]"),
    ("goto_user", "robot_in_room: {room: $room}", "robot_in_room: {room: kitchen}"),
    ("goto_user", "get_hotspot: {label: $room}", "get_hotspot: {label: kitchen}"),
    ("goto_user", "            - navigate_to: {goal: $hotspot}\n", ""),
    ("goto_user", "    - set_user_position: {user: $user}\n", ""),
    ("goto_user", ", safe_distance: $safe_distance}", "}"),
    ("goto_user", HERE_SEARCH, HERE_SEARCH.replace("window: $window, ", "")),
    ("goto_user", ROOM_SEARCH, ROOM_SEARCH.replace(", looks: $looks", "")),
    ("goto_user", "      selector:", "      memory: false\n      selector:"),
    ("goto_user", "default: 5 s", "default: 4 s"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("mission", "text", "broken"), MUTANTS)
def test_a_mistake_is_noticed(tmp_path, mission, text, broken):
    source = (BUILT_IN / f"{mission}.yaml").read_text()
    assert text in source
    (tmp_path / f"{mission}.yaml").write_text(source.replace(text, broken, 1))
    libraries = Libraries((tmp_path,))
    read = read_scenarios(FOLDER / f"{mission}.yaml", libraries)
    played = (run_scenario(scenario, libraries, lambda: 0.0) for scenario in read.scenarios)
    assert read.findings or any(not result.passed for result in played)
