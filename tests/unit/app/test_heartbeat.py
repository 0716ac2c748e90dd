"""Both ends of the pipe that heartbeats go through, in one process."""

from __future__ import annotations

import os

import pytest

from florence_bt.app.bringup.heartbeat import (
    FD_VARIABLE,
    LONGEST_LOOK_S,
    SILENT_S,
    HeartbeatMonitor,
    heartbeat_of_this_process,
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
    monitor.started()


def test_who_looks_seldom_was_held_up_and_blames_nobody(monitor, beat):
    beat()
    monitor.look(0.0)
    monitor.look(3600.0)
    assert monitor.silent_s == LONGEST_LOOK_S
    monitor.started()


def test_a_full_pipe_holds_nobody_up_and_is_read_whole(monitor, beat):
    for _ in range(100_000):
        beat()
    for look in range(40):
        monitor.look(look * 0.25)
    assert monitor.silent_s > SILENT_S
    beat()
    monitor.look(11.0)
    assert monitor.silent_s == 0.0
    monitor.started()


def test_a_supervisor_that_was_killed_is_no_error(monkeypatch):
    monitor = HeartbeatMonitor(0.0)
    monkeypatch.setenv(FD_VARIABLE, str(monitor.writer))
    beat = heartbeat_of_this_process()
    monitor.close()
    with pytest.raises(BrokenPipeError):
        os.write(monitor.writer, b"\0")
    beat()
    monitor.started()
