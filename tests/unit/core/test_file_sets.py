"""Sets of files: links are not followed, lists of others do nothing outside their folder, who reads mends."""

from __future__ import annotations

import json
import os
import re
import tempfile
from multiprocessing import get_context
from pathlib import Path

import pytest

from florence_bt.core.file_sets import LIST, WRITTEN, mend, replace_files
from florence_bt.core.text_files import read_bytes


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_files_come_and_go_in_one_step(tmp_path):
    (tmp_path / "old").write_text("old")
    (tmp_path / "kept").write_text("before")
    (tmp_path / "kept").chmod(0o640)
    contents = {tmp_path / "kept": b"after", tmp_path / "sub" / "new": b"new"}
    with pytest.raises(FileNotFoundError):
        replace_files(contents, remove=[tmp_path / "old"])
    assert names(tmp_path) == ["kept", "old"] and (tmp_path / "kept").read_text() == "before"
    replace_files(contents, remove=[tmp_path / "old", tmp_path / "none"], make_folders=True)
    assert names(tmp_path) == ["kept", "sub"] and names(tmp_path / "sub") == ["new"]
    assert (tmp_path / "kept").read_text() == "after" and (tmp_path / "kept").stat().st_mode & 0o777 == 0o640


def test_a_folder_in_the_way_changes_nothing(tmp_path):
    (tmp_path / "b").mkdir()
    with pytest.raises(IsADirectoryError) as error:
        replace_files({tmp_path / "a": b"a", tmp_path / "b": b"b"})
    assert error.value.filename == str(tmp_path / "b") and names(tmp_path) == ["b"]


def test_a_link_in_place_of_a_file_is_replaced_and_what_is_behind_it_stays(tmp_path):
    other = tmp_path / "other"
    other.write_text("theirs")
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "file").symlink_to(other)
    (folder / f".file.{os.getpid()}").symlink_to(other)
    (folder / WRITTEN).symlink_to(other)
    (folder / LIST).symlink_to(other)
    with pytest.raises(OSError, match="symbolic link"):
        replace_files({folder / "file": b"ours", folder / "second": b"ours"})
    (folder / LIST).unlink()
    replace_files({folder / "file": b"ours", folder / "second": b"ours"})
    assert other.read_text() == "theirs" and (folder / "file").read_text() == "ours"
    assert not (folder / "file").is_symlink()


def test_no_link_is_followed_from_a_guarded_folder_on(tmp_path):
    outside, own = tmp_path / "outside", tmp_path / "own"
    (outside / "deep").mkdir(parents=True)
    own.mkdir()
    (tmp_path / "way").symlink_to(own)
    (own / "guarded").symlink_to(outside)
    for file in (own / "guarded" / "a", own / "guarded" / "deep" / "a", tmp_path / "way" / "guarded" / "a"):
        with pytest.raises(OSError, match="link") as error:
            replace_files({file: b""}, no_links=[own / "guarded", tmp_path / "way" / "guarded"])
        assert error.value.filename == str(own / "guarded")
    (own / "guarded").unlink()
    (own / "guarded").mkdir()
    (own / "guarded" / "deep").symlink_to(outside)
    with pytest.raises(OSError, match="link"):
        replace_files({own / "guarded" / "deep" / "a": b""}, no_links=[own / "guarded"], make_folders=True)
    assert names(outside) == ["deep"]
    replace_files({tmp_path / "way" / "guarded" / "a": b"a"}, no_links=[tmp_path / "way" / "guarded"])
    assert (own / "guarded" / "a").read_text() == "a", "a link on the way there is the owner's"


def write_as_nobody(file):
    if os.geteuid() == 0:
        os.setgid(65534)
        os.setuid(65534)
    replace_files({file: b"ours"}, make_folders=True)


def test_folders_on_the_way_need_not_be_readable():
    with tempfile.TemporaryDirectory() as name:
        way = Path(name) / "way"
        (way / "home").mkdir(parents=True)
        (way / "home").chmod(0o777)
        Path(name).chmod(0o711)
        way.chmod(0o111)
        writer = get_context("fork").Process(target=write_as_nobody, args=(way / "home" / "new" / "file",))
        writer.start()
        writer.join()
        way.chmod(0o755)
        assert writer.exitcode == 0 and (way / "home" / "new" / "file").read_text() == "ours"


def left_behind(folder, moves, remove=(), text=None):
    """What a set leaves whose program ended after it was wholly written."""
    told = {"id": "12ab", "folders": ["."], "moves": moves, "remove": list(remove)}
    (folder / LIST).write_text(json.dumps(told) if text is None else text)
    (folder / WRITTEN).write_text("12ab")
    (folder / ".florence-new-12ab-0").write_text("new")


def test_who_reads_finishes_what_was_written_to_its_end(tmp_path):
    (tmp_path / "a").write_text("old")
    (tmp_path / "b").write_text("old")
    left_behind(tmp_path, [[".florence-new-12ab-0", "a"]], ["b"])
    assert read_bytes(tmp_path / "a") == b"new"
    assert names(tmp_path) == ["a"]


def test_who_reads_removes_what_was_not(tmp_path):
    (tmp_path / "a").write_text("old")
    left_behind(tmp_path, [[".florence-new-12ab-0", "a"]])
    (tmp_path / WRITTEN).write_text("34cd")
    assert read_bytes(tmp_path / "a") == b"old"
    assert names(tmp_path) == ["a"]


def test_who_reads_removes_half_a_file_that_has_no_list(tmp_path):
    (tmp_path / "a").write_text("old")
    (tmp_path / ".florence-new-12ab-0").write_text("ne")
    assert read_bytes(tmp_path / "a") == b"old"
    assert names(tmp_path) == ["a"]


@pytest.mark.parametrize(
    ("moves", "remove", "text"),
    [
        ([[".florence-new-12ab-0", "../outside"]], (), None),
        ([[".florence-new-12ab-0", "/tmp/outside"]], (), None),
        ([["../outside", "a"]], (), None),
        ([["b", "a"]], (), None),
        ([], ("../outside",), None),
        ([], ("..",), None),
        ([], (), ""),
        ([], (), "{}"),
        ([], (), "[[["),
        ([], (), '{"id": "12ab", "folders": [], "moves": [], "remove": []}'),
        ([], (), '{"id": "12ab", "folders": 3, "moves": 4, "remove": 5}'),
    ],
)
def test_a_list_of_a_stranger_reaches_no_file_outside_and_hinders_nobody(moves, remove, text, tmp_path):
    (tmp_path / "outside").write_text("theirs")
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a").write_text("a")
    left_behind(folder, moves, remove, text)
    assert read_bytes(folder / "a") == b"a" and (tmp_path / "outside").read_text() == "theirs"
    assert names(folder) == ["a"]
    replace_files({folder / "a": b"b"})


def test_a_folder_that_moved_away_from_the_others_is_mended_alone(tmp_path):
    (tmp_path / "a").write_text("old")
    told = {"id": "12ab", "folders": ["../gone", "."], "moves": [[".florence-new-12ab-0", "a"]], "remove": []}
    left_behind(tmp_path, [], text=json.dumps(told))
    (tmp_path / WRITTEN).unlink()
    mend(tmp_path)
    assert names(tmp_path) == ["a"] and (tmp_path / "a").read_text() == "old"


def write_often(folder, mark):
    for number in range(40):
        text = f"{mark} {number}".encode()
        replace_files({folder / "x" / "1": text, folder / "y" / "2": text, folder / "y" / "3": text})


def test_two_programs_write_the_same_set_one_after_the_other(tmp_path):
    for name in "xy":
        (tmp_path / name).mkdir()
    context = get_context("fork")
    writers = [context.Process(target=write_often, args=(tmp_path, mark)) for mark in "ab"]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0, 0]
    assert names(tmp_path / "x") == ["1"] and names(tmp_path / "y") == ["2", "3"]
    texts = {file.read_text() for file in tmp_path.glob("*/*")}
    assert len(texts) == 1 and texts.pop().endswith(" 39")


WRITES = re.compile(r"\.write_(text|bytes)\(|shutil\.(copy|move)|\.savefig\(|open\([^)]*\"[wax]b?\"")
OTHERWISE = {
    "app/bringup/process.py": "that it is up",
    "app/bringup/process_report.py": "its log",
    "app/bringup/simulated.py": "parts of a simulated robot, made anew each time",
    "app/bringup/supervisor.py": "its log",
    "app/demo/kernel_cache.py": "a cache",
    "app/runs/recorded_mission.py": "texts of missions, in a folder for one replay",
    "assurance/scenario.py": "a folder for one trial",
    "assurance/mutating/scenario_text.py": "a folder for one trial",
    "mission_testing/scenarios/from_run.py": "a folder for one trial",
    "app/interfaces/building.py": "the environment, with a list of its own",
    "app/interfaces/generating.py": "what is built, in a folder of its own",
    "app/maps/recordings/bag_files.py": "an unpacked copy, in a folder of its own",
    "drivers/kinect/fakenect.py": "a recording, frame by frame",
    "drivers/kinect/recording.py": "a recording, frame by frame",
    "drivers/turtlebot/override_file.py": "that the override is on, whatever is in it",
    "mission_testing/mission_tester.py": "a folder for one test",
    "simulation/home/picture.py": "into the memory",
    "../packages/florence_page/florence_page/editor/helpers.py": "a folder for one trial",
}
"""Modules that write otherwise, and what."""


def test_whatever_else_is_written_is_written_by_this_function():
    package = Path(__file__).parents[3] / "florence_bt"
    files = [*package.rglob("*.py"), *(package.parent / "packages").glob("*/florence_*/**/*.py")]
    found = {os.path.relpath(file, package) for file in files if WRITES.search(file.read_text("utf-8"))}
    assert found == set(OTHERWISE)
