"""Verbs for tests of missions: ``test``. They need neither ROS nor a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli._common import EXIT_CODES, FolderOption, app, errors_to_exit_codes
from florence_bt.cli.exit_codes import FAILED, OK

_STYLES = {"good": "green", "bad": "red", "head": "bold", "": ""}


@app.command(
    rich_help_panel="Mission files", epilog=f"Example: florence test scenarios --coverage\n\n{EXIT_CODES}"
)
def test(
    files: Annotated[list[Path], typer.Argument(help="Scenario files, or folders of them.")],
    keyword: Annotated[
        str,
        typer.Option(
            "-k",
            help="Only scenarios with these words in file or name; 'and', 'or', 'not', (...) join them.",
        ),
    ] = "",
    folders: FolderOption = None,
    junit: Annotated[Path | None, typer.Option(help="Write the results as JUnit XML.")] = None,
    coverage: Annotated[
        bool, typer.Option("--coverage", help="Report which nodes and outcomes were seen.")
    ] = False,
    min_coverage: Annotated[
        float | None, typer.Option(min=0, max=100, help="Fail when less per cent of the outcomes were seen.")
    ] = None,
    named: Annotated[
        bool | None,
        typer.Option(
            "--verbose/--quiet",
            "-v/-q",
            help="Name each scenario, or only those that failed; otherwise each when there are few.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Test missions with scenarios: mocked skills, no robot, no waiting."""
    with errors_to_exit_codes():
        from rich.console import Console
        from rich.text import Text

        from florence_bt.app.mission_files.scenario_runs import TestOptions, run_scenarios

        console = Console(highlight=False, soft_wrap=True)
        options = TestOptions(files, folders or [], keyword, junit, coverage, min_coverage, named)
        passed = run_scenarios(options, lambda line, style: console.print(Text(line, _STYLES[style])))
        raise typer.Exit(OK if passed else FAILED)
