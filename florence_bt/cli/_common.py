"""What every verb shares: the application, exit codes, errors, common options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from florence_bt.app.bringup.signals import as_keyboard_interrupt
from florence_bt.cli.exit_codes import INTERRUPTED, NOT_THERE, USAGE
from florence_bt.core.errors import ConfigError, FlorenceError

EXIT_CODES = (
    "Exit codes: 0 done; 1 the mission failed, was refused, or a check found errors; 2 wrong usage or "
    "configuration; 3 the system is not running, did not start or broke down; 130 interrupted (Ctrl-C)."
)


class _Verbs(TyperGroup):
    """The verbs; an error of Florence in one of them becomes one clear line and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Run a verb."""
        try:
            with as_keyboard_interrupt():
                return super().invoke(ctx)
        except ConfigError as error:
            _fail(str(error), USAGE)
        except FlorenceError as error:
            _fail(str(error), NOT_THERE)
        except ModuleNotFoundError as error:
            _fail(
                f"this command needs the package {error.name!r}, which is not installed; "
                "run `make setup` in a checkout, or build a ROS workspace with colcon (CONTRIBUTING.md)",
                USAGE,
            )
        except KeyboardInterrupt:
            _fail("interrupted", INTERRUPTED)


app = typer.Typer(
    name="florence",
    cls=_Verbs,
    help="Missions for home robots: behaviour trees in YAML, run on ROS 2.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _fail(message: str, code: int) -> NoReturn:
    typer.echo(f"florence: {message}", err=True)
    raise typer.Exit(code)


FolderOption = Annotated[
    list[Path] | None,
    typer.Option("--missions", help="Further folders of missions; later ones shadow earlier ones."),
]


def key_values(pairs: list[str]) -> dict[str, str]:
    values = {}
    for pair in pairs:
        name, separator, value = pair.partition("=")
        if not separator or not name:
            raise ConfigError(f"{pair!r} is not an input", valid=["key=value, e.g. room=kitchen"])
        values[name] = value
    return values
