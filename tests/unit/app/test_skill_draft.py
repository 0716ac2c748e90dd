"""Drafts of skills without code: they pass the check as they are, and a file keeps what it had."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

pytest.importorskip("nav2_msgs")

from florence_bt.app.mission_files.skill_draft import Offer, add_to_file, draft_all, draft_skill
from florence_bt.app.mission_files.skill_list import list_skills
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.declared_skills import STOCK, read_skills_file, templates_in
from tests.made_interfaces import make_interfaces

MISSIONS = Path(__file__).parents[3] / "examples" / "foreign_robot" / "missions"


@pytest.mark.parametrize(
    ("way", "interface"),
    [
        ("action", "nav2_msgs/action/NavigateToPose"),
        ("action", "nav2_msgs/action/FollowPath"),
        ("service", "std_srvs/srv/SetBool"),
        ("service", "nav2_msgs/srv/LoadMap"),
        ("condition", "sensor_msgs/msg/BatteryState"),
        ("condition", "std_msgs/msg/Bool"),
        ("wait_for", "sensor_msgs/msg/JointState"),
        ("publish", "geometry_msgs/msg/TwistStamped"),
        ("publish", "std_msgs/msg/Empty"),
    ],
)
def test_a_draft_passes_the_check(tmp_path: Path, way: str, interface: str) -> None:
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill(way, "tb4/my_thing", interface))
    found = read_skills_file(file)
    assert {finding.severity for finding in found.findings} == {"warning"}  # texts of the draft
    assert set(found.mappings) == {"my_thing"}
    assert len(found.mappings["my_thing"].send) == len(found.declarations["my_thing"].inputs)


def test_every_field_of_a_goal_is_sent(tmp_path: Path) -> None:
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill("action", "drive", "nav2_msgs/action/NavigateToPose"))
    assert [path for path, _ in read_skills_file(file).mappings["drive"].send] == ["pose", "behavior_tree"]


def test_codes_that_the_type_names_are_failures(tmp_path: Path) -> None:
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill("action", "spin", "nav2_msgs/action/Spin"))
    assert {"tf_error", "collision_ahead"} <= read_skills_file(file).declarations["spin"].failures.keys()


def test_constants_beside_the_one_integer_of_an_answer_are_failures() -> None:
    entry = draft_skill("service", "load_map", "nav2_msgs/srv/LoadMap").entry
    assert "result_map_does_not_exist: {when: $result == 1}" in entry and "result_success" not in entry


def test_a_file_keeps_what_it_had(tmp_path: Path) -> None:
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill("service", "open", "std_srvs/srv/Trigger"))
    add_to_file(file, draft_skill("service", "shut", "std_srvs/srv/Trigger"))
    before = file.read_text()
    assert set(read_skills_file(file).mappings) == {"open", "shut"}
    with pytest.raises(ConfigError, match="already"):
        add_to_file(file, draft_skill("service", "shut", "std_srvs/srv/Trigger"))
    with pytest.raises(ConfigError, match=r"skills\.yaml"):
        add_to_file(tmp_path / "mine.yaml", draft_skill("service", "shut", "std_srvs/srv/Trigger"))
    assert file.read_text() == before and not (tmp_path / "mine.yaml").exists()


def test_its_folder_is_made_too(tmp_path: Path) -> None:
    file = tmp_path / "my_robot" / "mine.skills.yaml"
    add_to_file(file, draft_skill("service", "open", "std_srvs/srv/Trigger"))
    assert set(read_skills_file(file).mappings) == {"open"}
    with pytest.raises(ConfigError, match="cannot be written"):
        add_to_file(file / "other.skills.yaml", draft_skill("service", "open", "std_srvs/srv/Trigger"))


def test_a_name_that_the_language_has_is_avoided() -> None:
    assert draft_skill("action", "/tb4/wait", "nav2_msgs/action/Wait").skill == "wait_skill"
    assert draft_skill("action", "/tb4/_2nd_Arm", "nav2_msgs/action/Wait").skill == "do_2nd_arm"
    with pytest.raises(ConfigError):
        draft_skill("action", "/tb4/2nd-Arm", "nav2_msgs/action/Wait")


def test_the_list_tells_what_serves_a_skill() -> None:
    known, wrong = list_skills(["drive_robot"], [MISSIONS])
    assert not wrong and "action tb4/drive_to (nav2_msgs/action/NavigateToPose)" in known
    assert "no_path: there is no way to the place" in known and "base" in known
    with pytest.raises(ConfigError, match="drive_robo"):
        list_skills(["drive_robo"], [MISSIONS])


@pytest.mark.parametrize("name", [*templates_in(STOCK), "our_switch"])
def test_a_template_is_shown_with_how_to_use_it(name: str, tmp_path: Path) -> None:
    text = "templates:\n  our_switch:\n    like: call_set_bool\n    deadline: 2 s\n\n# ours\nskills: {}\n"
    (tmp_path / "a.skills.yaml").write_text(text)
    known, _ = list_skills([name], [tmp_path])
    example = next(line.strip() for line in known.splitlines() if "like:" in line)
    assert f"like: {name}" in example and "# ours" not in known
    if name == "our_switch":
        assert "deadline: 2 s" in known
        return
    skill = example.replace("summary: ...", "summary: Something.").replace("NAME", "the/name")
    (tmp_path / "b.skills.yaml").write_text(f"skills:\n  {skill}\n")
    found = read_skills_file(tmp_path / "b.skills.yaml")
    assert not found.findings and list(found.mappings) == ["my_skill"]


def test_a_template_is_named_beside_the_skills() -> None:
    with pytest.raises(ConfigError) as caught:
        list_skills(["is_tru"])
    assert "is_true" in caught.value.valid


def test_the_commands() -> None:
    run = CliRunner().invoke
    listed = run(app, ["skills", "--missions", str(MISSIONS)])
    assert listed.exit_code == 0 and "drive_robot" in listed.output and "navigate_to" in listed.output
    drafted = run(app, ["skills", "add", "service", "gripper", "std_srvs/srv/SetBool"])
    assert drafted.exit_code == 0 and "service: gripper" in drafted.output
    wrong = run(app, ["skills", "add", "servise", "gripper", "std_srvs/srv/SetBool"])
    assert wrong.exit_code == 2


def drafted(interface: str, way: str = "action") -> dict[str, Any]:
    return yaml.safe_load(draft_skill(way, "it", interface).entry)["it"]


def test_a_result_with_a_code_but_no_names_of_codes_can_fail() -> None:
    draft = drafted("nav2_msgs/action/NavigateThroughPoses")
    assert "error_code" not in draft.get("outputs", {})
    assert [failure["when"] for failure in draft["failures"].values()] == ["$error_code != 0"]


def test_a_point_is_three_numbers() -> None:
    assert {"target_x", "target_y", "target_z"} < drafted("nav2_msgs/action/DriveOnHeading")["inputs"].keys()
    assert drafted("nav2_msgs/action/NavigateToPose")["inputs"]["pose"]["type"] == "pose"


def test_a_text_of_the_draft_is_a_warning_until_it_is_replaced(tmp_path: Path) -> None:
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill("condition", "battery", "std_msgs/msg/Bool"))
    assert len(read_skills_file(file).findings) == 2
    file.write_text(file.read_text().replace("Say here", "Told").replace("say here", "told"))
    assert read_skills_file(file).findings == ()


def test_a_check_of_skills_alone_tells_what_it_looked_at(tmp_path: Path) -> None:
    file = tmp_path / "mine.skills.yaml"
    add_to_file(file, draft_skill("service", "open", "std_srvs/srv/Trigger"))
    told = CliRunner().invoke(app, ["check", str(file)])
    assert told.exit_code == 0 and "1 skills file checked" in told.output


@pytest.mark.parametrize(
    ("skill", "would"),
    [
        ("say", "--skill my_say"),
        ("sequence", "--skill my_sequence"),
        ("class", "--skill my_class"),
        ("../grip", "--skill grip"),
        ("Grip it", "--skill grip_it"),
        ("grip\nskills", "--skill grip_skills"),
        ("grip\0", "--skill grip"),
        ("g" * 300, "--skill " + "g" * 60),
    ],
)
def test_a_name_that_no_mission_could_use_is_refused(skill: str, would: str) -> None:
    with pytest.raises(ConfigError) as caught:
        draft_skill("service", "open", "std_srvs/srv/Trigger", skill)
    assert list(caught.value.valid) == [would]


def test_a_link_is_not_written_through(tmp_path: Path) -> None:
    theirs = tmp_path / "theirs.yaml"
    theirs.write_text("skills: {}\n")
    file = tmp_path / "mine.skills.yaml"
    file.symlink_to(theirs)
    with pytest.raises(ConfigError, match="link"):
        add_to_file(file, draft_skill("service", "open", "std_srvs/srv/Trigger"))
    assert theirs.read_text() == "skills: {}\n"


def test_what_a_draft_leaves_out_is_said_in_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    make_interfaces(
        monkeypatch,
        "made_msgs",
        msg_Plant="string species\nbool ripe\nstring[] names",
        action_Water="int8 LOW=-1\nint8 HIGH=1\nint8 prio\nPlant[] only\nbuiltin_interfaces/Time begin\n"
        "geometry_msgs/Point[4] corners\n---\nuint8 OK=0\nuint8 code\nstring detail\nPlant[] plants\n"
        "builtin_interfaces/Time ended\n---\n"
        "uint8 percent\nstring bed",
    )
    draft = draft_skill("action", "cart/water", "made_msgs/action/Water")
    said = "\n".join(draft.left_out)
    assert all(word in said for word in ("only", "ended", "corners", "plants[*].names"))
    assert all(f"# {line}" in draft.entry for line in draft.left_out)
    entry = yaml.safe_load(draft.entry)["water"]
    assert entry["send"] == {"prio": "$prio", "begin": "now"} and "$percent" in entry["feedback"]
    assert entry["inputs"] == {"prio": {"type": "text", "choices": ["low", "high"]}}
    assert entry["outputs"]["plants_species"] == {"type": "list of text", "from": "plants[*].species"}
    add_to_file(tmp_path / "mine.skills.yaml", draft)
    assert {each.severity for each in read_skills_file(tmp_path / "mine.skills.yaml").findings} == {"warning"}


def test_what_a_condition_does_not_judge_is_said() -> None:
    (said,) = draft_skill("condition", "battery", "sensor_msgs/msg/BatteryState").left_out
    assert "percentage" in said and " voltage" not in said


OFFERS = (
    Offer("action", "/cart/spin", "nav2_msgs/action/Spin"),
    Offer("service", "/cart/spin", "std_srvs/srv/Empty"),
    Offer("service", "/cart/arm/lamp", "std_srvs/srv/SetBool"),
    Offer("service", "/cart/pump/change_state", "lifecycle_msgs/srv/ChangeState"),
    Offer("service", "/cart/pump/get_state", "lifecycle_msgs/srv/GetState"),
    Offer("service", "/cart/weigh", "nobodys_msgs/srv/Weigh"),
    Offer("condition", "/cart/door", "std_msgs/msg/Bool", latched=True),
    Offer("condition", "/cart/camera", "sensor_msgs/msg/Image"),
    Offer("publish", "/cart/say", "std_msgs/msg/String"),
    Offer("service", "/cart2/lamp", "std_srvs/srv/SetBool"),
)


@pytest.mark.parametrize("namespace", ["cart", "/cart", "/cart/"])
def test_a_whole_robot_is_drafted(tmp_path: Path, namespace: str) -> None:
    drafts, without = draft_all(OFFERS, namespace, ["lamp"])
    assert [draft.skill for draft in drafts] == [
        *("spin", "cart_spin", "arm_lamp", "change_pump", "door", "cart_say")
    ]
    assert [line.split(":")[0].split()[1] for line in without] == [
        *("/cart/pump/get_state", "/cart/weigh", "/cart/camera")
    ]
    assert "not installed" in without[1]
    file = tmp_path / "cart.skills.yaml"
    for draft in drafts:
        add_to_file(file, draft)
    found = read_skills_file(file)
    assert {each.severity for each in found.findings} == {"warning"} and found.mappings["door"].latched
    assert dict(found.mappings["change_pump"].fields({"transition": "activate"})) == {
        "transition.label": "activate"
    }


def test_a_namespace_with_nothing_in_it_is_told_with_those_that_are_there() -> None:
    with pytest.raises(ConfigError) as caught:
        draft_all(OFFERS, "kart")
    assert list(caught.value.valid) == ["/cart", "/cart2"]


@pytest.mark.parametrize(
    ("fields", "inputs"),
    [
        ("uint8 ROW_ANY=0\nuint8 ROW_LEFT=1\nuint8 side", {"side": ["any", "left"]}),
        ("uint8 DRIP=0\nuint8 FOG=2\nuint8 mode", {"mode": ["drip", "fog"]}),
        ("uint8 MODE_A=0\nuint8 MODE_B=1\nuint8 mode\nuint8 count", {"mode": ["a", "b"], "count": None}),
        (
            "int8 PRIO_LOW=-1\nint8 PRIO_HIGH=1\nint8 prio\nuint8 count",
            {"prio": ["low", "high"], "count": None},
        ),
        ("uint8 MODE_A=0\nuint8 MODE_B=1\nuint8 count\nuint8 size", {"count": None, "size": None}),
        ("uint8 MOST=9\nuint8 count", {"count": None}),
    ],
)
def test_numbers_that_have_names_are_choices(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, fields: str, inputs: dict[str, list[str] | None]
) -> None:
    make_interfaces(monkeypatch, "made_msgs", srv_Ask=f"{fields}\n---\n")
    draft = draft_skill("service", "cart/ask", "made_msgs/srv/Ask")
    drafted_inputs = yaml.safe_load(draft.entry)["ask"]["inputs"]
    assert {name: port.get("choices") for name, port in drafted_inputs.items()} == inputs
    add_to_file(tmp_path / "mine.skills.yaml", draft)
    found = read_skills_file(tmp_path / "mine.skills.yaml")
    assert {each.severity for each in found.findings} == {"warning"}
