"""The fork server and its forks: real processes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys

import pytest

from florence_bt.app.bringup.fork_server import ForkServer
from tests.script_process import is_alive, wait_for

PROBE = "tests.fork_probe"


class Bench:
    """A fork server whose forks say what they are."""

    def __init__(self, folder):
        self.folder = folder
        self.server = ForkServer(folder, PROBE, first=())
        self.forks = []
        self.heart, self._writer = os.pipe()
        self._held = (folder / "held").open("w")

    def fork(self, group):
        """Fork a process; gives it and what it says of itself."""
        log = self.folder / f"{len(self.forks)}.log"
        with log.open("wb") as output:
            fork = self.server.fork(
                group,
                self.folder / "options.json",
                output=output.fileno(),
                variables={"TOLD": "yes"},
                keep_open={"HEART": self._writer},
                hold=[self._held.fileno()],
            )
        self.forks.append(fork)
        wait_for(lambda: log.read_text().endswith("\n"), "the fork's first line")
        return fork, json.loads(log.read_text())

    def close(self):
        for fork in self.forks:
            fork.kill()
            wait_for(lambda fork=fork: fork.poll() is not None, "the end of a fork")
        self.server.close()
        self._held.close()
        for end in (self.heart, self._writer):
            os.close(end)


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.close()


def test_a_fork_is_a_child_of_this_process_as_if_it_had_started_it(bench, tmp_path, monkeypatch):
    # The server has begun; a fork is made of what is so now.
    monkeypatch.setenv("CHANGED", "now")
    monkeypatch.delenv("GONE", raising=False)
    monkeypatch.chdir(tmp_path)
    before = os.umask(0o027)
    try:
        fork, facts = bench.fork("ends")
    finally:
        os.umask(before)
    assert facts["pid"] == facts["session"] == fork.pid
    assert facts["parents"] == [os.getpid(), os.getpid()]
    assert (facts["folder"], facts["umask"]) == (str(tmp_path), 0o027)
    assert facts["variables"] | {"HEART": ""} == {"CHANGED": "now", "GONE": None, "TOLD": "yes", "HEART": ""}
    assert facts["command"][1:] == ["-m", PROBE, "ends", str(tmp_path / "options.json"), str(os.getpid())]
    assert os.read(bench.heart, 100) == b"beat"
    assert wait_for(fork.poll, "the end") == 7 == fork.returncode


def test_a_fork_has_only_the_files_that_it_was_given(bench, tmp_path):
    bench.fork("waits")
    _, facts = bench.fork("waits")
    kinds = [file for file in facts["files"] if "/proc/" not in file]
    assert str(tmp_path / "held") in kinds and kinds.count(str(tmp_path / "1.log")) == 2
    # Standard input, output and error, the heartbeat's pipe and the held file: nothing of the server.
    assert len(kinds) == 5 and not any(kind.startswith("socket") for kind in kinds)


def test_a_variable_that_is_gone_is_gone_in_the_forks(tmp_path, monkeypatch):
    monkeypatch.setenv("GONE", "not yet")
    bench = Bench(tmp_path)
    try:
        monkeypatch.delenv("GONE")
        assert bench.fork("ends")[1]["variables"]["GONE"] is None
    finally:
        bench.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_fork_is_ended_by_signals(bench, number):
    fork, _ = bench.fork("waits")
    assert fork.poll() is None and fork.returncode is None
    fork.terminate() if number == signal.SIGTERM else fork.kill()
    assert wait_for(fork.poll, "the end") == -number
    fork.terminate()  # which is nobody's process id any more


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_without_the_server_its_forks_go_on_and_another_server_forks(bench, number):
    first, _ = bench.fork("waits")
    gone = bench.server.pid
    os.kill(gone, number)
    if number == signal.SIGKILL:
        wait_for(lambda: not is_alive(gone), "the end of the server")
    second, facts = bench.fork("waits")
    assert bench.server.pid != gone and facts["parents"] == [os.getpid(), os.getpid()]
    assert first.poll() is None and second.poll() is None and not is_alive(gone)


def test_what_cannot_be_imported_is_left_to_the_forks(tmp_path, capfd):
    bench = Bench(tmp_path)
    try:
        bench.server.load(["json", "florence_bt.no_such_module", "colorsys"])
        assert "could not load florence_bt.no_such_module" in capfd.readouterr().err
        assert bench.fork("waits")[0].poll() is None
    finally:
        bench.close()


def test_a_server_whose_supervisor_was_killed_ends(tmp_path):
    program = f"""
import time
from pathlib import Path
from florence_bt.app.bringup.fork_server import ForkServer
from tests.script_process import is_alive, wait_for
server = ForkServer(Path({str(tmp_path)!r}), first=())
server.load(["colorsys"])
print(server.pid, flush=True)
time.sleep(600)
"""
    parent = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        server = int(parent.stdout.readline())
        assert is_alive(server)
    finally:
        parent.kill()
        parent.wait()
        parent.stdout.close()
    wait_for(lambda: not is_alive(server), "the end of the server")


def test_a_server_whose_supervisor_was_killed_while_it_loads_ends_without_a_word(tmp_path):
    """What it has to answer then nobody hears, and a traceback would be on the console."""
    ours, servers = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    number = servers.fileno()
    program = ["-m", "florence_bt.app.bringup.fork_server_main", str(tmp_path), str(number)]
    server = subprocess.Popen(
        [sys.executable, *program], pass_fds=[number], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    servers.close()
    ours.send(json.dumps({"load": ["colorsys"]}).encode())
    ours.close()
    output, _ = server.communicate(timeout=600)
    assert (server.returncode, output) == (0, b"")


def test_when_the_process_between_a_fork_and_the_server_is_killed_no_fork_is_left():
    """Whoever kills at random may meet it; the server forks anew then, and nobody knows of the first fork."""
    code = (
        "import os, signal\n"
        "from florence_bt.app.bringup import fork_server_main\n"
        "os.write = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        "print(fork_server_main._fork(), flush=True)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    # A fork that was left would say 0, and hold the pipe open meanwhile.
    assert (ended.stdout, ended.stderr, ended.returncode) == ("None\n", "", 0)
