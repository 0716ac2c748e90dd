"""The fork server: imports what the processes of a bring-up need, and forks them.

``python -m florence_bt.app.bringup.fork_server_main FOLDER SOCKET``, started by
:class:`florence_bt.app.bringup.fork_server.ForkServer`. It ends when the other end of its socket is closed.

A fork has only the thread that called it, so nothing may hold a lock on another one. Nothing that Florence
imports starts a thread before ``rclpy.init`` (a test counts them), with one exception: importing rclpy loads
LTTng-UST, whose two threads wait for a tracing daemon. They hold its locks only while they hear from one.
A fork has not got these threads, so it cannot be traced by LTTng.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import inspect
import json
import os
import socket
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from florence_bt.app.bringup.fork_server import MESSAGE_BYTES

MOST_DESCRIPTORS = 16
ARG_START, ARG_END = 45, 46
"""Fields of ``/proc/PID/stat`` behind the name, from 0: where the command line lies in memory (proc(5))."""


def main(channel: socket.socket) -> int:
    """Load and fork until the socket is closed at its other end.

    Args:
        channel: What the orders come by.

    Returns:
        The exit code: 0 of the server; of a fork that of its process.
    """
    # Of Python 3.12 and later, about the threads of LTTng-UST.
    warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
    gc.disable()  # which would write to all that the forks share
    while True:
        try:
            message, descriptors, _, _ = socket.recv_fds(channel, MESSAGE_BYTES, MOST_DESCRIPTORS)
        except ConnectionError:  # the supervisor was killed
            return 0
        if not message:
            return 0
        order = json.loads(message)
        if "load" in order:
            _load(order["load"])
            if not _answer(channel, {}):
                return 0
            continue
        # The first log line of a process finds the file of every module that there is, which takes 50 ms.
        inspect.getmodule(main.__code__)
        gc.freeze()
        pid = _fork()
        while pid is None:
            pid = _fork()
        if not pid:
            channel.close()
            return _run(order, descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        # Of a supervisor that was killed the fork takes no notice here: it looks after its parent itself.
        if not _answer(channel, {"pid": pid}):
            return 0


def _answer(channel: socket.socket, answer: dict[str, int]) -> bool:
    """Send an answer to the supervisor; False when it is there no more, because it was killed."""
    try:
        channel.send(json.dumps(answer).encode())
    except ConnectionError:
        return False
    return True


def _load(what: Sequence[str]) -> None:
    for each in what:
        module, _, function = each.partition(":")
        try:
            imported = importlib.import_module(module)
            if function:
                getattr(imported, function)()
        except Exception as error:
            # The process that needs it fails in the same way, and that is in its log and in what people read.
            print(f"the fork server could not load {each}: {error}", file=sys.stderr)


def _fork() -> int | None:
    """Fork a process that is not a child of this one.

    Returns:
        Its process id; in the fork itself 0, as soon as it has its new parent; None when the process in
        between was killed, and nothing is left.
    """
    told, tell = os.pipe()
    begin, hold = os.pipe()
    between = os.fork()
    if not between:
        fork = os.fork()
        if fork:
            os.write(tell, str(fork).encode())
            os._exit(0)
        for descriptor in (told, tell, hold):
            os.close(descriptor)
        if not os.read(begin, 1):
            os._exit(0)  # the server does not know of it
        os.close(begin)
        return 0
    os.close(tell)
    pid = int(os.read(told, 32) or 0) or None
    os.waitpid(between, 0)
    if pid is not None:
        with contextlib.suppress(BrokenPipeError):  # it is dead: who looks after it sees that
            os.write(hold, b"1")
    for descriptor in (told, begin, hold):
        os.close(descriptor)
    return pid


def _run(order: dict[str, Any], descriptors: Sequence[int]) -> int:
    """Become the process of a group of nodes, and return its exit code."""
    os.setsid()
    output, *rest = descriptors
    for standard in (1, 2):
        os.dup2(output, standard)
    os.close(output)
    os.chdir(order["folder"])
    os.umask(order["umask"])
    for name, value in order["variables"].items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
    os.environ.update({name: str(number) for name, number in zip(order["descriptors"], rest, strict=False)})
    group, options_file, parent = order["group"], order["options_file"], order["parent"]
    _show_as([sys.executable, "-m", order["module"], group, options_file, str(parent)])
    gc.enable()
    code: int = importlib.import_module(order["module"]).main(group, Path(options_file), parent)
    return code


def _show_as(words: Sequence[str]) -> None:
    """Show another command line to ps(1) and the like, as far as there is room for it."""
    fields = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    start, end = int(fields[ARG_START]), int(fields[ARG_END])
    text = "\0".join(words).encode(errors="surrogateescape")[: end - start - 1]
    ctypes.memmove(start, text.ljust(end - start, b"\0"), end - start)


if __name__ == "__main__":
    sys.exit(main(socket.socket(fileno=int(sys.argv[2]))))
