r"""Pages of the docs that are transcripts: runs the commands of a page, and writes what they print into it.

``python -m tools.first_hour docs/manual/first_hour.md`` does so for the newcomer's first hour, in a fresh
clone of the last commit with an environment of its own (minutes; ``--folder`` keeps both for the next time).

The page is the script. A ``console`` block has commands behind ``$`` and what they printed; a block
``yaml FILE`` is written to FILE. Words after ``console``::

    NAME          the terminal, each with a shell of its own ("terminal" if none is named)
    until=TEXT    the command stays; its output is taken until a line has this text
    lines=2..3    of a long output only the first two lines and the last three
    once=yes      done again, the command says nothing, and what it said the first time stays

``^C`` and ``^\`` are these keys. A block that begins without a command has the rest of what its terminal
prints.
"""

from __future__ import annotations

import argparse
import os
import queue
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(console|yaml)((?: [^\n]+)?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
KEYS = {"^C": signal.SIGINT, "^\\": signal.SIGQUIT}
ENDED = "the command has ended with code"
BUDGET_S = 1200.0
"""The longest wait for one command; a set-up takes minutes."""


class CommandWentWrong(Exception):
    """A command of a page did not do what a page could show."""


@dataclass(frozen=True)
class Block:
    """A block of a page that the tool runs or writes.

    Attributes:
        kind: ``console`` or ``yaml``.
        words: What stands behind it: terminal and options, or the file.
        text: What is in it.
        start: Where the text starts in the page.
    """

    kind: str
    words: tuple[str, ...]
    text: str
    start: int = 0

    @property
    def options(self) -> dict[str, str]:
        """The options of a ``console`` block."""
        return dict(word.split("=", 1) for word in self.words if "=" in word)

    @property
    def terminal(self) -> str:
        """The name of the terminal of a ``console`` block."""
        return next((word for word in self.words if "=" not in word), "terminal")

    @property
    def steps(self) -> list[str]:
        """List what is typed, in order: commands and keys; an empty one waits for the command before."""
        typed = [line for line in self.text.splitlines() if line.startswith("$ ") or line in KEYS]
        return typed if self.text.startswith(("$ ", "^")) else ["", *typed]


def blocks_of(page: str) -> list[Block]:
    """Return the blocks of a page in order."""
    return [
        Block(match[1], tuple(shlex.split(match[2])), match[3], match.start(3))
        for match in BLOCK.finditer(page)
        if match[1] == "console" or match[2]
    ]


def commands_of(page: str) -> list[str]:
    """Return the commands of a page in order."""
    blocks = [block for block in blocks_of(page) if block.kind == "console"]
    return [step[2:] for block in blocks for step in block.steps if step.startswith("$ ")]


class Shell:
    """A terminal of the page: a shell that runs one command after the other; use as a context manager.

    Args:
        folder: Where it starts.
        environment: The variables of its commands.
    """

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            ["bash", "--norc"],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            text=True,
        )
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._read, args=[self._process.stdout], daemon=True).start()
        self._type("trap : INT QUIT; ulimit -c 0")
        self.busy = False
        self.code = 0

    def __enter__(self) -> Shell:
        """Return the shell."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the command and the shell."""
        if self.busy:
            self.press(signal.SIGINT)
            try:
                self.read(budget_s=60.0)
            except CommandWentWrong:
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.communicate()

    def _read(self, output: IO[str]) -> None:
        for line in output:
            self._lines.put(line.rstrip())

    def _type(self, text: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{text}\n")
        self._process.stdin.flush()

    def start(self, command: str) -> None:
        """Type a command."""
        if self.busy:
            raise CommandWentWrong(f"the terminal is busy, and was to run: {command}")
        self._type(f"{{ {command}; }} < /dev/null; code=$?; echo; echo {ENDED} $code")
        self.busy = True

    def press(self, key: int) -> None:
        """Send the signal of a key to the command, as a terminal does."""
        os.killpg(self._process.pid, key)

    def read(self, until: str | None = None, budget_s: float = BUDGET_S) -> list[str]:
        """Wait for the end of the command, or for a line with a text, and return what was printed.

        Raises:
            CommandWentWrong: Neither comes.
        """
        lines: list[str] = []
        end = time.monotonic() + budget_s
        while self.busy:
            try:
                line = self._lines.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                said = "\n".join(lines)
                raise CommandWentWrong(f"nothing within {budget_s:g} s after:\n{said}") from None
            if line.startswith(ENDED):
                self.busy, self.code = False, int(line.rsplit(" ", 1)[1])
                return lines[:-1] if lines and not lines[-1] else lines
            lines.append(line)
            if until is not None and until in line:
                return lines
        return lines


def shortened(lines: list[str], amount: str) -> list[str]:
    """Keep the first and the last lines: ``2..3`` are two and three."""
    first, last = (int(number) for number in amount.split(".."))
    if len(lines) <= first + last + 1:
        return lines
    return [*lines[:first], "...", *lines[len(lines) - last :]]


def without_figures(text: str) -> str:
    """Remove what differs from run to run: figures, widths that follow from them, log lines of a run."""
    ended = re.sub(r"^ +[\d.]+ s  \[.\].*\n", "", text, flags=re.MULTILINE)
    return re.sub(r"[\s─=]+", " ", re.sub(r"-?\d[\d.:TZ-]*", "0", ended))


def transcript(
    page: str,
    folder: Path,
    environment: dict[str, str],
    runs: Callable[[Block], bool] = lambda _: True,
) -> Iterator[tuple[Block, str]]:
    """Run the commands of a page.

    Args:
        page: Its text.
        folder: Where files are written and commands run.
        environment: The variables of its commands.
        runs: Which blocks of commands run; the others are left out.

    Yields:
        Each block with its new text. Where only figures differ, that is the old one.

    Raises:
        CommandWentWrong: A command is not known, used wrongly, or does not end.
    """
    shells: dict[str, Shell] = {}
    try:
        for block in blocks_of(page):
            if block.kind == "yaml":
                file = folder / block.words[0]
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(block.text)
                yield block, block.text
                continue
            if not runs(block):
                continue
            if block.terminal not in shells:
                shells[block.terminal] = Shell(folder, environment)
            new = "".join(f"{line}\n" for line in _play(block, shells[block.terminal]))
            new = new.replace(str(folder), "~/florence_bt")
            said_nothing = "once" in block.options and new.splitlines() == block.steps
            same = said_nothing or without_figures(new) == without_figures(block.text)
            yield block, block.text if same else new
    finally:
        for shell in shells.values():
            shell.__exit__(None, None, None)


def _play(block: Block, shell: Shell) -> Iterator[str]:
    """Type what a block has, and yield its lines anew."""
    for step in block.steps:
        print(f"[{block.terminal}] {step}", file=sys.stderr, flush=True)
        if step in KEYS:
            shell.press(KEYS[step])
        elif step:
            shell.start(step[2:])
        lines = shell.read(block.options.get("until"))
        said = "\n".join(lines)
        if (not shell.busy and shell.code in (2, 127)) or "Traceback" in said:
            raise CommandWentWrong(f"{step}: code {shell.code}\n{said}")
        yield from [step] if step else []
        yield from shortened(lines, block.options["lines"]) if "lines" in block.options else lines


def written_anew(page: Path, folder: Path, environment: dict[str, str]) -> None:
    """Run a page and write it after each block, so that what was done stays when a command goes wrong."""
    old = page.read_text()
    done, place = "", 0
    for block, new in transcript(old, folder, environment):
        done += old[place : block.start] + new
        place = block.start + len(block.text)
        page.write_text(done + old[place:])


def clone(folder: Path) -> Path:
    """Bring the last commit into a folder, without what a page wrote there before; its ``.venv`` stays.

    Returns:
        The checkout.
    """
    checkout = folder / "florence_bt"
    if not checkout.exists():
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(checkout)], check=True)
    git = ["git", "-C", str(checkout)]
    commit = subprocess.check_output(["git", "-C", str(ROOT), "rev-parse", "HEAD"], text=True).strip()
    subprocess.run([*git, "fetch", "--quiet", str(ROOT), commit], check=True)
    subprocess.run([*git, "checkout", "--quiet", "--force", commit], check=True)
    subprocess.run([*git, "clean", "--quiet", "-fd"], check=True)
    shutil.rmtree(checkout / "runs", ignore_errors=True)
    return checkout.resolve()


def newcomers_environment() -> dict[str, str]:
    """Return the variables of this process without what points to a Florence that is installed already."""
    hidden = ("PYTHONPATH", "VIRTUAL_ENV", "FLORENCE_NAMESPACE")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    return environment | {"COLUMNS": "100", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def main() -> int:
    """Write the page of the command line.

    Returns:
        0 when each command could be shown, else 1.
    """
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("page", type=Path, help="the page, e.g. docs/manual/first_hour.md")
    parser.add_argument(
        "--folder", type=Path, help="where the clone is kept (a temporary folder if not given)"
    )
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="first_hour_") as temporary:
        folder = (arguments.folder or Path(temporary)).resolve()
        try:
            written_anew(arguments.page, clone(folder), newcomers_environment())
        except CommandWentWrong as wrong:
            print(wrong, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
