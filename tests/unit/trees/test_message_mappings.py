"""Skills without code: files that say how a skill is served are read and checked, and map messages."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nav2_msgs")
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import Spin
from rcl_interfaces.srv import SetParameters
from sensor_msgs.msg import Imu, Temperature
from std_msgs.msg import String
from std_srvs.srv import Trigger

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.interfaces import field_type, fill, get, holds, load_interface, part_of, put
from florence_bt.core.message_skills import MessageCondition
from florence_bt.core.outcome import Outcome
from florence_bt.core.serving import WaitBinding
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import DeclaredSkills, mappings_in, read_skills_file
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.message_mappings import WAYS, MessageMapping

STAMP = Time(sec=7)


def message_of(mapping: MessageMapping, inputs: dict[str, Any]) -> Any:
    part = WAYS[mapping.way].sent
    assert part is not None
    return fill(part_of(load_interface(mapping.interface), part)(), mapping.fields(inputs), STAMP)


@pytest.fixture
def read(tmp_path: Path) -> Any:
    def read(text: str) -> DeclaredSkills:
        path = tmp_path / "mine.skills.yaml"
        path.write_text(f"skills:\n{text}", encoding="utf-8")
        return read_skills_file(path)

    return read


SPIN = """\
  spin_by:
    inputs: {angle: {type: angle}}
    outputs: {took: {type: duration, from: total_elapsed_time}}
    failures:
      too_slow: {meaning: it took too long, when: $took > 10 s}
      no_transform: {when: $error_code == 702}
      gave_up: it gave up
    action: spin
    type: nav2_msgs/action/Spin
    send: {target_yaw: $angle, time_allowance: 12 s}
    feedback: "turned $angular_distance_traveled rad"
    reason: error_msg
"""


def test_an_action(read: Any) -> None:
    found = read(SPIN)
    assert not found.findings
    spin = found.mappings["spin_by"]
    goal = message_of(spin, {"angle": 1.5})
    assert (goal.target_yaw, goal.time_allowance.sec) == (1.5, 12)
    message = Spin.Result()
    message.total_elapsed_time.sec = 3
    assert spin.result(message).outputs == {"took": 3.0}
    message.total_elapsed_time.sec = 11
    slow = spin.result(message)
    assert (slow.code, slow.reason) == ("too_slow", "spin: it took too long")
    other = spin.result(Spin.Result(error_code=702, error_msg="no odom"), Outcome.FAILED)
    assert (other.code, other.reason) == ("no_transform", "spin: no odom")
    assert spin.result(Spin.Result(error_code=9), Outcome.FAILED).code == "gave_up"
    assert spin.result(Spin.Result(), Outcome.CANCELLED).outcome is Outcome.CANCELLED
    assert spin.feedback_text(Spin.Feedback(angular_distance_traveled=0.5)) == "turned 0.5 rad"


def test_a_service_a_condition_and_a_wait(read: Any) -> None:
    found = read(
        "  open_door:\n    service: door\n    type: std_srvs/srv/Trigger\n    reason: message\n"
        "    failures: {locked: {when: not $success}}\n"
        "  warm:\n    condition: temperature\n    type: sensor_msgs/msg/Temperature\n"
        "    inputs: {least: {type: number, default: 18}}\n    max_age: 3 s\n"
        "    failures: {too_cold: {when: $temperature < $least}}\n"
        "  get_place:\n    wait_for: goal_pose\n    type: geometry_msgs/msg/PoseStamped\n    deadline: 20 s\n"
        "    outputs: {place: {type: pose, from: pose}, frame: {type: text, from: header.frame_id}}\n"
    )
    assert not found.findings
    door, warm, place = (found.mappings[name] for name in ("open_door", "warm", "get_place"))
    assert door.result(Trigger.Response(success=True)).succeeded
    refused = door.result(Trigger.Response(message="the key turns twice"))
    assert (refused.code, refused.reason) == ("locked", "door: the key turns twice")
    assert warm.declaration.instant and warm.declaration.reports_changes and warm.max_age_s == 3.0
    assert warm.judge({"least": 20.0}, Temperature(temperature=19.0)).code == "too_cold"
    assert warm.judge({"least": 18.0}, Temperature(temperature=19.0)).succeeded
    message = PoseStamped()
    put(message, "pose", Pose2(1.0, 2.0, 0.5), STAMP)
    message.header.frame_id = "odom"
    waits = place.binding()
    assert isinstance(waits, WaitBinding)
    got = waits.result(message).outputs
    assert (got["place"].x, got["place"].y, got["frame"]) == (1.0, 2.0, "odom")
    assert got["place"].yaw == pytest.approx(0.5)
    assert waits.time_limit({}) == 20.0 and waits.nothing({}).code == "timed_out"


@pytest.mark.parametrize(
    ("interface", "path", "value", "kind", "shown"),
    [
        ("geometry_msgs/msg/PoseStamped", "pose", Pose2(1.0, 2.0, 0.5), Kind.POSE, "pose.position.x"),
        ("geometry_msgs/msg/Pose", "orientation", 1.0, Kind.ANGLE, "orientation.w"),
        ("sensor_msgs/msg/JointState", "position", (0.1, 0.2), Kind.LIST_OF_NUMBER, "position[1]"),
        (
            "nav_msgs/msg/Path",
            "poses",
            (Pose2(1.0, 2.0, 0.0),),
            Kind.LIST_OF_POSE,
            "poses[0].pose.position.x",
        ),
        ("geometry_msgs/msg/Twist", "linear.x", 1, Kind.NUMBER, "linear.x"),
        ("sensor_msgs/msg/JointState", "name", ("a", "b"), Kind.LIST_OF_TEXT, "name[1]"),
        ("sensor_msgs/msg/Imu", "orientation_covariance", (0.5,) * 9, Kind.LIST_OF_NUMBER, "orientation"),
    ],
)
def test_values_go_into_fields_and_come_back(
    interface: str, path: str, value: Any, kind: Kind, shown: str
) -> None:
    message = load_interface(interface)()
    assert holds(kind, field_type(type(message), path))
    put(message, path, value, STAMP)
    back = get(message, path, kind)
    assert back == (pytest.approx(value) if kind in (Kind.ANGLE, Kind.LIST_OF_NUMBER) else value)
    field_type(type(message), shown)
    with pytest.raises(ConfigError):
        get(message, f"{shown}.none", Kind.NUMBER)


@pytest.mark.parametrize(
    ("text", "place", "valid"),
    [
        ("    send: {target_jaw: 1}\n", (5, 12), "target_yaw"),
        ("    send: {time_allowance: hello}\n", (5, 28), None),
        ("    outputs: {a: {type: text, from: error_code}}\n", (5, 37), None),
        ("    outputs: {a: {type: text, from: error_mgs}}\n", (5, 37), "error_msg"),
        ("    failures: {x: {when: $eror_code == 1}}\n", (5, 26), "error_code"),
        ("    failures: {x: {when: $error_code}}\n", (5, 26), None),
        ("    failures: {x: one, y: two}\n", (3, 5), None),
        ("    feedback: $distance\n", (5, 15), None),
        ("    reason: error_code\n", (5, 13), None),
        ("    max_age: 3 s\n", (5, 5), "send"),
        ("    failures: {x: {meaning: more than $least, when: $error_code == 1}}\n", (5, 29), None),
        ("    send: {target_yaw: $angel}\n    inputs: {angle: {type: angle}}\n", (5, 24), "angle"),
    ],
)
def test_mistakes_are_told_at_their_place(
    read: Any, text: str, place: tuple[int, int], valid: str | None
) -> None:
    findings = read(f"  s:\n    action: spin\n    type: nav2_msgs/action/Spin\n{text}").findings
    places = [(finding.line, finding.column) for finding in findings]
    assert place in places, findings
    if valid is not None:
        assert any(valid in finding.valid for finding in findings), findings


@pytest.mark.parametrize(
    ("text", "place", "remedy"),
    [
        ("    condition: bell\n    type: Bool\n", (4, 11), "std_msgs/msg/Bool"),
        ("    condition: bell\n    type: std_msgs/Bool\n", (4, 11), "std_msgs/msg/Bool"),
        ("    service: lamp\n    type: my_msgs/Lamp\n", (4, 11), "my_msgs/srv/Lamp"),
        ("    service: lamp\n", (3, 5), "type: std_srvs/srv/SetBool"),
        ("    service: drive\n    type: nav2_msgs/action/Spin\n", (4, 11), "action: NAME"),
        ("    topic: bell\n    type: std_msgs/msg/Bool\n", (3, 5), "condition, for what it said last"),
        ("    like: is_true\n", (3, 11), "condition: NAME"),
        ("    description: Ring.\n", (3, 5), "summary"),
        ("    service: a\n    type: std_srvs/srv/SetBool\n    send: {data: on}\n", (5, 18), "true"),
        (
            "    inputs: {lit: {type: boolean}}\n    service: lamp\n    type: std_srvs/srv/SetBool\n"
            "    send: {data: lit}\n",
            (6, 18),
            "$lit",
        ),
        (
            "    inputs: {lit: {type: text}}\n    service: lamp\n    type: std_srvs/srv/SetBool\n"
            "    send: {data: $lit}\n",
            (6, 18),
            "inputs: {lit: {type: boolean}}",
        ),
        (
            "    inputs: {lit: {type: boolean}}\n    service: lamp\n    type: std_srvs/srv/SetBool\n",
            (3, 14),
            "send: {FIELD: $lit}",
        ),
        ("    publish: shout\n    type: std_msgs/msg/String\n", (3, 5), "send: {data: ...}"),
    ],
)
def test_a_mistake_is_told_with_its_remedy(read: Any, text: str, place: tuple[int, int], remedy: str) -> None:
    findings = read(f"  s:\n{text}").findings
    assert any((each.line, each.column) == place and remedy in each.valid for each in findings), findings


def test_a_skill_that_is_like_no_other_is_one_mistake(read: Any) -> None:
    (finding,) = read("  s:\n    like: is_treu\n    condition: bell\n").findings
    assert (finding.line, finding.column, finding.valid[0]) == (3, 11, "is_true")


def test_a_skill_that_florence_has_itself_is_pointed_out(tmp_path: Path) -> None:
    file = tmp_path / "mine.skills.yaml"
    file.write_text("skills:\n  say: {like: publish_text, publish: shout}\n")
    library = MissionLibrary()
    library.add_file(file)
    (finding,) = (each for each in library.findings if each.file == str(file))
    assert (finding.severity, finding.line, finding.column) == ("warning", 2, 3)


def test_a_latched_message_does_not_grow_old(read: Any) -> None:
    skill = read(
        "  idle:\n    condition: mode\n    type: std_msgs/msg/String\n    latched: true\n"
        "    failures: {busy: {when: $data != 'idle'}}\n"
    ).mappings["idle"]
    assert skill.latched and skill.max_age_s == math.inf
    clock = ManualClock()
    condition = MessageCondition(clock, "topic mode", skill.judge, skill.max_age_s)
    condition.take(String(data="idle"))
    changes: list[None] = []
    condition.watch({}, lambda: changes.append(None))
    clock.advance(100_000.0)
    assert condition.start({}).poll().succeeded and not changes
    condition.take(String(data="busy"))
    assert condition.start({}).poll().code == "busy" and len(changes) == 1


def test_a_message_that_is_too_old_at_once_is_a_mistake(read: Any) -> None:
    (finding,) = read(
        "  idle:\n    condition: mode\n    type: std_msgs/msg/String\n    max_age: 0 s\n"
    ).findings
    assert (finding.line, finding.column) == (5, 14)


@pytest.mark.parametrize(
    ("interface", "severity"),
    [
        ("nav2_msgs/action/Spim", "error"),
        ("nav2_msgs/srv/LoadMap", "error"),
        ("Spin", "error"),
        ("weather_msgs/action/Get", "warning"),
    ],
)
def test_a_type_that_does_not_fit_or_is_not_there(read: Any, interface: str, severity: str) -> None:
    (finding,) = read(f"  s:\n    action: spin\n    type: {interface}\n").findings
    assert (finding.severity, finding.line) == (severity, 4)


LATE = """\
class Light:
    @classmethod
    def get_fields_and_field_types(cls):
        return {}
"""


def test_an_interface_that_is_installed_meanwhile_is_found(
    read: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site-packages"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    text = "  s:\n    publish: lights\n    type: late_msgs/msg/Light\n"
    (finding,) = read(text).findings
    assert finding.severity == "warning" and "not installed" in finding.message
    (site / "late_msgs" / "msg").mkdir(parents=True)
    (site / "late_msgs" / "msg" / "__init__.py").write_text(LATE)
    try:
        assert not read(text).findings
    finally:
        for name in ("late_msgs.msg", "late_msgs"):
            sys.modules.pop(name, None)


def test_a_value_that_a_field_cannot_hold_is_told_by_the_run(read: Any) -> None:
    found = read(
        "  blink:\n    publish: lights\n    type: std_msgs/msg/UInt8\n"
        "    inputs: {times: {type: integer}}\n    send: {data: $times}\n"
    )
    assert message_of(found.mappings["blink"], {"times": 3}).data == 3
    with pytest.raises(ValueError, match="data"):
        message_of(found.mappings["blink"], {"times": 300})


@pytest.mark.parametrize("count", [0, 8, 10])
def test_an_array_of_a_fixed_length_takes_no_other(count: int) -> None:
    with pytest.raises(ValueError, match="orientation_covariance"):
        put(Imu(), "orientation_covariance", (1.0,) * count, STAMP)
    assert field_type(Imu, "orientation_covariance[8]") == "double"
    with pytest.raises(ConfigError, match="no item 9"):
        field_type(Imu, "orientation_covariance[9]")


def test_what_no_value_is_comes_as_such() -> None:
    message = Imu()
    message.linear_acceleration.x, message.orientation.x = math.inf, math.nan
    for path, kind in (("linear_acceleration.x", Kind.INTEGER), ("orientation", Kind.ANGLE)):
        with pytest.raises(ConfigError, match=path):
            get(message, path, kind)


def test_words_of_a_server_that_are_not_there_are_left_out(read: Any) -> None:
    found = read(
        "  limit:\n    service: x/set_parameters\n    type: rcl_interfaces/srv/SetParameters\n"
        '    reason: "results[0].reason"\n'
        '    outputs: {done: {type: boolean, from: "results[0].successful"}}\n'
    )
    assert [finding.severity for finding in found.findings] == ["warning"]  # words that nothing tells
    answered = found.mappings["limit"].result(SetParameters.Response())
    assert answered.code == "bad_output" and "results has 0 items" in answered.reason


def test_the_check_does_not_miss_a_skill_that_a_file_serves(read: Any, tmp_path: Path) -> None:
    read(SPIN)
    (tmp_path / "m.yaml").write_text("mission: m\ntree: {spin_by: {angle: 1 rad}}\n", encoding="utf-8")
    library = MissionLibrary.load([tmp_path], built_in=False)
    assert check(library.missions(), library, collect_declarations()) == []
    assert set(mappings_in([tmp_path])) == {"spin_by"}


ROOT = Path(__file__).parents[3]


def test_the_page_shows_the_file_of_the_example() -> None:
    page = (ROOT / "docs" / "manual" / "skills_without_code.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```yaml (\S+)#(\w+)\n(.*?)```", page, re.DOTALL)
    assert len(blocks) == 8
    for file, name, block in blocks:
        assert block.startswith(f"  {name}:") and block in (ROOT / file).read_text(encoding="utf-8"), name


def test_the_example_passes_the_check() -> None:
    library = MissionLibrary.load([ROOT / "examples" / "foreign_robot" / "missions"], built_in=False)
    assert library.findings == [] and len(library.names()) == 3
    assert check(library.missions(), library, collect_declarations()) == []


def test_a_plain_number_beside_a_length_is_told_how_it_gets_its_unit(tmp_path: Path) -> None:
    text = (
        "skills:\n  near:\n    inputs: {least: {type: length, default: 1 m}}\n"
        "    failures: {too_near: {when: $range < $least}}\n"
        "    condition: sonar\n    type: sensor_msgs/msg/Range\n"
    )
    file = tmp_path / "r.skills.yaml"
    file.write_text(text)
    (finding,) = read_skills_file(file).findings
    (hint,) = finding.valid
    file.write_text(f"{text}    {hint}\n")
    assert not read_skills_file(file).findings


@pytest.mark.parametrize(
    ("port", "wrong"),
    [
        ("{type: integer, min: 0, max: 255}", False),
        ("{type: integer}", False),
        ("{type: integer, min: -1, max: 255}", True),
        ("{type: integer, max: 256}", True),
    ],
)
def test_limits_of_an_input_lie_within_those_of_the_field(read: Any, port: str, wrong: bool) -> None:
    findings = read(
        f"  blink:\n    publish: lights\n    type: std_msgs/msg/UInt8\n"
        f"    inputs: {{times: {port}}}\n    send: {{data: $times}}\n"
    ).findings
    assert [finding.line for finding in findings] == ([6] if wrong else [])


def test_a_constant_lies_within_the_limits_of_the_field(read: Any) -> None:
    (finding,) = read(
        "  blink:\n    publish: lights\n    type: std_msgs/msg/UInt8\n    send: {data: 300}\n"
    ).findings
    assert finding.line == 5 and "0 to 255" in finding.message


def test_items_of_arrays_are_sent(read: Any) -> None:
    found = read(
        "  limit:\n    service: x/set_parameters\n    type: rcl_interfaces/srv/SetParameters\n"
        "    inputs: {value: {type: number}}\n"
        '    send: {"parameters[0].name": speed, "parameters[1].value.double_value": $value}\n'
    )
    message = message_of(found.mappings["limit"], {"value": 2.5})
    assert [each.name for each in message.parameters] == ["speed", ""]
    assert message.parameters[1].value.double_value == 2.5


@pytest.mark.parametrize(
    ("second", "warned"),
    [
        ("condition: /x/heat\n    type: std_msgs/msg/Bool\n    failures: {no: {when: $data}}", True),
        ("publish: x/heat\n    type: std_msgs/msg/Bool\n    send: {data: true}", True),
        ("wait_for: x/heat\n    type: std_msgs/msg/Float32", False),
        ("service: x/heat\n    type: std_srvs/srv/Empty", False),
        ("wait_for: x/cold\n    type: std_msgs/msg/Bool", False),
    ],
)
def test_one_name_with_two_types_is_told(tmp_path: Path, second: str, warned: bool) -> None:
    first = "skills:\n  hot:\n    summary: Hot.\n    wait_for: x/heat\n    type: std_msgs/msg/Float32\n"
    (tmp_path / "a.skills.yaml").write_text(first, encoding="utf-8")
    (tmp_path / "b.skills.yaml").write_text(
        f"skills:\n  other:\n    summary: Other.\n    {second}\n", encoding="utf-8"
    )
    found = [
        (Path(each.file).name, each.line, each.severity, each.valid)
        for each in MissionLibrary.load([tmp_path]).findings
    ]
    assert found == ([("b.skills.yaml", 2, "warning", ("type: std_msgs/msg/Float32",))] if warned else [])


@pytest.mark.parametrize("name", ["a//b", "1a/b", "'a b'", "a/", "$name", "tür/auf"])
def test_a_name_that_ros_does_not_allow_is_told(read: Any, name: str) -> None:
    found = read(f"  hot:\n    summary: Hot.\n    wait_for: {name}\n    type: std_msgs/msg/Float32\n")
    assert [(each.severity, each.line) for each in found.findings] == [("error", 4)]
