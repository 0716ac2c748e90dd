"""What the processes of a bring-up give their nodes."""

from __future__ import annotations

import math

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.supervisor import STARTED_AGAIN
from florence_bt.app.bringup.topology import factories
from florence_bt.skills.navigation.navigate.declaration import NOT_OF_NAV2

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
def test_only_a_real_robot_that_is_given_no_start_goes_on_where_it_was(tmp_path):
    pytest.importorskip("rclpy")

    def of_localiser(**options):
        made = factories("navigation", BringUp(folder=str(tmp_path), **options))
        (localiser,) = (part for part in made if part.func.__name__ == "LocaliserNode")
        return localiser.keywords["parameters"]

    assert of_localiser(simulated=False)["pose_file"] == str(tmp_path / "pose.json")
    given = of_localiser(simulated=False, start=(1.0, 2.0, 0.5))
    assert "pose_file" not in given
    assert given["initial_yaw"] == 0.5
    assert "pose_file" not in of_localiser()


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
    (make,) = factories("missions", BringUp(folder=str(tmp_path), nav=nav, mission_folders=("mine",)))
    make()
    parameters = made["parameters"]
    assert parameters.get("recovery_limit") == (math.inf if again else None)
    assert parameters["runs_folder"] == str(tmp_path / "runs")
    assert list(parameters["mission_folders"]) == ["mine"]
    assert made["without"] == without and "navigate_to" in made["declared"]
