"""The commands that this package adds to ``florence``: import and export, which need no ROS, and groot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, RosVerb, VerbList
from florence_bt.cli.exit_codes import FAILED, OK
from florence_bt.cli.output_paths import OUTPUT_FILE, OUTPUT_FOLDER
from florence_bt.core.errors import ConfigError
from florence_bt.core.installation import in_checkout

if TYPE_CHECKING:
    from florence_btcpp.exchange import Exchanged

app = VerbList()

FormOption = Annotated[str, typer.Option("--format", help="Form of the report: text, json or github.")]
StrictOption = Annotated[
    bool, typer.Option("--strict", help="Write nothing, and exit with 1, when something is lost.")
]


@app.command(
    "import",
    rich_help_panel="Mission files",
    epilog=f"Example: florence import navigate.xml -o missions/\n\n{EXIT_CODES}",
)
def import_(
    file: Annotated[
        Path, typer.Argument(help="XML file of BehaviorTree.CPP, version 4 or 3, or a folder of them.")
    ],
    folder: Annotated[
        Path, typer.Option("-o", "--out", click_type=OUTPUT_FOLDER, help="Folder for the mission files.")
    ],
    models: Annotated[
        list[Path] | None,
        typer.Option("--model", help="Another XML file whose TreeNodesModel describes the nodes."),
    ] = None,
    strict: StrictOption = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files that are there.")] = False,
    form: FormOption = "text",
) -> None:
    """Convert trees of BehaviorTree.CPP to missions; what has no equivalent is reported with its line.

    Nodes that no skill here fits become skills that are declared but not implemented.
    """
    from florence_btcpp.exchange import import_file

    _print_exchange(import_file(file, folder, models or [], form, strict=strict, overwrite=overwrite), form)


@app.command(
    rich_help_panel="Mission files",
    epilog=f"Example: florence export goto_user -o goto_user.xml\n\n{EXIT_CODES}",
)
def export(
    mission: Annotated[str, typer.Argument(help="Name of a mission, or a mission file.")],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", click_type=OUTPUT_FILE, help="XML file; without it the XML is printed."),
    ] = None,
    folders: FolderOption = None,
    strict: StrictOption = False,
    form: FormOption = "text",
) -> None:
    """Write a mission, with those that it calls, as XML of BehaviorTree.CPP 4."""
    from florence_btcpp.exchange import export_file

    exported = export_file(mission, out, folders or [], form, strict=strict)
    _print_exchange(exported, form if out is not None else "text")


@app.command(
    cls=RosVerb,
    rich_help_panel="Runs",
    epilog=f"Example: florence groot --port 1667\n\n{EXIT_CODES}",
)
def groot(
    port: Annotated[int, typer.Option(min=1, max=65535, help="The TCP port, on this machine only.")] = 1667,
) -> None:
    """Show the running mission in Groot2, or another program with its monitor protocol, until Ctrl-C."""
    try:
        from florence_btcpp.groot.node import serve_groot
    except ModuleNotFoundError as error:
        if error.name not in ("zmq", "msgpack") or in_checkout():
            raise
        problem = f"this command needs {error.name!r}, which is not installed"
        raise ConfigError(problem, valid=["pip install 'florence-btcpp[groot]'"]) from error

    raise typer.Exit(serve_groot(port))


def _print_exchange(exchanged: Exchanged, form: str) -> None:
    """Print what was done and the report; the one for people stands apart from the one for programs."""
    if exchanged.report:
        typer.echo(exchanged.report, err=form == "text")
    if exchanged.done:
        typer.echo(exchanged.done, err=form != "text")
    raise typer.Exit(OK if exchanged.good else FAILED)
