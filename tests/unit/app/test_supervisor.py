"""Real child processes, each a tiny Python script."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from florence_bt.app.bringup.heartbeat import LONGEST_LOOK_S, SILENT_S
from florence_bt.app.bringup.locks import bring_up_here, lock_domain, lock_folder, running_folder
from florence_bt.app.bringup.supervisor import (
    PAUSES_S,
    RESTARTS_PERIOD_S,
    STARTED_AGAIN,
    ProcessDied,
    Supervisor,
)
from florence_bt.core.errors import ConfigError
from tests.script_process import ScriptStart, is_alive, wait_for

OBEDIENT = """
import signal, sys, pathlib
def end(*_):
    with open(sys.argv[2], "a") as file:
        file.write(sys.argv[1] + "\\n")
    sys.exit(0)
signal.signal(signal.SIGTERM, end)
pathlib.Path(sys.argv[2] + "." + sys.argv[1]).touch()
while True:
    signal.pause()
"""
STUBBORN = OBEDIENT.replace(
    "signal.signal(signal.SIGTERM, end)", "signal.signal(signal.SIGTERM, signal.SIG_IGN)"
)
BEATING = OBEDIENT + "    os.write(int(os.environ['FLORENCE_HEARTBEAT_FD']), b'x')\n"
BEATING = BEATING.replace("import signal", "import os, signal").replace(
    "signal.pause()", "signal.sigtimedwait([], 0.01)"
)
DYING = "print('the port is gone', flush=True); raise SystemExit(7)"


@pytest.fixture
def supervisor_of(tmp_path):
    """A supervisor of scripts by group name; every child is gone in the end."""
    made = []

    def make(scripts, **options):
        def command(group, options_file):
            return [sys.executable, "-c", scripts[group], group, str(options_file)]

        patient = {"stop_budget_s": 300.0, **options}
        made.append(Supervisor(tmp_path / "told", tmp_path / "logs", ScriptStart(command), **patient))
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


def test_a_child_that_a_signal_has_stopped_is_noted_and_gets_no_other(tmp_path, supervisor_of):
    supervisor = supervisor_of({"one": OBEDIENT})
    wait_up(tmp_path, "one")
    pid = supervisor.pids()["one"]
    os.kill(pid, signal.SIGSTOP)
    try:
        wait_for(
            lambda: Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T", "the stop"
        )
        supervisor.write_stack("one")
        assert "a signal has stopped it" in (tmp_path / "logs" / "one.log").read_text()
        pending = Path(f"/proc/{pid}/status").read_text()
        assert [
            line.split()[1] for line in pending.splitlines() if line.startswith(("SigPnd", "ShdPnd"))
        ] == ["0" * 16] * 2
    finally:
        os.kill(pid, signal.SIGCONT)


def test_the_end_of_a_log_is_of_this_process_and_not_of_an_earlier_bring_up(tmp_path, supervisor_of):
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "base.log").write_text("a failure of yesterday\n")
    message = str(death_in(supervisor_of({"base": DYING})))
    assert "the port is gone" in message and "yesterday" not in message


def test_a_death_is_told_also_when_somebody_has_removed_the_log(tmp_path, supervisor_of):
    supervisor = supervisor_of({"base": OBEDIENT})
    wait_up(tmp_path, "base")
    (tmp_path / "logs" / "base.log").unlink()
    os.kill(supervisor.pids()["base"], signal.SIGKILL)
    assert "was killed by SIGKILL" in str(death_in(supervisor))


def test_what_has_to_be_done_after_a_death_is_done_at_once_and_once(tmp_path, supervisor_of):
    dead = []

    def after_death(name):
        dead.append(name)
        return f"{name} is reaped"

    scripts = {"hardware": OBEDIENT, "bad": STUBBORN}
    supervisor = supervisor_of(scripts, after_death=after_death, stop_budget_s=0.3)
    wait_up(tmp_path, *scripts)
    os.kill(supervisor.pids()["hardware"], signal.SIGKILL)
    for _ in range(2):
        message = str(death_in(supervisor))
        assert "'hardware' was killed by SIGKILL; hardware is reaped" in message
    assert dead == ["hardware"]
    supervisor.stop()
    assert dead == ["hardware", "bad"]


def test_a_child_that_died_unseen_before_the_end_is_reaped_too(tmp_path, supervisor_of):
    dead = []
    supervisor = supervisor_of({"hardware": OBEDIENT}, after_death=lambda name: dead.append(name) or "")
    wait_up(tmp_path, "hardware")
    os.kill(supervisor.pids()["hardware"], signal.SIGKILL)
    assert supervisor.stop() == [] and dead == ["hardware"]


def test_a_child_that_died_is_started_again_later_and_later_but_not_for_ever(tmp_path, supervisor_of):
    now = [0.0]
    supervisor = supervisor_of({"one": OBEDIENT, "missions": DYING, "two": OBEDIENT}, now=lambda: now[0])
    wait_up(tmp_path, "one", "two")
    pids = []
    for number, pause in enumerate(PAUSES_S):
        assert death_in(supervisor).name == "missions"
        pids.append(supervisor.pids()["missions"])
        assert supervisor.start_again("missions") == pause and supervisor.waiting() == {"missions"}
        assert supervisor.restarts("missions") == number + 1
        if pause:
            now[0] += pause - 0.1
            supervisor.check()
            assert supervisor.pids()["missions"] == pids[-1]
            now[0] += 0.1
    assert len(set(pids)) == len(PAUSES_S) and list(supervisor.pids()) == ["one", "missions", "two"]
    death_in(supervisor)
    assert supervisor.start_again("missions") is None and supervisor.waiting() == set()
    os.kill(supervisor.pids()["one"], signal.SIGKILL)
    wait_for(lambda: not is_alive(supervisor.pids()["one"]), "the death of another")
    assert supervisor.start_again("one") == PAUSES_S[0], "each process has a count of its own"
    now[0] = RESTARTS_PERIOD_S
    assert supervisor.restarts("missions") == 1
    assert supervisor.start_again("missions") == PAUSES_S[1]
    supervisor.stop()
    assert (tmp_path / "told").read_text().split()[0] == "two"


def test_a_process_that_is_given_up_is_not_minded_any_more(tmp_path, supervisor_of):
    supervisor = supervisor_of({"recorder": DYING, "missions": OBEDIENT})
    wait_up(tmp_path, "missions")
    assert death_in(supervisor).name == "recorder"
    supervisor.give_up("recorder")
    supervisor.check()
    assert supervisor.given_up() == {"recorder"} and supervisor.waiting() == set()
    assert supervisor.stop() == []


def test_the_others_are_watched_and_ended_when_one_cannot_be_started_again(tmp_path, supervisor_of):
    supervisor = supervisor_of({"one": OBEDIENT, "missions": OBEDIENT, "two": OBEDIENT})
    wait_up(tmp_path, "one", "missions", "two")
    os.kill(supervisor.pids()["missions"], signal.SIGKILL)
    assert death_in(supervisor).name == "missions"
    supervisor.start_again("missions")
    log = tmp_path / "logs" / "missions.log"
    log.unlink()
    log.symlink_to("/dev/full")  # the disk is
    with pytest.raises(ConfigError, match="the log cannot be written"):
        supervisor.check()
    assert supervisor.silences() == {}
    assert supervisor.stop() == [] and (tmp_path / "told").read_text().split() == ["two", "one"]


def test_a_full_disk_holds_up_neither_a_note_nor_the_end(tmp_path, supervisor_of):
    supervisor = supervisor_of({"one": OBEDIENT})
    wait_up(tmp_path, "one")
    (child,) = supervisor._children
    child.log.close()
    with Path("/dev/full").open("ab", buffering=0) as child.log:
        supervisor.note("one", "has not answered for 1.0 s")
        assert supervisor.stop() == []


def test_companions_are_ended_and_start_again_with_the_one_that_died(tmp_path, supervisor_of):
    now = [0.0]
    scripts = {"hardware": OBEDIENT, "navigation": OBEDIENT, "people": OBEDIENT}
    supervisor = supervisor_of(scripts, now=lambda: now[0])
    wait_up(tmp_path, *scripts)
    before = supervisor.pids()
    os.kill(before["hardware"], signal.SIGKILL)
    assert death_in(supervisor).name == "hardware"
    assert supervisor.start_again("hardware") == 0.0
    supervisor.start_along(["navigation"], "hardware")
    assert not is_alive(before["navigation"]) and (tmp_path / "told").read_text() == "navigation\n"
    supervisor.check()
    after = supervisor.pids()
    assert after["people"] == before["people"] and list(after) == list(before)
    assert all(is_alive(after[name]) and after[name] != before[name] for name in ("hardware", "navigation"))
    assert supervisor.restarts("navigation") == 0


class Watch:
    """A clock that is driven by hand, and what a supervisor hears meanwhile."""

    def __init__(self):
        self.now = 100.0

    def hear(self, supervisor, seconds, step_s=0.05):
        """Let time pass and look every this often; gives the last silences."""
        for _ in range(round(seconds / step_s)):
            self.now += step_s
            silences = supervisor.silences()
        return silences


def frozen(pid):
    """Stop a process and wait until it stands."""
    os.kill(pid, signal.SIGSTOP)
    wait_for(lambda: "State:\tT" in Path(f"/proc/{pid}/status").read_text(), "the standstill")


@pytest.fixture
def watched(supervisor_of, tmp_path):
    """A supervisor of two processes that beat, one of which was stopped, and its clock."""
    watch = Watch()
    supervisor = supervisor_of({"good": BEATING, "hung": BEATING}, now=lambda: watch.now, stop_budget_s=300.0)
    wait_for(lambda: set(supervisor.silences()) == {"good", "hung"}, "the first beats")
    frozen(supervisor.pids()["hung"])
    supervisor.silences()
    yield supervisor, watch
    if (hung := supervisor.pids().get("hung")) is not None and is_alive(hung):
        os.kill(hung, signal.SIGCONT)


def beat_comes(supervisor, watch, name):
    """Wait on the wall clock, with time standing still for the supervisor, until a beat came."""
    wait_for(lambda: supervisor.silences()[name] == 0.0, f"a beat of {name}")


def test_a_process_that_does_not_answer_is_known_after_a_second_and_the_others_are_not_blamed(watched):
    supervisor, watch = watched
    assert watch.hear(supervisor, SILENT_S - 0.1)["hung"] < SILENT_S
    beat_comes(supervisor, watch, "good")
    silences = watch.hear(supervisor, 0.15)
    assert silences["hung"] >= SILENT_S and silences["good"] < SILENT_S
    os.kill(supervisor.pids()["hung"], signal.SIGCONT)
    beat_comes(supervisor, watch, "hung")


def test_a_supervisor_that_was_held_up_blames_nobody(watched):
    supervisor, watch = watched
    watch.now += 3600.0  # the machine was suspended
    assert max(supervisor.silences().values()) <= LONGEST_LOOK_S
    beat_comes(supervisor, watch, "good")


def test_a_process_that_has_not_beaten_yet_has_the_budget_of_the_start(tmp_path, supervisor_of):
    watch = Watch()
    supervisor = supervisor_of({"slow": OBEDIENT}, now=lambda: watch.now)
    wait_up(tmp_path, "slow")
    assert watch.hear(supervisor, 60.0) == {}


def test_a_hung_process_can_be_killed_and_is_said_to_have_been(tmp_path, watched):
    supervisor, _ = watched
    supervisor.note("hung", "not answered")
    supervisor.kill("hung", "did not answer for 5 s and was killed")
    death = death_in(supervisor)
    assert death.what == "the process 'hung' did not answer for 5 s and was killed"
    assert "[florence_up]: not answered" in str(death)
    assert "hung" not in supervisor.silences()


class Stuck:
    """A process that is killed and not gone yet, as it closes a serial port."""

    returncode = None
    kills = 0

    def __init__(self, process):
        self.process, self.pid = process, process.pid

    def kill(self):
        self.kills += 1

    def poll(self):
        return None

    def wait(self):
        pytest.fail("the others are not watched meanwhile")


def test_nobody_waits_for_a_process_that_was_killed_and_is_not_gone_yet(tmp_path, watched):
    supervisor, watch = watched
    child = supervisor._child("hung")
    child.process = stuck = Stuck(child.process)
    supervisor.kill("hung", "did not answer for 5 s and was killed")
    supervisor.check()
    assert stuck.kills == 1 and set(supervisor.silences()) == {"good", "hung"}
    beat_comes(supervisor, watch, "good")
    child.process = stuck.process
    supervisor.kill("hung", "did not answer for 5 s and was killed")
    assert death_in(supervisor).name == "hung"


def test_the_end_does_not_wait_for_a_process_that_is_known_to_hang(tmp_path, watched):
    supervisor, watch = watched
    watch.hear(supervisor, SILENT_S + 0.05)
    beat_comes(supervisor, watch, "good")
    # The clock stands still: no budget can pass.
    assert supervisor.stop() == ["hung"]
    assert (tmp_path / "told").read_text().split() == ["good"]


def test_a_process_that_hangs_while_it_ends_is_killed_by_its_silence(tmp_path, supervisor_of):
    """Long before the budget for those that beat is over."""
    now = [0.0]

    def later():
        now[0] += 0.05
        return now[0]

    mute = BEATING.replace("    os.write", "    signal.getsignal(signal.SIGTERM) is end and os.write")
    mute = mute.replace(
        "def end(*_):", "def end(*_):\n    signal.signal(signal.SIGTERM, signal.SIG_IGN)\n    return"
    )
    supervisor = supervisor_of({"mute": mute}, now=later, stop_budget_s=1e9)
    wait_for(supervisor.silences, "the first beat")
    assert supervisor.stop() == ["mute"]
    assert now[0] < 300.0


def test_processes_that_do_not_need_each_other_are_ended_side_by_side(tmp_path, supervisor_of):
    # Each waits until the other one was asked, too.
    patient = OBEDIENT.replace(
        "    sys.exit(0)",
        "    import time\n    while len(open(sys.argv[2]).read().split()) < 3: time.sleep(0.01)\n"
        "    sys.exit(0)",
    )
    scripts = {"first": OBEDIENT, "a": patient, "b": patient, "last": OBEDIENT}
    supervisor = supervisor_of(scripts, ended_together=("b", "a"))
    wait_up(tmp_path, *scripts)
    assert supervisor.stop() == []
    told = (tmp_path / "told").read_text().split()
    assert (told[0], set(told[1:3]), told[3]) == ("last", {"a", "b"}, "first")


def test_a_process_can_be_ended_that_was_started_where_interrupts_are_ignored(tmp_path, supervisor_of):
    """In the background of a script, under nohup: children inherit that until their handlers stand."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)}
    try:
        before_handlers = OBEDIENT.replace("signal.signal(signal.SIGTERM, end)", "")
        supervisor = supervisor_of({"unresponsive": before_handlers})
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    wait_up(tmp_path, "unresponsive")
    assert supervisor.stop() == []


def test_a_process_that_is_started_again_is_told_so(tmp_path, supervisor_of):
    says = f"""
import os, sys
with open(sys.argv[2], "a") as file:
    file.write(os.environ[{STARTED_AGAIN!r}] + ";")
"""
    supervisor = supervisor_of({"missions": says})
    death_in(supervisor)
    assert supervisor.start_again("missions") == 0.0
    supervisor.check()
    death_in(supervisor)
    assert (tmp_path / "told").read_text() == ";1;"


def test_children_ignore_what_the_terminal_sends(tmp_path, supervisor_of):
    pid = supervisor_of({"one": OBEDIENT}).pids()["one"]
    assert os.getsid(pid) != os.getsid(0)


def test_logs_that_cannot_be_written_are_named(tmp_path):
    (tmp_path / "logs").write_text("a file")
    with (
        Supervisor(tmp_path / "told", tmp_path / "logs", ScriptStart(lambda *_: ["true"])) as supervisor,
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
import florence_bt.app.bringup.process as process
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
import florence_bt.app.bringup.process as process
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
    main = "import sys; from florence_bt.app.bringup.process import main; sys.exit(main('missions', '', 1))"
    assert subprocess.run([sys.executable, "-c", main], timeout=300).returncode == 0


def test_a_folder_has_one_bring_up_at_a_time(tmp_path):
    first = lock_folder(tmp_path / "new" / "folder")
    with pytest.raises(ConfigError, match=rf"process {os.getpid()}.*another folder"):
        lock_folder(tmp_path / "new" / "folder")
    lock_folder(tmp_path / "other").close()
    first.close()
    first.close()
    lock_folder(tmp_path / "new" / "folder").close()


@pytest.mark.parametrize("kind", ["file", "link", "open to all"])
def test_the_locks_of_a_domain_are_kept_only_where_nobody_else_writes(tmp_path, monkeypatch, kind):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = tmp_path / f"florence-{os.getuid()}"
    if kind == "file":
        folder.write_text("")
    elif kind == "link":
        folder.symlink_to(tmp_path)
    else:
        folder.mkdir()
        folder.chmod(0o777)
    with pytest.raises(ConfigError, match="only this user may write to"):
        lock_domain(tmp_path)


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
    assert not bring_up_here() and running_folder() is None
    first = lock_domain(tmp_path / "Küche\n2")
    assert bring_up_here() and running_folder() == tmp_path / "Küche\n2"
    with pytest.raises(ConfigError, match=rf"process {os.getpid()}\).*the ROS domain 41.*ROS_DOMAIN_ID="):
        lock_domain(tmp_path)
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    assert not bring_up_here()
    lock_domain(tmp_path).close()
    first.close()
    monkeypatch.setenv("ROS_DOMAIN_ID", "41")
    lock_domain(tmp_path).close()
    assert not bring_up_here() and running_folder() is None
