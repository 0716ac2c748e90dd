"""``florence run``, ``status`` and ``stop``: the command line on a running system."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console

from florence_bt.wiring.client import ACTIVE_STATES, MissionClient
from florence_bt.wiring.live import make_display, styled

FOREVER_S = float("inf")


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
        answer = client.run(mission, inputs, caller="florence run", policy=policy, priority=priority)
        console.print(answer.message, highlight=False, markup=False, soft_wrap=True)
        if not answer.accepted or detach:
            return bool(answer.accepted)

        def over() -> bool:
            return client.state.run_id == answer.run_id and client.state.state not in ACTIVE_STATES

        display = make_display(console, headless=headless)
        try:
            client.spin_until(over, FOREVER_S, watch=lambda: display.show(client.tree))
        except KeyboardInterrupt:
            client.stop("Ctrl-C at florence run", answer.run_id)
            client.spin_until(over, 10.0)
            raise
        finally:
            display.close()
        status = client.status(answer.run_id)
        console.print(styled(status.tree), soft_wrap=True)
        return bool(status.state == "SUCCEEDED")


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
            client.spin_until(lambda: False, FOREVER_S, watch=lambda: display.show(client.tree))
        finally:
            display.close()
    return True


def stop_mission(run_id: str) -> tuple[bool, str]:
    """Stop a run, or the current one: (whether there was one, a message)."""
    with MissionClient() as client:
        answer = client.stop("florence stop", run_id)
        return bool(answer.success), str(answer.message)
