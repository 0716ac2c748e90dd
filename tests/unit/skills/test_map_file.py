"""Map files: REFERENCE 7.8, and every way in which a person can get them wrong."""

from __future__ import annotations

import os
import resource
import struct
import threading
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.map_server.image import decode_image, encode_image
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.map_server.map_writer import save_map
from florence_bt.skills.navigation.map_server.pgm import decode_pgm, encode_pgm
from tests.sweeps import examples

GOOD = (
    "image: m.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\n"
    "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def write(
    folder: Path, text: str = GOOD, image: bytes = b"P5\n3 2\n255\n" + bytes([0, 254, 205, 255, 100, 0])
) -> Path:
    (folder / "m.pgm").write_bytes(image)
    (folder / "m.yaml").write_text(text)
    return folder / "m.yaml"


def test_trinary_map_is_flipped_and_thresholded(tmp_path: Path) -> None:
    grid = load_map(write(tmp_path))
    # The lower row of the image (255, 100, 0) is the first row of the grid.
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


def test_plain_image_with_comments() -> None:
    text = b"P2 # plain\n# by hand\n2 2\n# values\n15\n0 15 # a row\n7 1\n"
    assert decode_pgm(text).tolist() == [[0, 255], [119, 17]]


def test_sixteen_bit_image() -> None:
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
def test_bad_images(data: bytes, part: str) -> None:
    with pytest.raises(FrameError, match=part):
        decode_pgm(data)


@settings(max_examples=examples(50))
@given(st.binary(max_size=60))
@example(b"3 2\n255\n" + bytes(6))
def test_noise_is_a_frame_error_or_an_image(data: bytes) -> None:
    try:
        image = decode_pgm(b"P5\n" + data)
    except FrameError:
        return
    assert image.dtype == np.uint8 and 0 < image.size <= len(data)


@pytest.mark.parametrize(
    ("old", "new", "place", "part"),
    [
        ("image: m.pgm\n", "", ":1:", "'image' is missing"),
        ("0.05", "zero", ":2:13:", "must be a finite number"),
        *[
            ("0.05", wrong, ":2:13:", "would have worked: 0.001 to 1 (metres a cell)")
            for wrong in ("-0.05", "0", "1e300", "1e-30", "1e-9", "5", "1e6")
        ],
        ("[-1.0, 2.0, 0.0]", "[1e308, 2.0, 0.0]", ":3:9:", "within 10000 m"),
        ("[-1.0, 2.0, 0.0]", "[0, 0, 1e9]", ":3:9:", "a yaw in radians"),
        ("free_thresh: 0.196", "free_thresh: -0.1", ":6:14:", "thresholds"),
        ("occupied_thresh: 0.65", "occupied_thresh: 65", ":6:14:", "thresholds"),
        ("0.05", ".nan", ":2:13:", "must be a finite number"),
        ("[-1.0, 2.0, 0.0]", "[-1.0]", ":3:9:", "list of x, y and yaw"),
        ("[-1.0, 2.0, 0.0]", "[-1.0, 2.0]", ":3:9:", "list of x, y and yaw"),
        ("[-1.0, 2.0, 0.0]", "[-1.0, 2.0, .nan]", ":3:21:", "must be a finite number, not '.nan'"),
        ("[-1.0, 2.0, 0.0]", "[.inf, 2.0, 0.0]", ":3:10:", "must be a finite number, not '.inf'"),
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


def test_bad_image_names_the_image(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"m\.pgm: the image has 2 pixels"):
        load_map(write(tmp_path, image=b"P5\n3 2\n255\nab"))


@pytest.mark.parametrize(
    ("mode", "form", "kept"),
    [
        ("trinary", "pgm", [-1, 0, 100]),
        ("trinary", "png", [-1, 0, 100]),
        ("trinary", "bmp", [-1, 0, 100]),
        ("scale", "png", [-1, 0, *range(1, 99), 100]),
        ("scale", "pgm", [0, *range(1, 99), 100]),
        ("raw", "pgm", [-1, *range(101)]),
        ("raw", "png", [-1, *range(101)]),
    ],
)
def test_save_and_load_are_inverse(tmp_path: Path, mode: str, form: str, kept: list[int]) -> None:
    cells = np.random.default_rng(3).choice(np.array(kept, np.int8), (40, 25))
    grid = OccupancyGrid(0.05, Pose2(-3.25, 1.5, 0.0), cells)
    written = save_map(grid, tmp_path / "saved", mode=mode, form=form)
    assert written == tmp_path / "saved.yaml"
    loaded = load_map(written)
    assert np.array_equal(loaded.cells, cells)
    assert (loaded.resolution, loaded.origin) == (grid.resolution, grid.origin)


def test_what_cannot_be_saved_says_what_can(tmp_path: Path) -> None:
    grid = OccupancyGrid(0.05, Pose2(), np.full((2, 2), -1, np.int8))
    for options, part in (
        ({"mode": "tri"}, "would have worked: trinary"),
        ({"form": "jpg"}, "would have worked: png, pgm"),
        ({"mode": "scale"}, "would have worked: png"),
        ({"free_thresh": 0.7}, "would have worked: 0.196 and 0.65"),
    ):
        with pytest.raises(ConfigError, match=part):
            save_map(grid, tmp_path / "m.yaml", **options)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"would have worked: .*m\.yaml"):
        save_map(grid, tmp_path / "m.png")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"):
        save_map(grid, tmp_path / "file" / "m.yaml")
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def test_the_middle_of_trinary_is_unknown(tmp_path: Path) -> None:
    grid = OccupancyGrid(0.05, Pose2(), np.array([[19, 20, 64, 65]], np.int8))
    assert load_map(save_map(grid, tmp_path / "m.yaml")).cells.tolist() == [[0, -1, -1, 100]]


def test_encode_and_decode_are_inverse() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert np.array_equal(decode_pgm(encode_pgm(image)), image)


def test_colours_and_sixteen_bits_of_a_png() -> None:
    colours = np.zeros((1, 2, 3), np.uint8)
    colours[0, 0] = 30, 60, 90
    grey, opacity = decode_image(cv2.imencode(".png", colours)[1].tobytes())
    assert (grey.tolist(), opacity) == ([[60, 0]], None)
    deep = np.array([[65535, 65534, 257 * 205 + 256, 257 * 205, 257 * 205 - 1, 256, 0]], np.uint16)
    found, _ = decode_image(cv2.imencode(".png", deep)[1].tobytes())
    assert found.tolist() == [[255, 254, 205, 205, 204, 0, 0]]


def test_an_image_that_is_cut_is_not_read_as_walls() -> None:
    data = encode_image(np.full((50, 50), 254, np.uint8), None, "png")
    for part in (data[: len(data) // 2], data[:-12], data[:30]):
        with pytest.raises(FrameError, match="ends too early"):
            decode_image(part)
    with pytest.raises(FrameError, match="neither a graymap"):
        decode_image(b"GIF89a")
    with pytest.raises(FrameError, match="neither a graymap"):
        decode_image(b"")


def test_opacity_counts_as_in_other_map_servers(tmp_path: Path) -> None:
    grey = np.array([[0, 254, 254, 0]], np.uint8)
    opacity = np.array([[255, 255, 0, 0]], np.uint8)
    (tmp_path / "m.png").write_bytes(encode_image(grey, opacity, "png"))
    path = tmp_path / "m.yaml"
    for mode, cells in (
        ("trinary", [100, 0, -1, 100]),
        ("scale", [100, 0, -1, -1]),
        ("raw", [0, -1, -1, -1]),
    ):
        path.write_text(GOOD.replace("m.pgm", "m.png") + f"mode: {mode}\n")
        assert load_map(path).cells.tolist() == [cells]


def occupied_places(grid: OccupancyGrid) -> np.ndarray:
    rows, columns = np.nonzero(grid.cells == 100)
    points = np.stack([columns + 0.5, rows + 0.5], axis=1) * grid.resolution
    return np.array([grid.origin.apply(*point) for point in points])


def test_a_map_with_a_turned_origin_lies_right(tmp_path: Path) -> None:
    path = write(tmp_path, GOOD.replace("2.0, 0.0]", "2.0, 1.5707963267948966]"))
    grid = load_map(path)
    straight = load_map(write(tmp_path)).cells
    # A quarter turn: what was on the right is at the top.
    assert np.array_equal(grid.cells, np.rot90(straight, -1))
    assert (grid.origin.x, grid.origin.y) == pytest.approx((-1.1, 2.0))


@settings(max_examples=examples(40))
@given(yaw=st.floats(-7.0, 7.0), seed=st.integers(0, 100))
def test_no_obstacle_of_a_turned_map_is_lost_or_moved(yaw: float, seed: int) -> None:
    cells = np.random.default_rng(seed).choice(np.array([0, 0, 0, 100, -1], np.int8), (9, 13))
    turned = OccupancyGrid(0.1, Pose2(1.0, -2.0, yaw), cells)
    upright = turned.upright()
    assert upright.origin.yaw == 0.0
    before, after = occupied_places(turned), occupied_places(upright)
    if len(before):
        far = np.hypot(*(before[:, None] - after[None]).transpose(2, 0, 1))
        assert far.min(axis=1).max() <= 0.0708 and far.min(axis=0).max() <= 0.0708
    # Free stays free: what a straight line through the middle of a free cell sees.
    free = np.argwhere(cells == 0)
    neighbours = [cells[max(0, v - 1) : v + 2, max(0, u - 1) : u + 2] for v, u in free]
    for (v, u), around in zip(free, neighbours, strict=True):
        if around.shape == (3, 3) and (around == 0).all():
            x, y = turned.origin.apply(0.1 * (u + 0.5), 0.1 * (v + 0.5))
            assert upright.cells[upright.cell_of(x, y)] == 0


def huge_png(side: int) -> bytes:
    """A PNG image of one colour and some kB: what it has decoded, nobody wants to hold."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = zlib.compressobj(9)
    data = b"".join(rows.compress(bytes(1 + (side + 7) // 8)) for _ in range(side)) + rows.flush()
    header = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    "image",
    [
        huge_png(30_000),
        b"P5\n30000 30000\n255\n",
        b"P2\n999999999 999999999\n255\n1",
        b"BM" + bytes(12) + struct.pack("<Iii", 40, 30_000, -30_000),
        b"BM" + bytes(12) + struct.pack("<IHH", 12, 30_000, 30_000) + bytes(8),
    ],
)
def test_an_image_with_too_many_pixels_is_refused_before_it_is_decoded(tmp_path: Path, image: bytes) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ConfigError, match="at most 25000000 are read"):
        load_map(write(tmp_path, image=image))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000, "kB"


def test_a_long_image_that_is_turned_is_refused(tmp_path: Path) -> None:
    image = b"P5\n1000000 1\n255\n" + bytes(1_000_000)
    text = GOOD.replace("0.05", "0.001").replace("2.0, 0.0]", "2.0, 0.7]")
    with pytest.raises(ConfigError, match="the yaw 0"):
        load_map(write(tmp_path, text, image))


@pytest.mark.parametrize("what", ["the description", "the image", "a link to the image"])
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path, what: str) -> None:
    path = write(tmp_path)
    pipe = path if what == "the description" else tmp_path / "m.pgm"
    pipe.unlink()
    if what == "a link to the image":
        pipe.symlink_to(tmp_path / "pipe")
        pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    errors: list[ConfigError] = []

    def load() -> None:
        with pytest.raises(ConfigError) as caught:
            load_map(path)
        errors.append(caught.value)

    reader = threading.Thread(target=load, daemon=True)
    reader.start()
    reader.join(30.0)
    assert errors and "it is a pipe" in str(errors[0])


def test_a_device_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="it is a device"):
        load_map(write(tmp_path, GOOD.replace("m.pgm", "/dev/zero")))


def told(path: Path) -> tuple[OccupancyGrid, list[str]]:
    sentences: list[str] = []
    return load_map(path, sentences.append), sentences


def room(unknown: int = 205, free: int = 254, walls: int = 0) -> np.ndarray:
    """An image of which 60 % are free, 10 % walls and 30 % unknown, 10 x 10."""
    return np.repeat(np.array([free] * 6 + [walls] + [unknown] * 3, np.uint8)[:, None], 10, axis=1)


def test_unknown_stays_unknown_with_the_thresholds_of_nav2s_saver(tmp_path: Path) -> None:
    as_saved = GOOD.replace("0.196", "0.25")
    grid, sentences = told(write(tmp_path, as_saved, encode_pgm(room())))
    assert [(grid.cells == value).sum() for value in (0, 100, -1)] == [60, 10, 30]
    assert len(sentences) == 1 and "30 % of the cells" in sentences[0]
    negated = as_saved.replace("negate: 0", "negate: 1")
    grid, sentences = told(write(tmp_path, negated, encode_pgm(255 - room())))
    assert [(grid.cells == value).sum() for value in (0, 100, -1)] == [60, 10, 30]
    assert len(sentences) == 1
    assert told(write(tmp_path, GOOD, encode_pgm(room())))[1] == []


@pytest.mark.parametrize(("opacity", "part"), [(255, "stay unknown"), (0, "without it 60 % would be free")])
def test_opacity_that_changes_what_is_free_is_told(tmp_path: Path, opacity: int, part: str) -> None:
    grey = room()
    image = encode_image(grey, np.full_like(grey, opacity), "png")
    grid, sentences = told(write(tmp_path, GOOD, image))
    assert not (grid.cells[:3] == 0).any(), "what is unknown is the bottom of the image"
    assert part in " ".join(sentences).replace("Without", "without")


def test_a_map_with_hardly_a_free_cell_is_told(tmp_path: Path) -> None:
    _, sentences = told(write(tmp_path, GOOD.replace("negate: 0", "negate: 1"), encode_pgm(room())))
    assert len(sentences) == 1 and "negate: 1" in sentences[0] and "60 %" in sentences[0]


def small_grid() -> OccupancyGrid:
    return OccupancyGrid(0.05, Pose2(), np.zeros((4, 5), np.int8))


@pytest.mark.parametrize("there", ["yaml", "pgm", "yaml link", "pgm link", "pgm pipe", "yaml folder"])
def test_saving_replaces_no_file_that_is_not_this_map(tmp_path: Path, there: str) -> None:
    ending, _, kind = there.partition(" ")
    victim, target = tmp_path / "hotspots.yaml", tmp_path / f"new.{ending}"
    victim.write_text("hotspots: {}\n")
    if kind == "link":
        target.symlink_to(victim)
    elif kind == "pipe":
        os.mkfifo(target)
    elif kind == "folder":
        target.mkdir()
    else:
        target.write_text("something of somebody\n")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(ConfigError):
        save_map(small_grid(), tmp_path / "new.yaml")
    assert sorted(tmp_path.iterdir()) == before
    assert victim.read_text() == "hotspots: {}\n"
    assert kind or target.read_text() == "something of somebody\n"


def test_a_map_is_replaced_by_another_one_whole(tmp_path: Path) -> None:
    save_map(small_grid(), tmp_path / "m.yaml")
    save_map(OccupancyGrid(0.1, Pose2(), np.full((6, 7), 100, np.int8)), tmp_path / "m.yaml")
    grid = load_map(tmp_path / "m.yaml")
    assert grid.resolution == 0.1 and grid.cells.shape == (6, 7)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["m.pgm", "m.yaml"]


def test_a_disk_without_room_leaves_the_old_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_map(small_grid(), tmp_path / "m.yaml")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    fsync = os.fsync
    calls: list[int] = []

    def full(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ConfigError, match="No space left"):
        save_map(OccupancyGrid(0.1, Pose2(), np.full((6, 7), 100, np.int8)), tmp_path / "m.yaml")
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
