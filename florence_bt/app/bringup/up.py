"""``florence up``: the whole system until Ctrl-C."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from rich.console import Console

from florence_bt.app.bringup.fork_server import ForkServer
from florence_bt.app.bringup.missing_servers import MissingServers
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.package_processes import wanted_processes
from florence_bt.app.bringup.rehearsal import RehearsalPace
from florence_bt.app.bringup.system import System
from florence_bt.app.bringup.topology import recorder_parameters
from florence_bt.app.runs.client import MissionClient
from florence_bt.app.runs.journal_view import left_runs, outcomes_of
from florence_bt.core.errors import DeviceTimeout
from florence_bt.ros.environment import reach_of
from florence_bt.ros.late_nodes import LateNodes

FOREVER_S = float("inf")


def _findings(client: MissionClient) -> list[str]:
    """Return what is wrong with missions and skills of the running system, a line each."""
    try:
        return list(client.missions().findings)
    except DeviceTimeout as error:
        return [f"whether missions or skills are missing is not known: {error}"]


def _told_of_recorder(parameters: Mapping[str, Any]) -> str:
    """Return where what is published goes, for people."""
    folder, port = parameters["folder"], parameters.get("foxglove_port")
    ways = [
        *([f"recorded into {folder}"] if folder else []),
        *([f"shown to Foxglove at ws://localhost:{port}"] if port else []),
    ]
    return f"what is published is {' and '.join(ways)}"


def run_up(options: BringUp, fork_server: ForkServer) -> None:
    """Bring the system up, say how to use it, and keep it running.

    Args:
        options: What to bring up.
        fork_server: Starts its processes.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed, or SIGTERM came (``signals``); by then everything is down.
        FlorenceError: It did not come up, or a process died that cannot be started again; by then the rest is
            down too.
    """
    console = Console()

    def say(line: str) -> None:
        console.print(line, highlight=False, markup=False, soft_wrap=True)

    left = left_runs(options.runs)
    with System(options, say, fork_server) as system:
        reach = reach_of(os.environ)
        if not reach.this_machine:
            say(f"open to {reach.text}")
        seconds = system.wait_ready()
        for finding in _findings(system.client):
            say(finding)
        say(f"ready after {seconds:.1f} s; logs in {options.folder}/logs, runs in {options.runs}")
        if options.has_recorder:
            say(_told_of_recorder(recorder_parameters(options)))
        for each in wanted_processes(options):
            say(each.told(options))
        for line in outcomes_of(options.runs, left):
            say(line)
        if not options.missions_only and not system.client.knows_pose():
            say("the robot does not know where it is; publish its pose on initialpose, e.g. with RViz")
        mission = "MISSION" if options.missions_only else "goto_user"
        which = f" (with --namespace {options.namespace})" if options.namespace else ""
        verbs = f"florence run {mission}, florence status, florence stop"
        say(f"in another terminal{which}: {verbs}; Ctrl-C ends all")
        system.client.follow_speech(lambda text: say(f"the robot says: {text}"))
        MissingServers(system.client.robot, say)
        LateNodes(system.client.node, say)
        pace = RehearsalPace()
        if options.emulated:
            system.client.follow_truth()

        def watch() -> None:
            system.keep_up()
            too_slow = pace.look(system.client.truth) if options.emulated else ""
            if too_slow:
                say(too_slow)

        system.client.spin_until(lambda: False, FOREVER_S, watch=watch)
