"""Verbs about packages of ROS interfaces: ``interfaces`` lists them, ``show`` and ``add``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, VerbList, Verbs, app, tell
from florence_bt.cli.output_paths import OUTPUT_FOLDER

interfaces = VerbList(cls=Verbs, help="Packages of ROS messages, services and actions: list, show, add.")
app.add_typer(interfaces, name="interfaces", rich_help_panel="Mission files")


@interfaces.callback(invoke_without_command=True, epilog=f"Example: florence interfaces\n\n{EXIT_CODES}")
def list_all(context: typer.Context) -> None:
    """List the packages of ROS interfaces that are installed: how many types each has, and where it is from.

    A ROS 2 that is sourced in this shell comes before the environment of florence.
    """
    if context.invoked_subcommand is None:
        from florence_bt.app.interfaces.installed import list_packages

        tell(list_packages())


@interfaces.command(epilog=f"Example: florence interfaces show nav2_msgs/action/Spin\n\n{EXIT_CODES}")
def show(
    name: Annotated[
        str, typer.Argument(metavar="TYPE", help="A type, such as std_srvs/srv/SetBool, or a package.")
    ],
) -> None:
    """Print the fields and constants of a type, with those of its fields; or the types of a package."""
    from florence_bt.app.interfaces.installed import show as text_of

    typer.echo(text_of(name))


@interfaces.command(epilog=f"Example: florence interfaces add gripper_interfaces/\n\n{EXIT_CODES}")
def add(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FOLDER|PACKAGE",
            help="A folder with msg, srv or action in it; or a package that comes with Florence: nav2_msgs, "
            "geographic_msgs.",
        ),
    ],
    replace: Annotated[
        bool, typer.Option("--replace", help="Take the place of a package of the same name from elsewhere.")
    ] = False,
    prefix: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FOLDER,
            metavar="FOLDER",
            help="Install there.",
            show_default="the environment of florence",
        ),
    ] = None,
) -> None:
    """Build a package of messages, services and actions for florence.

    With a sourced ROS 2 its packages are used, and nothing is built.
    """
    from florence_bt.app.interfaces.adding import add_package

    add_package(
        source, replace=replace, prefix=prefix.resolve() if prefix is not None else None, say=typer.echo
    )
