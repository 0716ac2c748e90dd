"""Labels and poses: wherever they are written, they must exist."""

import pytest

from florence_bt.trees.checks.lint import KnownPlaces
from florence_bt.trees.language.findings import WARNING

PLACES = KnownPlaces(labels=("kitchen", "hall", "tv"), rooms=("kitchen", "hall"), file="flat.yaml")
GOTO = "inputs: {room: {type: text}}\ntree: {get_hotspot: {label: $room}}\n"


def lines(workshop, text, places=PLACES):
    return [line for line in workshop.lines(text, hotspots=places) if "nothing reads" not in line]


@pytest.mark.parametrize(
    ("tree", "at"),
    [
        ("{get_hotspot: {label: kichen}}", "kichen"),
        ("{run: goto, with: {room: kichen}}", "kichen"),
        ("{run: through, with: {where: kichen}}", "kichen"),
        ("{sequence: [{set: {r: kichen}}, {get_hotspot: {label: $r}}]}", "kichen"),
        ("{sequence: [{set: {r: hall}}, {get_hotspot: {label: $r}}, {set: {r: kichen}}]}", "kichen"),
        ("{switch: $room, cases: {hall: {wait: 1 s}, kichen: {run: goto, with: {room: $room}}}}", "kichen"),
        ('{if: $room == "kichen", then: {get_hotspot: {label: $room}}}', '"kichen"'),
        ('{if: \'$room in ["hall", "kichen"]\', then: {get_hotspot: {label: $room}}}', '"kichen"'),
        ('{get_hotspot: {label: $room}, when: not ("kichen" != $room)}', '"kichen"'),
    ],
)
def test_labels_are_followed_to_where_they_are_used(workshop, tree, at):
    workshop.write(GOTO, "goto")
    workshop.write("inputs: {where: {type: text}}\ntree: {run: goto, with: {room: $where}}\n", "through")
    (line,) = lines(workshop, f"tree: {tree}\ninputs: {{room: {{type: text}}}}\n")
    column = f"tree: {tree}".index(at) + 1
    assert line == f"2:{column} error there is no hotspot 'kichen' in flat.yaml | kitchen"
    assert lines(workshop, f"tree: {tree.replace('kichen', 'tv')}\ninputs: {{room: {{type: text}}}}\n") == []


def test_defaults(workshop):
    head = "inputs: {room: {type: text, default: kichen}}\nkeys: {k: {type: text, default: hal}}\n"
    found = lines(
        workshop, head + "tree: {sequence: [{get_hotspot: {label: $room}}, {get_hotspot: {label: $k}}]}\n"
    )
    assert found == [
        "2:38 error there is no hotspot 'kichen' in flat.yaml | kitchen",
        "3:33 error there is no hotspot 'hal' in flat.yaml | hall",
    ]


def test_an_empty_text_in_a_key_names_no_place_yet(workshop):
    workshop.write(GOTO, "goto")
    head = 'keys: {room: {type: text, default: ""}}\ninputs: {other: {type: text, default: ""}}\n'
    go = "{run: goto, with: {room: $room}}"
    for tree in (
        f"{{sequence: [{go}, {{get_hotspot: {{label: $other}}}}]}}",
        f'{{sequence: [{go}, {{set: {{room: ""}}}}, {{get_hotspot: {{label: $other}}}}]}}',
        f"{{sequence: [{{if: $room != '', then: {go}}}, {{get_hotspot: {{label: $other}}}}]}}",
        f"{{switch: $room, cases: {{'': {{get_hotspot: {{label: $other}}}}}}, default: {go}}}",
    ):
        assert lines(workshop, f"{head}tree: {tree}\n") == []
    (line,) = lines(workshop, 'tree: {run: goto, with: {room: ""}}\n')
    assert "there is no hotspot ''" in line
    misspelt = head.replace('""', "kichen")
    found = lines(workshop, f"{misspelt}tree: {go}\n")
    assert any("there is no hotspot 'kichen'" in line for line in found)


def test_a_room_is_a_hotspot_but_not_every_hotspot_is_a_room(workshop):
    assert lines(workshop, "tree: {in_room: {room: kitchen}}\n") == []
    assert lines(workshop, "tree: {in_room: {room: tv}}\n") == [
        "2:24 error the hotspot 'tv' is not a room in flat.yaml | hall, kitchen"
    ]
    assert lines(workshop, "tree: {in_room: {room: hal}}\n") == [
        "2:24 error there is no room 'hal' in flat.yaml | hall"
    ]


def test_what_cannot_be_known_is_not_judged(workshop):
    tree = 'tree: {get_hotspot: {label: "$room no. 5"}}\ninputs: {room: {type: text, default: kichen}}\n'
    assert lines(workshop, tree) == []
    assert lines(workshop, "tree: {get_hotspot: {label: kichen}}\n", KnownPlaces(labels=None)) == []


def test_how_bad_it_is_depends_on_how_sure_the_places_are(workshop):
    places = KnownPlaces(labels=("kitchen",), severity=WARNING)
    assert lines(workshop, "tree: {get_hotspot: {label: kichen}}\n", places) == [
        "2:29 warning there is no hotspot 'kichen' | kitchen"
    ]


def test_poses_must_be_on_the_map(workshop):
    places = KnownPlaces(labels=None, problem_at=lambda x, y: "outside the map" if x > 10.0 else None)
    bad, good = "{x: 11 m, y: 0, yaw: 0}", "{x: 900 cm, y: 0, yaw: 0}"
    for tree, count in (
        (f"{{navigate_to: {{goal: {bad}}}}}", 1),
        (f"{{navigate_to: {{goal: {good}}}}}", 0),
        (f"{{sequence: [{{set: {{p: {bad}}}}}, {{navigate_to: {{goal: $p}}}}]}}", 1),
        ("{navigate_to: {goal: {x: $far, y: 0, yaw: 0}}}", 0),
    ):
        found = lines(workshop, f"tree: {tree}\ninputs: {{far: {{type: length}}}}\n", places)
        assert [line.split("error ")[1] for line in found] == [
            "this pose is outside the map | a pose where the robot can stand"
        ] * count


@pytest.fixture
def workshop(workshop):
    from florence_bt.core.declaration import Kind, Port, SkillDeclaration

    in_room = SkillDeclaration("in_room", "Look", inputs={"room": Port(Kind.TEXT, "which", names="room")})
    workshop.declarations = {**workshop.declarations, "in_room": in_room}
    return workshop
