"""Recordings of a Kinect as MCAP: what goes in comes out, other people's readers agree, damage is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.sweeps import examples

pytest.importorskip("mcap", reason="mcap is not here (extra record)")

from florence_bt.app.devices.kinect_recording import convert
from florence_bt.core.errors import ConfigError, DeviceLost
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.codec import pack_11_bit
from florence_bt.drivers.kinect.fakenect import INDEX
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.recording import (
    COLOUR,
    DEPTH,
    FILE,
    IMAGE_SCHEMA,
    Reading,
    RecordingSource,
    RecordingWriter,
    recorded,
    recorded_depth,
)

RAW = (np.arange(240 * 320, dtype=np.uint32) % 2048).astype(np.uint16).reshape(240, 320)
PIXELS = (np.arange(240 * 320 * 3) % 251).astype(np.uint8).reshape(240, 320, 3)
READING = Reading((-1, 819, 2), -62, 4)


def write(folder: Path) -> Path:
    with RecordingWriter(folder) as writer:
        writer.add(DepthFrame(320, 240, 100.5, pack_11_bit(RAW)), 1_800_000_012.5)
        writer.add(VideoFrame(320, 240, 100.75, PIXELS), 1_800_000_012.75)
        writer.add_reading(READING, 1_800_000_013.0)
        raw = DepthFrame(320, 240, 101.0, RAW, DepthEncoding.RAW, View.DEPTH)
        writer.add(raw, 1_800_000_013.5)
        writer.add(DepthFrame(320, 240, 102.0, RAW, DepthEncoding.MILLIMETRES, View.COLOUR), 1_800_000_014.5)
    return folder


def test_what_goes_in_comes_out(tmp_path: Path) -> None:
    moments, parts = zip(*recorded(write(tmp_path / "new" / "folder")), strict=True)
    assert [moment - 1_800_000_000 for moment in moments] == pytest.approx([12.5, 12.75, 13.0, 13.5, 14.5])
    first, colour, reading, second, third = parts
    assert (first.timestamp, first.view, first.encoding) == (100.5, View.SHARED, DepthEncoding.RAW)
    assert (second.view, third.view, third.encoding) == (View.DEPTH, View.COLOUR, DepthEncoding.MILLIMETRES)
    for depth in (first, second):
        np.testing.assert_array_equal(depth.raw(), RAW)
    np.testing.assert_array_equal(
        third.metres(), DepthFrame(320, 240, 0.0, RAW, DepthEncoding.MILLIMETRES).metres()
    )
    np.testing.assert_array_equal(colour.pixels(), PIXELS)
    assert (colour.timestamp, reading) == (100.75, READING)
    assert [moment for moment, _ in recorded_depth(tmp_path / "new" / "folder" / FILE)] == [0.0, 1.0, 2.0]


def test_rosbags_reads_the_images(tmp_path: Path) -> None:
    rosbags = pytest.importorskip("rosbags.highlevel")
    with rosbags.AnyReader([write(tmp_path) / FILE]) as reader:
        wanted = [each for each in reader.connections if each.topic in (DEPTH, COLOUR)]
        found: list[Any] = [
            reader.deserialize(data, each.msgtype) for each, _, data in reader.messages(connections=wanted)
        ]
    assert [(each.encoding, each.header.frame_id) for each in found] == [
        ("mono16", "shared"),
        ("rgb8", "colour"),
        ("mono16", "depth"),
        ("16UC1", "colour"),
    ]
    np.testing.assert_array_equal(found[0].data.view("<u2").reshape(240, 320), RAW)
    assert (found[1].width, found[1].height, found[1].step, found[1].header.stamp.sec) == (320, 240, 960, 100)


def test_the_schema_is_that_of_ros() -> None:
    typesys = pytest.importorskip("rosbags.typesys")
    ours = typesys.get_types_from_msg(IMAGE_SCHEMA, "sensor_msgs/msg/Image")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    for name, (constants, fields) in ours.items():
        assert (constants, fields) == tuple(store.fielddefs[name]), name


def test_a_recording_is_never_overwritten_and_one_without_images_leaves_nothing(tmp_path: Path) -> None:
    write(tmp_path)
    with pytest.raises(ConfigError, match="already"):
        RecordingWriter(tmp_path)
    with RecordingWriter(tmp_path / "empty"):
        pass
    assert not list((tmp_path / "empty").iterdir())
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"cannot be written|already"):
        RecordingWriter(tmp_path / "file" / "below")


def played(source: RecordingSource) -> list[Frame]:
    frames = []
    with pytest.raises(DeviceLost, match="is over; it starts again"):
        while True:
            if (frame := source.read(0.3)) is not None:
                frames.append(frame)
    return frames


def test_it_is_played_as_fast_as_it_was_made(tmp_path: Path) -> None:
    now = [50.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds

    write(tmp_path)
    source = RecordingSource(tmp_path, lambda: now[0], sleep)
    assert len(played(source)) == 4 and now[0] == pytest.approx(52.0)
    source.close()
    with pytest.raises(DeviceLost, match="closed"):
        source.read(0.0)
    source = RecordingSource(tmp_path, lambda: now[0], sleep)
    source.request(colour=False)
    assert len(played(source)) == 3


@pytest.mark.parametrize("leap", [1.8e9, -1.0e6])
def test_a_clock_that_was_set_meanwhile_costs_a_second_at_most(tmp_path: Path, leap: float) -> None:
    now = [50.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds

    depth = DepthFrame(320, 240, 101.0, RAW, DepthEncoding.RAW)
    with RecordingWriter(tmp_path) as writer:
        for moment in (2e6, 2e6 + 0.5, 2e6 + leap, 2e6 + leap + 0.25):
            writer.add(depth, moment)
    assert len(played(RecordingSource(tmp_path, lambda: now[0], sleep))) == 4
    assert 0.75 <= now[0] - 50.0 <= 1.75 + 1e-6
    assert [moment for moment, _ in recorded_depth(tmp_path)][-1] == pytest.approx(now[0] - 50.0)


def test_a_folder_of_libfreenect_and_a_recording_become_each_other(tmp_path: Path) -> None:
    ours = write(tmp_path / "ours")
    assert convert(ours, tmp_path / "theirs") == (3, 1)
    assert (tmp_path / "theirs" / INDEX).exists()
    assert convert(tmp_path / "theirs", tmp_path / "theirs") == (3, 1)
    before, after = list(recorded(ours)), list(recorded(tmp_path / "theirs"))
    assert [moment for moment, _ in after] == pytest.approx([moment for moment, _ in before], abs=1e-6)
    for (_, one), (_, other) in zip(before[:4], after[:4], strict=True):
        if isinstance(one, DepthFrame) and isinstance(other, DepthFrame):
            np.testing.assert_array_equal(other.raw()[::2, ::2], one.raw())
        elif isinstance(one, VideoFrame) and isinstance(other, VideoFrame):
            np.testing.assert_array_equal(other.pixels()[::2, ::2], one.pixels())
        else:
            assert one == other == READING
    with pytest.raises(ConfigError, match="already"):
        convert(ours, tmp_path / "theirs")


def test_what_holds_nothing_becomes_nothing(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "index").mkdir()
    (tmp_path / "index" / INDEX).touch()
    (tmp_path / "cut.mcap").write_bytes((write(tmp_path / "ours") / FILE).read_bytes()[:60])
    for source in ("none", "other", "index", "cut.mcap"):
        with pytest.raises(DeviceLost):
            convert(tmp_path / source, tmp_path / "target")
        assert not (tmp_path / "target").exists(), source


def test_what_is_no_recording_says_how_to_make_one(tmp_path: Path) -> None:
    for place in (tmp_path, tmp_path / "none.mcap"):
        with pytest.raises(DeviceLost, match=r"kinect record.*kinect convert"):
            RecordingSource(place)
    with RecordingWriter(tmp_path) as writer:
        writer.add(VideoFrame(320, 240, 100.75, PIXELS), 12.75)
    with pytest.raises(DeviceLost, match="no depth image"):
        RecordingSource(tmp_path)


@settings(
    max_examples=examples(150), suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(
    places=st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(0, 255)), min_size=1, max_size=5),
    cut=st.floats(0.0, 1.0),
)
def test_a_damaged_file_ends_early_or_is_told(
    tmp_path: Path, places: list[tuple[float, int]], cut: float
) -> None:
    if not (tmp_path / FILE).exists():
        write(tmp_path)
    data = bytearray((tmp_path / FILE).read_bytes())
    for share, value in places:
        data[min(int(share * len(data)), len(data) - 1)] = value
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data[: int(cut * len(data)) or None])
    try:
        assert len(list(recorded(damaged))) <= 5
    except DeviceLost as error:
        assert "damaged" in str(error)
