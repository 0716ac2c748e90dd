"""Verbs that talk to a running system: ``run``, ``status``, ``stop``."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, FAILED, OK, app, errors_to_exit_codes, key_values


class PolicyChoice(StrEnum):
    """What to do when another mission is running."""

    reject = "reject"
    queue = "queue"
    preempt = "preempt"


@app.command(epilog=f"Example: florence run goto_room room=kitchen\n\n{EXIT_CODES}")
def run(
    mission: Annotated[str, typer.Argument(help="Name of the mission.")],
    inputs: Annotated[
        list[str] | None, typer.Argument(metavar="KEY=VALUE...", help="Inputs of the mission.")
    ] = None,
    policy: Annotated[
        PolicyChoice, typer.Option(help="When another mission is running.")
    ] = PolicyChoice.reject,
    priority: Annotated[int, typer.Option(help="Higher goes before lower.")] = 0,
    headless: Annotated[bool, typer.Option(help="Plain log lines instead of the live tree.")] = False,
    detach: Annotated[bool, typer.Option(help="Return once the mission is accepted.")] = False,
) -> None:
    """Trigger a mission on the running system and watch it to its end."""
    with errors_to_exit_codes():
        from rich.console import Console

        from florence_bt.wiring.remote import run_mission

        raise typer.Exit(
            OK
            if run_mission(
                mission,
                key_values(inputs or []),
                policy=policy.value,
                priority=priority,
                console=Console(),
                headless=headless,
                detach=detach,
            )
            else FAILED
        )


@app.command(epilog=f"Example: florence status --watch\n\n{EXIT_CODES}")
def status(
    run_id: Annotated[
        str, typer.Option("--run", help="A run's id.", show_default="the current or last run")
    ] = "",
    watch: Annotated[bool, typer.Option("--watch", help="Keep showing until Ctrl-C.")] = False,
) -> None:
    """Show the tree of the current or last run as ASCII text, with reasons."""
    with errors_to_exit_codes():
        from rich.console import Console

        from florence_bt.wiring.remote import show_status

        raise typer.Exit(OK if show_status(run_id, Console(), watch=watch) else FAILED)


@app.command(epilog=f"Example: florence stop\n\n{EXIT_CODES}")
def stop(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
) -> None:
    """Stop the running mission; the robot stands still."""
    with errors_to_exit_codes():
        from florence_bt.wiring.remote import stop_mission

        success, message = stop_mission(run_id)
        typer.echo(message)
        raise typer.Exit(OK if success else FAILED)
