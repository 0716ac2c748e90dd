"""What the fork server imports starts no thread: a fork has only the one that forked it."""

from __future__ import annotations

import os
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
