"""Emulated devices alone, for any client: ``python -m florence_bt.simulation.emulators create``."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from florence_bt.core.errors import FlorenceError
from florence_bt.simulation.emulators._create_control import HELP
from florence_bt.simulation.emulators._create_models import MODELS
from florence_bt.simulation.emulators.create_program import CreateOptions, CreateProgram

OK, FAILED, INTERRUPTED = 0, 1, 130

CREATE_EPILOG = f"""\
The first line of the output is the device file; a client opens it like a serial port. Lines on standard input
(and on the connections of --control) make things go wrong; each is answered by one:

{HELP}

example:
  python -m florence_bt.simulation.emulators create --link ./create --control ./create.sock
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run an emulator until it is told to end.

    Returns:
        The exit code: 0 when told to end, 1 when it could not start, 130 after an interrupt.
    """
    options = _parser().parse_args(arguments)
    checksum = {"with-header": True, "without-header": False, None: None}[options.checksum]
    try:
        program = CreateProgram(
            CreateOptions(
                options.link,
                options.model,
                checksum,
                options.noise_seed,
                options.strict_baud,
                options.control,
            ),
            time.monotonic,
            None if sys.stdin is None else sys.stdin.fileno(),
        )
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return FAILED
    return _serve(program)


def _serve(program: CreateProgram) -> int:
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
        help="an iRobot Create or Create 2 on a pseudo-terminal",
        description="An iRobot Create or Create 2 on a pseudo-terminal, on an endless floor.",
        epilog=CREATE_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    create.add_argument("--link", type=Path, metavar="PATH", help="put a link to the device file there")
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
    create.add_argument("--control", type=Path, metavar="PATH", help="take lines on a Unix socket there too")
    return parser


if __name__ == "__main__":
    sys.exit(main())
