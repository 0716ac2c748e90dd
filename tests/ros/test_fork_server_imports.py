"""What the fork server imports starts no thread: a fork has only the one that forked it. And no Python:
one that loses the server amid its start would fill the terminal with a traceback."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.bringup.fork_server import EVERYBODY, ForkServer
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.topology import loaded_for, processes


def threads_of(pid: int) -> int:
    return len(os.listdir(f"/proc/{pid}/task"))


def test_what_the_processes_of_a_bring_up_import_starts_no_thread(tmp_path: Path) -> None:
    options = BringUp(folder=str(tmp_path), record=True, page_port=8080, home_file="home.yaml")
    with ForkServer(tmp_path, first=()) as server:
        server.load(["rclpy"])  # whose tracing library has two, which wait for a tracing daemon
        with_rclpy = threads_of(server.pid)
        for group, what in {
            "all": EVERYBODY,
            **{each: loaded_for(each, options) for each in processes(options)},
        }.items():
            server.load(what)
            assert threads_of(server.pid) == with_rclpy, group
        assert with_rclpy <= 3


STARTED = """
import importlib, json, sys
programs = []
sys.addaudithook(lambda event, told: programs.append(told[0]) if event == "subprocess.Popen" else None)
for each in json.loads(sys.argv[1]):
    module, _, function = each.partition(":")
    imported = importlib.import_module(module)
    if function:
        getattr(imported, function)()
print(json.dumps([str(program) for program in programs]))
"""


def test_what_the_processes_of_a_bring_up_import_starts_no_python(tmp_path: Path) -> None:
    options = BringUp(folder=str(tmp_path), record=True, page_port=8080, home_file="home.yaml")
    what = [*EVERYBODY, *(each for group in processes(options) for each in loaded_for(group, options))]
    run = subprocess.run(
        [sys.executable, "-c", STARTED, json.dumps(what)], check=True, capture_output=True, text=True
    )
    # The page's import asks ldconfig(8) for the C library.
    assert set(json.loads(run.stdout)) <= {"/sbin/ldconfig"}
