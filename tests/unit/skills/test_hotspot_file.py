"""Changes of hotspot files: what is edited, what stays, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.zones import KEEP_OUT, SLOW, Zone
from florence_bt.skills.locator.hotspot_file import HotspotFile
from florence_bt.skills.locator.hotspots import Hotspot, load_hotspots

BLOCK = """\
# Our home.
hotspots:
  # the kitchen
  - label: kitchen   # here we cook
    x: 1.5
    y: -2
    yaw: 90 deg
    polygon: [[0, 0], [3, 0], [3, -4], [0, -4]]
  # the television
  - {label: tv, x: 4, y: 1e0, kind: object}   # big

# the end
"""
FLOW = "hotspots: [{label: tv, x: 1, y: 2, kind: object}, {label: 'a, b', x: 2, y: 3}, # two\n ]\nzones: []\n"
NESTED = """\
hotspots:
-
  label: tv
  kind: object
  x: 1
  y: 1 # why
zones:
- label: attic stairs
  kind: slow
  speed_limit: 50 %
  polygon:
  - [0, 0]
  - [1, 1]
  - [1, 0]
"""
CORNERS = ((0.0, 0.0), (2.0, 0.0), (1.0, 2.5))


@pytest.fixture(params=[BLOCK, FLOW, NESTED, "", "hotspots: []\n", "hotspots:\n"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "home.yaml"
    path.write_text(request.param)
    return path


def test_everything_can_be_added_changed_and_removed(file: Path) -> None:
    """Adds and changes one of each, renames, then empties the file: each step is saved and read again."""
    changed = HotspotFile(file)
    before = [spot for spot in changed.hotspots if spot.label != "tv"]
    changed.put(Hotspot("tv", Pose2(9.0, 8.0, 0.5), "object"))
    changed.put(Hotspot('odd: "x", {y}', Pose2(1.0, 2.0, 7.0 - 6.28), "room", CORNERS))
    zones = changed.hotspots.zones
    changed.put_zone(Zone("stairs", KEEP_OUT, CORNERS))
    changed.put_zone(Zone("rug", SLOW, CORNERS, 0.2))
    changed.save()
    read = load_hotspots(file)
    assert [spot for spot in read if spot.label in {each.label for each in before}] == before
    assert read.get("tv") == Hotspot("tv", Pose2(9.0, 8.0, 0.5), "object")
    assert read.zones == (*zones, Zone("stairs", KEEP_OUT, CORNERS), Zone("rug", SLOW, CORNERS, 0.2))

    changed = HotspotFile(file)
    changed.rename("tv", "telly")
    changed.put(replace(read.get("telly") or Hotspot("telly", Pose2()), kind="object", pose=Pose2(3.0, 4.0)))
    changed.put_zone(Zone("rug", SLOW, CORNERS, 0.5, is_share=True))
    changed.remove_zone("stairs")
    changed.save()
    read = load_hotspots(file)
    assert read.get("tv") is None and read.get("telly") == Hotspot("telly", Pose2(3.0, 4.0), "object")
    assert read.zones == (*zones, Zone("rug", SLOW, CORNERS, 0.5, is_share=True))

    for label in read.labels():
        changed.remove(label)
    for zone in read.zones:
        changed.remove_zone(zone.label)
    changed.save()
    assert len(load_hotspots(file)) == 0 and load_hotspots(file).zones == ()


def test_only_what_is_meant_changes(tmp_path: Path) -> None:
    path = tmp_path / "home.yaml"
    path.write_text(BLOCK)
    changed = HotspotFile(path)
    kitchen = changed.hotspots.get("kitchen")
    assert kitchen is not None
    changed.put(replace(kitchen, pose=replace(kitchen.pose, x=1.75)))
    changed.save()
    assert path.read_text() == BLOCK.replace("x: 1.5", "x: 1.75")
    assert (tmp_path / "home.yaml.bak").read_text() == BLOCK
    changed.put(replace(kitchen, pose=Pose2(1.75, -2.0, 1.0)), {"yaw": "57.29577951308232 deg"})
    changed.put(Hotspot("sofa", Pose2(1.0, 2.0), "object"))
    changed.remove("tv")
    changed.save()
    text = path.read_text()
    assert "yaw: 57.29577951308232 deg" in text and "phi" not in text.partition("sofa")[0]
    assert all(
        comment in text for comment in ("# Our home.", "# here we cook", "# the television", "# the end")
    )


def test_what_cannot_be_changed_in_place_is_refused_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "home.yaml"
    text = 'hotspots:\n  - {label: "a\\tb", x: 1, y: 2}\n'
    path.write_text(text)
    with pytest.raises(ConfigError, match="by hand"):
        HotspotFile(path).rename("a\tb", "c")
    assert path.read_text() == text


def test_unknown_and_taken_labels_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "home.yaml"
    path.write_text(BLOCK)
    changed = HotspotFile(path)
    with pytest.raises(ConfigError, match="kitchen"):
        changed.remove("kitchn")
    with pytest.raises(ConfigError, match="already"):
        changed.rename("tv", "kitchen")
    with pytest.raises(ConfigError, match="no zone"):
        changed.remove_zone("stairs")


def test_a_save_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "home.yaml"
    path.write_text(BLOCK)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    changed = HotspotFile(path)
    changed.remove("tv")
    with pytest.raises(ConfigError, match="cannot write"):
        changed.save()
    assert path.read_text() == BLOCK
    assert [file.name for file in tmp_path.iterdir()] == ["home.yaml"]
