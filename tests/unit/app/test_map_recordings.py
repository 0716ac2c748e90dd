"""Recordings of a drive, in each format that is read, and what is wrong with some."""

from __future__ import annotations

import gzip
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from florence_bt.app.maps.build import build_map
from florence_bt.app.maps.recordings.recording import Choices, RecordedScan, read_recording
from florence_bt.app.maps.told import mount_from_text
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from tests.unit.app.recorded_drives import MOUNT, STEPS, Moment, moments, write_bag, write_carmen


@pytest.fixture(scope="module")
def drive() -> list[Moment]:
    return moments()


def assert_is(found: list[RecordedScan], drive: list[Moment], mount: Transform3 = MOUNT) -> None:
    assert len(found) == len(drive)
    assert all(each.odom.distance_to(moment.odom) < 1e-5 for each, moment in zip(found, drive, strict=True))
    assert np.allclose(found[0].mount.rotation, mount.rotation, atol=1e-6)
    assert np.allclose(found[0].mount.translation, mount.translation, atol=1e-6)
    assert 0.0 <= found[0].read <= found[-1].read <= 1.0


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_gives_scans_odometry_and_an_upside_down_mount(
    tmp_path: Path, drive: list[Moment], storage: StoragePlugin
) -> None:
    bag = write_bag(tmp_path / "bag", drive, storage=storage)
    found = list(read_recording(bag))
    assert_is(found, drive)
    assert (found[3].scan.ranges == drive[3].scan.ranges).all()
    (file,) = [each for each in bag.iterdir() if each.suffix in (".mcap", ".db3")]
    assert_is(list(read_recording(file)), drive)


def test_scans_wait_for_an_odometry_that_is_recorded_late(tmp_path: Path, drive: list[Moment]) -> None:
    assert_is(list(read_recording(write_bag(tmp_path / "bag", drive, odom_late_s=1.0))), drive)


def test_without_odometry_tf_is_taken(tmp_path: Path, drive: list[Moment]) -> None:
    bag = write_bag(tmp_path / "bag", drive, odometry=False, odom_tf=True)
    assert_is(list(read_recording(bag)), drive)
    with pytest.raises(ConfigError, match="base_footprint") as caught:
        list(read_recording(bag, Choices(base_frame="chassis")))
    assert "--base-frame FRAME" in str(caught.value)


def test_of_two_lasers_one_is_chosen(tmp_path: Path, drive: list[Moment]) -> None:
    bag = write_bag(tmp_path / "bag", drive, scans=("/front/scan", "/rear/scan"))
    with pytest.raises(ConfigError, match=f"/front/scan \\({STEPS} messages\\)") as caught:
        list(read_recording(bag))
    assert caught.value.valid == ("--scan /front/scan", "--scan /rear/scan")
    assert len(list(read_recording(bag, Choices(scan="rear/scan")))) == STEPS
    with pytest.raises(ConfigError, match="/front/scan"):
        list(read_recording(bag, Choices(scan="front")))


def test_a_mount_comes_from_an_option_or_a_description(tmp_path: Path, drive: list[Moment]) -> None:
    bag = write_bag(tmp_path / "bag", drive, mount=False)
    with pytest.raises(ConfigError, match="where the laser 'laser' is") as caught:
        list(read_recording(bag))
    assert any("--mount" in each for each in caught.value.valid)
    given = mount_from_text("0.057 0 0.087 180 0 0")
    assert_is(list(read_recording(bag, Choices(mount=given))), drive)
    urdf = tmp_path / "robot.urdf"
    urdf.write_text(
        '<robot name="r"><link name="base_footprint"/><link name="laser"/><joint name="j" type="fixed">'
        '<parent link="base_footprint"/><child link="laser"/>'
        f'<origin xyz="0.057 0 0.087" rpy="{math.pi} 0 0"/></joint></robot>'
    )
    assert_is(list(read_recording(bag, Choices(urdf=urdf))), drive)
    with pytest.raises(ConfigError, match="roll, pitch, yaw"):
        mount_from_text("1 2")


def test_what_is_missing_is_named_with_the_topics_that_are_there(tmp_path: Path, drive: list[Moment]) -> None:
    with pytest.raises(ConfigError, match=r"no laser scan .* /odom \(nav_msgs"):
        list(read_recording(write_bag(tmp_path / "no_laser", drive, scans=())))
    with pytest.raises(ConfigError, match="no odometry is recorded"):
        list(read_recording(write_bag(tmp_path / "no_odom", drive, odometry=False)))
    with pytest.raises(ConfigError, match=r"mapped.mcap"):
        (tmp_path / "mapped.mcap").write_bytes(b"")
        read_recording(tmp_path / "map.mcap")


def test_numbers_that_mean_nothing_are_left_out(tmp_path: Path, drive: list[Moment]) -> None:
    broken = [replace(drive[5], odom=Pose2(math.nan, 0.0, 0.0)), *drive[6:]]
    found = list(read_recording(write_bag(tmp_path / "bag", [*drive[:5], *broken])))
    assert len(found) == STEPS
    assert all(each.odom.is_finite() for each in found)
    nothing = [replace(each, odom=Pose2(math.nan)) for each in drive]
    with pytest.raises(ConfigError, match="no message can be used"):
        list(read_recording(write_bag(tmp_path / "nothing", nothing)))


def test_scans_whose_beams_all_go_one_way_are_told(tmp_path: Path, drive: list[Moment]) -> None:
    one_way = [replace(each, scan=replace(each.scan, angle_increment=0.0)) for each in drive]
    with pytest.raises(ConfigError, match="angle_increment is 0 rad"):
        list(read_recording(write_bag(tmp_path / "bag", one_way)))
    (log := tmp_path / "new.log").write_text(
        f"ROBOTLASER1 0 -1.57 3.14 0 8.0 0.01 0 181 {'1.5 ' * 181}0 1.2 2 0 1 2 0 0 0 0 0 0 5.5 host 5.5\n"
    )
    with pytest.raises(ConfigError, match="0 rad apart"):
        list(read_recording(log))


def only_file(bag: Path) -> Path:
    (file,) = [each for each in bag.iterdir() if each.suffix in (".mcap", ".db3")]
    return file


def test_a_cut_mcap_is_read_as_far_as_it_goes_and_left_as_it_is(tmp_path: Path, drive: list[Moment]) -> None:
    bag = write_bag(tmp_path / "bag", drive)
    file = only_file(bag)
    cut = file.read_bytes()[: -(file.stat().st_size // 3)]
    file.write_bytes(cut)
    for path in (file, bag):
        found = list(read_recording(path))
        assert 0 < len(found) < STEPS
        assert_is(found, drive[: len(found)])
    assert file.read_bytes() == cut
    file.write_bytes(b"nothing of the kind")
    with pytest.raises(ConfigError, match="no MCAP file"):
        list(read_recording(file))


def test_a_cut_sqlite_says_how_it_is_mended(tmp_path: Path, drive: list[Moment]) -> None:
    file = only_file(write_bag(tmp_path / "bag", drive, storage=StoragePlugin.SQLITE3))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(ConfigError, match="reindex"):
        list(read_recording(file))


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_without_metadata_or_storage_in_it_is_read(
    tmp_path: Path, drive: list[Moment], storage: StoragePlugin
) -> None:
    bag = write_bag(tmp_path / "bag", drive, storage=storage)
    metadata = bag / "metadata.yaml"
    text = metadata.read_text()
    plugin = "mcap" if storage is StoragePlugin.MCAP else "sqlite3"
    for empty in ("''", '""', ""):
        changed = text.replace(f"storage_identifier: {plugin}", f"storage_identifier: {empty}")
        assert changed != text
        metadata.write_text(changed)
        assert_is(list(read_recording(bag)), drive)
    metadata.write_text("")
    assert_is(list(read_recording(bag)), drive)
    metadata.unlink()
    assert_is(list(read_recording(bag)), drive)


def test_a_bag_whose_file_was_renamed_or_packed_is_read(tmp_path: Path, drive: list[Moment]) -> None:
    bag = write_bag(tmp_path / "bag", drive)
    file = only_file(bag).rename(bag / "kitchen.mcap")
    assert_is(list(read_recording(bag)), drive)
    (bag / "kitchen.mcap.gz").write_bytes(gzip.compress(file.read_bytes()))
    file.unlink()
    assert_is(list(read_recording(bag)), drive)
    assert_is(list(read_recording(bag / "kitchen.mcap.gz")), drive)


def test_a_part_that_is_missing_is_told(tmp_path: Path, drive: list[Moment]) -> None:
    bag = write_bag(tmp_path / "bag", drive)
    name = only_file(bag).name
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(f"- {name}", f"- {name}\n  - bag_1.mcap"))
    with pytest.raises(ConfigError, match="missing"):
        list(read_recording(bag))


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_compressed_bag_is_read(tmp_path: Path, drive: list[Moment], mode: CompressionMode) -> None:
    bag = write_bag(tmp_path / "bag", drive, compression=mode)
    assert_is(list(read_recording(bag)), drive)
    if mode is CompressionMode.FILE:
        metadata = bag / "metadata.yaml"
        metadata.write_text(
            metadata.read_text().replace("storage_identifier: mcap", "storage_identifier: ''")
        )
        assert_is(list(read_recording(bag)), drive)
        metadata.unlink()
        (file,) = bag.iterdir()
        assert file.suffix == ".zstd"
        assert_is(list(read_recording(bag)), drive)
        assert_is(list(read_recording(file)), drive)
        file.write_bytes(file.read_bytes()[:-200])  # zstd unpacks whole blocks only
        found = list(read_recording(file))
        assert 0 < len(found) < STEPS
        assert_is(found, drive[: len(found)])


def test_the_parts_of_a_bag_are_read_in_order_and_two_bags_are_not_one(
    tmp_path: Path, drive: list[Moment]
) -> None:
    both = tmp_path / "both"
    both.mkdir()
    half = STEPS // 2
    for number, part in ((1, drive[half:]), (0, drive[:half])):
        only_file(write_bag(tmp_path / f"part{number}", part)).rename(both / f"both_{number}.mcap")
    assert_is(list(read_recording(both)), drive)
    (both / "both_1.mcap").rename(both / "other_0.mcap")
    with pytest.raises(ConfigError, match="more than one bag") as caught:
        list(read_recording(both))
    assert caught.value.valid == tuple(str(both / name) for name in ("both_0.mcap", "other_0.mcap"))
    for file in both.iterdir():
        file.unlink()
    with pytest.raises(ConfigError, match="no bag in this folder"):
        list(read_recording(both))


@pytest.mark.parametrize("name", ["drive.log", "drive.log.gz"])
def test_a_raw_log_of_carmen_has_its_odometry_and_mount(
    tmp_path: Path, drive: list[Moment], name: str
) -> None:
    log = write_carmen(tmp_path / name, drive, offset=0.2)
    found = list(read_recording(log))
    assert_is(found, drive, Transform3.from_pose2(Pose2(0.2)))
    assert np.isinf(found[0].scan.ranges).any() == (~np.isfinite(drive[0].scan.ranges)).any()
    assert len(found[0].scan.ranges) == 181
    assert found[0].scan.angle_max == pytest.approx(math.pi / 2)


def test_a_corrected_log_of_carmen_has_the_raw_motion(tmp_path: Path) -> None:
    ranges = " ".join(["2.0"] * 180)
    lines = []
    for number in range(4):
        # The wheels tell a metre, the correction makes 0.9 m of it.
        x = 0.9 * number
        lines.append(f"ODOM {x + 0.1 if number else 0} 0 0 0 0 0 {number} host {number}")
        lines.append(f"FLASER 180 {ranges} {x} 0 0 {x} 0 0 {number} host {number}")
        lines.append(f"ODOM {x} 0 0 0 0 0 0 host 0\nNEFF 10")
    (log := tmp_path / "corrected.log").write_text("\n".join(lines))
    found = list(read_recording(log))
    assert [each.odom.x for each in found] == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert [each.reference.x for each in found if each.reference] == pytest.approx([0.0, 0.9, 1.8, 2.7])


def test_the_newer_lines_of_carmen_are_read_too(tmp_path: Path) -> None:
    beams = " ".join(["1.5"] * 90 + ["nan"] * 91)
    (log := tmp_path / "new.log").write_text(
        f"ROBOTLASER1 0 -1.5707963 3.1415926 0.0174533 8.0 0.01 0 181 {beams} 0 1.2 2 0 1 2 0 "
        "0 0 0 0 0 5.5 host 5.5\n"
    )
    (found,) = read_recording(log)
    assert found.odom == Pose2(1.0, 2.0, 0.0)
    assert found.mount.translation[0] == pytest.approx(0.2)
    assert (found.scan.stamp, found.scan.range_max) == (5.5, 8.0)
    assert int(found.scan.valid().sum()) == 90


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("FLASER 180 1.0 2.0", r"bad.log:1: this FLASER is cut"),
        ("hello\nworld", "no line FLASER"),
        ("ODOM a b c", r"bad.log:1: this ODOM"),
        ("", "no line FLASER"),
    ],
)
def test_what_is_no_log_is_refused_with_its_line(tmp_path: Path, text: str, problem: str) -> None:
    (log := tmp_path / "bad.log").write_text(text)
    with pytest.raises(ConfigError, match=problem):
        list(read_recording(log))


def test_a_cut_log_leaves_the_map_of_what_was_read(tmp_path: Path, drive: list[Moment]) -> None:
    log = write_carmen(tmp_path / "drive.log.gz", drive)
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    built = build_map(log, Choices(), SlamParameters())
    assert isinstance(built.problem, ConfigError)
    assert "ends too early" in str(built.problem)
    assert 5 < built.scans < STEPS
    assert (built.grid.cells == 100).any()


@pytest.mark.parametrize(
    ("odom", "stamp", "problem"),
    [
        (lambda pose: Pose2(1000 * pose.x, 1000 * pose.y, pose.yaw), 1.0, "not in metres"),
        (lambda pose: Pose2(pose.x, pose.y, pose.yaw + 20.0 * (round(pose.x / 0.12) % 2)), 1.0, "radians"),
        (lambda pose: pose, -1.0, "clock goes back"),
    ],
)
def test_what_cannot_be_a_drive_is_told(tmp_path: Path, drive: list[Moment], odom, stamp, problem) -> None:
    wrong = [replace(each, odom=odom(each.odom), stamp=stamp * 10.0 * each.stamp) for each in drive]
    if stamp > 0:
        wrong = [replace(each, stamp=each.stamp / 10.0) for each in wrong]
    built = build_map(write_carmen(tmp_path / "drive.log", wrong), Choices(), SlamParameters())
    assert problem in str(built.problem)


def test_ranges_in_millimetres_are_told(tmp_path: Path, drive: list[Moment]) -> None:
    far = [replace(each.scan, ranges=each.scan.ranges * 1000, range_max=5600.0) for each in drive]
    wrong = [replace(each, scan=scan) for each, scan in zip(drive, far, strict=True)]
    with pytest.raises(ConfigError, match="not in metres"):
        build_map(write_bag(tmp_path / "bag", wrong), Choices(), SlamParameters())
