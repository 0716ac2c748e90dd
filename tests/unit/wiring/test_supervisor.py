"""Real child processes, each a tiny Python script."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.wiring.locks import bring_up_here, lock_domain, lock_folder
from florence_bt.wiring.supervisor import (
    RESTARTS,
    RESTARTS_PERIOD_S,
    STARTED_AGAIN,
    ProcessDied,
    Supervisor,
    command_of,
)

OBEDIENT = """
import signal, sys, pathlib
def end(*_):
    with open(sys.argv[2], "a") as file:
        file.write(sys.argv[1] + "\\n")
    sys.exit(0)
signal.signal(signal.SIGINT, end)
pathlib.Path(sys.argv[2] + "." + sys.argv[1]).touch()
while True:
    signal.pause()
"""
STUBBORN = OBEDIENT.replace(
    "signal.signal(signal.SIGINT, end)", "signal.signal(signal.SIGINT, signal.SIG_IGN)"
)
DYING = "print('the port is gone', flush=True); raise SystemExit(7)"


def wait_for(condition, what, budget_s=300.0):
    end = time.monotonic() + budget_s
    while not (value := condition()):
        assert time.monotonic() < end, f"waited for {what}"
        time.sleep(0.005)
    return value


def is_alive(pid):
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


@pytest.fixture
def supervisor_of(tmp_path):
    """A supervisor of scripts by group name; every child is gone in the end."""
    made = []

    def make(scripts, **options):
        def command(group, options_file):
            return [sys.executable, "-c", scripts[group], group, str(options_file)]

        patient = {"stop_budget_s": 300.0, **options}
        made.append(Supervisor(tmp_path / "told", tmp_path / "logs", make_command=command, **patient))
        made[-1].start(list(scripts))
        return made[-1]

    yield make
    for supervisor in made:
        supervisor.stop()


def wait_up(tmp_path, *groups):
    wait_for(lambda: all((tmp_path / f"told.{group}").exists() for group in groups), "the children")


def test_children_end_in_the_opposite_order_of_their_start(tmp_path, supervisor_of):
    supervisor = supervisor_of(dict.fromkeys(["one", "two", "three"], OBEDIENT))
    wait_up(tmp_path, "one", "two", "three")
    supervisor.check()
    pids = list(supervisor.pids().values())
    assert supervisor.stop() == []
    assert (tmp_path / "told").read_text().split() == ["three", "two", "one"]
    assert not any(is_alive(pid) for pid in pids) and supervisor.pids() == {}
    assert supervisor.stop() == []


def test_a_stubborn_child_is_killed_and_named(tmp_path, supervisor_of):
    supervisor = supervisor_of({"bad": STUBBORN}, stop_budget_s=0.3)
    wait_up(tmp_path, "bad")
    bad = supervisor.pids()["bad"]
    assert supervisor.stop() == ["bad"]
    assert not is_alive(bad) and not (tmp_path / "told").exists()


def death_in(supervisor):
    """Wait for the death of a child."""

    def died():
        try:
            supervisor.check()
        except ProcessDied as error:
            return error
        return None

    return wait_for(died, "the death")


def test_a_child_that_dies_is_reported_with_its_log(tmp_path, supervisor_of):
    supervisor = supervisor_of({"good": OBEDIENT, "hardware": DYING})
    death = death_in(supervisor)
    assert death.name == "hardware" and death.what == "the process 'hardware' ended with code 7"
    assert death.what in str(death) and "the port is gone" in str(death)
    assert str(tmp_path / "logs" / "hardware.log") in str(death)


def test_what_has_to_be_done_after_a_death_is_done_at_once_and_once(tmp_path, supervisor_of):
    dead = []

    def after_death(name):
        dead.append(name)
        return f"{name} is mourned"

    scripts = {"hardware": OBEDIENT, "bad": STUBBORN}
    supervisor = supervisor_of(scripts, after_death=after_death, stop_budget_s=0.3)
    wait_up(tmp_path, *scripts)
    os.kill(supervisor.pids()["hardware"], signal.SIGKILL)
    for _ in range(2):
        message = str(death_in(supervisor))
        assert "'hardware' was killed by SIGKILL; hardware is mourned" in message
    assert dead == ["hardware"]
    supervisor.stop()
    assert dead == ["hardware", "bad"]


def test_a_child_that_died_unseen_before_the_end_is_mourned_too(tmp_path, supervisor_of):
    dead = []
    supervisor = supervisor_of({"hardware": OBEDIENT}, after_death=lambda name: dead.append(name) or "")
    wait_up(tmp_path, "hardware")
    os.kill(supervisor.pids()["hardware"], signal.SIGKILL)
    assert supervisor.stop() == [] and dead == ["hardware"]


def test_a_child_that_died_can_be_started_again_but_not_for_ever(tmp_path, supervisor_of):
    now = [0.0]
    supervisor = supervisor_of({"one": OBEDIENT, "missions": DYING, "two": OBEDIENT}, now=lambda: now[0])
    wait_up(tmp_path, "one", "two")
    pids = set()
    for _ in range(RESTARTS):
        assert death_in(supervisor).name == "missions"
        pids.add(supervisor.pids()["missions"])
        assert supervisor.start_again("missions")
        now[0] += 1.0
    assert len(pids) == RESTARTS and list(supervisor.pids()) == ["one", "missions", "two"]
    death_in(supervisor)
    assert not supervisor.start_again("missions")
    now[0] = RESTARTS_PERIOD_S
    assert supervisor.start_again("missions")
    death_in(supervisor)
    assert not supervisor.start_again("missions")
    supervisor.stop()
    assert (tmp_path / "told").read_text().split() == ["two", "one"]


def test_a_process_that_is_started_again_is_told_so(tmp_path, supervisor_of):
    says = f"""
import os, sys
with open(sys.argv[2], "a") as file:
    file.write(os.environ[{STARTED_AGAIN!r}] + ";")
"""
    supervisor = supervisor_of({"missions": says})
    death_in(supervisor)
    assert supervisor.start_again("missions")
    death_in(supervisor)
    assert (tmp_path / "told").read_text() == ";1;"


def test_children_ignore_what_the_terminal_sends(tmp_path, supervisor_of):
    pid = supervisor_of({"one": OBEDIENT}).pids()["one"]
    assert os.getsid(pid) != os.getsid(0)


def test_logs_that_cannot_be_written_are_named(tmp_path):
    (tmp_path / "logs").write_text("a file")
    with (
        Supervisor(tmp_path / "told", tmp_path / "logs") as supervisor,
        pytest.raises(ConfigError, match="logs"),
    ):
        supervisor.start(["missions"])


def test_a_killed_supervisor_takes_its_children_along(tmp_path):
    # The real entry point, whose heavy part is replaced by a pause.
    program = f"""
import os, signal, subprocess, sys, time
child = '''
import os, signal, sys
sys.argv = ["process", "x", "options.json", str(os.getppid())]
import florence_bt.wiring.process as process
class Heavy:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("florence_bt.ros"):
            open({str(tmp_path / "up")!r}, "w").close()
            while True:
                signal.pause()
sys.meta_path.insert(0, Heavy())
from pathlib import Path
process.main("x", Path("options.json"), int(sys.argv[3]))
'''
process = subprocess.Popen([sys.executable, "-c", child], start_new_session=True)
print(process.pid, flush=True)
time.sleep(600)
"""
    parent = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        child = int(parent.stdout.readline())
        wait_for((tmp_path / "up").exists, "the child")
    finally:
        parent.kill()
        parent.wait()
        parent.stdout.close()
    wait_for(lambda: not is_alive(child), "the child's end")


def test_a_child_ends_also_when_it_is_asked_amid_a_callback_of_an_import(tmp_path):
    # As the locks of the import machinery have one, in which an exception would be lost.
    program = f"""
import os, signal, sys, weakref
import florence_bt.wiring.process as process
class Lock: pass
class Heavy:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("florence_bt.ros"):
            lock = Lock()
            watcher = weakref.ref(lock, lambda _: os.kill(os.getpid(), signal.SIGINT))
            del lock
            open({str(tmp_path / "went on")!r}, "w").close()
            os._exit(7)
sys.meta_path.insert(0, Heavy())
from pathlib import Path
process.main("x", Path("options.json"), os.getppid())
"""
    assert subprocess.run([sys.executable, "-c", program], timeout=300).returncode == 0
    assert not (tmp_path / "went on").exists()


def test_a_child_whose_parent_was_gone_before_it_began_does_nothing(tmp_path):
    command = command_of("missions", tmp_path / "options.json")
    command[-1] = "1"  # not its parent
    assert subprocess.run(command, timeout=300).returncode == 0


def test_a_folder_has_one_bring_up_at_a_time(tmp_path):
    first = lock_folder(tmp_path / "new" / "folder")
    with pytest.raises(ConfigError, match=rf"process {os.getpid()}.*another folder"):
        lock_folder(tmp_path / "new" / "folder")
    lock_folder(tmp_path / "other").close()
    first.close()
    first.close()
    lock_folder(tmp_path / "new" / "folder").close()


def test_children_that_were_left_over_keep_the_folder(tmp_path, supervisor_of):
    lock = lock_folder(tmp_path)
    supervisor = supervisor_of({"one": OBEDIENT}, keep_open=[lock.fileno()])
    lock.close()
    with pytest.raises(ConfigError, match="what is left of it"):
        lock_folder(tmp_path)
    supervisor.stop()
    lock_folder(tmp_path).close()


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"cannot be used.*--out"):
        lock_folder(tmp_path / "file" / "folder")


def test_a_ros_domain_has_one_bring_up_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "41")
    assert not bring_up_here()
    first = lock_domain()
    assert bring_up_here()
    with pytest.raises(ConfigError, match=rf"process {os.getpid()}\).*the ROS domain 41.*ROS_DOMAIN_ID="):
        lock_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    assert not bring_up_here()
    lock_domain().close()
    first.close()
    monkeypatch.setenv("ROS_DOMAIN_ID", "41")
    lock_domain().close()
    assert not bring_up_here()
