"""Mistakes that are told before any process starts."""

from __future__ import annotations

import socket
from dataclasses import replace

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.preflight import check_options
from florence_bt.app.bringup.simulated import (
    LEADER_WAITS_S,
    flat_of,
    who_is_at_home,
    with_places,
    with_world_files,
)
from florence_bt.app.bringup.topology import NODES, factories, processes
from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.navigation.map_server.map_file import load_map


def write(tmp_path, name, text):
    file = tmp_path / name
    file.write_text(text)
    return str(file)


def refused(match, tmp_path, **options):
    with pytest.raises(ConfigError, match=match) as error:
        check_options(BringUp(folder=str(tmp_path / "out"), **options))
    assert not (tmp_path / "out").exists()
    return str(error.value)


def test_a_sensor_in_a_room_that_does_not_exist_is_told_with_its_place(tmp_path):
    file = write(tmp_path, "home.yaml", "sensors:\n  pir: {room: kichen}\n")
    assert f"{file}:2:15: " in refused("would have worked: kitchen", tmp_path, home_file=file)


def test_a_password_that_is_not_set_is_told(tmp_path, monkeypatch):
    pytest.importorskip("paho.mqtt.client", reason="paho-mqtt is not here (extra home)")
    monkeypatch.delenv("NO_SUCH_PASSWORD", raising=False)
    text = "mqtt: {host: h, username: u, password_env: NO_SUCH_PASSWORD}\nsensors: {pir: {room: kitchen}}\n"
    refused("NO_SUCH_PASSWORD is not set", tmp_path, home_file=write(tmp_path, "home.yaml", text))


def test_a_recorder_that_could_not_start_is_told(tmp_path):
    pytest.importorskip("foxglove", reason="foxglove-sdk is not here (extra record)")
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        refused("another port", tmp_path, foxglove_port=server.getsockname()[1])
    config = write(tmp_path, "robot.yaml", f"recorder: {{folder: {write(tmp_path, 'file', '')}}}\n")
    refused("cannot be written to: File exists", tmp_path, record=True, config_file=config)


def test_the_home_sensors_are_started_when_their_file_is_given(tmp_path):
    pytest.importorskip("rclpy")
    home = str(find_data("config", "home.yaml"))
    without = factories("people", BringUp(folder=str(tmp_path)))
    given = factories("people", BringUp(folder=str(tmp_path), home_file=home))
    assert [node.func.__name__ for node in given[len(without) :]] == ["HomeSensorsNode"]


def test_the_files_of_the_package_are_right(tmp_path):
    for options in ({}, {"person": "kitchen"}, {"person": "absent"}, {"simulated": False}):
        check_options(BringUp(folder=str(tmp_path), **options))


def test_a_room_or_situation_that_does_not_exist_is_told(tmp_path):
    assert "would have worked: walking" in refused("'walkin'", tmp_path, person="walkin")


def test_who_is_at_home_is_a_situation_of_the_seed(tmp_path):
    flat = flat_of(BringUp(folder=str(tmp_path)))
    people, start = who_is_at_home(flat, "lying", 3)
    assert [each.posture for each in people] == ["lying"] and start == flat.start
    assert who_is_at_home(flat, "lying", 3) == (people, start) != who_is_at_home(flat, "lying", 4)
    assert len(who_is_at_home(flat, "company", 3)[0]) in (2, 3)


def test_somebody_leads_the_robot_that_faces_them(tmp_path):
    flat = flat_of(BringUp(folder=str(tmp_path)))
    (leader, visitor), start = who_is_at_home(flat, "leading", 3)
    assert leader.once and leader.wait == LEADER_WAITS_S and not visitor.once
    assert abs(start.bearing_to(leader.pose.x, leader.pose.y)) < 0.01
    assert 1.1 < start.distance_to(leader.pose) < 1.3


@pytest.mark.parametrize("line", ["resolution: fast", "origin: [1, 2", "resolution: -0.05"])
def test_a_broken_map_is_told_with_its_line(tmp_path, line):
    key = line.split(":")[0]
    text = find_data("maps", "flat.yaml").read_text().splitlines()
    place = next(number for number, old in enumerate(text, 1) if old.startswith(f"{key}:"))
    text[place - 1] = line
    file = write(tmp_path, "broken.yaml", "\n".join(text) + "\n")
    message = refused("broken", tmp_path, map_file=file)
    if "[" not in line:  # an open bracket is found out where it should have been closed
        assert f"{file}:{place}:" in message


def test_a_missing_map_is_told(tmp_path):
    refused("nowhere", tmp_path, map_file=str(tmp_path / "nowhere.yaml"))


def test_an_unknown_key_of_a_hotspot_is_told_with_line_and_likeness(tmp_path):
    file = write(
        tmp_path, "spots.yaml", "hotspots:\n- {label: desk, x: 1, y: 2}\n- {lable: bed, x: 1, y: 2}\n"
    )
    assert f"{file}:3:4" in refused("'lable'.*label", tmp_path, hotspots_file=file)


def test_an_unknown_node_is_told_with_likeness(tmp_path):
    file = write(tmp_path, "robot.yaml", "navigat: {}\n")
    refused("unknown node 'navigat'.*navigate", tmp_path, config_file=file)


def test_an_unknown_room_is_told_with_likeness(tmp_path):
    refused("kitchen", tmp_path, person="kitchn")


def test_a_wrong_home_is_told_with_its_line(tmp_path):
    text = find_data("maps", "flat.source.yaml").read_text()
    wrong = text.replace("{room: bathroom, x: 7.4", "{room: bathrom, x: 7.4")
    file = write(tmp_path, "home.source.yaml", wrong)
    line = next(number for number, each in enumerate(wrong.splitlines(), 1) if "bathrom," in each)
    assert f"{file}:{line}:" in refused("unknown room 'bathrom'.*bathroom", tmp_path, world_file=file)
    refused("No such file", tmp_path, world_file=str(tmp_path / "none.yaml"))
    refused("--world FILE, --world-seed SEED", tmp_path, world_file=file, world_seed=3)


def test_a_home_of_ones_own_gets_its_map_and_hotspots(tmp_path):
    options = BringUp(folder=str(tmp_path), world_seed=3)
    check_options(options)
    ready = with_world_files(options)
    grid, spots = load_map(ready.map_file), load_hotspots(ready.hotspots_file)
    flat = flat_of(options)
    assert {room.label for room in spots.rooms()} == {room.name for room in flat.rooms}
    assert (grid.cells == laser_map(flat).cells).all()
    assert with_world_files(replace(options, map_file="own.yaml")).map_file == "own.yaml"
    assert with_world_files(BringUp(folder=str(tmp_path))).map_file is None


def test_start_and_room_of_the_user_are_settled_once_for_all_processes(tmp_path):
    simulated = BringUp(folder=str(tmp_path), person="kitchen", seed=4)
    ready, start = with_places(simulated), flat_of(simulated).start
    assert ready.start_pose == start and ready.user_room == "kitchen"
    assert BringUp.read(ready.write()) == ready
    assert with_places(replace(simulated, start=(1.0, 2.0, 0.5))).start == (1.0, 2.0, 0.5)
    assert with_places(replace(simulated, person="absent")).user_room == flat_of(simulated).rooms[0].name
    assert with_places(replace(simulated, mapping=True)).user_room is None
    robot = BringUp(folder=str(tmp_path), simulated=False)
    assert with_places(robot) == robot


def test_a_robot_has_no_simulated_home(tmp_path):
    with pytest.raises(ConfigError, match="--sim"):
        BringUp(folder=str(tmp_path), simulated=False, world_seed=3)
    assert BringUp(folder=str(tmp_path), simulated=False, emulated=True, world_seed=3).own_world


def test_a_folder_of_missions_that_is_not_there_is_told(tmp_path):
    refused("no folder of missions", tmp_path, mission_folders=(str(tmp_path / "none"),))


def test_a_folder_may_lie_deeper_than_the_path_of_a_socket(tmp_path):
    folder = tmp_path / ("x" * 120)
    check_options(BringUp(folder=str(folder)))
    assert not folder.exists()


def test_a_port_that_is_taken_is_told_before_anything_starts(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as server:
        refused("another port", tmp_path, page_port=server.getsockname()[1])


def test_a_page_for_others_needs_tokens(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    refused("florence page --token", tmp_path, page_port=8080, page_host="0.0.0.0")


def test_the_processes_of_a_bring_up():
    assert list(processes(BringUp(folder="x", record=True, page_port=8080))) == [*NODES, "page"]
    assert "simulator" not in processes(BringUp(folder="x", simulated=False))
    with pytest.raises(ConfigError, match=r"'navigatio'.*navigation"):
        factories("navigatio", BringUp(folder="x"))


def test_a_bring_up_that_makes_a_map_has_neither_a_map_nor_places(tmp_path):
    options = BringUp(folder=str(tmp_path), mapping=True, world_seed=31)
    check_options(options)
    assert options.hotspots.name == "places.yaml"
    nodes = [made.func.__name__ for made in factories("navigation", options)]
    assert nodes == ["MappingNode", "NavigationNode"]
    for wrong, valid in (
        ({"map_file": "maps/flat.yaml"}, "--mapping without --map"),
        ({"nav": "nav2"}, "--mapping without --nav nav2"),
    ):
        with pytest.raises(ConfigError, match=valid):
            BringUp(folder="x", mapping=True, **wrong)
    with pytest.raises(ConfigError, match=r"--mapping --continue"):
        BringUp(folder="x", resumed_drive="a.drive")
    with pytest.raises(ConfigError, match=r"a\.drive.*the drive cannot be read"):
        check_options(BringUp(folder=str(tmp_path), mapping=True, resumed_drive=str(tmp_path / "a.drive")))
