"""What the network is given, and what is made of its answers; the answers here are made by hand."""

from __future__ import annotations

import math
import subprocess
import sys

import cv2
import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, DepthImage, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker import detector
from florence_bt.skills.people.user_tracker.detector import detect_people
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.parameters import DetectorParameters
from florence_bt.skills.people.user_tracker.person_network import (
    FILE,
    POSTURES,
    NetworkOutput,
    Pixels,
    infer,
)

OPTICAL_IN_BASE = Transform3.from_xyz_rpy((-0.087, 0.0, 0.54), (-math.pi / 2, 0.0, -math.pi / 2))


def picture(width: int, depth: float = 2.0) -> DepthImage:
    height, focal = width * 3 // 4, 525.0 * width / 640
    camera = CameraModel(width, height, focal, focal, width / 2 - 0.5, height / 2 - 0.5)
    return DepthImage(0.0, "optical", camera, np.full((height, width), depth, np.float32))


@pytest.mark.parametrize("width", [160, 320, 640])
def test_every_size_of_picture_gives_the_same_pixels(width: int) -> None:
    pixels = Pixels.of(picture(width), OPTICAL_IN_BASE)
    assert pixels.points.shape == (120, 160, 3)
    np.testing.assert_allclose(pixels.points[..., 0], 2.0 - 0.087, atol=1e-5)
    assert pixels.points[0, 0, 1] > 1.1 and pixels.points[0, 159, 1] < -1.1, "left is left"
    assert pixels.points[0, 80, 2] > 1.4 and pixels.points[119, 80, 2] < -0.3, "up is up"
    np.testing.assert_allclose(np.hypot(pixels.rays[..., 0], pixels.rays[..., 1]), 1.0, atol=1e-5)
    np.testing.assert_allclose(pixels.area, (2.0 / 131.25) ** 2, rtol=1e-4)


def test_a_camera_may_look_straight_down() -> None:
    down = Transform3.from_xyz_rpy((0.0, 0.0, 2.0), (math.pi, 0.0, 0.0))
    image = picture(160)
    camera = CameraModel(160, 120, 131.25, 131.25, 80.0, 60.0)
    pixels = Pixels.of(DepthImage(0.0, "optical", camera, image.depth), down)
    assert np.isfinite(pixels.rays).all()


def test_what_was_not_measured_is_given_as_nothing() -> None:
    image = picture(160)
    image.depth[40:, :] = np.nan
    given = Pixels.of(image, OPTICAL_IN_BASE).as_input()
    assert given.shape == (3, 120, 160) and np.isfinite(given).all()
    assert (given[:, 40:] == 0.0).all()
    np.testing.assert_allclose(given[0, :40], 0.5)
    assert (given[2, :40] == 1.0).all()


def test_the_network_answers_for_every_second_pixel() -> None:
    answer = infer(Pixels.of(picture(160), OPTICAL_IN_BASE))
    assert answer.person.shape == (60, 80)
    assert answer.middle.shape == (60, 80, 2)
    np.testing.assert_allclose(answer.posture.sum(axis=-1), 1.0, atol=1e-5)
    assert ((answer.person >= 0.0) & (answer.person <= 1.0)).all()


def test_another_runtime_gives_the_same_answer() -> None:
    depth = np.random.default_rng(1).uniform(0.6, 4.0, (120, 160)).astype(np.float32)
    image = picture(160)
    pixels = Pixels.of(DepthImage(0.0, "optical", image.camera, depth), OPTICAL_IN_BASE)
    network = cv2.dnn.readNetFromONNX(str(FILE))
    network.setInput(pixels.as_input()[None])
    output = network.forward()[0]
    answer = infer(pixels)
    np.testing.assert_allclose(answer.person, 1.0 / (1.0 + np.exp(-output[0])), atol=1e-4)
    np.testing.assert_allclose(answer.middle, np.moveaxis(output[1:3], 0, -1), atol=1e-3)


def test_the_network_is_loaded_when_it_is_asked_first() -> None:
    module = "florence_bt.skills.people.user_tracker.node"
    code = f"import sys, {module}; sys.exit('onnxruntime' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


_ANSWER = """
import hashlib
import numpy as np
from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.person_network import Pixels, infer

depth = np.random.default_rng(2).uniform(0.6, 4.0, (120, 160)).astype(np.float32)
camera = CameraModel(160, 120, 131.25, 131.25, 79.5, 59.5)
answer = infer(Pixels.of(DepthImage(0.0, "", camera, depth), Transform3.identity()))
said = (answer.person, answer.middle, answer.posture)
print(hashlib.sha256(b"".join(array.tobytes() for array in said)).hexdigest())
"""


def test_a_picture_has_one_answer_in_every_process() -> None:
    answers = {
        subprocess.run([sys.executable, "-c", _ANSWER], check=True, capture_output=True).stdout
        for _ in range(2)
    }
    assert len(answers) == 1


class Said:
    """Answers as if people stood 0.2 m behind what is seen, at some columns of the answer."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._output = NetworkOutput(
            np.zeros((60, 80), np.float32),
            np.zeros((60, 80, 2), np.float32),
            np.zeros((60, 80, 3), np.float32),
        )
        self._output.posture[...] = (1.0, 0.0, 0.0)
        monkeypatch.setattr(detector, "infer", lambda pixels: self._output)

    def person(
        self, columns: slice, rows: slice = slice(10, 50), sure: float = 0.95, lie: bool = False
    ) -> None:
        self._output.person[rows, columns] = sure
        self._output.middle[rows, columns, 0] = 0.2
        if lie:
            self._output.posture[rows, columns] = (0.0, 0.1, 0.9)


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> Said:
    return Said(monkeypatch)


def test_votes_that_meet_are_a_person(said: Said) -> None:
    said.person(slice(36, 44))
    (found,) = detect_people(picture(320), OPTICAL_IN_BASE)
    assert (found.x, found.y) == pytest.approx((2.0 - 0.087 + 0.2, 0.0), abs=0.03)
    assert found.distance == pytest.approx(2.2, abs=0.03)
    assert (found.confidence, found.posture) == (pytest.approx(0.95), "standing")
    assert found.height == pytest.approx(0.54 + 2.0 * (119.5 - 42) / 262.5, abs=0.06)


def test_two_people_are_two_nearest_first(said: Said) -> None:
    image = picture(320)
    image.depth[:, :160] = 3.0
    said.person(slice(16, 22))
    said.person(slice(50, 58), lie=True)
    near, far = detect_people(image, OPTICAL_IN_BASE)
    assert (near.posture, far.posture) == ("lying", "standing")
    assert near.y < 0.0 < far.y
    assert set(POSTURES) >= {near.posture, far.posture}


def test_too_few_or_unsure_pixels_are_nobody(said: Said) -> None:
    said.person(slice(36, 44), rows=slice(30, 31))
    assert detect_people(picture(320), OPTICAL_IN_BASE) == []
    said.person(slice(36, 44), sure=0.55)
    assert detect_people(picture(320), OPTICAL_IN_BASE) == []
    assert (
        len(detect_people(picture(320), OPTICAL_IN_BASE, None, DetectorParameters(minimum_confidence=0.5)))
        == 1
    )


def test_somebody_too_far_away_is_left_alone(said: Said) -> None:
    said.person(slice(36, 44))
    assert detect_people(picture(320, 4.5), OPTICAL_IN_BASE) == []


@pytest.mark.parametrize(("sure", "found"), [(0.95, True), (0.7, False)])
def test_a_map_lowers_the_confidence_and_erases_nobody(said: Said, sure: float, found: bool) -> None:
    said.person(slice(36, 44), sure=sure)
    cells = np.zeros((100, 100), np.int8)
    robot = Pose2(1.0, 2.0, 0.0)
    grid = OccupancyGrid(0.05, Pose2(), cells)
    row, column = grid.cell_of(*robot.apply(1.913, 0.0))
    cells[row - 20 : row + 20, column - 2 : column + 3] = 100
    people = detect_people(picture(320), OPTICAL_IN_BASE, known=KnownObstacles(grid), robot=robot)
    assert bool(people) is found
    assert len(detect_people(picture(320), OPTICAL_IN_BASE)) == 1, "without the map"
    if found:
        assert people[0].confidence == pytest.approx(sure - DetectorParameters().map_penalty, abs=0.01)


@pytest.mark.parametrize(
    ("known_m", "width_m", "loses"),
    [(3.2, 5.0, False), (2.9, 5.0, False), (2.5, 5.0, True), (2.5, 2.5, True)],
    ids=["known", "at its edge", "behind it", "outside of the map"],
)
def test_who_stands_behind_what_the_map_knows_may_be_a_reflection(
    said: Said, known_m: float, width_m: float, loses: bool
) -> None:
    said.person(slice(36, 44), sure=0.95)
    cells = np.full((100, round(width_m / 0.05)), -1, np.int8)
    cells[:, : round(known_m / 0.05)] = 0
    known = KnownObstacles(OccupancyGrid(0.05, Pose2(), cells))
    people = detect_people(picture(320), OPTICAL_IN_BASE, known=known, robot=Pose2(1.0, 2.0, 0.0))
    penalty = DetectorParameters().unknown_penalty if loses else 0.0
    assert people[0].confidence == pytest.approx(0.95 - penalty, abs=0.01)
