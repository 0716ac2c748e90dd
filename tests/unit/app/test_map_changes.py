"""florence map clean, crop, rotate, edit: the files, what belongs to them, and the way back."""

import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import OK, USAGE
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, save_pose
from florence_bt.skills.navigation.map_server.map_file import load_map

ROOT = Path(__file__).parents[3]


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file in ("maps/flat.yaml", "maps/flat.pgm"):
        shutil.copy(ROOT / file, tmp_path)
    places = (ROOT / "hotspots" / "flat.yaml").read_text()
    zone = "zones:\n- label: stairs\n  kind: keep_out\n  polygon: [[8, 6], [9, 6], [9, 7]]\n"
    (tmp_path / "places.yaml").write_text(f"# ours\n{places}{zone}")
    save_pose(tmp_path / "pose.json", Pose2(6.0, 3.0, 1.0), load_map(tmp_path / "flat.yaml"))
    return tmp_path


def florence(*arguments, code=OK):
    done = CliRunner().invoke(app, ["map", *arguments], catch_exceptions=False)
    assert done.exit_code == code, done.output
    return done.output


def bytes_of(folder):
    return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


def test_what_belongs_to_a_map_turns_with_it_and_back(home):
    before, places, start = load_map("flat.yaml"), load_hotspots("places.yaml"), bytes_of(home)
    belongings = ["--hotspots", "places.yaml", "--pose", "pose.json"]
    florence("rotate", "flat.yaml", "--by", "25 deg", *belongings)
    after, turned = load_map("flat.yaml"), load_hotspots("places.yaml")
    turn = Pose2(0.0, 0.0, math.radians(25.0))
    for old, new in zip(places, turned, strict=True):
        assert new.label == old.label and new.kind == old.kind
        assert (turn @ old.pose).distance_to(new.pose) < 0.002
        assert math.cos(new.pose.yaw - old.pose.yaw - turn.yaw) > 0.999999
        for corner, moved in zip(old.polygon, new.polygon, strict=True):
            assert math.dist(turn.apply(*corner), moved) < 0.002
        assert after.problem_with_place(new.pose.x, new.pose.y) is None
    assert math.dist(turn.apply(8, 6), turned.zones[0].polygon[0]) < 0.002
    pose = load_pose(Path("pose.json"), after)
    assert pose is not None and pose.distance_to(turn @ Pose2(6.0, 3.0)) < 1e-6
    assert Path("places.yaml").read_text().startswith("# ours\n")
    assert int((after.cells == OCCUPIED).sum()) >= int((before.cells == OCCUPIED).sum())
    florence("rotate", "flat.yaml", "--undo")
    assert bytes_of(home) == start


def test_changes_are_taken_back_one_by_one(home):
    states = [bytes_of(home)]
    for arguments in (("clean",), ("crop", "--box", "[[0, 0], [8, 5]]"), ("edit", "wall=[[1, 1], [2, 1]]")):
        states.append({name: data for name, data in bytes_of(home).items() if "versions" not in name})
        florence(arguments[0], "flat.yaml", *arguments[1:])
    for state in reversed(states[1:]):
        florence("edit", "flat.yaml", "--undo")
        assert {name: data for name, data in bytes_of(home).items() if "versions" not in name} == state
    assert bytes_of(home) == states[0]
    assert "no earlier version" in florence("clean", "flat.yaml", "--undo", code=USAGE)


def test_a_later_edit_by_hand_is_not_lost_by_undo(home):
    florence("rotate", "flat.yaml", "--by", "90 deg", "--hotspots", "places.yaml")
    text = Path("places.yaml").read_text() + "# by hand\n"
    Path("places.yaml").write_text(text)
    told = florence("rotate", "flat.yaml", "--undo", code=USAGE)
    assert "places.yaml" in told and "--overwrite" in told
    assert Path("places.yaml").read_text() == text
    florence("rotate", "flat.yaml", "--undo", "--overwrite")
    assert "by hand" not in Path("places.yaml").read_text()


def test_another_file_leaves_the_map_as_it_is(home):
    start = bytes_of(home)
    florence(
        "rotate", "flat.yaml", "--out", "turned/home.yaml", "--by", "90 deg", "--hotspots", "places.yaml"
    )
    assert {name: data for name, data in bytes_of(home).items() if name in start} == start
    assert load_map("turned/home.yaml").cells.shape != load_map("flat.yaml").cells.shape
    assert load_hotspots("turned/home.places.yaml").get("kitchen") is not None


def test_an_image_of_another_format_and_a_turned_origin(home):
    import cv2

    grid = load_map("flat.yaml")
    cv2.imwrite("home.png", cv2.imread("flat.pgm", cv2.IMREAD_GRAYSCALE))
    Path("home.yaml").write_text(
        "image: home.png\nresolution: 0.05\norigin: [1.0, 2.0, 0.3]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    told = florence("edit", "home.yaml", "wall=[[1, 4], [3, 4]]", "--picture", "home.svg")
    assert "17.19 deg" in told and Path("home.svg").exists()
    changed = load_map("home.yaml")
    assert changed.origin.yaw == 0.0 and Path("home.png").read_bytes().startswith(b"\x89PNG")
    assert np.count_nonzero(changed.cells == OCCUPIED) >= np.count_nonzero(grid.cells == OCCUPIED)
    florence("edit", "home.yaml", "--undo")
    assert "0.3" in Path("home.yaml").read_text()


def test_a_map_with_steps_keeps_them_and_its_unknown(home):
    text = Path("flat.yaml").read_text()
    Path("flat.yaml").write_text(text.replace("mode: trinary", "mode: scale"))
    before = load_map("flat.yaml")
    assert ((before.cells > 0) & (before.cells < OCCUPIED)).any()
    florence("edit", "flat.yaml", "unknown=[[1, 1], [2, 2]]")
    after = load_map("flat.yaml")
    changed = after.cells != before.cells
    assert (after.cells[changed] == UNKNOWN).all() and np.count_nonzero(changed) == 400
    florence("clean", "flat.yaml")
    assert set(np.unique(load_map("flat.yaml").cells)) == {UNKNOWN, FREE, OCCUPIED}


@pytest.mark.parametrize(
    "arguments",
    [
        ("edit", "flat.yaml"),
        ("edit", "flat.yaml", "wall=[[1, 1], [2, 1]]", "--undo"),
        ("edit", "flat.yaml", "wall=[1, 2]"),
        ("edit", "flat.yaml", "wall=[[1, 2, 3], [2, 1, 3]]"),
        ("edit", "flat.yaml", "[[1, 2], [2, 1]]"),
        ("edit", "flat.yaml", "wall=[[1, 1], [2, 1]]", "--picture", "home.txt"),
        ("crop", "flat.yaml", "--box", "[[1, 1]]"),
        ("rotate", "flat.yaml", "--by", "5"),
        ("clean", "nowhere.yaml"),
        ("clean", "flat.yaml", "--hotspots", "nowhere.yaml"),
        ("clean", "flat.yaml", "--out", "home.txt"),
        ("clean", "flat.yaml", "--out", "places.yaml"),
    ],
)
def test_what_is_wrong_changes_nothing(home, arguments):
    start = bytes_of(home)
    florence(*arguments, code=USAGE)
    assert bytes_of(home) == start and not (home / "flat.versions").exists()


def test_a_full_disk_changes_nothing(home, monkeypatch):
    start = bytes_of(home)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert "No space left" in florence("clean", "flat.yaml", code=USAGE)
    assert bytes_of(home) == start
    assert not (home / "flat.versions").exists()
