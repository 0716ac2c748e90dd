"""What the processes of a bring-up give their nodes."""

from __future__ import annotations

import math

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.preflight import check_options
from florence_bt.app.bringup.supervisor import STARTED_AGAIN
from florence_bt.app.bringup.topology import (
    NODES,
    RECORDER,
    companions,
    ended_together,
    factories,
    observers,
    own_bindings,
    process_of,
    processes,
)
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.navigation.navigate.bindings import NOT_OF_NAV2

TIMEOUTS = [
    ("hardware", "VelocityFilterNode", "command_timeout"),
    ("navigation", "NavigationNode", "scan_timeout"),
]


@pytest.mark.ros
@pytest.mark.parametrize(("group", "node", "name"), TIMEOUTS)
@pytest.mark.parametrize(("speed", "factor"), [(0.5, 1.0), (1.0, 1.0), (4.0, 4.0)])
def test_what_finds_out_silence_has_the_real_time_of_the_robot(tmp_path, group, node, name, speed, factor):
    pytest.importorskip("rclpy")
    file = tmp_path / "robot.yaml"
    file.write_text("velocity_filter: {command_timeout: 0.25}\n")
    options = BringUp(folder=str(tmp_path), speed=speed, config_file=str(file))
    (made,) = (part for part in factories(group, options) if part.func.__name__ == node)
    assert made.keywords["parameters"].get(name, 0.25) == 0.25 * factor


@pytest.mark.ros
@pytest.mark.parametrize(("written", "expected"), [("1", 4.0), ("null", 1.0)])
def test_so_has_it_when_it_is_a_whole_number_or_left_out(tmp_path, written, expected):
    pytest.importorskip("rclpy")
    file = tmp_path / "robot.yaml"
    file.write_text(f"navigate: {{scan_timeout: {written}}}\n")
    options = BringUp(folder=str(tmp_path), speed=4.0, config_file=str(file))
    (made,) = (part for part in factories("navigation", options) if part.func.__name__ == "NavigationNode")
    assert made.keywords["parameters"]["scan_timeout"] == expected


@pytest.mark.ros
@pytest.mark.parametrize("rehearsal", [True, False])
def test_a_silent_laser_in_a_rehearsal_comes_with_advice(tmp_path, rehearsal):
    pytest.importorskip("rclpy")
    made = factories("navigation", BringUp(str(tmp_path), simulated=False, emulated=rehearsal))
    (node,) = (part for part in made if part.func.__name__ == "NavigationNode")
    assert ("--sim" in node.keywords["parameters"].get("silence_advice", "")) is rehearsal


@pytest.mark.ros
def test_a_robot_goes_on_where_it_was_and_a_simulated_one_only_when_it_is_started_again(
    tmp_path, monkeypatch
):
    pytest.importorskip("rclpy")
    monkeypatch.delenv(STARTED_AGAIN, raising=False)

    def of_localiser(**options):
        made = factories("navigation", BringUp(folder=str(tmp_path), **options))
        (localiser,) = (part for part in made if part.func.__name__ == "LocaliserNode")
        return localiser.keywords["parameters"]

    assert of_localiser(simulated=False)["pose_file"] == str(tmp_path / "pose.json")
    given = of_localiser(simulated=False, start=(1.0, 2.0, 0.5))
    assert given["pose_file"] != str(tmp_path / "pose.json") and given["initial_yaw"] == 0.5
    kept = tmp_path / "simulated_pose.json"
    kept.write_text("of an earlier bring-up")
    assert of_localiser(start=(1.0, 2.0, 0.5))["pose_file"] == str(kept) and not kept.exists()
    kept.write_text("of the localiser that died")
    monkeypatch.setenv(STARTED_AGAIN, "1")
    of_localiser(start=(1.0, 2.0, 0.5))
    assert kept.exists()


@pytest.mark.ros
@pytest.mark.parametrize(
    ("own", "clearance"), [("", 0.2), ("approach_user: {start_clearance: 0.3}\n", 0.3)], ids=["", "its own"]
)
def test_the_approach_is_told_where_navigation_fits(tmp_path, own, clearance):
    pytest.importorskip("rclpy")
    file = tmp_path / "robot.yaml"
    file.write_text("navigate: {footprint_padding: 0.03, start_clearance: 0.2, max_vel_x: 0.3}\n" + own)
    made = factories("people", BringUp(folder=str(tmp_path), config_file=str(file)))
    (approach,) = (part for part in made if part.func.__name__ == "ApproachNode")
    given = approach.keywords["parameters"]
    assert (given["footprint_padding"], given["start_clearance"]) == (0.03, clearance)
    assert "max_vel_x" not in given, "not a parameter of its own"


@pytest.mark.ros
@pytest.mark.parametrize(("nav", "without"), [("own", ()), ("nav2", NOT_OF_NAV2)])
@pytest.mark.parametrize("again", [False, True])
def test_a_mission_server_that_is_started_again_recovers_runs_of_any_age(
    tmp_path, monkeypatch, nav, without, again
):
    pytest.importorskip("rclpy")
    import florence_bt.runtime.node as module

    made = {}

    class Server:
        parameter_classes = ()

        def __init__(self, skills, declarations, **rest):
            made.update(rest, without=skills.keywords["without"], declared=set(declarations))

        def on_close(self, callback):
            callback()

    monkeypatch.setattr(module, "MissionNode", Server)
    if again:
        monkeypatch.setenv(STARTED_AGAIN, "1")
    else:
        monkeypatch.delenv(STARTED_AGAIN, raising=False)
    *_, make = factories("missions", BringUp(folder=str(tmp_path), nav=nav, mission_folders=("mine",)))
    make()
    parameters = made["parameters"]
    assert parameters.get("recovery_limit") == (math.inf if again else None)
    assert parameters["runs_folder"] == str(tmp_path / "runs")
    assert list(parameters["mission_folders"]) == ["mine"]
    assert made["without"] == without and "navigate_to" in made["declared"]


@pytest.mark.ros
def test_a_robot_that_is_not_ours_does_not_get_the_hotspots_of_the_flat(tmp_path):
    pytest.importorskip("rclpy")
    alone = BringUp(folder=str(tmp_path), simulated=False, base="running", nav="nav2", missions_only=True)
    check_options(alone)
    locator = factories("missions", alone)[0]
    assert len(load_hotspots(locator.keywords["parameters"]["hotspots_file"])) == 0
    flat = factories("people", BringUp(folder=str(tmp_path)))[1]
    assert len(load_hotspots(flat.keywords["parameters"]["hotspots_file"])) > 5


@pytest.mark.ros
@pytest.mark.parametrize(("speech", "nodes"), [(None, 2), ("cat", 2), ("none", 1)])
def test_the_robots_voice_is_left_out_where_another_node_speaks(tmp_path, speech, nodes):
    pytest.importorskip("rclpy")
    options = BringUp(folder=str(tmp_path), speech=speech)
    made = factories("missions", options)
    assert len(made) == nodes
    if speech == "cat":
        assert made[0].keywords["parameters"]["program"] == "cat"


def test_nobody_waits_for_the_servers_of_others(tmp_path):
    def own(**options):
        return {each.name for each in own_bindings(BringUp(folder=str(tmp_path), **options))}

    everything = own()
    assert {"navigate_to_pose", "florenceLocator/getRooms", "battery_state"} <= everything
    with_nav2 = own(nav="nav2")
    assert "spin" not in with_nav2 and {"battery_state", "florenceLocator/getRooms"} <= with_nav2
    beside = own(nav="nav2", base="running", simulated=False)
    assert "battery_state" not in beside and "florenceLocator/getRooms" in beside
    only = own(nav="nav2", base="running", simulated=False, missions_only=True)
    assert only and all(name.startswith("florenceLocator/") for name in only)


def test_split_gives_each_node_a_process_in_the_same_order(tmp_path):
    options = BringUp(folder=str(tmp_path), split=True)
    split = processes(options)
    whole = processes(BringUp(folder=str(tmp_path)))
    assert list(split.values()) == [(node,) for nodes in whole.values() for node in nodes]
    assert list(whole) == [name for name in NODES if name != RECORDER] and "home_sensors" not in split
    assert process_of("velocity_filter", options) == "velocity_filter"
    assert set(ended_together(options)) == {*whole["navigation"], *whole["people"]}
    quiet = BringUp(folder=str(tmp_path), split=True, speech="none", simulated=False)
    assert not {"speech", "simulator"} & set(processes(quiet))


@pytest.mark.ros
def test_every_process_of_a_split_bring_up_has_its_one_node(tmp_path):
    pytest.importorskip("rclpy")
    options = BringUp(folder=str(tmp_path), split=True)
    for process in processes(options):
        assert len(factories(process, options)) == 1, process


RECORDED = {"record": True}, {"foxglove_port": 8765}, {"record": True, "split": True, "missions_only": True}


@pytest.mark.parametrize("asked", RECORDED)
def test_a_recorder_is_there_from_the_first_message_to_the_last_and_nothing_depends_on_it(tmp_path, asked):
    alone = {"nav": "nav2", "base": "running", "simulated": False} if "missions_only" in asked else {}
    options = BringUp(folder=str(tmp_path), **asked, **alone)
    assert next(iter(processes(options))) == "recorder" and observers(options) == {"recorder"}
    without = BringUp(folder=str(tmp_path))
    assert "recorder" not in processes(without) and observers(without) == set()


def test_the_page_is_there_when_it_is_asked_for_and_nothing_depends_on_it(tmp_path):
    options = BringUp(folder=str(tmp_path), page_port=8080)
    assert list(processes(options))[-1] == "page" and observers(options) == {"page"}
    assert "page" not in processes(BringUp(folder=str(tmp_path)))


@pytest.mark.ros
def test_the_page_is_served_where_the_bring_up_says_and_shows_its_runs(tmp_path):
    pytest.importorskip("nicegui")
    options = BringUp(folder=str(tmp_path), page_port=8123, page_host="::1")
    (made,) = factories("page", options)
    given = made.keywords["parameters"]
    assert (given["host"], given["port"], given["runs_folder"]) == ("::1", 8123, str(tmp_path / "runs"))


@pytest.mark.ros
def test_the_configuration_says_where_recordings_go_when_something_is_recorded(tmp_path):
    pytest.importorskip("foxglove")
    file = tmp_path / "robot.yaml"
    file.write_text("recorder: {folder: /disk, max_age: 3}\n")

    def of_recorder(**options):
        (made,) = factories("recorder", BringUp(folder=str(tmp_path), **options))
        return made.keywords["parameters"]

    usual = of_recorder(record=True)
    assert usual["folder"] == str(tmp_path / "recordings") and usual["clock_wait"] > 60.0
    assert "clock_wait" not in of_recorder(record=True, simulated=False), "there is no clock to wait for"
    given = of_recorder(record=True, config_file=str(file))
    assert (given["folder"], given["max_age"]) == ("/disk", 3)
    shown = of_recorder(foxglove_port=8765, config_file=str(file))
    assert (shown["folder"], shown["foxglove_port"]) == ("", 8765)


def test_what_starts_again_when_a_process_dies(tmp_path):
    def of(process, **options):
        return companions(process, BringUp(folder=str(tmp_path), **options))

    for process in ("navigation", "people", "missions"):
        assert of(process) == []
    assert of("hardware") == ["navigation"]
    assert of("simulator") is None
    assert of("hardware", nav="nav2") is None, "Nav2 cannot be told that the odometry begins anew"
    assert of("turtlebot_node", split=True) == ["localiser"]
    assert of("velocity_filter", split=True) == []
