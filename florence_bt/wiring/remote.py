"""``florence run``, ``status`` and ``stop``: the command line on a running system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console

from florence_bt.wiring.client import MissionClient
from florence_bt.wiring.live import make_display, styled
from florence_bt.wiring.run_watch import RunWatch
from florence_bt.wiring.signals import held_back

FOREVER_S = float("inf")
STOP_BUDGET_S = 20.0
"""Wall seconds to wait for the end of a run that was stopped; skills may take some to end."""


def run_mission(
    mission: str,
    inputs: Mapping[str, str],
    *,
    policy: str,
    priority: int,
    console: Console,
    headless: bool,
    detach: bool,
) -> bool:
    """Trigger a mission and watch it; Ctrl-C stops the mission.

    Returns:
        Whether it succeeded, or was accepted when detached.
    """
    with MissionClient() as client:
        answer: Any = None
        try:
            # A Ctrl-C between the question and the answer would leave a mission that nobody stops.
            with held_back():
                answer = client.run(mission, inputs, caller="florence run", policy=policy, priority=priority)
            console.print(answer.message, highlight=False, markup=False, soft_wrap=True)
            if not answer.accepted or detach:
                return bool(answer.accepted)
            status = _watch(client, answer.run_id, console, headless=headless)
        except KeyboardInterrupt:
            if answer is not None and answer.accepted and not detach:
                client.stop("Ctrl-C at florence run", answer.run_id)
                client.spin_until(RunWatch(client, answer.run_id).over, STOP_BUDGET_S)
            raise
        console.print(styled(status.tree), soft_wrap=True)
        return bool(status.state == "SUCCEEDED")


def _watch(client: MissionClient, run_id: str, console: Console, *, headless: bool) -> Any:
    """Show a run until it is over; gives its status."""
    display = make_display(console, headless=headless)
    try:
        watch = RunWatch(client, run_id)
        client.spin_until(watch.over, FOREVER_S, watch=lambda: display.show(client.tree))
    finally:
        display.close()
    return watch.result()


def show_status(run_id: str, console: Console, *, watch: bool) -> bool:
    """Print the status of a run, once or until Ctrl-C. False when no such run is known."""
    with MissionClient() as client:
        status = client.status(run_id)
        if not watch:
            console.print(styled(status.tree), soft_wrap=True)
            return bool(status.found or not run_id)
        display = make_display(console, headless=False)
        try:
            client.tree = status.tree
            server = RunWatch(client)
            client.spin_until(server.over, FOREVER_S, watch=lambda: display.show(client.tree))
        finally:
            display.close()
    return True


def stop_mission(run_id: str) -> tuple[bool, str]:
    """Stop a run, or the current one: (whether there was one, a message)."""
    with MissionClient() as client:
        answer = client.stop("florence stop", run_id)
        return bool(answer.success), str(answer.message)
