"""What the tests of the emulators that run alone share."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

from florence_bt.core.socket_paths import short_path

EMULATORS = str(Path(__file__).parents[2] / "tools" / "emulators")
"""The program; Python runs a folder with a ``__main__``."""
LONG_S = 60.0
"""A limit for what takes microseconds."""


def documented_commands(device: str) -> set[str]:
    """The commands of the control channel that docs/notes/emulators.md has in its table for a device."""
    text = (Path(__file__).parents[2] / "docs" / "notes" / "emulators.md").read_text()
    table = (
        text.partition(f"\n## {device}")[2].partition("### Making things go wrong")[2].partition("\n## ")[0]
    )
    rows = [line for line in table.partition("\nIn a test")[0].splitlines() if line.startswith("| `")]
    first_cells = [re.split(r"(?<!\\)\|", row)[1] for row in rows]
    return {usage.split()[0] for cell in first_cells for usage in re.findall("`([^`]+)`", cell)}


class Hand:
    """A clock that stands until somebody turns it."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class EmulatorProcess:
    """An emulator as a process of its own, with a control socket.

    Attributes:
        process: The process.
        path: What a client opens.
        control: The control socket.
    """

    def __init__(self, folder: Path, device: str, *options: str) -> None:
        """Start it, and wait until a client can open its line.

        Args:
            folder: Where the control socket goes.
            device: ``create`` or ``scip``.
            options: Of its command line.
        """
        self.control = folder / "control.sock"
        words = [device, "--control", str(self.control), *options]
        self.process = subprocess.Popen(
            [sys.executable, EMULATORS, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.path = self.process.stdout.readline().strip()

    def type(self, lines: str) -> None:
        """Say something at its console."""
        assert self.process.stdin is not None
        self.process.stdin.write(lines)
        self.process.stdin.flush()

    def read(self) -> str:
        """The next line of its console."""
        assert self.process.stdout is not None
        return self.process.stdout.readline()

    def say(self, line: str) -> str:
        """Say something at its control socket."""
        with socket.socket(socket.AF_UNIX) as peer:
            peer.settimeout(LONG_S)
            with short_path(self.control) as place:
                peer.connect(place)
            peer.sendall(line.encode() + b"\n")
            with peer.makefile() as answers:
                return answers.readline().strip()

    def status(self) -> dict[str, Any]:
        """What it says of itself."""
        return dict(json.loads(self.say("status")))

    def end(self, number: signal.Signals = signal.SIGTERM) -> int:
        """End it; returns its exit code."""
        with self.process:
            if self.process.poll() is None:
                self.process.send_signal(number)
        return self.process.returncode
