"""A process that ends when the one that started it does, whatever that died of.

A parent that is killed cannot end its children, and one of theirs that hangs amid its own end would stay for
ever. So each child watches its parent by a descriptor of the kernel (pidfd_open(2)), which names no later
process of the same number. ``python -m florence_bt.app.bringup.parent PARENT MODULE ARGUMENT...`` runs a
module of ours so.
"""

from __future__ import annotations

import faulthandler
import os
import runpy
import select
import signal
import sys
import threading


def end_with(parent: int, grace_s: float = 0.0) -> bool:
    """Let this process end when its parent has.

    Args:
        parent: The process id of its parent.
        grace_s: Wall seconds that it gets to end by itself then. After that it ends at once, also when Python
            does nothing any more, and writes its stacks to the standard error; with 0 it is killed at once.

    Returns:
        Whether the parent still runs. Where it does not, nothing is watched.
    """
    try:
        descriptor = os.pidfd_open(parent)
    except ProcessLookupError:
        return False
    if os.getppid() != parent:  # its number has come to somebody else
        os.close(descriptor)
        return False

    def watch() -> None:
        select.select([descriptor], [], [])
        if grace_s <= 0.0:
            os.kill(os.getpid(), signal.SIGKILL)
        # A thread of C, which does not need Python's lock.
        faulthandler.dump_traceback_later(grace_s, exit=True)

    threading.Thread(target=watch, name="parent", daemon=True).start()
    return True


def child_command(module: str, *arguments: str) -> list[str]:
    """Return the command line of a module of ours that is killed when this process ends."""
    return [sys.executable, "-m", "florence_bt.app.bringup.parent", str(os.getpid()), module, *arguments]


def main() -> None:
    """Run a module until this process's parent ends."""
    _, parent, module, *arguments = sys.argv
    if end_with(int(parent)):
        sys.argv = [module, *arguments]
        runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
