"""One process of a bring-up, forked for the supervisor (:mod:`florence_bt.app.bringup.fork_server`)."""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import sys
from pathlib import Path
from types import FrameType

from florence_bt.app.bringup.heartbeat import STACK_SIGNAL, heartbeat_of_this_process
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.parent import end_with
from florence_bt.core.errors import FlorenceError

PR_SET_PDEATHSIG = 1
"""prctl(2): the signal that the kernel sends when the parent process ends."""
ALONE_S = 10.0
"""Wall seconds that a process gets to end when its supervisor was killed, which would have given it 8."""


def main(group: str, options_file: Path, parent: int) -> int:
    """Run the nodes of one process until asked to end.

    Args:
        group: A name of :func:`florence_bt.app.bringup.topology.processes`.
        options_file: JSON file of a :class:`BringUp`.
        parent: Process id of the supervisor.

    Returns:
        The exit code: 0 for an asked end, 1 for an error.
    """
    for number in (signal.SIGINT, signal.SIGTERM):  # which may have been ignored, as under nohup
        signal.signal(number, _end_before_start)
    # Should the supervisor be killed, its children must not drive on alone.
    ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if not end_with(parent, ALONE_S):
        return 0  # it was killed before the kernel was asked for the signal
    # These imports take seconds; ending the process meanwhile must not print a traceback.
    from florence_bt.app.bringup.topology import factories, remappings
    from florence_bt.ros.arguments import use_arguments, without_parameters
    from florence_bt.ros.process import run_nodes

    # Only of the thread that has the signal, the main one: the others run on while they are looked at.
    faulthandler.register(STACK_SIGNAL, all_threads=False)
    try:
        options = BringUp.read(options_file)
        # Parameters come by the configuration (topology), which also reads what the arguments say of them.
        use_arguments(without_parameters(options.ros_arguments))

        def write_up_file() -> None:
            up_file = options.up_file(group)
            try:
                up_file.parent.mkdir(exist_ok=True)
                up_file.write_text(f"{os.getpid()}\n", encoding="utf-8")
            except OSError as error:
                print(f"florence {group}: cannot write that it is up: {error}", file=sys.stderr)

        return run_nodes(
            factories(group, options),
            remappings=remappings(options),
            on_ready=write_up_file,
            beat=heartbeat_of_this_process(),
        )
    except FlorenceError as error:
        print(f"florence {group}: {error}", file=sys.stderr)
        return 1


def _end_before_start(number: int, frame: FrameType | None) -> None:
    # Nothing is open yet. An exception is lost when the signal comes amid a callback of the import machinery.
    os._exit(0)
