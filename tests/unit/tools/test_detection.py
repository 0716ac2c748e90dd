"""The pictures from which the network learns, and the table of what it finds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.drivers.kinect.codec import raw_from_metres
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame
from florence_bt.drivers.kinect.recording import RecordingWriter
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.skills.people.user_tracker.detector import Detection, detect_people
from florence_bt.skills.people.user_tracker.person_network import POSTURES, Pixels
from tools.detection import (
    NOBODY,
    PERSON,
    PICTURE,
    Line,
    judge,
    judge_recording,
    kind_of,
    main,
    recall,
    report,
    truth_of,
)
from tools.person_network.pictures import FIRST_SEED, Picture, example_of, pictures_of_home
from tools.person_network.plain_rooms import plain_pictures
from tools.recorded_pictures import LABELS


def with_people(pictures: list[Picture]) -> list[Picture]:
    return [picture for picture in pictures if (picture.owner >= 0).sum() > 100]


@pytest.fixture(scope="module")
def home() -> list[Picture]:
    return list(pictures_of_home(FIRST_SEED - 1, 16, bent=False, width=160))


@pytest.mark.slow
def test_what_shows_a_person_is_where_the_person_is(home: list[Picture]) -> None:
    shown = with_people(home)
    assert shown, "some pictures show people"
    for picture in shown:
        points = Pixels.of(picture.depth, picture.optical_in_base).points
        for index, spec in enumerate(picture.people):
            mine = points[(picture.owner == index) & np.isfinite(points[..., 0])]
            x, y = picture.robot.inverse().apply(spec.pose.x, spec.pose.y)
            apart = np.hypot(mine[:, 0] - x, mine[:, 1] - y)
            assert (apart < 1.4).mean() > 0.97 if len(mine) else True
            assert picture.whole[index] >= (picture.owner == index).sum()


def test_an_example_says_the_way_from_each_pixel_to_the_middle(home: list[Picture]) -> None:
    picture = with_people(home)[0]
    example = example_of(picture)
    pixels = Pixels.of(picture.depth, picture.optical_in_base)
    row, column = np.argwhere(example.person == 1)[0]
    point, ray = pixels.points[2 * row, 2 * column], pixels.rays[2 * row, 2 * column]
    along, left = example.middle[row, column].astype(float)
    middle = (point[0] + along * ray[0] - left * ray[1], point[1] + along * ray[1] + left * ray[0])
    spec = picture.people[picture.owner[2 * row, 2 * column]]
    assert math.dist(picture.robot.apply(*middle), (spec.pose.x, spec.pose.y)) < 0.01
    assert (example.posture[example.person == 1] >= 0).all()
    assert (example.person == -1).any() and (example.person == 0).any()


def test_the_same_seed_gives_the_same_pictures() -> None:
    first, second = (list(plain_pictures(5, 3)) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.depth.depth, other.depth.depth)


@pytest.mark.slow
def test_plain_rooms_have_people_in_reach_of_their_parts() -> None:
    pictures = with_people(list(plain_pictures(3, 12)))
    assert pictures
    for picture in pictures:
        points = Pixels.of(picture.depth, picture.optical_in_base).points
        for index, spec in enumerate(picture.people):
            mine = points[(picture.owner == index) & np.isfinite(points[..., 0])]
            assert (np.hypot(mine[:, 0] - spec.pose.x, mine[:, 1] - spec.pose.y) < 0.8).all()


SOMEBODY = PersonSpec("a", Pose2(2.0, 0.0), "standing")


def picture_of(spec: PersonSpec, home: list[Picture]) -> Picture:
    owner = np.full((120, 160), -1)
    owner[:20, :20] = 0
    return replace(home[0], robot=Pose2(), owner=owner, people=[spec], whole=[500])


def test_a_detection_nearby_is_the_person_and_another_one_is_nobody(home: list[Picture]) -> None:
    picture = picture_of(SOMEBODY, home)
    found = [Detection(2.0, 0.3, 2.0), Detection(2.0, 1.0, 2.2)]
    shown, seen, nobody = judge(truth_of(picture), found, 7, 3, empty=False)
    assert shown == Line(7, 3, False, PICTURE)
    assert (seen.home, seen.number, seen.what) == (7, 3, PERSON)
    assert (seen.kind, seen.error, seen.posture_right) == ("standing", pytest.approx(0.3), True)
    assert seen.shown == pytest.approx(0.8)
    away = math.dist(truth_of(picture).camera[:2], (2.0, 1.0))
    assert nobody == Line(7, 3, False, NOBODY, distance=pytest.approx(away), posture="standing")
    _, missed = judge(truth_of(picture), [], empty=False)
    assert (missed.error, missed.posture, missed.posture_right) == (None, "", False)
    far = judge(truth_of(picture), [Detection(2.0, 0.6, 2.0, posture="sitting")], empty=False)
    assert [(each.what, each.error) for each in far[1:]] == [(PERSON, None), (NOBODY, None)]


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"posture": "lying", "surface": 0.5}, "lying in bed"),
        ({"posture": "lying"}, "lying on the floor"),
        ({"posture": "seated"}, "sitting"),
        ({"posture": "leaning"}, "bent over"),
        ({"height": 1.1}, "child up to 1.3 m, standing"),
        ({"aid": "wheelchair"}, "with a wheelchair"),
    ],
)
def test_what_people_do_has_a_row_each(change: dict[str, object], kind: str) -> None:
    assert kind_of(replace(SOMEBODY, **change)) == kind


def test_the_report_has_recall_by_distance_and_hiding() -> None:
    seen = Line(1, 0, False, PERSON, "standing", 1.5, 0.9, 0.05, "standing", posture_right=True)
    missed = replace(seen, error=None, posture="", posture_right=False)
    hidden = replace(seen, shown=0.5, distance=2.5)
    nobody = Line(1, 0, False, NOBODY, distance=1.0)
    pictures = [Line(1, number, False, PICTURE) for number in range(2)] + [Line(1, 0, True, PICTURE)]
    assert recall([seen, missed]) == "50 % of 2" and recall([]) == ""
    text = report([*pictures, seen, missed, hidden, nobody, nobody, replace(nobody, empty=True)])
    assert "| standing, in full view |  | 50 % of 2 |  |  |" in text
    assert "| standing, 40 to 60 % hidden |  |  | 100 % of 1 |  |" in text
    assert "Of 2 pictures with people 2 detections were nobody; of 1 pictures without people 1." in text
    assert "5 cm off (median)" in text and "right for 100 %, not told for 0 %, wrong for 0 %" in text
    assert set(POSTURES) == {"standing", "sitting", "lying"}


def record(folder: Path, pictures: Sequence[Picture]) -> None:
    """Write pictures as the Kinect of a user would record them, one a second."""
    with RecordingWriter(folder) as writer:
        for second, picture in enumerate(pictures):
            raw = raw_from_metres(picture.depth.depth)
            writer.add(DepthFrame(320, 240, 0.0, raw, DepthEncoding.RAW), 100.0 + second)


def label(folder: Path, text: str) -> None:
    (folder / LABELS).write_text(text)


@pytest.mark.slow
def test_a_labelled_recording_gives_the_same_table(tmp_path: Path) -> None:
    pictures = list(pictures_of_home(FIRST_SEED - 4, 8, bent=False, width=320, situations=("standing",)))
    record(tmp_path, pictures)
    labels = ["scenes:"]
    for second, picture in enumerate(pictures):
        labels.append(f"  - {{from: {second}, to: {second + 0.5}, people: [")
        for (spec, (x, y)), shown in zip(truth_of(picture).people, truth_of(picture).shown, strict=True):
            if shown is not None:
                labels.append(f"      {{x: {x}, y: {y}, shown: {min(shown, 1.0)}, height: {spec.height}}},")
        labels.append("    ]}")
    label(tmp_path, "\n".join(labels))
    lines = judge_recording(tmp_path)
    assert [each.what for each in lines].count(PICTURE) == len(pictures)
    recorded = [each for each in lines if each.what == PERSON]
    expected = [
        seen
        for picture in pictures
        for seen in judge(
            truth_of(picture), detect_people(picture.depth, picture.optical_in_base), empty=False
        )
        if seen.what == PERSON
    ]
    assert sum(seen.error is not None for seen in expected) >= 2
    assert [seen.error is not None for seen in recorded] == [seen.error is not None for seen in expected]
    for one, other in zip(recorded, expected, strict=True):
        assert (one.kind, one.shown) == (other.kind, pytest.approx(min(other.shown, 1.0)))
        assert one.distance == pytest.approx(other.distance, abs=0.02)


@pytest.mark.slow
def test_what_cannot_be_used_of_labels_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    empty_home = list(pictures_of_home(FIRST_SEED - 4, 4, bent=False, width=320, empty=True))
    record(tmp_path, empty_home)
    monkeypatch.setattr("sys.argv", ["detection.py", "--recorded", str(tmp_path)])
    for text, said in (
        ("scenes: []", "scenes"),
        ("scenes:\n  - {from: 2, to: 1, people: []}", "labels.yaml:2"),
        ("scenes:\n  - {from: 0, to: 1, people: []}\n  - {from: 9, to: 10, people: []}", "labels.yaml:3"),
        ("scenes:\n  - {from: 0, to: 1, people: [{x: 1, y: 0, doing: sleeping}]}", "sitting"),
        ("scenes:\n  - {from: 0, to: 1, people: [{x: 1 m, y: 0}]}", "valid number"),
    ):
        label(tmp_path, text)
        assert main() == 2
        assert said in capsys.readouterr().err
    (tmp_path / LABELS).unlink()
    assert main() == 2
    assert LABELS in capsys.readouterr().err
    label(tmp_path, "scenes:\n  - {from: 0, to: 2.5, people: []}")
    assert main() == 0
    assert "of 3 pictures without people" in capsys.readouterr().out
