from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import pytest

from florence_bt.app.demo import pictures
from florence_bt.app.demo.pictures import BackgroundPictures
from florence_bt.runtime.recorder import RunRecord


class Drawer(BackgroundPictures):
    """Runs other programs than the one that draws."""

    def __init__(self, program: str) -> None:
        super().__init__(Path("map.yaml"), Path("spots.yaml"))
        self.program = program

    def command(self, record: RunRecord) -> list[str]:
        return [sys.executable, "-c", self.program, str(record.folder)]


ALONE = """
import os, pathlib, sys
folder = pathlib.Path(sys.argv[1])
os.mkdir(folder.parent / "drawing")  # fails when another one draws
(folder.parent / "order").open("a").write(folder.name + " ")
os.rmdir(folder.parent / "drawing")
"""


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    monkeypatch.setattr(pictures, "FINISH_BUDGET_S", 300.0)


def test_pictures_are_drawn_one_after_the_other_and_the_end_waits_for_them(tmp_path):
    drawer = Drawer(ALONE)
    for number in range(4):
        drawer.draw(RunRecord(tmp_path / str(number)))
    drawer.close()
    assert (tmp_path / "order").read_text().split() == ["0", "1", "2", "3"]
    drawer.close()


def test_of_very_many_runs_the_latest_get_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "MOST_PICTURES_WAITING", 2)
    drawer = Drawer(ALONE)
    with drawer._changed:  # the thread gets to none of them meanwhile
        for number in range(6):
            drawer.draw(RunRecord(tmp_path / str(number)))
    drawer.close()
    assert (tmp_path / "order").read_text().split() == ["4", "5"]


def test_a_picture_that_takes_for_ever_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "FINISH_BUDGET_S", 0.1)
    begun = tmp_path / "begun"
    drawer = Drawer(f"import os, signal; os.symlink(str(os.getpid()), {str(begun)!r}); signal.pause()")
    for _ in range(3):
        drawer.draw(RunRecord(tmp_path))
    end = time.monotonic() + 300.0
    while not begun.is_symlink():
        assert time.monotonic() < end, "no picture was begun"
        time.sleep(0.005)
    drawer.close()
    assert not Path("/proc", begun.readlink()).exists(), "it has ended"


def test_a_picture_that_cannot_be_begun_hinders_no_other(tmp_path, capfd):
    drawer = Drawer(ALONE)
    good = drawer.command
    drawer.command = lambda record: ["/there/is/no/such/program"]
    drawer.draw(RunRecord(tmp_path / "lost"))
    drawer.command = good
    drawer.draw(RunRecord(tmp_path / "kept"))
    drawer.close()
    assert (tmp_path / "order").read_text().split() == ["kept"]
    assert "a picture was not drawn" in capfd.readouterr().err


def test_a_full_disk_is_told_in_one_line(tmp_path, capsys):
    assert pictures.main("map.yaml", "spots.yaml", str(tmp_path / "gone")) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_nothing_was_drawn(tmp_path, capfd):
    started = tmp_path / "started"
    drawer = Drawer(f"open({str(started)!r}, 'w')")
    drawer.close()
    assert not started.exists() and capfd.readouterr() == ("", "")
    assert all(thread.name != "pictures" for thread in threading.enumerate())


def test_the_real_command_names_the_folder(tmp_path):
    command = BackgroundPictures(Path("map.yaml"), Path("spots.yaml")).command(RunRecord(tmp_path))
    assert command[-3:] == ["map.yaml", "spots.yaml", str(tmp_path)]
