"""Starts the processes of a bring-up as forks of one process that has imported what they need.

A fresh interpreter imports for a second before it can do anything, and each has its own copy of what it
imported. The fork server (:mod:`florence_bt.app.bringup.fork_server_main`) imports once; its forks begin at
once and share its memory. The idea is that of multiprocessing's ``forkserver``, whose processes are children
of the server: ours are children of the supervisor, as processes that it starts itself would be. Each is
forked by a process in between that ends at once, and the kernel gives it to the nearest subreaper (prctl(2)),
which the supervisor is meanwhile. So the supervisor waits for them and they end with it; nobody needs the
server once they run.

Only the standard library is imported here: the server is started before the rest is imported.
"""

from __future__ import annotations

import array
import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from florence_bt.core.closing import Closing
from florence_bt.core.errors import FlorenceError

PR_SET_CHILD_SUBREAPER = 36
"""prctl(2): whether orphans among the descendants become children of this process."""
SERVER = "florence_bt.app.bringup.fork_server_main"
PROCESS = "florence_bt.app.bringup.process"
EVERYBODY = (
    "florence_bt.ros.rclpy_internals:load_no_generator",
    "florence_bt.app.bringup.process",
    "florence_bt.app.bringup.topology",
    "florence_bt.ros.process",
    # What rclpy imports for the first node.
    "rosidl_generator_py",
    "service_msgs.msg",
    "type_description_interfaces.msg",
)
"""Every process of a bring-up needs these."""
MESSAGE_BYTES = 65536
"""No message is longer."""
FORK_BUDGET_S = 2.0
"""Wall seconds that a fork may take: another server takes the place of one that needs longer."""
TITLE_SPACE = 64
"""Bytes of its command line that the server leaves to those of its forks, beside what both have."""


class ForkedProcess:
    """A child process; what the supervisor needs of :class:`subprocess.Popen`.

    Attributes:
        pid: Its process id.
        returncode: The exit code as :mod:`subprocess` has it; None while it was not seen to have ended.
    """

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Look whether it has ended; gives its exit code, None while it runs."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def terminate(self) -> None:
        """Ask it to end (SIGTERM), if it runs."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once (SIGKILL), if it runs."""
        self._send(signal.SIGKILL)

    def _send(self, number: signal.Signals) -> None:
        # Until it is waited for, nobody else gets its process id.
        if self.poll() is None:
            os.kill(self.pid, number)


class ForkServer(Closing):
    """The process that imports and forks. Use as a context manager: leaving it ends the server.

    Args:
        folder: The folder of the bring-up, for people who read a list of processes.
        module: Its ``main(group, options_file, parent)`` is what a fork runs.
        first: What it begins to load at once (:meth:`load`).
    """

    def __init__(self, folder: Path, module: str = PROCESS, first: Sequence[str] = EVERYBODY) -> None:
        self._folder = folder
        self._module = module
        self._start(first)

    @property
    def pid(self) -> int:
        """The process id of the server."""
        return self._process.pid

    def load(self, what: Sequence[str]) -> None:
        """Do in the server what its forks need not do any more, and wait until that is done.

        What fails is left to the forks that need it, which say so. A server that has ended is not started
        again for this: the next :meth:`fork` does.

        Args:
            what: Modules to import, and functions to call, as ``module:function``.
        """
        self._socket.settimeout(None)
        self._ask({"load": list(what)})

    def fork(
        self,
        group: str,
        options_file: Path,
        *,
        output: int,
        variables: Mapping[str, str],
        keep_open: Mapping[str, int],
        hold: Sequence[int] = (),
    ) -> ForkedProcess:
        """Start the process of a group of nodes.

        It has a session of its own, and the environment, working directory and umask of this process.

        Args:
            group: A name of :func:`florence_bt.app.bringup.topology.processes`.
            options_file: JSON file of a ``BringUp``.
            output: File descriptor of its standard output and standard error.
            variables: Environment variables that it has besides.
            keep_open: Environment variable -> file descriptor: it has a copy, and the variable says which.
            hold: Other file descriptors of which it has a copy until it ends.

        Raises:
            FlorenceError: There is no server, and none can be started.
        """
        order = {
            "module": self._module,
            "group": group,
            "options_file": str(options_file),
            "parent": os.getpid(),
            "variables": self._changed() | dict(variables),
            "descriptors": list(keep_open),
            "folder": os.getcwd(),
            "umask": _umask(),
        }
        descriptors = [output, *keep_open.values(), *hold]
        with _subreaper():
            self._socket.settimeout(FORK_BUDGET_S)
            answer = self._ask(order, descriptors)
            if answer is None:
                # The new one loads nothing beforehand: whoever watches the other processes cannot wait.
                self.close()
                self._start(())
                answer = self._ask(order, descriptors)
        if answer is None:
            raise FlorenceError(f"no process can be started: the fork server {self._process.pid} is gone")
        return ForkedProcess(answer["pid"])

    def close(self) -> None:
        """End the server; what it has forked goes on."""
        self._socket.close()
        self._process.kill()
        self._process.wait()

    def _start(self, first: Sequence[str]) -> None:
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with its:
            self._environment = dict(os.environ)
            self._process = subprocess.Popen(
                [
                    *(sys.executable, "-u", "-m", SERVER),
                    *(str(self._folder), str(its.fileno()), " " * TITLE_SPACE),
                ],
                stdin=subprocess.DEVNULL,
                pass_fds=[its.fileno()],
                # A Ctrl-C in the terminal is the supervisor's to hand on, in the right order.
                start_new_session=True,
                # OpenBLAS would start a thread for each further core, which pays for large matrices only.
                env={"OPENBLAS_NUM_THREADS": "1", **os.environ},
            )
        self._socket = ours
        self._loads = bool(first)
        if first:
            self._send({"load": list(first)})

    def _changed(self) -> dict[str, str | None]:
        """Return what has changed in the environment since the server began; None: is not there any more."""
        gone = dict.fromkeys(self._environment.keys() - os.environ.keys())
        return gone | {
            name: value for name, value in os.environ.items() if self._environment.get(name) != value
        }

    def _ask(self, message: Mapping[str, Any], descriptors: Sequence[int] = ()) -> dict[str, Any] | None:
        """Send a message and return the answer; None when the server has ended or does not answer."""
        try:
            if self._loads:  # what it began with
                self._loads = not self._socket.recv(MESSAGE_BYTES)
            self._send(message, descriptors)
            answer = self._socket.recv(MESSAGE_BYTES)
        except (TimeoutError, ConnectionError):
            return None
        return json.loads(answer) if answer else None

    def _send(self, message: Mapping[str, Any], descriptors: Sequence[int] = ()) -> None:
        socket.send_fds(self._socket, [json.dumps(message).encode()], array.array("i", descriptors))


@contextmanager
def _subreaper() -> Iterator[None]:
    """Be the parent of orphans among the descendants meanwhile.

    Raises:
        OSError: The kernel refused it.
    """
    libc = ctypes.CDLL(None, use_errno=True)

    def be(on: int) -> None:
        if libc.prctl(PR_SET_CHILD_SUBREAPER, on, 0, 0, 0):
            number = ctypes.get_errno()
            raise OSError(number, f"prctl(PR_SET_CHILD_SUBREAPER): {os.strerror(number)}")

    be(1)
    try:
        yield
    finally:
        be(0)


def _umask() -> int:
    """Return the umask of this process, which can be read only by setting one."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
