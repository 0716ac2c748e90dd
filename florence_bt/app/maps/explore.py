"""``florence map explore`` and ``florence map build`` on a running system."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from rich.console import Console

from florence_bt.app.bringup.signals import held_back
from florence_bt.app.maps.watching import MapFiles, MapWatch
from florence_bt.app.runs.client import MissionClient, RunWatch
from florence_bt.app.runs.run_trees import run_tree_from_ros
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.skills.navigation.navigate.results import OUT_OF_REACH

if TYPE_CHECKING:
    from florence_bt.app.bringup.options import BringUp

MISSION = "explore"
_STOP_BUDGET_S = 20.0
"""Seconds in which a run that is stopped ends. Chosen."""


def build_by_hand(files: MapFiles, console: Console) -> None:
    """Show the map that the running system makes until Ctrl-C; then write it.

    Raises:
        DeviceTimeout: No system makes a map.
        ConfigError: It cannot be written.
    """
    with MissionClient("florence_map") as client:
        watch = MapWatch(client, console)
        watch.wait()
        console.out("drive the robot through every room (florence teleop); Ctrl-C writes the map")
        try:
            watch.show_until(lambda: False)
        except KeyboardInterrupt:
            with held_back():
                watch.write(files)


def explore_home(files: MapFiles, console: Console, system: BringUp | None = None) -> bool:
    """Let the robot explore, and write the map.

    Args:
        files: Where to.
        console: For the progress.
        system: The system to bring up for it; None for the one that runs.

    Returns:
        Whether it has seen all that it can get to, and is back.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed; what is known by then was written.
        DeviceTimeout: No system makes a map.
        ConfigError: The map cannot be written.
    """
    with ExitStack() as stack:
        if system is None:
            client, check = stack.enter_context(MissionClient("florence_map")), lambda: None
        else:
            client, check = _bring_up(stack, system, console)
        watch = MapWatch(client, console)
        watch.wait()
        with held_back():
            answer = client.run(MISSION, {}, caller="florence map explore")
        console.out(answer.message)
        if not answer.accepted:
            return False
        run = RunWatch(client, answer.run_id)
        try:
            watch.show_until(run.over, check)
        except KeyboardInterrupt:
            with held_back():
                client.stop("Ctrl-C at florence map explore", answer.run_id)
                client.spin_until(run.over, _STOP_BUDGET_S)
                watch.write(files)
            raise
        end = run.result()
        watch.write(files)
        succeeded = bool(end.state == "SUCCEEDED")
        if succeeded:
            console.out(end_sentence(run_tree_from_ros(end.run_tree)))
        else:
            console.out(f"the robot has not seen everything: {end.reason or end.state}")
            console.out("florence map explore goes on where it ended, while the system is up")
        return succeeded


def end_sentence(end: RunTree) -> str:
    """Tell how an exploration ended: whether the map is whole, how many looks it took, where the robot is.

    Args:
        end: The run of the mission after its end; the outputs of a mission of one's own, which may be others,
            are told as they are.
    """
    outputs = end.outputs
    if not outputs.keys() >= {"complete", "looks", "left_aside", "returned"}:
        return f"outputs {end.outputs_line}" if outputs else "the robot is done"
    where = next(filter(None, (re.search(f"{OUT_OF_REACH}: (.*)", node.says) for node in end.nodes)), None)
    open_at = f"at {where[1]}" if where else "where the robot got no further"
    whole = outputs["complete"] == "true"
    looks, aside = int(outputs["looks"]), int(outputs["left_aside"])
    missed = f" ({aside} of the places it did not get to)" if aside else ""
    return (
        ("the map is complete" if whole else f"the map stays open, {open_at}: a room may be missing")
        + f"; {looks} look{'s' * (looks != 1)}{missed}; the robot "
        + ("is back where it began" if outputs["returned"] == "true" else "is not quite where it began")
    )


def _bring_up(
    stack: ExitStack, options: BringUp, console: Console
) -> tuple[MissionClient, Callable[[], None]]:
    from florence_bt.app.bringup.system import System

    system = stack.enter_context(System(options, console.out))
    console.out(f"ready after {system.wait_ready():.1f} s")
    return system.client, system.keep_up
