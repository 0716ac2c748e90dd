"""``florence demo``: the simulated flat, one mission from trigger to end, and what came out of it."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from florence_bt.app.bringup.fork_server import ForkServer
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.system import System
from florence_bt.app.demo.pictures import PICTURE
from florence_bt.app.runs.client import RunWatch
from florence_bt.app.runs.live import LiveDisplay, LogDisplay, make_display
from florence_bt.app.runs.run_trees import run_tree_from_ros
from florence_bt.app.runs.screen import KEYS_OF_DEMO, print_status
from florence_bt.app.runs.watching import RunFeed
from florence_bt.core.errors import DeviceTimeout
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.simulation.home.closeness import Closeness, closeness, closeness_text

MISSION = "goto_user"
MISSION_BUDGET_S = 600.0
"""Simulated seconds after which a demo is given up; the mission's own deadlines are shorter."""
PICTURE_BUDGET_S = 120.0
"""Wall seconds for the picture of the run."""
TRUTH_BUDGET_S = 10.0
"""Wall seconds to wait for the first message of the simulator."""


@dataclass(frozen=True, slots=True)
class DemoResult:
    """The end of a demo.

    Attributes:
        succeeded: Whether the mission succeeded.
        reason: Why not, empty after success.
        duration: Simulated seconds from trigger to end.
        tree: The run with its final tree.
        run_folder: Where the run's files are.
        closeness: How the robot really stands to the person, None when nobody is at home.
        contacts: What the robot touched, by name.
    """

    succeeded: bool
    reason: str
    duration: float
    tree: RunTree
    run_folder: Path
    closeness: Closeness | None
    contacts: tuple[str, ...]


def run_demo(options: BringUp, console: Console, fork_server: ForkServer, *, headless: bool) -> DemoResult:
    """Bring the simulated flat up, run the mission and take everything down again.

    Args:
        options: The bring-up; must be simulated.
        console: Where to print.
        fork_server: Starts its processes.
        headless: Plain log lines instead of the live tree.

    Raises:
        FlorenceError: The system did not come up, or a process died.
    """
    display = make_display(console, headless=headless, keys=KEYS_OF_DEMO)
    with closing(display), System(options, display.say, fork_server) as system:
        seconds = system.wait_ready()
        display.say(f"ready after {seconds:.1f} s; calling the mission service for {MISSION}")
        return _run_mission(system, display)


def _run_mission(system: System, display: LiveDisplay | LogDisplay) -> DemoResult:
    client = system.client
    client.follow_truth()
    if not client.spin_until(lambda: bool(client.truth), TRUTH_BUDGET_S, watch=system.check):
        raise DeviceTimeout("the simulator does not publish its truth; see its log")
    start = float(client.truth["time"])
    # A demonstration that was killed may have left a run that is recovered at this start.
    answer = client.run(MISSION, {}, caller="florence demo", policy="preempt")
    if not answer.accepted:
        raise DeviceTimeout(f"{MISSION} was refused: {answer.message}")

    feed = RunFeed(client, display, answer.run_id)

    def watch() -> None:
        system.check()
        feed.look()
        if display.left:
            raise KeyboardInterrupt

    wall_budget = MISSION_BUDGET_S / min(system.options.speed, 1.0)
    if not client.spin_until(RunWatch(client, answer.run_id).over, wall_budget, watch=watch):
        client.stop("the demo's time is over")
        raise DeviceTimeout(f"{MISSION} did not end within {MISSION_BUDGET_S:.0f} s; it was stopped")
    end = float(client.truth["time"])
    # The base coasts to a halt behind its filters; the truth is read when it stands.
    client.spin_until(lambda: float(client.truth["time"]) > end + 1.0, 10.0, watch=system.check)
    status = client.status(answer.run_id)
    folder = system.options.runs / answer.run_id
    client.spin_until((folder / PICTURE).is_file, PICTURE_BUDGET_S, watch=system.check)
    return DemoResult(
        succeeded=status.state == "SUCCEEDED",
        reason=status.reason,
        duration=end - start,
        tree=run_tree_from_ros(status.run_tree),
        run_folder=folder,
        closeness=_closeness(client.truth),
        contacts=tuple(contact["name"] for contact in client.truth["contacts"]),
    )


def _closeness(truth: Mapping[str, Any]) -> Closeness | None:
    people = list(truth["people"].values())
    return closeness(Pose2(*truth["robot"]), Pose2(*people[0])) if people else None


def print_result(result: DemoResult, console: Console, *, whole: bool = False) -> None:
    """Print how it ended, the verdict last; with ``whole`` also the nodes that were not reached."""
    console.print()
    print_status(result.tree, console, whole=whole)
    console.print()
    console.print(f"The run's folder: {result.run_folder}", soft_wrap=True, highlight=False)
    touched = (
        f"The robot touched: {', '.join(result.contacts)}."
        if result.contacts
        else "The robot touched nothing."
    )
    console.print(touched, highlight=False)
    if result.closeness is not None:
        console.print(f"The robot stands {closeness_text(result.closeness)}.", highlight=False)
    else:
        console.print("Nobody is at home.")
    word = "[green]succeeded[/]" if result.succeeded else "[red]failed[/]"
    console.print(f"The mission {word} after {result.duration:.0f} s.", highlight=False)
    if result.reason:
        console.print(f"Reason: {result.reason}", highlight=False, markup=False)
