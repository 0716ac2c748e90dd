"""Every way in which a bring-up or a client ends early: nothing is left, the exit code is the right one."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from florence_bt.app.bringup.heartbeat import STACK_SIGNAL
from tests.script_process import free_port
from tests.sweeps import sweep

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.timeout(1800)]

FLORENCE = [sys.executable, "-m", "florence_bt.cli"]
PATIENCE_S = 600.0


def command_of(pid: int) -> str:
    """The command line of a process, empty when it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


def left_over(folder: Path) -> list[int]:
    """Processes of a bring-up in a folder that are still there, those that draw pictures included."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            command = command_of(int(entry.name))
            if str(folder) in command and "florence_bt." in command:
                found.append(int(entry.name))
    return found


def kill_process(folder: Path, group: str, number: signal.Signals = signal.SIGKILL) -> None:
    """Kill the process of a group of nodes, or send it another signal."""
    (victim,) = (
        pid for pid in left_over(folder) if f"florence_bt.app.bringup.process\0{group}\0" in command_of(pid)
    )
    os.kill(victim, number)


def recorded(folder: Path) -> list[str]:
    """The runs that have a folder."""
    return [entry.name for entry in (folder / "runs").iterdir() if entry.is_dir()]


def bring_up(start_process, verb, folder, *more):
    # Nobody is at home: a demonstration looks into every room before it ends by itself. In real time, for
    # what is waited for here are processes: each simulated second that passes meanwhile is of no use.
    arguments = [verb, *(["--sim"] if verb == "up" else ["--headless"]), "--person", "absent"]
    return start_process(*FLORENCE, *arguments, "--out", folder, *more)


def assert_clean(child, folder, code):
    assert child.process.returncode == code, child.output
    assert "Traceback" not in child.output and "terminate called" not in child.output, child.output
    assert left_over(folder) == []
    ports = folder / "ports"
    assert not ports.exists() or not any(ports.iterdir())


MOMENTS = {
    "while the parts are loaded": (None, [signal.SIGINT]),
    "while the processes start": ("starting simulator, hardware", [signal.SIGTERM]),
    "while the mission runs": ("calling the mission service", [signal.SIGTERM]),
    "by the impatient": (
        "calling the mission service",
        [signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGINT],
    ),
}


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_demo_can_be_interrupted_at_every_moment(start_process, tmp_path, moment):
    text, signals = MOMENTS[moment]
    folder = tmp_path / "out"
    child = bring_up(start_process, "demo", folder)
    if text:
        child.wait_for(text, PATIENCE_S)
    else:
        wait_for_module(child, "rclpy")
    for number in signals:
        child.process.send_signal(number)
    child.end(signals[-1], PATIENCE_S)
    assert_clean(child, folder, 130)


def wait_for_module(child, name):
    """Wait until a process has mapped a library of a module: it is amid its imports."""
    maps = Path(f"/proc/{child.process.pid}/maps")
    while name not in maps.read_text():
        assert child.process.poll() is None, child.output
        time.sleep(0.001)


@contextmanager
def background():
    """A script's background under nohup: SIGINT and SIGHUP are ignored, which every process inherits."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_what_is_refused_while_a_system_runs_and_what_its_clients_see_when_it_dies(
    start_process, tmp_path, patrol
):
    folder = tmp_path / "out"
    system = bring_up(start_process, "up", folder, "--missions", patrol)
    system.wait_for("ready after", PATIENCE_S)

    again = bring_up(start_process, "up", folder)
    assert again.process.wait(PATIENCE_S) == 2 and f"process {system.process.pid}" in again.output
    elsewhere = bring_up(start_process, "demo", tmp_path / "elsewhere")
    assert elsewhere.process.wait(PATIENCE_S) == 2, elsewhere.output
    assert "ROS_DOMAIN_ID" in elsewhere.output
    assert left_over(tmp_path / "elsewhere") == []

    # Ctrl-C at the client stops the mission, and only that.
    first = start_process(*FLORENCE, "run", "patrol", "--headless")
    first.wait_for("[>] drive to the hotspot", PATIENCE_S)
    assert first.end(signal.SIGINT, PATIENCE_S) == 130, first.output
    (run_id,) = recorded(folder)
    status = start_process(*FLORENCE, "status", "--run", run_id)
    assert status.process.wait(PATIENCE_S) == 0 and "STOPPED" in status.output
    assert "Ctrl-C at florence run" in status.output

    # The mission server dies without a word while a client watches: another one takes the run up.
    watcher = start_process(*FLORENCE, "run", "patrol", "--headless")
    watcher.wait_for("[>] drive to the hotspot", PATIENCE_S)
    kill_process(folder, "missions")
    system.wait_for("the process 'missions' was killed by SIGKILL", PATIENCE_S)
    assert watcher.process.wait(PATIENCE_S) == 1, watcher.output
    assert "aborted because: the process died during it; restarted as" in watcher.output
    system.wait_for("the process 'missions' is up again", PATIENCE_S)

    # The world dies: there is nothing to start again, and all ends with what it was.
    watcher = start_process(*FLORENCE, "run", "patrol", "--headless", "--policy", "preempt")
    watcher.wait_for("[>] drive to the hotspot", PATIENCE_S)
    kill_process(folder, "simulator")
    assert system.process.wait(PATIENCE_S) == 3
    assert "the process 'simulator' was killed by SIGKILL" in system.output
    assert watcher.process.wait(PATIENCE_S) in (1, 3), watcher.output
    last = start_process(*FLORENCE, "runs", "--folder", folder / "runs", "--limit", "1")
    assert last.process.wait(PATIENCE_S) == 0
    assert "STOPPED" in last.output and "the process 'simulator' was killed by SIGKILL" in last.output
    assert_clean(system, folder, 3)


def test_a_killed_bring_up_hinders_no_other_not_even_one_in_the_background_of_a_script(
    start_process, tmp_path, patrol
):
    folder = tmp_path / "out"
    first = bring_up(start_process, "up", folder, "--missions", patrol)
    first.wait_for("ready after", PATIENCE_S)
    run = start_process(*FLORENCE, "run", "patrol", "--detach")
    assert run.process.wait(PATIENCE_S) == 0
    first.process.kill()
    first.process.wait()
    end = time.monotonic() + PATIENCE_S
    while left_over(folder):
        assert time.monotonic() < end
        time.sleep(0.02)

    with background():
        fresh = bring_up(start_process, "up", folder)
    fresh.wait_for("starting simulator, hardware", PATIENCE_S)
    for number in (signal.SIGINT, signal.SIGHUP):  # they stay ignored
        fresh.process.send_signal(number)
    fresh.wait_for("ready after", PATIENCE_S)
    (run_id,) = recorded(folder)
    old = start_process(*FLORENCE, "status", "--run", run_id)
    assert old.process.wait(PATIENCE_S) == 0 and "STOPPED" in old.output
    fresh.end(signal.SIGTERM, PATIENCE_S)
    assert "was killed" not in fresh.output
    assert_clean(fresh, folder, 130)


def test_a_hung_mission_server_stops_the_robot_and_is_started_again(start_process, tmp_path, patrol):
    folder = tmp_path / "out"
    system = bring_up(start_process, "up", folder, "--missions", patrol)
    system.wait_for("ready after", PATIENCE_S)
    watcher = start_process(*FLORENCE, "run", "patrol", "--headless")
    watcher.wait_for("[>] drive to the hotspot", PATIENCE_S)
    kill_process(folder, "missions", signal.SIGSTOP)
    system.wait_for("the process 'missions' has not answered for 1.0 s; the robot is stopped", PATIENCE_S)
    kill_process(folder, "missions", signal.SIGCONT)
    system.wait_for("the process 'missions' answers again", PATIENCE_S)
    system.wait_for("the robot may drive again", PATIENCE_S)
    status = start_process(*FLORENCE, "status")
    assert status.process.wait(PATIENCE_S) == 0 and "patrol: RUNNING" in status.output, status.output
    log = folder / "logs" / "missions.log"
    assert "a signal has stopped it" in log.read_text()
    kill_process(folder, "missions", STACK_SIGNAL)
    end = time.monotonic() + PATIENCE_S
    while "(most recent call first)" not in log.read_text():
        assert time.monotonic() < end, log.read_text()
        time.sleep(0.02)

    kill_process(folder, "missions", signal.SIGSTOP)
    system.wait_for("the process 'missions' did not answer for 5 s and was killed", PATIENCE_S)
    system.wait_for("the process 'missions' is up again", PATIENCE_S)
    again = start_process(*FLORENCE, "run", "patrol", "--headless", "--policy", "preempt")
    again.wait_for("[>] drive to the hotspot", PATIENCE_S)
    system.end(signal.SIGINT, PATIENCE_S)
    assert_clean(system, folder, 130)


@pytest.mark.parametrize("known", [True, False])
def test_ctrl_c_while_the_hardware_hangs(start_process, tmp_path, patrol, known):
    """The base is stopped past its driver; nobody waits for a process that will not end."""
    folder = tmp_path / "out"
    system = bring_up(start_process, "up", folder, "--missions", patrol)
    system.wait_for("ready after", PATIENCE_S)
    watcher = start_process(*FLORENCE, "run", "patrol", "--headless")
    watcher.wait_for("[>] drive to the hotspot", PATIENCE_S)
    kill_process(folder, "hardware", signal.SIGSTOP)
    if known:
        system.wait_for("the process 'hardware' has not answered for 1.0 s; the robot is stopped", PATIENCE_S)
    system.end(signal.SIGINT, PATIENCE_S)
    assert "the process 'hardware' did not end in time and was killed" in system.output
    assert "the base was sent a stop command" in system.output
    assert_clean(system, folder, 130)


def start_of(start_process, verb, folder):
    """Begin what brings a simulated robot up."""
    if verb == "up":
        return bring_up(start_process, verb, folder)
    return start_process(
        *FLORENCE, "map", "explore", "--sim", "--overwrite", "--folder", folder, folder.parent / "home.yaml"
    )


@pytest.mark.parametrize("seed", sweep(range(20), every=7))
def test_killed_at_any_moment_of_a_start_nothing_is_left_and_the_next_start_works(
    start_process, tmp_path, seed
):
    draw = random.Random(seed)
    verb, folder, there = draw.choice(["up", "explore"]), tmp_path / "out", draw.randint(1, 7)
    system = start_of(start_process, verb, folder)
    end = time.monotonic() + PATIENCE_S
    while len(left_over(folder)) < there and "ready after" not in system.output:
        assert system.process.poll() is None and time.monotonic() < end, system.output
        time.sleep(0.001)
    victim = draw.choice([system.process.pid, *left_over(folder)])
    os.kill(victim, signal.SIGKILL)
    if victim != system.process.pid:  # one of its processes: it is started again, or all ends
        while system.process.poll() is None and "ready after" not in system.output:
            assert time.monotonic() < end, system.output
            time.sleep(0.02)
        system.process.kill()
    system.process.wait()
    while left := left_over(folder):
        assert time.monotonic() < end, [command_of(pid) for pid in left]
        time.sleep(0.02)
    assert "Traceback" not in system.output, system.output

    fresh = start_of(start_process, verb, folder)
    fresh.wait_for("ready after", PATIENCE_S)
    fresh.end(signal.SIGINT, PATIENCE_S)
    assert_clean(fresh, folder, 130)


@pytest.mark.parametrize(("command", "ready"), [("page", "the page: "), ("record", "recording into")])
def test_a_killed_page_or_recorder_leaves_nothing_and_the_next_one_works(
    start_process, tmp_path, command, ready
):
    folder = tmp_path / "out"
    folder.mkdir()
    words = [command, *(["--port", str(free_port()), "--folder"] if command == "page" else []), folder]
    for _ in range(2):
        child = start_process(*FLORENCE, *words)
        child.wait_for(ready, PATIENCE_S)
        child.process.kill()
        child.process.wait()
        assert left_over(folder) == [] and "Traceback" not in child.output
    last = start_process(*FLORENCE, *words)
    last.wait_for(ready, PATIENCE_S)
    last.end(signal.SIGINT, PATIENCE_S)
    assert "Traceback" not in last.output


def test_a_client_that_does_not_get_out_of_ros_ends_all_the_same(start_process):
    program = """
import threading
from florence_bt.app.runs import client
client.LEAVING_S = 0.2
here = client.MissionClient("hangs")
here.node.destroy_node = threading.Event().wait
here.close()
"""
    child = start_process("-c", program)
    assert child.process.wait(PATIENCE_S) == 1 and "Timeout" in child.output
