"""Fields in ``when``, ``send`` and ``feedback`` are held against their types, and the run reads them so."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("std_msgs")

from builtin_interfaces.msg import Time

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.interfaces import fill, get, load_interface, part_of
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import DeclaredSkills, read_skills_file
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.value_schemas import port
from tests.made_interfaces import make_interfaces

PLANT = "string species\nfloat32 height\nbool ripe"
BED = """
uint8 STATE_DRY=1
uint8 STATE_WET=2
uint8 state
string<=16 name
float32 moisture
geometry_msgs/Point[4] corners
Plant[] plants
builtin_interfaces/Time watered_at
geometry_msgs/PoseStamped place
"""
TANK = """
std_msgs/Header header
float32 litres
builtin_interfaces/Duration time_left
string<=32[<=4] warnings
Bed bed
"""
DOSE = """
uint8 MODE_DRIP=0
uint8 MODE_FOG=2
uint8 mode
uint8[] nozzles
float64[3] mix
string<=16 bed
float32 flow
string<=4[<=2] tags
Plant[] only
Bed whole
builtin_interfaces/Time not_before
---
bool ok
Bed bed
"""
GROW = """
---
bool ok
---
float32 share
builtin_interfaces/Duration eta
Bed bed
"""


@pytest.fixture(autouse=True)
def interfaces(monkeypatch: pytest.MonkeyPatch) -> None:
    make_interfaces(
        monkeypatch,
        "made_msgs",
        msg_Plant=PLANT,
        msg_Bed=BED,
        msg_Tank=TANK,
        srv_Dose=DOSE,
        action_Grow=GROW,
    )


@pytest.fixture
def read(tmp_path: Path) -> Any:
    def read(text: str) -> DeclaredSkills:
        file = tmp_path / "mine.skills.yaml"
        file.write_text(f"skills:\n  it:\n{text}", encoding="utf-8")
        return read_skills_file(file)

    return read


def condition(when: str) -> str:
    return f"    condition: tank\n    type: made_msgs/msg/Tank\n    failures:\n      no: {{when: '{when}'}}\n"


def service(send: str, inputs: str = "") -> str:
    head = "    service: dose\n    type: made_msgs/srv/Dose\n    failures: {no: {when: not $ok}}\n"
    return f"{head}{f'    inputs: {{{inputs}}}' if inputs else ''}\n    send:\n      {send}\n"


@pytest.mark.parametrize(
    ("when", "holds"),
    [
        ("$time_left < 2 min", True),
        ("$time_left > 2 min", False),
        ("count($warnings) > 1", True),
        ('"low" in $warnings', True),
        ('$warnings[1] == "empty"', False),
        ("$bed.state == 2", True),
        ('$bed.name != "b1"', False),
        ("$bed.plants[0].ripe", True),
        ("$bed.plants[1].height > $bed.plants[0].height", True),
        ("$bed.corners[3].x > 1 m", True),
        ("$bed.place.x > 2 m", True),
        ("$bed.place.yaw > 90 deg", False),
        ("$bed.watered_at.sec == 7", True),
        ('$header.frame_id == "tank"', True),
        ("$bed.moisture > 1", True),
    ],
)
def test_fields_of_every_depth_are_read(read: Any, when: str, holds: bool) -> None:
    found = read(condition(when))
    assert not found.findings
    tank = load_interface("made_msgs/msg/Tank")()
    tank.header.frame_id = "tank"
    tank.time_left.sec, tank.warnings = 100, ["low", "dry"]
    plants = [load_interface("made_msgs/msg/Plant")() for _ in range(2)]
    plants[0].ripe, plants[1].height = True, 0.5
    tank.bed.state, tank.bed.name, tank.bed.plants, tank.bed.moisture = 2, "b1", plants, math.inf
    tank.bed.corners[3].x, tank.bed.place.pose.position.x, tank.bed.watered_at.sec = 1.5, 3.0, 7
    assert (found.mappings["it"].judge({}, tank).code == "no") is holds


def test_a_number_that_was_not_measured_is_no_answer(read: Any) -> None:
    tank = load_interface("made_msgs/msg/Tank")()
    tank.litres = math.nan
    for when in ("$litres < 3", "not $litres > 3"):
        judged = read(condition(when)).mappings["it"].judge({}, tank)
        assert judged.code == "bad_output" and "litres" in judged.reason and "nan" in judged.reason
    missing = read(condition("$bed.plants[0].ripe")).mappings["it"].judge({}, tank)
    assert missing.code == "bad_output" and "plants has 0 items" in missing.reason


@pytest.mark.parametrize(
    ("when", "would_work"),
    [
        ("$time_left < 2", "2 s"),
        ("$litres < 1 m", "outputs: {litres: {type: length, from: litres}}"),
        ("$bed.state == 256", None),
        ("$bed.state in [1, 2] and 300 == $bed.state", None),
        ("$bed.plants.ripe", "[0] behind the array"),
        (
            "true in $bed.plants[*].ripe",
            "outputs: {bed_plants_ripe: {type: list of ..., from: 'bed.plants[*].ripe'}}, "
            "and $bed_plants_ripe",
        ),
        ("$bed > 1", "$bed.state"),
        ("$bed.plants == 1", "$bed.plants[0].ripe"),
        (
            "count($bed.plants) == 0",
            "outputs: {bed_plants_ripe: {type: list of boolean, from: 'bed.plants[*].ripe'}}, "
            "and $bed_plants_ripe",
        ),
        ("$bed.stat == 1", "state"),
        ("$bed.watered_at > 1", "$bed.watered_at.sec"),
        ("$bed.corners[4].x > 1 m", None),
        ("$warnings == 1", None),
        ("$warnings[7] == 1", None),
        ("$litres.x > 1", None),
    ],
)
def test_what_an_expression_cannot_read_is_told_by_the_check(
    read: Any, when: str, would_work: str | None
) -> None:
    (finding,) = read(condition(when)).findings
    assert (finding.severity, finding.line) == ("error", 6)
    assert would_work is None or would_work in finding.valid


@pytest.mark.parametrize(
    ("send", "inputs"),
    [
        ("mix: [1, 2]", ""),
        ("mix: [1, 2, $a, 4]", "a: {type: number}"),
        ("mix: $m", "m: {type: list of number, default: [1, 2]}"),
        ("nozzles: [1, 300]", ""),
        ("nozzles: [$a, -1]", "a: {type: integer}"),
        ("nozzles: [MODE_FOG, MODE_FOGG]", ""),
        ("mix: [true, 1, 2]", ""),
        ("mix: [[1], 2, 3]", ""),
        ("mix: [$a, 1, 2]", "a: {type: list of number}"),
        ("mix: 3", ""),
        ("bed: $t", "t: {type: text, choices: [short, a_text_of_more_than_16_characters]}"),
        ("'only[100000000].ripe': true", ""),
        ("{'only[*].ripe': [true, false], 'only[*].species': [fern]}", ""),
        ("nozzles: $n", "n: {type: list of integer, default: [256]}"),
        ("mode: $a", "a: {type: integer, default: 300}"),
        ("bed: a_name_of_more_than_16_characters", ""),
        ("bed: seventeen_letters", ""),
        ("bed: ééééééééé", ""),
        ("bed: $t", "t: {type: text, default: a_name_of_more_than_16_characters}"),
        ("tags: [seven]", ""),
        ("tags: [a, b, c]", ""),
        ("flow: 1e39", ""),
    ],
)
def test_a_value_that_a_field_has_no_room_for_is_told_by_the_check(read: Any, send: str, inputs: str) -> None:
    findings = read(service(send, inputs)).findings
    assert {(each.severity, each.line) for each in findings} == {("error", 8)}, findings


def test_what_has_room_passes_and_is_sent(read: Any) -> None:
    fields = "mode: 255, nozzles: [0, $a], mix: [1, 2.5, $a], bed: sixteen__letters, tags: [four]"
    text = service("FIELDS", "a: {type: integer, min: 0, max: 9}")
    found = read(text.replace("\n      FIELDS", f" {{{fields}, flow: -1e38}}"))
    assert not found.findings
    request = part_of(load_interface("made_msgs/srv/Dose"), "Request")()
    fill(request, found.mappings["it"].fields({"a": 7}), Time())
    assert (request.mode, request.nozzles, request.mix) == (255, [0, 7], [1.0, 2.5, 7.0])
    assert request.bed == "sixteen__letters"


@pytest.mark.parametrize(
    ("send", "kind", "value"),
    [
        ("bed: $a", "text", "a_name_of_more_than_16_characters"),
        ("nozzles: $a", "list of integer", (1, 300)),
        ("mix: $a", "list of number", (1.0, 2.0)),
        ("tags: $a", "list of text", ("a", "b", "c")),
        ("flow: $a", "number", 1e39),
    ],
)
def test_a_value_that_only_the_run_knows_is_refused_by_it(
    read: Any, send: str, kind: str, value: Any
) -> None:
    found = read(service(send, f"a: {{type: {kind}}}"))
    assert not found.findings
    request = part_of(load_interface("made_msgs/srv/Dose"), "Request")()
    with pytest.raises(ValueError, match=send.partition(":")[0]):
        fill(request, found.mappings["it"].fields({"a": value}), Time())


def test_feedback_is_told_with_units_and_held_against_the_type(read: Any) -> None:
    head = "    action: grow\n    type: made_msgs/action/Grow\n    failures: {no: {when: not $ok}}\n"
    found = read(f"{head}    feedback: $share of it, $eta left\n")
    assert not found.findings
    feedback = load_interface("made_msgs/action/Grow").Feedback()
    feedback.share, feedback.eta.sec = math.nan, 3
    assert found.mappings["it"].feedback_text(feedback) == "nan of it, 3 s left"
    assert found.findings == ()
    deep = read(f"{head}    feedback: $bed.name is $bed.moisture wet, $share. More.\n")
    assert not deep.findings
    feedback.share, feedback.bed.name, feedback.bed.moisture = 0.5, "b1", 0.25
    assert deep.mappings["it"].feedback_text(feedback) == "b1 is 0.25 wet, 0.5. More."
    for wrong in ("$bed", "$nobody", "$bed.nobody", "$bed.plants is it"):
        (finding,) = read(f"{head}    feedback: {wrong}\n").findings
        assert (finding.severity, finding.line) == ("error", 6)


def test_constants_have_names_in_what_is_sent_and_judged(read: Any) -> None:
    found = read(service("{mode: MODE_FOG, whole.state: STATE_WET}").replace("send:\n      ", "send: "))
    assert not found.findings
    assert found.mappings["it"].fields({}) == {"mode": 2, "whole.state": 2}
    found = read(condition("$bed.state == STATE_WET"))
    assert not found.findings
    tank = load_interface("made_msgs/msg/Tank")()
    assert found.mappings["it"].judge({}, tank).succeeded
    tank.bed.state = 2
    assert found.mappings["it"].judge({}, tank).code == "no"


def test_texts_and_fractions_have_names_too(read: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    definition = """
string FAST="f"
float32 MOST=0.5
string how
float32 rate
---
string FINE="fine"
string status
"""
    make_interfaces(monkeypatch, "made_msgs", srv_Move=definition)
    text = "    service: move\n    type: made_msgs/srv/Move\n    send: {how: FAST, rate: MOST}\n"
    found = read(f"{text}    failures: {{no: {{when: $status != FINE}}}}\n")
    assert not found.findings
    assert found.mappings["it"].fields({}) == {"how": "f", "rate": 0.5}
    answer = load_interface("made_msgs/srv/Move").Response()
    assert found.mappings["it"].result(answer).code == "no"
    answer.status = "fine"
    assert found.mappings["it"].result(answer).succeeded


@pytest.mark.parametrize(
    ("text", "would_work"),
    [
        (service("mode: MODE_FOGG"), "MODE_FOG"),
        (service("mode: fog"), "MODE_FOG"),
        (service("whole.state: MODE_FOG"), None),
        (service("not_before: soon"), "now"),
        (service("not_before: 3"), "now"),
        (condition("$bed.state == STATE_WEET"), "STATE_WET"),
        (condition("$litres == MODE_FOG"), None),
    ],
)
def test_a_name_that_the_interface_does_not_have_is_told(
    read: Any, text: str, would_work: str | None
) -> None:
    (finding,) = read(text).findings
    assert finding.severity == "error" and (would_work is None or would_work in finding.valid)


def test_a_name_of_an_interface_that_is_not_installed_is_no_mistake(read: Any) -> None:
    (finding,) = read(condition("$state == STATE_WET").replace("made_msgs", "nobodys_msgs")).findings
    assert finding.severity == "warning"


def test_names_of_constants_stand_in_lists(read: Any) -> None:
    found = read(service("nozzles: [MODE_FOG, 7, MODE_DRIP]"))
    assert not found.findings
    assert found.mappings["it"].fields({}) == {"nozzles": (2, 7, 0)}


def test_an_integer_is_never_cut_off_a_fraction(read: Any) -> None:
    text = "    wait_for: tank\n    type: made_msgs/msg/Tank\n    outputs: {n: {type: integer, from: %s}}\n"
    (finding,) = read(text % "litres").findings
    assert finding.severity == "error" and finding.valid == ("type: number",)
    assert not read(text % "bed.state").findings
    tank = load_interface("made_msgs/msg/Tank")()
    tank.litres = 0.5
    with pytest.raises(ConfigError):
        get(tank, "litres", Kind.INTEGER)


def test_now_is_the_time_when_the_message_is_sent(read: Any) -> None:
    found = read(service("not_before: now"))
    assert not found.findings
    request = part_of(load_interface("made_msgs/srv/Dose"), "Request")()
    fill(request, found.mappings["it"].fields({}), Time(sec=7, nanosec=5))
    assert (request.not_before.sec, request.not_before.nanosec) == (7, 5)


def test_the_same_field_of_every_item_is_a_list(read: Any) -> None:
    outputs = "    outputs: {species: {type: list of text, from: 'bed.plants[*].species'}}\n"
    found = read(outputs + service("only[*].species: $s", "s: {type: list of text}"))
    assert not found.findings
    response = part_of(load_interface("made_msgs/srv/Dose"), "Response")()
    response.ok = True
    assert found.mappings["it"].result(response).outputs == {"species": ()}
    for species in ("tomato", "basil"):
        plant = load_interface("made_msgs/msg/Plant")()
        plant.species = species
        response.bed.plants.append(plant)
    assert found.mappings["it"].result(response).outputs == {"species": ("tomato", "basil")}
    request = part_of(load_interface("made_msgs/srv/Dose"), "Request")()
    fill(request, found.mappings["it"].fields({"s": ("tomato", "basil")}), Time())
    assert [plant.species for plant in request.only] == ["tomato", "basil"]


def test_lists_for_one_array_are_of_one_length(read: Any) -> None:
    send = "{'only[*].species': $s, 'only[*].ripe': $r}"
    found = read(
        service("FIELDS", "s: {type: list of text}, r: {type: list of boolean}").replace(
            "\n      FIELDS", f" {send}"
        )
    )
    assert not found.findings
    fields = found.mappings["it"].fields
    request = part_of(load_interface("made_msgs/srv/Dose"), "Request")()
    fill(request, fields({"s": ("tomato", "basil"), "r": (False, True)}), Time())
    assert [plant.ripe for plant in request.only] == [False, True]
    request = part_of(load_interface("made_msgs/srv/Dose"), "Request")()
    with pytest.raises(ValueError, match=r"only\[\*\].ripe"):
        fill(request, fields({"s": ("tomato", "basil"), "r": (True,)}), Time())
    with pytest.raises(ValueError, match="corners"):
        fill(request, {"whole.corners[*].x": (1.0, 2.0)}, Time())


@pytest.mark.parametrize(
    "text",
    [
        service("only[*].species: $s", "s: {type: text}"),
        service("only[*]: $s", "s: {type: list of text}"),
        service("mode[*].x: 1"),
        "    outputs: {a: {type: text, from: 'bed.plants[*].species'}}\n" + service("mode: 1"),
        "    outputs: {a: {type: list of text, from: 'bed.plants[*].corners[*].x'}}\n" + service("mode: 1"),
    ],
)
def test_a_list_that_does_not_fit_is_told(read: Any, text: str) -> None:
    assert [each.severity for each in read(text).findings if "nowhere" not in each.message] == ["error"]


def test_choices_of_an_input_are_the_numbers_of_the_interface(read: Any) -> None:
    found = read(service("mode: $how", "how: {type: text, choices: [drip, fog], default: fog}"))
    assert not found.findings
    skill = found.mappings["it"]
    for how, number in (("drip", 0), ("fog", 2)):
        request = fill(
            part_of(load_interface("made_msgs/srv/Dose"), "Request")(), skill.fields({"how": how}), Time()
        )
        assert request.mode == number
    input_port = found.declarations["it"].inputs["how"]
    assert input_port.problem_with("fog") is None
    assert "drip, fog" in str(input_port.problem_with("rain"))


@pytest.mark.parametrize(
    ("how", "would_work"),
    [
        ("{type: text, choices: [drip, rain]}", None),
        ("{type: text, choices: [drip, fogg]}", "MODE_FOG"),
        ("{type: text, choices: [drip, fog], default: rain}", "drip"),
        ("{type: text, choices: []}", "choices: [left, right]"),
        ("{type: text, choices: fog}", "choices: [left, right]"),
        ("{type: integer, choices: [a]}", None),
        ("{type: text}", None),
    ],
)
def test_choices_that_do_not_fit_are_told(read: Any, how: str, would_work: str | None) -> None:
    findings = read(service("mode: $how", f"how: {how}")).findings
    assert {each.severity for each in findings} == {"error"}
    assert would_work is None or any(would_work in each.valid for each in findings)


def test_a_mission_gives_a_choice(tmp_path: Path) -> None:
    text = "skills:\n  it:\n" + service("mode: $how", "how: {type: text, choices: [drip, fog]}")
    (tmp_path / "mine.skills.yaml").write_text(text, encoding="utf-8")
    for how, wrong in (("fog", False), ("rain", True), ("$how", False), ('"$how"', False)):
        mission = f"mission: m\ninputs: {{how: {{type: text}}}}\ntree: {{it: {{how: {how}}}}}\n"
        (tmp_path / "m.yaml").write_text(mission, encoding="utf-8")
        library = MissionLibrary.load([tmp_path], built_in=False)
        findings = check(library.missions(), library, collect_declarations())
        errors = [each for each in findings if each.severity == "error"]
        assert bool(errors) is wrong, findings
        assert not errors or errors[0].valid == ("drip", "fog")
    (schema_of_how,) = (port(each, {}) for each in library.declarations["it"].inputs.values())
    assert {"enum": ["drip", "fog"]} in schema_of_how["anyOf"]
