"""Both ends of the pipe that heartbeats go through, in one process."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from florence_bt.app.bringup import heartbeat
from florence_bt.app.bringup.heartbeat import (
    FD_VARIABLE,
    KILLED_AFTER_S,
    LONGEST_LOOK_S,
    SILENT_S,
    HeartbeatMonitor,
    heartbeat_of_this_process,
    run_delay,
)


@pytest.fixture
def monitor():
    monitor = HeartbeatMonitor(0.0)
    yield monitor
    monitor.close()


@pytest.fixture
def beat(monitor, monkeypatch):
    monkeypatch.setenv(FD_VARIABLE, str(monitor.writer))
    return heartbeat_of_this_process()


def test_silence_counts_from_the_first_beat_on(monitor, beat):
    monitor.look(60.0)
    assert not monitor.has_beaten and not monitor.is_silent
    beat()
    monitor.look(60.1)
    assert monitor.has_beaten and monitor.silent_s == 0.0
    for look in range(1, 21):
        monitor.look(60.1 + 0.05 * look)
    assert monitor.silent_s == pytest.approx(SILENT_S)
    beat()
    monitor.look(61.2)
    assert monitor.silent_s == 0.0
    monitor.started(os.getpid())


def test_who_does_long_work_is_silent_but_not_killed_for_a_minute(monitor, beat):
    beat(long_work=True)
    monitor.look(0.0)
    for look in range(1, 20 * 61 + 1):
        monitor.look(0.05 * look)
    assert SILENT_S <= monitor.silent_s < KILLED_AFTER_S
    for look in range(20 * 61 + 1, 20 * 66):
        monitor.look(0.05 * look)
    assert monitor.silent_s >= KILLED_AFTER_S - 0.2
    beat()
    monitor.look(66.0)
    for look in range(1, 20 * 5 + 2):
        monitor.look(66.0 + 0.05 * look)
    assert monitor.silent_s >= KILLED_AFTER_S
    monitor.started(os.getpid())


def test_who_looks_seldom_was_held_up_and_blames_nobody(monitor, beat):
    beat()
    monitor.look(0.0)
    monitor.look(3600.0)
    assert monitor.silent_s == LONGEST_LOOK_S
    monitor.started(os.getpid())


def test_time_without_a_processor_makes_nobody_hang(monitor, beat, monkeypatch):
    waited = iter([7.0, *(7.0 + 0.04 * look for look in range(1, 200))])
    monkeypatch.setattr(heartbeat, "run_delay", lambda pid: next(waited))
    beat()
    looks = 0
    monitor.look(0.0)
    while not monitor.is_silent:
        looks += 1
        monitor.look(0.05 * looks)
    assert looks == pytest.approx(SILENT_S / 0.05, abs=1), "the robot is held as soon as ever"
    for look in range(101):
        monitor.look(0.05 * (looks + 1 + look))
    assert monitor.silent_s == pytest.approx(SILENT_S + 100 * 0.01)
    monitor.started(os.getpid())


def test_the_kernel_tells_who_waits_for_a_processor():
    core = min(os.sched_getaffinity(0))
    spin = f"import os, time; os.sched_setaffinity(0, [{core}]); print(flush=True)\nwhile True: pass"
    stand = "import signal; print(flush=True); signal.pause()"
    rivals = [start_python(spin), start_python(spin), start_python(stand)]
    try:
        before = [run_delay(rival.pid) for rival in rivals]
        # The one that stands waits while it starts, too: on a busy machine for some time.
        while run_delay(rivals[0].pid) < before[0] + 0.5:
            pass
        assert run_delay(rivals[2].pid) < before[2] + 0.25
    finally:
        for rival in rivals:
            with rival:
                rival.kill()
    assert run_delay(rivals[0].pid) == 0.0, "it is gone"


def start_python(code):
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    process.stdout.readline()
    return process


def test_a_full_pipe_holds_nobody_up_and_is_read_whole(monitor, beat):
    for _ in range(100_000):
        beat()
    for look in range(40):
        monitor.look(look * 0.25)
    assert monitor.silent_s > SILENT_S
    beat()
    monitor.look(11.0)
    assert monitor.silent_s == 0.0
    monitor.started(os.getpid())


def test_a_supervisor_that_was_killed_is_no_error(monkeypatch):
    monitor = HeartbeatMonitor(0.0)
    monkeypatch.setenv(FD_VARIABLE, str(monitor.writer))
    beat = heartbeat_of_this_process()
    monitor.close()
    with pytest.raises(BrokenPipeError):
        os.write(monitor.writer, b"\0")
    beat()
    monitor.started(os.getpid())
