"""Edits are read and checked in a process of their own; this process only looks at the dates of the files."""

from __future__ import annotations

import gc
import os
import pickle
import queue
import signal
import sys
import threading
import weakref

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.runtime import background_check
from florence_bt.runtime import missions as mission_files
from florence_bt.runtime.background_check import LIMIT_S, BackgroundCheck
from florence_bt.runtime.check_process import CheckProcess
from florence_bt.runtime.missions import MissionFolders, ReloadReport
from florence_bt.trees.language.loader import MissionLibrary

SPEAK = {"speak": SkillDeclaration("speak", "Say something", inputs={"text": Port(Kind.TEXT, "what to say")})}
GREET = "mission: greet\ndescription: {}\ntree:\n  speak: {{text: {}}}\n"


class Bench:
    """A background check over one mission, with the executor's thread played by the test."""

    def __init__(self, folder):
        self.file = folder / "greet.yaml"
        self.edit("Greets.")
        self.missions = MissionFolders.of([folder], SPEAK, built_in=False)
        self.clock = ManualClock()
        self.soon = queue.SimpleQueue()
        self.answers = []
        self.check = BackgroundCheck(self.missions, self.adopt, self.soon.put, self.clock)

    def edit(self, description, says="hello"):
        self.file.write_text(GREET.format(description, says))

    def adopt(self, missions):
        self.missions = missions

    def ask(self):
        self.check.when_fresh(lambda problem, report: self.answers.append((problem, report)))

    def run(self):
        while not self.answers:
            self.soon.get(timeout=300.0)()
        return self.answers.pop()

    @property
    def description(self):
        return self.missions.library.get("greet").description


@pytest.fixture
def bench(tmp_path, monkeypatch):
    bench = Bench(tmp_path)

    def here(*arguments, **options):
        raise AssertionError("missions are read or checked on the executor's thread")

    monkeypatch.setattr(MissionLibrary, "load", here)
    monkeypatch.setattr(mission_files, "check", here)
    yield bench
    bench.check.close()


def test_nothing_is_checked_when_nothing_was_edited(bench, monkeypatch):
    monkeypatch.setattr(CheckProcess, "check", None)
    bench.ask()
    assert bench.answers == [("", ReloadReport())]


def test_an_edit_counts_when_it_was_checked_elsewhere(bench):
    bench.edit("Greets kindly.")
    bench.ask()
    assert bench.answers == [] and bench.description == "Greets.", "the version of before stays until then"
    problem, report = bench.run()
    assert (problem, report.changed) == ("", ("greet",)) and bench.description == "Greets kindly."
    assert bench.missions.findings_of(bench.missions.library.get("greet")) == [], "it was checked already"
    bench.ask()
    assert bench.answers.pop()[0] == "", "at once: nothing was edited since"


def test_a_broken_edit_does_not_count_for_any_later_check_either(bench):
    bench.edit("Greets.", "[")
    bench.ask()
    assert "greet" in bench.run()[1].held and bench.description == "Greets."
    (bench.file.parent / "other.yaml").write_text(GREET.format("x", "y").replace("greet", "other"))
    bench.ask()
    _, report = bench.run()
    assert report.changed == ("other",) and "greet" in report.held and bench.description == "Greets."
    bench.edit("Greets again.")
    bench.ask()
    assert not bench.run()[1].held and bench.description == "Greets again."


def test_an_edit_during_the_check_is_checked_too(bench):
    bench.edit("one")
    bench.ask()
    bench.edit("the second one")
    bench.ask()
    bench.run()
    assert bench.description == "the second one" and len(bench.answers) == 1


def test_a_check_that_takes_too_long_is_given_up(bench):
    bench.edit("Greets kindly.")
    process = bench.check._process
    os.kill(process.pid, signal.SIGSTOP)
    bench.ask()
    bench.clock.advance(LIMIT_S)
    assert "not checked within 25 s" in bench.answers.pop()[0] and process.killed
    bench.ask()
    assert bench.run()[0] == "" and bench.description == "Greets kindly."
    assert bench.soon.empty(), "nobody heard of the check that was killed"


def test_a_process_that_breaks_is_told(bench):
    bench.check._pickled = b"nonsense"
    bench.edit("Greets kindly.")
    bench.ask()
    assert "ended with code 1" in bench.run()[0] and bench.description == "Greets."


def test_a_process_that_died_between_two_edits_is_told_and_replaced(bench):
    os.kill(bench.check._process.pid, signal.SIGKILL)
    bench.edit("Greets kindly.")
    bench.ask()
    assert "ended with code -9" in bench.run()[0]
    bench.ask()
    assert bench.run()[0] == "" and bench.description == "Greets kindly."


def test_who_asks_while_an_edit_is_checked_waits_for_it_though_it_was_taken_back(bench):
    before = bench.file.stat()
    bench.edit("Greets kindly.")
    bench.ask()
    bench.edit("Greets.")
    os.utime(bench.file, ns=(before.st_atime_ns, before.st_mtime_ns))
    bench.ask()
    assert bench.answers == []
    assert bench.run()[0] == "" and bench.description == "Greets."
    assert len(bench.answers) == 1


def test_the_garbage_collector_rests_while_much_is_read():
    assert gc.isenabled()
    with background_check.collector_paused():
        assert not gc.isenabled()
    assert gc.isenabled()
    gc.unfreeze()


def test_one_process_checks_every_edit_and_ends_with_its_owner(bench, monkeypatch):
    threads, check = [], CheckProcess.check

    def watched(process, pickled):
        threads.append(threading.current_thread())
        return check(process, pickled)

    monkeypatch.setattr(CheckProcess, "check", watched)
    process = bench.check._process
    for description in ("Greets kindly.", "Greets again."):
        bench.edit(description)
        bench.ask()
        assert bench.run()[0] == "" and bench.description == description
    assert bench.check._process is process
    assert len(threads) == 2 and threading.current_thread() not in threads
    bench.check.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process.pid, 0)


def test_what_was_replaced_is_freed_beside_the_executor(bench):
    freed_by = []
    weakref.finalize(bench.missions.library, lambda: freed_by.append(threading.current_thread().name))
    bench.edit("Greets kindly.")
    bench.ask()
    bench.run()
    for thread in threading.enumerate():
        if thread.name == "free":
            thread.join()
    assert freed_by == ["free"]


def test_a_folder_out_of_reach_changes_nothing(bench):
    bench.file.unlink()
    bench.file.parent.rename(bench.file.parent.with_name("elsewhere"))
    bench.ask()
    problem, report = bench.answers.pop()
    assert problem == "" and "cannot be read" in report.held["the folders"] and bench.description == "Greets."


def test_missions_are_read_and_freed_in_slices(tmp_path, monkeypatch):
    folder = Bench(tmp_path)
    folder.check.close()
    folder.edit("Greets.\ninputs:\n  whom: {type: text}", "$whom")
    folder.missions.refresh()
    pauses = []
    now = iter(range(10**9))
    monkeypatch.setattr(background_check.time, "perf_counter", lambda: next(now))
    monkeypatch.setattr(background_check.time, "sleep", pauses.append)
    data = pickle.dumps(folder.missions, background_check.PROTOCOL)
    source = background_check._Slices(data)
    read = pickle.Unpickler(source).load()
    assert [*read.library.get("greet").required_inputs()] == ["whom"] and source.position == len(data)
    assert len(pauses) > 100, "others may run after every part, not only at the end"

    pauses.clear()
    tree, freed_after = read.library.get("greet").tree, []
    weakref.finalize(read.library, lambda: freed_after.append(len(pauses)))
    parts = [read]
    del read
    background_check._free(parts)
    assert parts == [] and freed_after and len(pauses) > freed_after[0] + 10
    assert sys.getrefcount(tree) == 2, "only this test holds it"
