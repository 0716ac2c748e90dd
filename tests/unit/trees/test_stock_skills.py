"""The skills and templates that come with Florence, and skills that are like others."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from florence_bt.trees.checks import lint
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import STOCK, DeclaredSkills, read_skills_file
from florence_bt.trees.language.loader import MissionLibrary

TEMPLATES = yaml.safe_load(STOCK.read_text())["templates"]
WAYS = {"publish": "publish", "call": "service", "set": "service", "wait": "wait_for"}


def read(folder: Path, text: str) -> DeclaredSkills:
    file = folder / "mine.skills.yaml"
    file.write_text(text, encoding="utf-8")
    return read_skills_file(file)


def test_every_mission_can_use_them_without_a_file(tmp_path: Path) -> None:
    library = MissionLibrary.load()
    assert {"dock_robot", "is_charging", "follow_waypoints"} <= library.mappings.keys()
    assert not library.findings and not library.mappings.keys() & collect_declarations().keys()
    assert all(mapping.stock for mapping in library.mappings.values())


@pytest.mark.parametrize("template", TEMPLATES)
def test_a_template_needs_a_name_and_nothing_else(tmp_path: Path, template: str) -> None:
    pytest.importorskip("rclpy")
    way = WAYS.get(template.partition("_")[0], "condition")
    found = read(tmp_path, f"skills:\n  mine: {{like: {template}, {way}: tb4/mine}}\n")
    assert found.findings == ()
    assert found.mappings["mine"].name == "tb4/mine" and not found.mappings["mine"].stock
    assert found.declarations["mine"].summary == TEMPLATES[template]["summary"]


def test_the_stock_skills_fit_their_interfaces(tmp_path: Path) -> None:
    """Those whose interfaces are installed: the others are in the complete nav2_msgs."""
    pytest.importorskip("nav2_msgs")
    found = read(tmp_path, STOCK.read_text())
    assert all("nav2_msgs has no action" in finding.message for finding in found.findings)
    assert {"is_charging", "clear_local_costmap"} <= found.mappings.keys()


def test_what_the_skill_says_itself_counts(tmp_path: Path) -> None:
    found = read(
        tmp_path,
        """
templates:
  press: {like: call_trigger, summary: Press a button., deadline: 9 s}
skills:
  press_red: {like: press, service: red}
  press_blue: {like: press_red, service: blue, failures: {jammed: {when: not $success}}}
  is_charging: {like: is_charging, condition: tb4/battery, deadline: 1 min}
  tell_red: {like: press_red, wait_for: red, type: std_msgs/msg/String, failures: {}, reason: data}
""",
    )
    assert found.findings == ()
    assert {"press_red", "press_blue", "is_charging", "tell_red"} == found.mappings.keys()
    red, blue, battery, tell = (
        found.mappings[name] for name in ("press_red", "press_blue", "is_charging", "tell_red")
    )
    assert (red.name, blue.name, battery.name) == ("red", "blue", "tb4/battery")
    assert (tell.way, tell.name) == ("wait_for", "red")
    assert set(red.declaration.failures) == {"refused"} and set(blue.declaration.failures) == {"jammed"}
    assert blue.declaration.summary == "Press a button." and blue.declaration.deadline_s == 9.0
    assert battery.declaration.deadline_s == 60.0 and "not_charging" in battery.declaration.failures


@pytest.mark.parametrize(
    ("text", "line", "about"),
    [
        ("skills:\n  mine: {like: call_triger, service: x}\n", 2, "call_trigger"),
        (
            "skills:\n  mine:\n    like: later\n    service: x\n  later: {like: call_trigger, service: y}\n",
            3,
            "later",
        ),
        ("skills:\n  mine: {like: call_trigger}\n", 2, "service"),
        ("skills:\n  mine: {like: [call_trigger], service: x}\n", 2, "like"),
        ("templates: [a]\nskills: {}\n", 1, "templates"),
    ],
)
def test_a_skill_like_nothing(tmp_path: Path, text: str, line: int, about: str) -> None:
    findings = read(tmp_path, text).findings
    assert findings and findings[0].line == line
    assert about in f"{findings[0].message} {findings[0].valid}"


def test_what_does_not_fit_the_template_is_told_at_like(tmp_path: Path) -> None:
    pytest.importorskip("std_msgs")
    text = "skills:\n  mine:\n    like: publish_number\n    publish: x\n    type: std_msgs/msg/String\n"
    assert [finding.line for finding in read(tmp_path, text).findings] == [3]


def test_a_stock_skill_whose_interface_is_not_installed_is_told_where_it_is_used(tmp_path: Path) -> None:
    nav2 = pytest.importorskip("nav2_msgs.action")
    file = tmp_path / "go_to_bed.yaml"
    file.write_text("mission: go_to_bed\ndescription: Dock.\ntree:\n  dock_robot:\n", encoding="utf-8")
    library = MissionLibrary.load([tmp_path])
    found = lint.check([library.get("go_to_bed")], library, collect_declarations())
    told = [(finding.line, finding.valid) for finding in found]
    assert told == ([] if hasattr(nav2, "DockRobot") else [(4, ("florence interfaces add nav2_msgs",))])
