"""Processes of tests: a command in place of a process of nodes, and waiting for what they do."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any


class ScriptStart:
    """Starts the command of a group as the fork server starts its process.

    Args:
        command_of: The words of the command, given the group and the options file.
    """

    def __init__(self, command_of: Callable[[str, Path], Sequence[str]]) -> None:
        self._command_of = command_of

    def __call__(
        self,
        group: str,
        options_file: Path,
        *,
        output: int,
        variables: Mapping[str, str],
        keep_open: Mapping[str, int],
        hold: Sequence[int] = (),
    ) -> subprocess.Popen[bytes]:
        """Start it."""
        numbers = {name: str(number) for name, number in keep_open.items()}
        return subprocess.Popen(
            self._command_of(group, options_file),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env={**os.environ, **variables, **numbers},
            start_new_session=True,
            pass_fds=(*keep_open.values(), *hold),
        )


def wait_for(condition: Callable[[], Any], what: str, budget_s: float = 300.0) -> Any:
    """Wait until a condition holds, and give its value."""
    end = time.monotonic() + budget_s
    while not (value := condition()):
        assert time.monotonic() < end, f"waited for {what}"
        time.sleep(0.005)
    return value


def is_alive(pid: int) -> bool:
    """Tell whether a process runs; one that has ended and was not waited for does not."""
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


def free_port() -> int:
    """Return a TCP port of this machine that nobody listens on."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])
