from __future__ import annotations

import sys
from pathlib import Path

from florence_bt.runtime.recorder import RunRecord
from florence_bt.wiring import pictures
from florence_bt.wiring.pictures import BackgroundPictures


class Drawer(BackgroundPictures):
    """Runs other programs than the one that draws."""

    def __init__(self, program: str) -> None:
        super().__init__(Path("map.yaml"), Path("spots.yaml"))
        self.program = program

    def command(self, record: RunRecord) -> list[str]:
        return [sys.executable, "-c", self.program, str(record.folder)]


def test_the_end_waits_for_pictures_that_are_being_drawn(tmp_path):
    drawer = Drawer("import sys, pathlib; pathlib.Path(sys.argv[1], 'flat.png').touch()")
    drawer.draw(RunRecord(tmp_path))
    drawer.draw(RunRecord(tmp_path))
    drawer.close()
    assert (tmp_path / "flat.png").exists()
    drawer.close()


def test_a_picture_that_takes_for_ever_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "FINISH_BUDGET_S", 0.1)
    drawer = Drawer("import signal; signal.pause()")
    drawer.draw(RunRecord(tmp_path))
    (process,) = drawer._processes
    drawer.close()
    assert process.returncode is not None


def test_the_real_command_names_the_folder(tmp_path):
    command = BackgroundPictures(Path("map.yaml"), Path("spots.yaml")).command(RunRecord(tmp_path))
    assert command[-3:] == ["map.yaml", "spots.yaml", str(tmp_path)]
