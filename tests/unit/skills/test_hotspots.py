"""Hotspot files: what is read, what is refused and where, and what a save leaves behind."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.skills.locator.hotspot_file import HotspotFile
from florence_bt.skills.locator.hotspots import (
    Hotspot,
    Hotspots,
    load_hotspots,
    parse_hotspots,
)

GOOD = """\
hotspots:
  - label: kitchen
    x: 1.5
    y: -2
    phi: 1.57
    kind: room
    polygon: [[0, 0], [3, 0], [3, -4], [0, -4]]
  - {label: tv, x: 4, y: 1e0, kind: object}
"""


def test_a_file_is_read() -> None:
    hotspots = parse_hotspots(GOOD)
    kitchen, tv = hotspots
    assert kitchen == Hotspot(
        "kitchen", Pose2(1.5, -2.0, 1.57), "room", ((0.0, 0.0), (3.0, 0.0), (3.0, -4.0), (0.0, -4.0))
    )
    assert tv == Hotspot("tv", Pose2(4.0, 1.0, 0.0), "object")
    assert hotspots.labels() == ("kitchen", "tv")
    assert hotspots.rooms() == (kitchen,)
    assert len(hotspots) == 2


@pytest.mark.parametrize(
    ("phi", "valid"),
    [
        ("90", "90 deg, if degrees are meant"),
        ("-180", "-180 deg, if degrees"),
        ("400", "-180 deg to 180 deg"),
    ],
)
def test_degrees_in_place_of_radians_are_refused(phi: str, valid: str) -> None:
    with pytest.raises(ConfigError, match=f"phi is in radians, and {phi} is more than a whole turn.*{valid}"):
        parse_hotspots(f"hotspots: [{{label: a, x: 1, y: 2, phi: {phi}}}]")


@pytest.mark.parametrize("text", ["", "hotspots: []", "# nothing\n"])
def test_an_empty_file_has_no_hotspots(text: str) -> None:
    assert len(parse_hotspots(text)) == 0


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("hotspots: [", ":1:12", "not YAML"),
        ("- a", ":1:1", "mapping"),
        ("rooms: []", ":1:1", "hotspots"),
        ("hotspots: 3", ":1:11", "list"),
        ("hotspots:\n  - {x: 1, y: 2}", ":2:5", "'label' is missing"),
        ("hotspots:\n  - {label: a, x: 1}", ":2:5", "'y' is missing"),
        ("hotspots:\n  - {label: a, x: one, y: 2}", ":2:19", "finite number, not 'one'"),
        ("hotspots:\n  - {label: a, x: .nan, y: 2}", ":2:19", "finite"),
        ("hotspots:\n  - {label: a, x: nan, y: 2}", ":2:19", "finite"),
        ("hotspots:\n  - {label: a, x: 1, y: inf}", ":2:25", "finite"),
        ("hotspots:\n  - {label: '', x: 1, y: 2}", ":2:13", "label must be text"),
        ("hotspots:\n  - {label: a, x: 1, y: 2, kynd: room}", ":2:28", "kind"),
        ("hotspots:\n  - {label: a, x: 1, y: 2, kind: rom}", ":2:34", "room"),
        ("hotspots:\n  - {label: a, x: 1, x: 1, y: 2}", ":2:22", "duplicated"),
        ("hotspots:\n  - {label: a, x: 1, y: 2}\n  - {label: a, x: 3, y: 2}", ":3:5", "twice"),
        ("hotspots:\n  - {label: a, x: 1, y: 2, polygon: [[0, 0], [1, 1]]}", ":2:37", "at least 3"),
        ("hotspots:\n  - {label: a, x: 1, y: 2, polygon: [[0], [1, 1], [1, 0]]}", ":2:38", "two numbers"),
    ],
)
def test_a_mistake_is_told_with_its_place(text: str, place: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_hotspots(text, "flat.yaml")
    assert str(caught.value).startswith(f"flat.yaml{place}: ")
    assert problem in str(caught.value)


def test_a_missing_or_binary_file_is_a_config_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.yaml"):
        load_hotspots(tmp_path / "nowhere.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError):
        load_hotspots(tmp_path / "binary.yaml")


NUMBERS = st.floats(-1e3, 1e3)
HOTSPOTS = st.lists(
    st.builds(
        Hotspot,
        st.text(st.characters(exclude_categories=("Cs", "Cc", "Zs", "Zl", "Zp")), min_size=1, max_size=12),
        st.builds(Pose2, NUMBERS, NUMBERS, st.floats(-math.tau, math.tau)),
        st.sampled_from(("room", "object")),
        st.lists(st.tuples(NUMBERS, NUMBERS), min_size=3, max_size=5).map(tuple) | st.just(()),
    ),
    unique_by=lambda hotspot: hotspot.label,
    max_size=4,
)


@given(HOTSPOTS)
def test_what_is_written_is_read_back(hotspots: list[Hotspot]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "flat.yaml"
        changed = HotspotFile(file, create=True)
        assert not file.exists()
        for hotspot in hotspots:
            changed.put(hotspot)
        changed.save()
        assert list(load_hotspots(file)) == hotspots
        assert file.read_text().startswith("# ")


def test_a_point_is_inside_or_outside_of_any_polygon() -> None:
    # An L: the corner at the upper right is missing.
    corners = ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0))
    room = Hotspot("l", Pose2(), polygon=corners)
    assert room.contains(1.0, 3.0) and room.contains(3.0, 1.0)
    assert not room.contains(3.0, 3.0) and not room.contains(-0.1, 1.0)
    assert not Hotspot("none", Pose2()).contains(0.0, 0.0)


def test_an_unknown_label_gets_a_hint() -> None:
    hotspots = parse_hotspots(GOOD)
    assert "kitchen" in hotspots.unknown("kitchn")
    assert "empty" in Hotspots().unknown("kitchen")
    assert hotspots.get("kitchn") is None


def test_reading_hotspots_loads_no_heavy_module() -> None:
    code = (
        "import sys; import florence_bt.skills.locator.hotspots, florence_bt.skills.locator.locator,"
        " florence_bt.skills.locator.bindings, florence_bt.skills.people.user_tracker.bindings,"
        " florence_bt.skills.people.approach_user.bindings,"
        " florence_bt.skills.people.approach_user.polite_pose;"
        " print([m for m in ('numpy', 'numba', 'rclpy', 'cv2', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_heading_of_up_to_a_turn_is_kept() -> None:
    pose = parse_hotspots("hotspots:\n  - {label: a, x: 0, y: 0, phi: 6.0}").get("a")
    assert pose is not None and math.isclose(pose.pose.yaw, 6.0)
