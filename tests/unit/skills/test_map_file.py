"""Map files: REFERENCE 7.8, and every way in which a person can get them wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.map_server.pgm import decode_pgm
from tests.unit.skills.map_saver import encode_pgm, save_map

GOOD = (
    "image: m.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\n"
    "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def write(
    folder: Path, text: str = GOOD, picture: bytes = b"P5\n3 2\n255\n" + bytes([0, 254, 205, 255, 100, 0])
) -> Path:
    (folder / "m.pgm").write_bytes(picture)
    (folder / "m.yaml").write_text(text)
    return folder / "m.yaml"


def test_trinary_map_is_flipped_and_thresholded(tmp_path: Path) -> None:
    grid = load_map(write(tmp_path))
    # The lower row of the picture (255, 100, 0) is the first row of the grid.
    assert grid.cells.tolist() == [[0, -1, 100], [100, 0, -1]]
    assert grid.cells.dtype == np.int8
    assert (grid.resolution, grid.origin) == (0.05, Pose2(-1.0, 2.0, 0.0))


def test_negate_scale_and_raw(tmp_path: Path) -> None:
    negated = load_map(write(tmp_path, GOOD.replace("negate: 0", "negate: 1")))
    assert negated.cells.tolist() == [[100, -1, 0], [0, 100, 100]]
    scaled = load_map(write(tmp_path, GOOD + "mode: scale\n"))
    # occ(100) = 0.6078: 1 + 98 * (0.6078 - 0.196) / 0.454 = 89.9
    assert scaled.cells.tolist() == [[0, 89, 100], [100, 0, 1]]
    raw = load_map(write(tmp_path, GOOD + "mode: raw\n"))
    assert raw.cells.tolist() == [[-1, 100, 0], [0, -1, -1]]


def test_plain_picture_with_comments() -> None:
    text = b"P2 # plain\n# by hand\n2 2\n# values\n15\n0 15 # a row\n7 1\n"
    assert decode_pgm(text).tolist() == [[0, 255], [119, 17]]


def test_sixteen_bit_picture() -> None:
    assert decode_pgm(b"P5 2 1 65535\n" + bytes([0xFF, 0xFF, 0x80, 0x00])).tolist() == [[255, 127]]


@pytest.mark.parametrize(
    ("data", "part"),
    [
        (b"", "P5 or P2"),
        (b"\x89PNG", "P5 or P2"),
        (b"P5\n3", "height"),
        (b"P5\n3 2\n", "greatest value"),
        (b"P5\n0 2\n255\n", "0 x 2"),
        (b"P5\n3 2\n255\n12345", "5 pixels"),
        (b"P5\n1 1\n70000\n1", "70000"),
        (b"P2\n1 1\n255\nx", "not a number"),
        (b"P2\n1 1\n9\n10", "greatest value is 9"),
    ],
)
def test_bad_pictures(data: bytes, part: str) -> None:
    with pytest.raises(FrameError, match=part):
        decode_pgm(data)


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=60))
@example(b"3 2\n255\n" + bytes(6))
def test_noise_is_a_frame_error_or_a_picture(data: bytes) -> None:
    try:
        image = decode_pgm(b"P5\n" + data)
    except FrameError:
        return
    assert image.dtype == np.uint8 and 0 < image.size <= len(data)


@pytest.mark.parametrize(
    ("old", "new", "place", "part"),
    [
        ("image: m.pgm\n", "", ":1:", "'image' is missing"),
        ("0.05", "zero", ":2:13:", "must be a number"),
        ("0.05", "-0.05", ":2:13:", "above zero"),
        ("0.05", ".nan", ":2:13:", "must be a number"),
        ("[-1.0, 2.0, 0.0]", "[-1.0]", ":3:9:", "list of x, y and yaw"),
        ("[-1.0, 2.0, 0.0]", "[-1.0, 2.0, 0.5]", ":3:21:", "turned by 0.5"),
        ("negate: 0", "negate: maybe", ":4:9:", "0 or 1"),
        ("free_thresh: 0.196", "free_thresh: 0.9", ":6:14:", "thresholds"),
        ("negate: 0", "negat: 0", ":4:1:", "would have worked: negate"),
        ("negate: 0", "mode: trinry", ":4:7:", "would have worked: trinary"),
        ("negate: 0", "negate: [", ":", "not YAML"),
        ("image: m.pgm", "image: n.pgm", "m.yaml", "would have worked: m.pgm"),
    ],
)
def test_bad_descriptions_name_the_place_and_the_cure(
    tmp_path: Path, old: str, new: str, place: str, part: str
) -> None:
    path = write(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        load_map(path)
    assert place in str(caught.value)
    assert part in str(caught.value)


def test_missing_file_lists_the_maps_beside_it(tmp_path: Path) -> None:
    write(tmp_path)
    with pytest.raises(ConfigError, match=r"would have worked: .*m\.yaml"):
        load_map(tmp_path / "n.yaml")


def test_bad_picture_names_the_picture(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"m\.pgm: the picture has 2 pixels"):
        load_map(write(tmp_path, picture=b"P5\n3 2\n255\nab"))


def test_save_and_load_are_inverse(tmp_path: Path) -> None:
    cells = np.random.default_rng(3).choice(np.array([0, 100, -1], np.int8), (7, 5))
    grid = OccupancyGrid(0.05, Pose2(-3.25, 1.5, 0.0), cells)
    save_map(grid, tmp_path / "saved.yaml")
    loaded = load_map(tmp_path / "saved.yaml")
    assert np.array_equal(loaded.cells, cells)
    assert (loaded.resolution, loaded.origin) == (grid.resolution, grid.origin)


def test_encode_and_decode_are_inverse() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert np.array_equal(decode_pgm(encode_pgm(image, "a note")), image)


@pytest.mark.parametrize("name", ["depot", "tb3_sandbox"])
def test_real_maps(name: str) -> None:
    path = next(
        (
            base / "shared/data/maps" / f"{name}.yaml"
            for base in Path(__file__).resolve().parents
            if (base / "shared/data/maps" / f"{name}.yaml").exists()
        ),
        None,
    )
    if path is None:
        pytest.skip("the map is not here")
    grid = load_map(path)
    assert set(np.unique(grid.cells)) <= {-1, 0, 100}
    assert (grid.cells == 0).sum() > 1000
    assert (grid.cells == 100).sum() > 100
