"""Verbs for tests of missions: ``test``. They need neither ROS nor a robot."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, app
from florence_bt.cli.exit_codes import FAILED, INTERRUPTED, NOT_THERE, OK, USAGE
from florence_bt.cli.output_paths import OUTPUT_FILE
from florence_bt.core.errors import ConfigError

_CODES = {0: OK, 1: FAILED, 2: INTERRUPTED, 3: NOT_THERE, 4: USAGE, 5: USAGE}
"""The exit codes of pytest -> ours."""
_SETTINGS = ("--florence-test", "--tb=short", "--no-header", "--assert=plain", "--override-ini=python_files=")
_EPILOG = (
    "Example: florence test scenarios --coverage\n\n"
    "Further options, such as -x, -v or --durations, go to pytest.\n\n"
)


@app.command(
    rich_help_panel="Mission files",
    epilog=f"{_EPILOG}{EXIT_CODES}",
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
)
def test(
    files: Annotated[list[str], typer.Argument(help="Scenario files, folders of them, options of pytest.")],
    keyword: Annotated[str, typer.Option("-k", help="Only scenarios with these words, as in pytest.")] = "",
    folders: FolderOption = None,
    junit: Annotated[
        Path | None,
        typer.Option("--junit", "--junitxml", click_type=OUTPUT_FILE, help="Write the results as JUnit XML."),
    ] = None,
    coverage: Annotated[
        bool, typer.Option("--coverage", help="Report which nodes and outcomes were seen.")
    ] = False,
    min_coverage: Annotated[
        float | None, typer.Option(min=0, max=100, help="Fail when fewer outcomes were seen, in per cent.")
    ] = None,
) -> None:
    """Test missions with scenarios: mocked skills, no robot, no waiting. pytest runs them."""
    try:
        import pytest
    except ModuleNotFoundError as error:
        from florence_bt.core.installation import how_to_get

        raise ConfigError("florence test needs pytest", valid=[how_to_get("pytest")]) from error

    from florence_bt.app.mission_files.output import write_output

    arguments = [*files, *_SETTINGS, f"--config-file={os.devnull}", f"--rootdir={Path.cwd()}"]
    arguments += ["--disable-plugin-autoload", "-p", "florence_bt.mission_testing.plugin"]
    # The last one searches the memory for garbage five times at the end: half of what a short run takes.
    arguments += ["-p", "no:cacheprovider", "--noconftest", "-p", "no:unraisableexception"]
    arguments += ["-k", keyword] if keyword else []
    arguments += [f"--florence-missions={folder}" for folder in folders or []]
    arguments += ["--florence-coverage"] if coverage else []
    arguments += [f"--florence-min-coverage={min_coverage}"] if min_coverage is not None else []
    with tempfile.TemporaryDirectory(prefix="florence_test_") as folder:
        report = Path(folder) / "report.xml"  # pytest follows links, and leaves half a file on a full disk
        arguments += [f"--junitxml={report}"] if junit is not None else []
        code = _CODES.get(int(pytest.main(arguments)), FAILED)
        if junit is not None and report.is_file():
            write_output(junit, report.read_bytes(), make_folder=True, mark=b"<testsuite")
    raise typer.Exit(code)
