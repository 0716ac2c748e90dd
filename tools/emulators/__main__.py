"""Emulated devices alone, for any client: ``python tools/emulators create``."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from florence_bt.core.errors import FlorenceError
from florence_bt.simulation.emulators.create_models import MODELS as BASES
from florence_bt.simulation.emulators.scip_models import MODELS as SCANNERS
from tools.emulators.create_program import CreateOptions, CreateProgram
from tools.emulators.scip_program import ScipOptions, ScipProgram

OK, FAILED, INTERRUPTED = 0, 1, 130
LATENCY_S, LONGEST_LATENCY_S = 0.005, 10.0
USUAL, SHORT = "usual", "short"
CHECKSUMS = {"with-header": True, "without-header": False}

EPILOG = """\
docs/notes/emulators.md explains the options. The first line of the output is the device file, which a client
opens like a serial port, or host:port with --tcp. Lines on standard input (and on the connections of
--control) make things go wrong; the line `help` lists them.

example:
  python tools/emulators {device} --link ./{device} --control ./control.sock
"""

T = TypeVar("T", CreateOptions, ScipOptions)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run an emulator until `quit` or a signal.

    Returns:
        The exit code: 0 after `quit` or SIGTERM, 1 when it could not start, 130 after an interrupt.
    """
    options = _parser().parse_args(arguments)
    console = None if sys.stdin is None else sys.stdin.fileno()
    try:
        return _serve(_program(options, console))
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return FAILED


def _program(options: argparse.Namespace, console: int | None) -> CreateProgram | ScipProgram:
    if options.device == "create":
        options.header_in_checksum = CHECKSUMS.get(options.checksum)
        return CreateProgram(_options(CreateOptions, options), time.monotonic, console)
    options.short_status = options.scip1 == SHORT
    options.scip1 = options.scip1 is not None
    return ScipProgram(_options(ScipOptions, options), time.monotonic, console)


def _options(cls: type[T], options: argparse.Namespace) -> T:
    return cls(**{field.name: getattr(options, field.name) for field in fields(cls)})


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
        prog="python tools/emulators", description="Emulated devices, for any client."
    )
    devices = parser.add_subparsers(dest="device", required=True, metavar="DEVICE")
    create = _add_device(devices, "create", "an iRobot Create or Create 2 on an endless floor", BASES)
    create.add_argument(
        "--checksum",
        choices=tuple(CHECKSUMS),
        help="form of a stream frame's checksum; default: as the model's manual says",
    )
    create.add_argument(
        "--latency",
        type=_seconds,
        metavar="SECONDS",
        default=LATENCY_S,
        dest="latency_s",
        help=f"how much later everything leaves; default: {LATENCY_S:g}",
    )
    create.add_argument(
        "--keep-input",
        action="store_true",
        dest="keeps_input",
        help="execute input that comes during a wait after it",
    )
    scip = _add_device(devices, "scip", "a Hokuyo URG, UTM or UST in a room with a pillar", SCANNERS)
    scip.add_argument(
        "--scip1",
        nargs="?",
        choices=(USUAL, SHORT),
        const=USUAL,
        help="wake up in SCIP 1.1, like old firmware; short: SCIP2.0 is answered with a 0",
    )
    return parser


def _add_device(devices: Any, name: str, what: str, models: Iterable[str]) -> argparse.ArgumentParser:
    device: argparse.ArgumentParser = devices.add_parser(
        name,
        help=what,
        description=f"Emulates {what}, on a pseudo-terminal or a TCP port.",
        epilog=EPILOG.format(device=name),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    usual = next(iter(models))
    where = device.add_mutually_exclusive_group()
    where.add_argument("--link", type=Path, metavar="PATH", help="put a link to the device file there")
    where.add_argument(
        "--tcp", type=int, metavar="PORT", dest="tcp_port", help="listen on 127.0.0.1; 0 takes any port"
    )
    device.add_argument("--model", choices=sorted(models), default=usual, help=f"default: {usual}")
    device.add_argument(
        "--noise-seed", type=int, metavar="NUMBER", dest="seed", help="default: perfect sensors"
    )
    device.add_argument("--strict-baud", action="store_true", help="a wrong speed gives garbage")
    device.add_argument(
        "--control", type=Path, metavar="PATH", help="take commands on a Unix socket there too"
    )
    return device


def _seconds(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 0.0 <= float(text) <= LONGEST_LATENCY_S:
            return float(text)
    raise argparse.ArgumentTypeError(f"a number from 0 to {LONGEST_LATENCY_S:g} is needed, not {text!r}")


if __name__ == "__main__":
    sys.exit(main())
