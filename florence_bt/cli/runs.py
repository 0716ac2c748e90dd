"""Verbs about runs: run, status, stop, pause, breakpoints, override, answer, reload, runs, report."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, RosVerb, app, key_values, tell
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE


class PolicyChoice(StrEnum):
    """The policies for when another mission is running."""

    reject = "reject"
    queue = "queue"
    preempt = "preempt"


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog=f"Example: florence run goto_room room=kitchen\n\n{EXIT_CODES}",
)
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
    whole: Annotated[
        bool, typer.Option("--all", help="In the final tree also the nodes that were not reached.")
    ] = False,
) -> None:
    """Trigger a mission on the running system and watch it to its end.

    Ctrl-C stops the mission (exit code 130); q leaves it running (exit code 0).
    """
    from rich.console import Console

    from florence_bt.app.runs.remote import run_mission

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
            whole=whole,
        )
        else FAILED
    )


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog="Examples: florence status --watch; florence status --all; "
    f"florence status --folder runs/up/runs --events\n\n{EXIT_CODES}",
)
def status(
    run_id: Annotated[
        str, typer.Option("--run", help="A run's id.", show_default="the current or last run")
    ] = "",
    watch: Annotated[
        bool,
        typer.Option("--watch", help="Keep showing until q or Ctrl-C; the screen says which keys there are."),
    ] = False,
    whole: Annotated[
        bool, typer.Option("--all", help="With all nodes of called missions, which are folded otherwise.")
    ] = False,
    folder: Annotated[
        Path | None,
        typer.Option(help="Read the journal of this folder of runs instead; needs no running system."),
    ] = None,
    events: Annotated[
        bool, typer.Option("--events", help="From the journal, with each event and its time.")
    ] = False,
) -> None:
    """Show the tree of the current or last run as ASCII text, with reasons."""
    if folder is not None or events:
        from florence_bt.app.runs.journal_view import run_text

        typer.echo(run_text(folder, run_id, events=events))
        raise typer.Exit(OK)
    from rich.console import Console

    from florence_bt.app.runs.remote import show_status

    raise typer.Exit(OK if show_status(run_id, Console(), watch=watch, whole=whole) else FAILED)


@app.command(cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence stop\n\n{EXIT_CODES}")
def stop(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
    reason: Annotated[str, typer.Option(help="Why, for the status and the journal.")] = "",
) -> None:
    """Stop the running mission; the robot stands still."""
    from florence_bt.app.runs.remote import stop_mission

    _end_with(*stop_mission(run_id, reason))


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog=f"Example: florence pause --reason 'a visitor'\n\n{EXIT_CODES}",
)
def pause(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
    reason: Annotated[str, typer.Option(help="Why, for the status and the journal.")] = "",
) -> None:
    """Pause the running mission: the robot stands still, and no time passes for the mission."""
    from florence_bt.app.runs.remote import pause_mission

    _end_with(*pause_mission(run_id, reason))


@app.command(cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence resume\n\n{EXIT_CODES}")
def resume(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
) -> None:
    """Go on with a paused mission; the skills that were stopped are started again."""
    from florence_bt.app.runs.remote import resume_mission

    _end_with(*resume_mission(run_id))


@app.command(
    "break",
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog="Examples: florence break navigate_to; florence break approach_user/turn; "
    f"florence break --clear\n\n{EXIT_CODES}",
)
def break_before(
    nodes: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NODE]...",
            help="The name of a node, a skill or a called mission; names of nodes above before slashes.",
        ),
    ] = None,
    remove: Annotated[
        list[str] | None, typer.Option("--remove", metavar="NODE", help="Take this breakpoint away.")
    ] = None,
    clear: Annotated[bool, typer.Option("--clear", help="Take all breakpoints away.")] = False,
) -> None:
    """Pause every run before a node starts: the robot stands, and no time passes; without a node, list them.

    `florence continue` lets it go on, `florence step` to the next leaf. A stop works as always.
    """
    from florence_bt.app.runs.remote import set_breakpoints

    _end_with(*set_breakpoints(nodes or (), remove or (), clear=clear))


@app.command(cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence step\n\n{EXIT_CODES}")
def step(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
) -> None:
    """Let the mission go on to the start of its next leaf, and pause it there."""
    from florence_bt.app.runs.remote import step_mission

    _end_with(*step_mission(run_id))


@app.command(
    "continue", cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence continue\n\n{EXIT_CODES}"
)
def continue_run(
    run_id: Annotated[str, typer.Option("--run", help="A run's id.", show_default="the current run")] = "",
) -> None:
    """Go on from a breakpoint; the same as `florence resume`."""
    resume(run_id)


@app.command(cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence override\n\n{EXIT_CODES}")
def override() -> None:
    """Stop the base at once and let nothing but `manual_cmd_vel` drive it until `florence release`."""
    from florence_bt.app.runs.switch_override import stop_the_robot

    tell(stop_the_robot("florence override").word)


@app.command(cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence release\n\n{EXIT_CODES}")
def release() -> None:
    """End the manual override: missions may start again. What it stopped stays stopped."""
    from florence_bt.app.runs.switch_override import release_the_robot

    tell(release_the_robot("florence release"))


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog=f"Examples: florence answer; florence answer yes\n\n{EXIT_CODES}",
)
def answer(
    words: Annotated[
        list[str] | None, typer.Argument(metavar="[TEXT]...", help="What to answer, e.g. yes.")
    ] = None,
) -> None:
    """Answer the question that a mission waits with; without a text, show which question is open."""
    from florence_bt.app.runs.remote import answer_question

    _end_with(*answer_question(" ".join(words or [])))


@app.command(cls=RosVerb, rich_help_panel="Runs", epilog=f"Example: florence reload\n\n{EXIT_CODES}")
def reload() -> None:
    """Load edited missions, hotspots and zones; a file with an error keeps its old version, and says so."""
    from florence_bt.app.runs.remote import reload_files

    _end_with(*reload_files())


def _end_with(success: bool, message: str) -> None:
    tell(message)
    raise typer.Exit(OK if success else FAILED)


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog=f"Example: florence runs --mission goto_user --state failed\n\n{EXIT_CODES}",
)
def runs(
    mission: Annotated[str, typer.Option(help="Only runs of this mission.", show_default="all")] = "",
    state: Annotated[
        str, typer.Option(help="Only runs in this state, e.g. succeeded or failed.", show_default="all")
    ] = "",
    limit: Annotated[int, typer.Option(help="Show at most this many, the latest first.")] = 20,
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the runs.", show_default="the running system's, or the one used last below ./runs"
        ),
    ] = None,
) -> None:
    """List recorded runs, the latest first: of the running system, or of the last one when none is up."""
    from florence_bt.app.runs.journal_view import runs_table
    from florence_bt.app.wrapping import terminal_columns

    columns = terminal_columns()
    for line in runs_table(folder, mission=mission, state=state, limit=limit, columns=columns):
        typer.echo(line)


@app.command(
    rich_help_panel="Runs",
    epilog=f"Example: florence report --folder runs/up/runs --out run.html\n\n{EXIT_CODES}",
)
def report(
    run: Annotated[str, typer.Argument(help="A run's id.", show_default="the latest run")] = "",
    folder: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the runs.", show_default="the running system's, or the one used last below ./runs"
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FILE, help="The file.", show_default="report.html in the folder of the run"
        ),
    ] = None,
) -> None:
    """Write one HTML file of a recorded run, to be sent to somebody: map, tree, reasons, times."""
    from florence_bt.app.runs.report import write_report

    typer.echo(write_report(folder, run, out))
