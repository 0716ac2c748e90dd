"""What the supervisor starts in tests: a command in place of a process of nodes."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path


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
