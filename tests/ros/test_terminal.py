"""``florence run`` and ``status --watch`` in a terminal: what its user sees, and what the keys do."""

from __future__ import annotations

import os
import signal

import pytest

pytest.importorskip("pyte")

from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tools.terminal import Terminal

pytestmark = [pytest.mark.ros, pytest.mark.timeout(600)]

FLORENCE = ("-m", "florence_bt.cli")


@pytest.fixture
def in_terminal(bench_of):
    """A mission server, and a function that runs a command in a terminal while the server is served."""
    bench = bench_of(Step(None), Step(None), Step(None))

    def run(*arguments, **size):
        return Terminal([*FLORENCE, *arguments], **size)

    def seen(terminal, pattern):
        return terminal.wait_for(pattern, meanwhile=lambda: bench.ros.loop.spin_once(0.01))

    return bench, run, seen


def ended(terminal):
    """Wait for the end of the command; the time-out of the test limits it."""
    while terminal.code is None:
        terminal.look()


def test_ctrl_c_stops_the_mission_and_shows_how_it_ended(in_terminal):
    bench, run, seen = in_terminal
    with run("run", "drive_once", "way=2 m") as terminal:
        screen = seen(terminal, r"(?m)^now +drive ")
        assert "drive_once: RUNNING" in screen and "Ctrl-C stop the mission" in screen
        terminal.press("\x03")
        screen = seen(terminal, r"(?s)STOPPED.*interrupted")
        assert "Ctrl-C at florence run" in screen and "[-] drive" in screen
        ended(terminal)
        assert terminal.code == 130
    bench.wait("STOPPED")


def test_a_terminal_that_is_closed_stops_its_mission(in_terminal):
    bench, run, seen = in_terminal
    with run("run", "drive_once") as terminal:
        seen(terminal, r"(?m)^now +drive ")
        terminal.hang_up()
        assert "Ctrl-C at florence run" in bench.wait("STOPPED").reason


def test_q_leaves_the_mission_running_and_the_end_is_told_with_its_reason(in_terminal):
    bench, run, seen = in_terminal
    with run("run", "drive_once") as terminal:
        seen(terminal, r"(?m)^now +drive ")
        terminal.press("q")
        seen(terminal, "the mission goes on")
        ended(terminal)
        assert terminal.code == 0
    assert bench.status().state == "RUNNING"
    with run("status", "--watch") as terminal:
        seen(terminal, r"(?m)^now +drive ")
        bench.end_drive(failure("blocked", "a chair is in the way"))
        bench.wait("FAILED")
        screen = seen(terminal, "FAILED")
        assert "a chair is in the way" in screen
        terminal.press("q")
        ended(terminal)
        assert terminal.code == 0


def test_a_viewer_that_stands_still_does_not_hold_missions_up(in_terminal):
    bench, run, seen = in_terminal
    with run("status", "--watch") as terminal:
        bench.run("drive_once")
        seen(terminal, r"(?m)^now +drive ")
        os.kill(terminal.pid, signal.SIGSTOP)
        bench.end_drive(success())
        bench.wait("SUCCEEDED")
        for _ in range(30):
            run_id = bench.run("be_quick").run_id
            assert bench.wait("SUCCEEDED", run_id).found
        os.kill(terminal.pid, signal.SIGCONT)
        seen(terminal, "be_quick: SUCCEEDED")
        terminal.resize(120, 30)
        seen(terminal, "─" * 85)
