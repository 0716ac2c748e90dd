"""``florence hotspot`` on files: everything wrong is told at once, changes, lists and pictures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from florence_bt.app.places.check import check_places, place_findings
from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, OK, USAGE
from florence_bt.core.paths import find_data
from florence_bt.skills.locator.hotspots import load_hotspots, parse_places

HOME = """\
hotspots:
  - {label: kitchen, x: 1, y: 1, phi: 1.5, kind: room, polygon: [[0, 0], [3, 0], [3, 3], [0, 3]]}
  - {label: hall, x: 5, y: 1, yaw: 90 deg, kind: room, polygon: [[2, 1], [6, 1], [6, 2], [2, 2]]}
  - {label: bath, x: 9, y: 9, kind: room, polygon: [[7, 0], [8, 0], [8, 1], [7, 1]]}
  - {label: attic, x: 20, y: 20, kind: room, polygon: [[20, 20], [21, 21], [21, 20], [20, 21]]}
  - {label: sofa, x: 30.5, y: 0.5, kind: object}
  - {label: line, x: 40, y: 0, kind: room, polygon: [[40, 0], [41, 0], [42, 0]]}
zones:
  - {label: stairs, kind: keep_out, polygon: [[30, 0], [31, 0], [31, 1], [30, 1]]}
"""


def test_wrong_shapes_and_places_are_all_found_where_they_stand() -> None:
    findings = place_findings(parse_places(HOME.encode(), Path("home.yaml")))
    told = [(finding.line, finding.severity, finding.message) for finding in findings]
    for line, severity, words in [
        (2, "warning", "85.9"),
        (3, "error", "'kitchen' and 'hall' overlap by 1.0 m²"),
        (4, "error", "'bath' does not contain its own hotspot"),
        (5, "error", "edge 3 of the room 'attic' crosses its edge 1"),
        (6, "error", "in the keep-out zone 'stairs'"),
        (7, "error", "no area"),
    ]:
        assert any((at, how) == (line, severity) and words in text for at, how, text in told), words
    assert len(findings) == 6


def test_wrong_fields_are_all_found() -> None:
    text = """\
hotspots:
  - {label: a, x: one, y: 2, kynd: room}
  - {x: 1, y: 2}
  - {label: b, x: 1, y: 2, phi: 90, polygon: [[0, 0], [1]]}
  - {label: b, x: 1, y: 2, yaw: 90}
  - {label: c, x: 1, y: 2, yaw: 90 dge, phi: 1}
zones:
  - {label: z, kind: keepout, polygon: [[0, 0], [1, 1], [1, 0]]}
  - {label: s, kind: slow, polygon: [[0, 0], [1, 1], [1, 0]]}
  - {label: t, kind: slow, speed_limit: 0.2, polygon: [[0, 0], [1, 1], [1, 0]]}
  - {label: u, kind: keep_out, speed_limit: 20 %}
"""
    findings = place_findings(parse_places(text.encode(), Path("home.yaml")))
    errors = [finding for finding in findings if finding.severity == "error"]
    lines = [error.line for error in errors]
    assert lines == sorted(lines) and {*range(2, 7), *range(8, 12)} == set(lines)
    valid = {(error.line, value) for error in errors for value in error.valid}
    assert {(2, "kind"), (4, "90 deg, if degrees are meant"), (8, "keep_out"), (10, "0.2 m/s")} <= valid
    assert sum(error.line == 2 for error in errors) == 2


def test_the_map_tells_of_hotspots_in_walls(tmp_path: Path) -> None:
    file = tmp_path / "home.yaml"
    file.write_text("hotspots:\n  - {label: sofa, x: 1.9, y: 5.9}\n  - {label: moon, x: 99, y: 5.9}\n")
    report, wrong = check_places(file, find_data("maps", "flat.yaml"), "text")
    assert wrong and f"{file}:2:5:" in report and f"{file}:3:5:" in report
    assert "obstacle" in report and "outside the map" in report
    assert check_places(file, None, "text")[1] is False


def test_the_flat_of_the_package_has_no_mistakes() -> None:
    report, _ = check_places(find_data("hotspots", "flat.yaml"), find_data("maps", "flat.yaml"), "json")
    assert json.loads(report) == []


@pytest.fixture
def florence(tmp_path: Path) -> Any:
    def call(*arguments: str) -> Any:
        options = [*arguments, "--hotspots", str(tmp_path / "home.yaml")]
        return CliRunner().invoke(app, ["hotspot", *options], catch_exceptions=False)

    return call


def test_a_home_is_taught_on_the_command_line(florence: Any, tmp_path: Path) -> None:
    room = "polygon=[[0, 0], [3, 0], [3, 3], [0, 3]]"
    assert florence("add", "kitchen", "x=1", "y=2 m", "yaw=90 deg", "kind=room", room).exit_code == OK
    assert florence("add", "sofa", "x=-1", "y=-2").exit_code == OK
    assert florence("move", "sofa", "yaw=-90 deg", "x=2").exit_code == OK
    assert florence("rename", "sofa", "settee").exit_code == OK
    limit = "speed_limit=30 %"
    assert florence("zone", "add", "rug", "kind=slow", limit, room).exit_code == OK
    places = load_hotspots(tmp_path / "home.yaml")
    assert places.labels() == ("kitchen", "settee") and places.zones[0].limit_text == "30 %"
    settee = places.get("settee")
    assert settee is not None and settee.kind == "object"
    assert (settee.pose.x, settee.pose.y, round(settee.pose.yaw, 3)) == (2.0, -2.0, -1.571)
    listed = json.loads(florence("list", "--json").stdout)
    assert [spot["yaw_deg"] for spot in listed["hotspots"]] == [90.0, -90.0]
    assert "settee" in florence("list").stdout and "30 %" in florence("list").stdout
    assert florence("check").exit_code == OK
    for arguments in (("remove", "settee"), ("zone", "remove", "rug")):
        assert florence(*arguments).exit_code == OK
    assert load_hotspots(tmp_path / "home.yaml").labels() == ("kitchen",)


def test_what_is_typed_wrong_changes_nothing_and_says_what_would_have_worked(
    florence: Any, tmp_path: Path
) -> None:
    assert florence("add", "kitchen", "x=1", "y=2").exit_code == OK
    before = (tmp_path / "home.yaml").read_text()
    for arguments, words in [
        (("add", "kitchen", "x=1", "y=2"), "florence hotspot move"),
        (("add", "hall", "x=1"), "'y' is missing"),
        (("add", "hall", "x=1, label: b", "y=2"), "number"),
        (("move", "kitchn", "x=1"), "kitchen"),
        (("move", "kitchen", "yaw=90"), "90 deg"),
        (("move", "kitchen", "yow=90 deg"), "yaw"),
        (("remove", "kitchn"), "kitchen"),
        (("zone", "add", "a", "kind=keep-out", "polygon=[[0, 0], [1, 0], [1, 1]]"), "keep_out"),
    ]:
        done = florence(*arguments)
        assert done.exit_code == USAGE and words in done.output, arguments
    assert (tmp_path / "home.yaml").read_text() == before


@pytest.mark.parametrize(
    ("arguments", "mistakes"),
    [
        (
            ("add", "", "x=abc", "yaw=90", "kind=roomy", "polygn=1", "polygon=[[0,0]]"),
            ("label is empty", "'polygn'", "'y' is missing", "'abc'", "no unit", "'roomy'", "3 corners"),
        ),
        (("add", "sofa", "x=[1", "y=1e9"), ("x: not YAML", "y is 1e+09 m")),
        (("zone", "add", "a", "kind=slo", "polygon=7", "speed=1"), ("'slo'", "must be a list", "'speed'")),
        (("zone", "add", "a", "kind=slow", "polygon=[[0,0],[1,1]]"), ("3 corners", "needs a 'speed_limit'")),
        (("add", "sofa", "x=1", "x=2", "y=3", "y=4"), ("x is given twice", "y is given twice")),
    ],
)
def test_all_mistakes_are_told_at_once_and_no_file_is_left(
    florence: Any, tmp_path: Path, arguments: tuple[str, ...], mistakes: tuple[str, ...]
) -> None:
    done = florence(*arguments)
    assert done.exit_code == USAGE
    assert f"{len(mistakes)} mistakes:" in done.output
    assert not [words for words in mistakes if words not in done.output], done.output
    assert not any(tmp_path.iterdir())


def test_that_a_place_is_there_already_is_told_beside_what_is_wrong_with_it(florence: Any) -> None:
    assert florence("add", "sofa", "x=1", "y=2").exit_code == OK
    done = florence("add", "sofa", "x=1", "y=a")
    assert "already" in done.output and "'a'" in done.output


def test_a_change_tells_what_is_wrong_with_the_places_now(florence: Any, tmp_path: Path) -> None:
    (tmp_path / "home.yaml").write_text("hotspots:\n  - {label: sofa, x: 0.6, y: 0.4}\n")
    done = florence("zone", "add", "rug", "kind=keep_out", "polygon=[[0, 0], [1, 0], [1, 1]]")
    assert done.exit_code == OK and "'sofa' is in the keep-out zone 'rug'" in done.stdout
    assert florence("check").exit_code == FAILED


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["png", "svg"])
def test_places_are_drawn_with_and_without_a_map(florence: Any, tmp_path: Path, ending: str) -> None:
    (tmp_path / "home.yaml").write_text(HOME)
    with_map, without = tmp_path / f"with.{ending}", tmp_path / f"without.{ending}"
    given = ("--map", str(find_data("maps", "flat.yaml")))
    assert florence("draw", "--out", str(with_map), *given).exit_code == OK
    assert florence("draw", "--out", str(without)).exit_code == OK
    if ending == "svg":
        assert "</svg>" in with_map.read_text() and "</svg>" in without.read_text()
    else:
        assert with_map.read_bytes()[:4] == without.read_bytes()[:4] == b"\x89PNG"
    refused = florence("draw", "--out", str(tmp_path / "places.gif"))
    assert refused.exit_code == USAGE and "places.png" in refused.output
