"""Checks before any process starts, so that a typing mistake costs no time and moves nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from florence_bt.app.bringup.config import config_of
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.package_processes import package_processes, wanted_processes
from florence_bt.app.bringup.simulated import flat_of, people_at_home
from florence_bt.app.bringup.topology import recorder_parameters, refuse_wrong_parameters
from florence_bt.core.errors import ConfigError
from florence_bt.core.installation import how_to_get
from florence_bt.core.paths import find_data
from florence_bt.ros.arguments import parameters_in
from florence_bt.skills.home_sensors.mqtt import require_paho
from florence_bt.skills.home_sensors.settings import load_home
from florence_bt.skills.locator.hotspots import Hotspots, load_hotspots, parse_hotspots
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.speech.voice import command_of
from florence_bt.trees.language.loader import MissionLibrary


def check_options(options: BringUp, warn: Callable[[str], None] = lambda sentence: None) -> None:
    """Read every file that the bring-up will read.

    Args:
        options: The bring-up.
        warn: Told what is probably wrong with the map.

    Raises:
        ConfigError: The configuration, the map, the hotspots or the person's room is wrong; with file, line
            and what would have worked. So for the file of a simulated home.
    """
    if options.config_file is not None or any(parameters_in(options.ros_arguments)):
        # That of the package is right (tested); the check takes a second or two.
        refuse_wrong_parameters(config_of(options))
    map_file = options.map_file or find_data("maps", "flat.yaml")
    load_map(map_file, lambda sentence: warn(f"{map_file}: warning: {sentence}"))
    MissionLibrary.load([Path(folder) for folder in options.mission_folders])
    if options.own_world and not options.mapping and not options.hotspots_file:
        from florence_bt.simulation.home.build_map import hotspots_yaml

        hotspots = parse_hotspots(hotspots_yaml(flat_of(options)))
    elif options.has_no_places and not options.hotspots_file:
        hotspots = Hotspots()
    else:
        hotspots = load_hotspots(options.hotspots_file or find_data("hotspots", "flat.yaml"))
    if options.home_file is not None:
        home = load_home(options.home_file, hotspots)
        if home.mqtt is not None:
            require_paho()
            home.mqtt.password()
    if options.speech is not None:
        command_of(options.speech)
    if options.has_recorder:
        from florence_bt.app.recording.node import check_recorder

        check_recorder(recorder_parameters(options))
    if options.page_port and "page" not in {each.name for each in package_processes()}:
        raise ConfigError("the page is not installed", valid=[how_to_get("florence_page")])
    for each in wanted_processes(options):
        each.check(options)
    if options.mapping:
        from florence_bt.skills.navigation.mapping.drive import load_drive
        from florence_bt.skills.navigation.mapping.pose_graph import import_gtsam

        import_gtsam()
        if options.resumed_drive is not None:
            load_drive(Path(options.resumed_drive))
    if options.in_flat:
        people_at_home(options)
