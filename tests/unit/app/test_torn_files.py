"""A kill at any moment, and a full disk, leave the old files or the new ones, never some of each."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.core.file_sets import mend
from tests.dying import DIED, ENDED, FAILED, library, outcomes
from tests.sweeps import sweep
from tests.unit.app import torn_files

KINDS = {
    "save_mission": (),
    "undo": ("rotate",),
    "build_again": ("build",),
    "rotate": (),
    "rooms": (),
    "build": (),
    "crop": ("rotate",),
    "clean_to": (),
    "add_hotspot": (),
    "name_rooms": ("rooms",),
    "add_zone": (),
    "add_skills": (),
    "save_draft": (),
    "calibrate": (),
    "import_trees": (),
    "init": (),
}
"""What writes, and what is done before."""
DISKS = (0, 100, 1_000, 10_000, 40_000, 60_000, 100_000, 400_000)
"""Bytes that a disk takes."""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    return library(tmp_path_factory.mktemp("dying"))


def files_of(folder):
    """All files, hidden ones too, with their content."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def before(kind, tmp_path, monkeypatch):
    """The folder as it is before."""
    start = tmp_path / "home"
    start.mkdir()
    torn_files.make_home(start)
    monkeypatch.chdir(start)
    for first in KINDS[kind]:
        assert not getattr(torn_files, first)()
    monkeypatch.chdir(tmp_path)
    return start


def mended(folder):
    """The files, after everything in the folder was looked at."""
    for each in (folder, *filter(Path.is_dir, folder.rglob("*"))):
        mend(each)
    return files_of(folder)


@pytest.mark.parametrize("kind", sweep(KINDS, every=6))
def test_a_kill_leaves_the_old_files_or_the_new_ones(kind, built, tmp_path, monkeypatch):
    start = before(kind, tmp_path, monkeypatch)
    found = outcomes(built, f"tests.unit.app.torn_files:{kind}", start, ["step=each"])
    *killed, (_, (how, end)) = found.items()
    assert how == ENDED and len(killed) >= 4
    old, new = files_of(start), files_of(end)
    maps = ("maps/flat.yaml", "maps/home.yaml")
    known = {(each, torn_files.grid_of(folder / each)) for each in maps for folder in (start, end)}
    seen = set()
    for number, (step, (how, folder)) in enumerate(killed):
        assert how == DIED
        for each in maps:
            assert (each, torn_files.grid_of(folder / each)) in known, step
        left = mended(folder)
        assert left in (old, new), f"{step}: {sorted(left.items() ^ old.items())[:1]}"
        seen.add(left == new)
        if left == old and number % 8 == 0:
            monkeypatch.chdir(folder)
            assert not getattr(torn_files, kind)(), f"{step}: it cannot be done again"
            assert files_of(folder) == new
    assert seen == {False, True}, "one of the steps is the one that counts"


@pytest.mark.parametrize("kind", sweep(KINDS, every=6))
def test_a_full_disk_changes_nothing(kind, built, tmp_path, monkeypatch):
    start = before(kind, tmp_path, monkeypatch)
    found = outcomes(built, f"tests.unit.app.torn_files:{kind}", start, [f"bytes={each}" for each in DISKS])
    old = files_of(start)
    assert next(how for how, _ in found.values()) == FAILED
    for limit, (how, folder) in found.items():
        assert (files_of(folder) == old) == (how == FAILED), limit
    assert how == ENDED, "there is room for all of it"
