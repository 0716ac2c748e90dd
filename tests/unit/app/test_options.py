from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.simulated import clear_ports, hardware_settings
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2


@pytest.mark.parametrize(
    "options",
    [
        {},
        {
            "person": "kitchen",
            "start": (1.0, 2.0, 0.5),
            "seed": 3,
            "speed": 2.0,
            "mission_folders": ("a", "b"),
        },
        {
            "simulated": False,
            "config_file": "robot.yaml",
            "map_file": "m",
            "hotspots_file": "h",
        },
    ],
)
def test_a_bring_up_travels_as_json(tmp_path, options):
    bring_up = BringUp(folder=str(tmp_path / "deep" / "folder"), **options)
    assert BringUp.read(bring_up.write()) == bring_up


@pytest.mark.parametrize("speed", [0.0, -1.0, 101.0, math.nan, math.inf])
def test_a_speed_that_no_machine_has_is_refused(speed):
    with pytest.raises(ConfigError, match="speed"):
        BringUp(folder="x", speed=speed)


def test_a_negative_seed_is_refused():
    with pytest.raises(ConfigError, match="seed"):
        BringUp(folder="x", seed=-1)


def test_what_is_derived_from_the_options():
    assert BringUp(folder="x").runs == Path("x/runs")
    assert BringUp(folder="x", start=(1.0, 2.0, 0.0)).start_pose == Pose2(1.0, 2.0, 0.0)
    assert BringUp(folder="x").start_pose is None


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"cannot be used.*--out"):
        BringUp(folder=str(tmp_path / "file" / "x")).write()
    (tmp_path / "options.json").mkdir()
    with pytest.raises(ConfigError, match="cannot be used"):
        BringUp(folder=str(tmp_path)).write()


def test_the_options_are_readable_for_people(tmp_path):
    text = BringUp(folder=str(tmp_path), seed=7).write().read_text()
    assert json.loads(text)["seed"] == 7 and "\n" in text


def test_the_ports_of_a_killed_bring_up_are_removed_and_nothing_else(tmp_path):
    options = BringUp(folder=str(tmp_path))
    settings = hardware_settings(options)
    settings.folder.mkdir()
    settings.base_port.symlink_to("/dev/pts/some-other-terminal")
    settings.laser_port.write_text("a file of somebody")
    (settings.folder / "notes").write_text("")
    clear_ports(options)
    assert sorted(path.name for path in settings.folder.iterdir()) == ["hokuyo", "notes"]
    clear_ports(options)
