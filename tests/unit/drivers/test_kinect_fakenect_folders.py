"""The folders of libfreenect's record, against hand-written files, and what is refused."""

import struct
from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError, DeviceLost, FrameError
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.codec import pack_11_bit
from florence_bt.drivers.kinect.fakenect import (
    INDEX,
    NOTES,
    FakenectWriter,
    check_recording,
    recorded,
    recorded_view,
)
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame
from florence_bt.drivers.kinect.recording import Reading

RAW = (np.arange(240 * 320, dtype=np.uint32) % 2048).astype(np.uint16).reshape(240, 320)


def test_names_heads_and_contents(tmp_path: Path) -> None:
    with FakenectWriter(tmp_path / "new" / "folder") as writer:
        writer.add(DepthFrame(320, 240, 100.0, pack_11_bit(RAW)), 12.5)
        writer.add(VideoFrame(640, 480, 100.5, bytes(640 * 480 * 3)), 12.75)
        writer.add_reading(Reading((-1, 819, 2), -62, 4), 13.0)
    folder = tmp_path / "new" / "folder"
    names = (folder / INDEX).read_text().splitlines()
    ticks = [6_000_000_000 % 2**32, 6_030_000_000 % 2**32]
    assert names == [
        f"d-12.500000-{ticks[0]}.pgm",
        f"r-12.750000-{ticks[1]}.ppm",
        f"a-13.000000-{ticks[1]}.dump",
    ]
    depth = (folder / names[0]).read_bytes()
    head = b"P5 640 480 65535\n"
    assert depth.startswith(head) and len(depth) == len(head) + 640 * 480 * 2
    stored = np.frombuffer(depth[len(head) :], "<u2").reshape(480, 640)
    for down in (0, 1):
        for across in (0, 1):
            np.testing.assert_array_equal(stored[down::2, across::2], RAW)
    assert (folder / names[1]).read_bytes() == b"P6 640 480 255\n" + bytes(640 * 480 * 3)
    assert (folder / names[2]).read_bytes() == struct.pack("<hhhbxi", -1, 819, 2, -62, 4)
    check_recording(folder)
    assert recorded_view(folder) is View.SHARED


def test_the_depth_images_come_back_with_their_moments(tmp_path: Path) -> None:
    with FakenectWriter(tmp_path) as writer:
        for number in range(3):
            writer.add(
                DepthFrame(320, 240, 100.0 + number, pack_11_bit(RAW + np.uint16(number) & 2047)), 12.5
            )
            writer.add(VideoFrame(640, 480, 100.5, bytes(640 * 480 * 3)), 12.5 + 0.25 * number)
        writer.add(DepthFrame(320, 240, 0.0, pack_11_bit(RAW)), 13.5)
    depth = [(moment, part) for moment, part in recorded(tmp_path) if isinstance(part, DepthFrame)]
    moments, frames = zip(*depth, strict=True)
    assert moments == (12.5, 12.5, 12.5, 13.5)
    assert [frame.view for frame in frames] == [View.SHARED] * 4
    np.testing.assert_array_equal(frames[1].raw()[::2, ::2], RAW + 1 & 2047)
    np.testing.assert_array_equal(frames[3].raw()[1::2, 1::2], RAW)
    (tmp_path / "d-good.pgm").write_bytes(b"P5 640 480 65535\n" + bytes(640 * 480 * 2))
    (tmp_path / INDEX).write_text("d-good.pgm\n")
    with pytest.raises(DeviceLost, match=r"d-good\.pgm"):
        list(recorded(tmp_path))


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    with FakenectWriter(tmp_path) as writer:
        writer.add(DepthFrame(320, 240, 100.0, pack_11_bit(RAW)), 12.5)
    with pytest.raises(ConfigError, match="already"):
        FakenectWriter(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"cannot be written|already"):
        FakenectWriter(tmp_path / "file" / "below")


def test_odd_sizes_are_refused(tmp_path: Path) -> None:
    with FakenectWriter(tmp_path) as writer, pytest.raises(FrameError, match="640 x 480"):
        writer.add(DepthFrame(300, 200, 0.0, np.zeros((200, 300), np.uint16), DepthEncoding.RAW), 1.0)


@pytest.mark.parametrize(
    ("index", "said"),
    [
        (None, "florence kinect convert"),
        ("", "no depth image"),
        ("r-1.0-1.ppm\n", "no depth image"),
        ("d-1.0-1.pgm\n", "d-1.0-1.pgm"),
        ("d-good.pgm\n\nd-good.pgm\n", "damaged"),
        ("d-good.pgm\nx-1.0-1.pgm\n", "damaged"),
        ("d-good.pgm\nd-short.pgm\n", "d-short.pgm"),
        ("d-good.pgm\nd-small.pgm\n", "d-small.pgm"),
        ("d-good.pgm\nr-good.pgm\n", "r-good.pgm"),
        ("d-good.pgm\nd-empty.pgm\n", "d-empty.pgm"),
        ("d-good.pgm\nd-\x00.pgm\n", "damaged"),
    ],
)
def test_what_fakenect_cannot_play_is_refused(tmp_path: Path, index: str | None, said: str) -> None:
    image = b"P5 640 480 65535\n" + bytes(640 * 480 * 2)
    (tmp_path / "d-good.pgm").write_bytes(image)
    (tmp_path / "r-good.pgm").write_bytes(image)  # too short for colour
    (tmp_path / "x-1.0-1.pgm").write_bytes(image)
    (tmp_path / "d-short.pgm").write_bytes(image[:-1])
    (tmp_path / "d-small.pgm").write_bytes(image.replace(b"640", b"320", 1))
    (tmp_path / "d-empty.pgm").write_bytes(b"")
    if index is not None:
        (tmp_path / INDEX).write_text(index)
    with pytest.raises(DeviceLost, match=said):
        check_recording(tmp_path)


@pytest.mark.parametrize("notes", ["", "{", "[]", '{"view": "moon"}', '{"eye": 1}'])
def test_damaged_notes(tmp_path: Path, notes: str) -> None:
    (tmp_path / NOTES).write_text(notes)
    with pytest.raises(DeviceLost, match=r"florence\.json"):
        recorded_view(tmp_path)
