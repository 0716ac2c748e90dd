"""Parts of every verb: the application with the verbs of other packages, errors, common options."""

from __future__ import annotations

import shlex
import sys
from itertools import takewhile
from operator import itemgetter
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from florence_bt.app.bringup.signals import as_keyboard_interrupt
from florence_bt.app.wrapping import hanging, terminal_columns
from florence_bt.cli.exit_codes import INTERRUPTED, NOT_THERE, USAGE
from florence_bt.core.errors import ConfigError, FlorenceError, raise_all
from florence_bt.ros.arguments import (
    NAMESPACE_VARIABLE,
    ros_arguments,
    split_ros_arguments,
    use_arguments,
    use_namespace,
)

EXIT_CODES = (
    "Exit codes: 0 done; 1 the mission failed, was refused, or a check found errors; 2 wrong usage or "
    "configuration; 3 the system is not running, did not start or broke down; 130 interrupted (Ctrl-C)."
)
_PANELS = ("The system", "Mission files", "Runs", "The robot")
"""Sections of the list of verbs, in their order; those that verbs of other packages name come behind."""
_WHOLE_SENTENCE = 1000
"""Letters of the first sentence of a verb's help that the list shows: all."""


class _OptionsOnce:
    """Refuses an option that is given twice: the last one would count, and nobody would know."""

    def make_parser(self, ctx: Any) -> Any:
        """Make the parser of the words."""
        parser: Any = super().make_parser(ctx)  # type: ignore[misc]
        parse = parser.parse_args

        def parse_once(args: list[str]) -> Any:
            options, rest, order = parse(args=args)
            for option in order:
                if isinstance(option, TyperOption) and not option.multiple and order.count(option) > 1:
                    names = " or ".join(option.opts + option.secondary_opts)
                    raise ConfigError(f"{names} is given {order.count(option)} times", valid=["once"])
            return options, rest, order

        parser.parse_args = parse_once
        return parser


class Verb(_OptionsOnce, TyperCommand):
    """A verb."""


class Verbs(_OptionsOnce, TyperGroup):
    """A group of verbs, whose list says in a sentence what each one does."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of verbs, one section for each panel; with whole sentences, as far as the first."""
        names = self.list_commands(ctx)
        widest = max(map(len, names))
        panels: dict[str, list[tuple[str, str]]] = {panel: [] for panel in _PANELS}
        for name in names:
            verb: Any = self.get_command(ctx, name)
            says = verb.get_short_help_str(_WHOLE_SENTENCE)
            panels.setdefault(verb.rich_help_panel or "Commands", []).append((name.ljust(widest), says))
        for panel, rows in filter(itemgetter(1), panels.items()):
            with formatter.section(panel):
                formatter.write_dl(rows)


class _AllVerbs(Verbs):
    """The verbs; an error of Florence in one of them becomes one clear line and an exit code.

    Installed packages add verbs: a ``typer.Typer`` with their commands, in the entry point group
    ``florence_bt.commands``. They are loaded when a word is none of Florence's own verbs, and for the list.
    """

    _complete = False

    def list_commands(self, ctx: Any) -> list[str]:
        """List the verbs, those of other packages last."""
        self._add_others()
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Find a verb."""
        if cmd_name not in self.commands:
            self._add_others()
        return super().get_command(ctx, cmd_name)

    def _add_others(self) -> None:
        """Add the verbs of installed packages; what cannot be loaded is told and takes nothing else away."""
        if self._complete:
            return
        self._complete = True
        from florence_bt.trees.language.third_party import ThirdParty

        packages = ThirdParty()
        for owner, commands in packages.commands():
            for name, command in typer.main.get_group(commands).commands.items():
                if name in self.commands:
                    packages.refuse(owner, f"its command {name!r} is ignored: there is one of that name")
                self.commands.setdefault(name, command)
        for finding in packages.findings:
            typer.echo(f"florence: {finding.file}: {finding.message}", err=True)

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
            from florence_bt.core.installation import how_to_get

            advice = how_to_get(error.name or "")
            _fail(f"this command needs {error.name!r}, which is not installed: {advice}", USAGE)
        except KeyboardInterrupt:
            _fail("interrupted", INTERRUPTED)
        finally:
            use_arguments(())  # those of the verb, which came while it was read


class VerbList(typer.Typer):
    """Something that verbs are added to."""

    def command(
        self, name: str | None = None, *, cls: type[TyperCommand] | None = None, **details: Any
    ) -> Any:
        """Add a function as a verb, see :class:`typer.Typer`."""
        return super().command(name, cls=cls or Verb, **details)


app = VerbList(
    name="florence",
    cls=_AllVerbs,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain text: to load what draws boxes around it takes 0.15 s
)


def _tell_version(wanted: bool) -> None:
    if wanted:
        from florence_bt import __version__

        typer.echo(f"florence {__version__}")
        raise typer.Exit


@app.callback(help="Missions for home robots: behaviour trees in YAML, run on ROS 2.", epilog=EXIT_CODES)
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Tell the version.", callback=_tell_version, is_eager=True)
    ] = False,
) -> None:
    """Take the options that need no verb."""


def tell(text: str, *, err: bool = False) -> None:
    """Print for people: a terminal that is narrow breaks lines between words."""
    columns = terminal_columns(sys.stderr if err else sys.stdout)
    typer.echo("\n".join(hanging(line, columns) for line in text.split("\n")), err=err)


def _fail(message: str, code: int) -> NoReturn:
    tell(f"florence: {message}", err=True)
    raise typer.Exit(code)


class _TakesRosArguments:
    """The options of verbs that talk to ROS: ``--namespace``, and ``--ros-args`` as all programs of ROS 2."""

    def __init__(self, *arguments: Any, params: list[Any] | None = None, **details: Any) -> None:
        super().__init__(*arguments, params=[*(params or ()), *_ros_options()], **details)  # type: ignore[call-arg]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        words, of_ros = split_ros_arguments(args)
        use_arguments((*ros_arguments(), *of_ros))
        found: list[str] = super().parse_args(ctx, words)  # type: ignore[misc]
        return found


class RosVerb(_TakesRosArguments, Verb):
    """A verb that talks to ROS."""


class RosGroup(_TakesRosArguments, Verbs):
    """A group of verbs that talks to ROS itself."""


def _ros_options() -> list[TyperOption]:
    return [
        TyperOption(
            param_decls=["--namespace"],
            envvar=NAMESPACE_VARIABLE,
            show_envvar=True,
            metavar="NAMESPACE",
            help="The robot's ROS namespace, e.g. /robot1.",
            expose_value=False,
            callback=_take_namespace,
        ),
        TyperOption(
            param_decls=["--ros-args"],
            metavar="ARGS... [--]",
            help="Arguments of ROS 2: -r FROM:=TO, -p NODE:NAME:=VALUE, --params-file FILE, --log-level ...",
            expose_value=False,
        ),
    ]


def _take_namespace(context: Any, option: Any, value: str | None) -> None:
    if value is not None:
        source = context.get_parameter_source(option.name)
        use_namespace(value, chosen=source is not None and source.name == "COMMANDLINE")


FolderOption = Annotated[
    list[Path] | None,
    typer.Option("--missions", help="Further folders of missions; later ones shadow earlier ones."),
]


def key_values(pairs: list[str]) -> dict[str, str]:
    """Read inputs as people type them.

    Raises:
        ConfigError: One of them is not ``key=value``, or a key comes twice.
    """
    values: dict[str, str] = {}
    wrong: list[ConfigError] = []
    for index, pair in enumerate(pairs):
        name, separator, value = pair.partition("=")
        if not separator or not name:
            if values:
                raise _split_by_the_shell(pairs, index)
            wrong.append(ConfigError(f"{pair!r} is not an input", valid=["key=value, e.g. room=kitchen"]))
        elif name in values:
            problem = f"{name} is given twice: {values[name]!r} and {value!r}"
            wrong.append(ConfigError(problem, valid=[f"{name}=..., once"]))
        else:
            values[name] = value
    raise_all(wrong)
    return values


def _split_by_the_shell(pairs: list[str], index: int) -> ConfigError:
    """Make the error for a value with blanks but no quotes, which the shell split into several arguments."""
    pieces = takewhile(lambda piece: "=" not in piece, pairs[index:])
    name, _, first = pairs[index - 1].partition("=")
    meant = f"{name}={shlex.quote(' '.join((first, *pieces)))}"
    return ConfigError(f"{pairs[index]!r} is not an input: a value with blanks needs quotes", valid=[meant])
