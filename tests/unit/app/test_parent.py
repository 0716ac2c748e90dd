"""Processes end with the one that started them, whatever it died of: real processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from florence_bt.app.bringup.locks import lock_folder
from florence_bt.app.bringup.parent import child_command
from florence_bt.core.errors import ConfigError
from tests.script_process import is_alive, wait_for

STUBBORN = """
import signal, sys
for number in (signal.SIGTERM, signal.SIGINT):
    signal.signal(number, signal.SIG_IGN)
print("is up", file=sys.stderr, flush=True)
while True:
    signal.pause()
"""
"""A child that nothing but a kill can end."""


class Parent:
    """A process that runs a script, which prints the process id of its child, and is killed."""

    def __init__(self, script: str, folder: Path) -> None:
        self._log = folder / "log"
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=log, text=True, cwd=folder
            )
        assert self._process.stdout is not None
        self.child = int(self._process.stdout.readline())
        wait_for(lambda: "is up" in self.log, "the child")

    @property
    def log(self) -> str:
        return self._log.read_text()

    @property
    def pid(self) -> int:
        return self._process.pid

    def kill(self) -> None:
        assert self._process.stdout is not None
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()


def test_a_module_is_killed_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "stubborn.py").write_text(STUBBORN)
    parent = Parent(
        """
import subprocess, time
from florence_bt.app.bringup.parent import child_command
print(subprocess.Popen(child_command("stubborn"), start_new_session=True).pid, flush=True)
time.sleep(600)
""",
        tmp_path,
    )
    assert is_alive(parent.child)
    parent.kill()
    wait_for(lambda: not is_alive(parent.child), "the end of the child")


def test_a_module_whose_parent_is_gone_does_not_begin(tmp_path: Path) -> None:
    (tmp_path / "begun.py").write_text("open('begun', 'w').close()")
    started = child_command("begun")
    done = subprocess.run(
        ["sh", "-c", '"$@" & wait', "sh", *started], cwd=tmp_path, check=False
    )  # whose parent is the shell, and not this process
    assert done.returncode == 0 and not (tmp_path / "begun").exists()


def test_a_process_of_a_bring_up_that_hangs_in_its_end_goes_with_its_supervisor(tmp_path: Path) -> None:
    # The real process, but for the nodes, which never end, and a shorter grace.
    (tmp_path / "hangs.py").write_text(
        """
import signal
from florence_bt.app.bringup import process
process.ALONE_S = 0.2

def main(group, options_file, parent):
    import florence_bt.ros.process
    def run_nodes(*_, **__):
        exec(STUBBORN)
    florence_bt.ros.process.run_nodes = run_nodes
    return process.main(group, options_file, parent)
"""
        f"STUBBORN = {STUBBORN!r}\n"
    )
    parent = Parent(
        """
import os, time
from pathlib import Path
from florence_bt.app.bringup.fork_server import ForkServer
from florence_bt.app.bringup.heartbeat import FD_VARIABLE
from florence_bt.app.bringup.locks import lock_folder
from florence_bt.app.bringup.options import BringUp
here = Path.cwd()
lock = lock_folder(here)
options = BringUp(folder=str(here)).write()
server = ForkServer(here, "hangs", first=())
more = {"keep_open": {FD_VARIABLE: os.pipe()[1]}, "hold": [lock.fileno()]}
print(server.fork("people", options, output=2, variables={}, **more).pid, flush=True)
time.sleep(600)
""",
        tmp_path,
    )
    with pytest.raises(ConfigError, match=f"process {parent.pid}\\)"):
        lock_folder(tmp_path)
    parent.kill()
    refusals: list[str] = []

    def is_free() -> bool:
        try:
            lock_folder(tmp_path).close()
        except ConfigError as refusal:
            refusals.append(str(refusal))
            return False
        return True

    wait_for(is_free, "the end of the child")
    assert f"process {parent.child}, left by {parent.pid}" in refusals[0], "who is left is named"
    assert not is_alive(parent.child) and "run_nodes" in parent.log, "its stack says where it hung"
