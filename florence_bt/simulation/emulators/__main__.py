"""Emulated devices alone, for any client: ``python -m florence_bt.simulation.emulators create``."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from florence_bt.core.errors import FlorenceError
from florence_bt.simulation.emulators._create_control import HELP
from florence_bt.simulation.emulators._create_models import MODELS
from florence_bt.simulation.emulators._scip_control import HELP as SCIP_HELP
from florence_bt.simulation.emulators.create_program import CreateOptions, CreateProgram
from florence_bt.simulation.emulators.scip import MODELS as SCANNERS
from florence_bt.simulation.emulators.scip_program import ScipOptions, ScipProgram

OK, FAILED, INTERRUPTED = 0, 1, 130
LATENCY_S, LONGEST_LATENCY_S = 0.005, 10.0
USUAL, SHORT = "usual", "short"

CREATE_EPILOG = f"""\
The first line of the output is the device file, which a client opens like a serial port, or host:port with
--tcp. Lines on standard input (and on the connections of --control) make things go wrong; each is answered by
one:

{HELP}

examples:
  python -m florence_bt.simulation.emulators create --link ./create --control ./create.sock
  python -m florence_bt.simulation.emulators create --model create2 --tcp 0
"""

SCIP_EPILOG = f"""\
The first line of the output is the device file, or host:port with --tcp. Lines on standard input (and on the
connections of --control) make things go wrong; each is answered by one:

{SCIP_HELP}

examples:
  python -m florence_bt.simulation.emulators scip --link ./laser --control ./laser.sock
  python -m florence_bt.simulation.emulators scip --model utm-30lx --tcp 10940
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run an emulator until it is told to end.

    Returns:
        The exit code: 0 when told to end, 1 when it could not start, 130 after an interrupt.
    """
    options = _parser().parse_args(arguments)
    console = None if sys.stdin is None else sys.stdin.fileno()
    try:
        program = _scanner(options, console) if options.device == "scip" else _base(options, console)
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return FAILED
    return _serve(program)


def _base(options: argparse.Namespace, console: int | None) -> CreateProgram:
    checksum = {"with-header": True, "without-header": False, None: None}[options.checksum]
    return CreateProgram(
        CreateOptions(
            options.link,
            options.model,
            checksum,
            options.noise_seed,
            options.strict_baud,
            options.control,
            options.tcp,
            options.latency,
            options.keep_input,
        ),
        time.monotonic,
        console,
    )


def _scanner(options: argparse.Namespace, console: int | None) -> ScipProgram:
    return ScipProgram(
        ScipOptions(
            options.link,
            options.tcp,
            options.model,
            options.scip1 is not None,
            options.noise_seed,
            options.control,
            options.strict_baud,
            options.scip1 == SHORT,
        ),
        time.monotonic,
        console,
    )


def _serve(program: CreateProgram | ScipProgram) -> int:
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda signum, _frame: caught.append(signum))
    # In the background of a terminal the keyboard is not ours: reading it then fails instead of stopping us.
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    try:
        print(program.path, flush=True)
        program.serve(lambda: not caught)
    finally:
        program.close()
    return INTERRUPTED if signal.SIGINT in caught else OK


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m florence_bt.simulation.emulators", description="Emulated devices, for any client."
    )
    devices = parser.add_subparsers(dest="device", required=True, metavar="DEVICE")
    create = devices.add_parser(
        "create",
        help="an iRobot Create or Create 2 on a pseudo-terminal or a TCP port",
        description="An iRobot Create or Create 2 on a pseudo-terminal or a TCP port, on an endless floor.",
        epilog=CREATE_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_line(create, "listen on this TCP port of 127.0.0.1 instead; 0 takes any that is free")
    create.add_argument("--model", choices=sorted(MODELS), default="create", help="default: create")
    create.add_argument(
        "--checksum",
        choices=("with-header", "without-header"),
        help="whether the header counts for a stream frame's checksum; default: as the model's manual says",
    )
    create.add_argument(
        "--noise-seed", type=int, metavar="NUMBER", help="noisy sensors; perfect ones without this"
    )
    create.add_argument(
        "--strict-baud", action="store_true", help="a client at the wrong speed sees and sends garbage"
    )
    create.add_argument(
        "--latency",
        type=_seconds,
        metavar="SECONDS",
        default=LATENCY_S,
        help=f"how much later everything leaves; default: {LATENCY_S:g}",
    )
    create.add_argument(
        "--keep-input", action="store_true", help="obey what comes during a wait after it; else it is ignored"
    )
    create.add_argument("--control", type=Path, metavar="PATH", help="take lines on a Unix socket there too")
    _add_scip(devices)
    return parser


def _add_scip(devices: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    scip = devices.add_parser(
        "scip",
        help="a Hokuyo URG, UTM or UST on a pseudo-terminal or a TCP port",
        description="A Hokuyo scanner that speaks SCIP 2.0, standing in a room with a pillar.",
        epilog=SCIP_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    _add_line(
        scip,
        "listen on this TCP port of 127.0.0.1 instead; scanners use 10940, 0 takes any that is free",
    )
    scip.add_argument("--model", choices=sorted(SCANNERS), default="urg-04lx", help="default: urg-04lx")
    scip.add_argument(
        "--scip1",
        nargs="?",
        choices=(USUAL, SHORT),
        const=USUAL,
        help="wake up in SCIP 1.1 until told SCIP2.0, like old firmware; short: which is answered with a 0",
    )
    scip.add_argument(
        "--strict-baud", action="store_true", help="as on RS-232: a client at the wrong speed gets garbage"
    )
    scip.add_argument(
        "--noise-seed", type=int, metavar="NUMBER", help="noisy distances; perfect ones without this"
    )
    scip.add_argument("--control", type=Path, metavar="PATH", help="take lines on a Unix socket there too")


def _seconds(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 0.0 <= float(text) <= LONGEST_LATENCY_S:
            return float(text)
    raise argparse.ArgumentTypeError(f"a number from 0 to {LONGEST_LATENCY_S:g} is needed, not {text!r}")


def _add_line(device: argparse.ArgumentParser, tcp_help: str) -> None:
    """Where the client finds the device."""
    where = device.add_mutually_exclusive_group()
    where.add_argument("--link", type=Path, metavar="PATH", help="put a link to the device file there")
    where.add_argument("--tcp", type=int, metavar="PORT", help=tcp_help)


if __name__ == "__main__":
    sys.exit(main())
