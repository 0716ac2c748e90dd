"""The pictures from which the network learns, and the table of what it finds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.person_network import POSTURES, Pixels
from tools.detection import Judged, Seen, judge, kind_of, recall, report
from tools.person_network.pictures import FIRST_SEED, Picture, example_of, pictures_of_home
from tools.person_network.plain_rooms import plain_pictures


def with_people(pictures: list[Picture]) -> list[Picture]:
    return [picture for picture in pictures if (picture.owner >= 0).sum() > 100]


@pytest.fixture(scope="module")
def home() -> list[Picture]:
    return list(pictures_of_home(FIRST_SEED - 1, 16, bent=False, width=160))


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
    judged = judge(picture, [Detection(2.0, 0.3, 2.0), Detection(2.0, 1.0, 2.2)])
    (seen,) = judged.people
    assert (seen.kind, seen.error, seen.posture_right) == ("standing", pytest.approx(0.3), True)
    assert seen.shown == pytest.approx(0.8)
    assert judged.wrong == 1
    assert judge(picture, []).people[0].error is None
    far = judge(picture, [Detection(2.0, 0.6, 2.0, posture="sitting")])
    assert (far.people[0].error, far.wrong) == (None, 1)


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
    seen = Seen("standing", 1.5, 0.9, 0.05, posture_right=True)
    missed = replace(seen, error=None, posture_right=False)
    hidden = replace(seen, shown=0.5, distance=2.5)
    assert recall([seen, missed]) == "50 % of 2" and recall([]) == ""
    text = report([Judged((seen, missed), 0), Judged((hidden,), 2)], [Judged((), 1)])
    assert "| standing, in full view |  | 50 % of 2 |  |  |" in text
    assert "| standing, 40 to 60 % hidden |  |  | 100 % of 1 |  |" in text
    assert (
        "Of 2 pictures of homes with people 2 detections were nobody; of 1 pictures of homes without people 1"
        in text
    )
    assert "5 cm off (median)" in text and "right for 100 %" in text
    assert set(POSTURES) == {"standing", "sitting", "lying"}
