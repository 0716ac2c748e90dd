"""A drive that goes on another day: the kept scans with their poses and ties, in a file."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import mend, replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.pose_graph import Tie

SUFFIX = ".drive"
VERSION = 1
_STEP_M = 0.002
"""Points are kept in steps of so many metres, in 16 bits."""
_FARTHEST_M = 65.0
"""Distance beyond which nothing is kept."""


@dataclass(frozen=True, slots=True)
class MappedDrive:
    """All that is known of a drive; n kept scans.

    Attributes:
        scans: The kept scans.
        poses: base_footprint in the map at each of them.
        driven: The same by the laser odometry.
        ways: Metres driven up to each of them.
        torn: Whether nothing ties it to the one before.
        ties: What is known of how the poses lie to each other.
        touches: Where the bumper met something: the number of a scan, and base_footprint relative to the pose
            at that scan, turned towards what was met.
    """

    scans: tuple[KeptScan, ...]
    poses: tuple[Pose2, ...]
    driven: tuple[Pose2, ...]
    ways: tuple[float, ...]
    torn: tuple[bool, ...]
    ties: tuple[Tie, ...]
    touches: tuple[tuple[int, Pose2], ...] = ()


def drive_bytes(drive: MappedDrive) -> bytes:
    """Return the content of the file of a drive."""
    arrays = {
        "version": np.array(VERSION),
        "stamps": np.array([scan.stamp for scan in drive.scans]),
        "starts": np.array([scan.start for scan in drive.scans], np.float32).reshape(-1, 2),
        "poses": _numbers(drive.poses),
        "driven": _numbers(drive.driven),
        "ways": np.array(drive.ways),
        "torn": np.array(drive.torn, bool),
        "tied": np.array([(tie.first, tie.second) for tie in drive.ties], np.int32).reshape(-1, 2),
        "relatives": _numbers(tie.relative for tie in drive.ties),
        "covariances": np.array([tie.covariance for tie in drive.ties]).reshape(-1, 3, 3),
        "tie_ways": np.array([tie.way for tie in drive.ties]),
        "touched": np.array([number for number, _ in drive.touches], np.int32),
        "touches": _numbers(touch for _, touch in drive.touches),
    }
    for name in ("points", "clear"):
        parts = [_steps(getattr(scan, name)) for scan in drive.scans]
        arrays[f"{name}_counts"] = np.array([len(part) for part in parts], np.int32)
        arrays[name] = np.concatenate(parts) if parts else np.zeros((0, 2), np.int16)
    data = io.BytesIO()
    np.savez_compressed(data, **arrays)  # type: ignore[arg-type]
    return data.getvalue()


def save_drive(path: Path, drive: MappedDrive) -> None:
    """Write a drive, in one step.

    Raises:
        OSError: It cannot be written.
    """
    replace_files({path: drive_bytes(drive)})


def load_drive(path: Path) -> MappedDrive:
    """Load a drive.

    Raises:
        ConfigError: It cannot be read.
    """
    # Older files have no touches.
    arrays: dict[str, Any] = {"touched": np.zeros(0, np.int32), "touches": np.zeros((0, 3))}
    try:
        arrays |= _arrays_in(path)
        if int(arrays["version"]) != VERSION:
            raise ValueError(f"it is of version {int(arrays['version'])}, not {VERSION}")
        return _drive(arrays)
    except OSError as error:
        problem = f"the drive cannot be read: {error.strerror or error}"
        raise ConfigError(
            problem, file=path, valid=[f"a file *{SUFFIX} beside a map that was built"]
        ) from error
    except (ValueError, KeyError, TypeError) as error:
        problem = f"it holds no drive, or is damaged: {error}"
        raise ConfigError(
            problem, file=path, valid=[f"a file *{SUFFIX} beside a map that was built"]
        ) from error


def _arrays_in(path: Path) -> dict[str, Any]:
    """Read a file of arrays; raises ValueError when it is damaged."""
    try:
        mend(path.parent)
        with path.open("rb") as file, np.load(file, allow_pickle=False) as saved:
            return {name: saved[name] for name in saved.files}
    except OSError:
        raise
    except Exception as error:
        # Those of zipfile, zlib, tokenize and more: a damaged byte may be anywhere.
        raise ValueError(str(error)) from error


def _drive(arrays: dict[str, Any]) -> MappedDrive:
    points = _parts(arrays["points"], arrays["points_counts"])
    clear = _parts(arrays["clear"], arrays["clear_counts"])
    scans = tuple(
        KeptScan(float(stamp), start, ends, free)
        for stamp, start, ends, free in zip(arrays["stamps"], arrays["starts"], points, clear, strict=True)
    )
    ties = tuple(
        Tie(int(tied[0]), int(tied[1]), relative, covariance, float(way))
        for tied, relative, covariance, way in zip(
            arrays["tied"],
            _poses(arrays["relatives"]),
            arrays["covariances"],
            arrays["tie_ways"],
            strict=True,
        )
    )
    touches = tuple(zip(arrays["touched"].tolist(), _poses(arrays["touches"]), strict=True))
    names = ("poses", "driven", "ways", "relatives", "covariances", "tie_ways", "touches")
    numbers = [arrays[name] for name in names]
    if not scans or not all(np.isfinite(each).all() for each in numbers):
        raise ValueError("it has no scans, or numbers that are not finite")
    if any(tie.first >= tie.second or tie.second >= len(scans) for tie in ties):
        raise ValueError("a tie is between poses that are not there")
    if any(not 0 <= number < len(scans) for number, _ in touches):
        raise ValueError("a touch is at a scan that is not there")
    return MappedDrive(
        scans,
        _poses(arrays["poses"]),
        _poses(arrays["driven"]),
        tuple(arrays["ways"].tolist()),
        tuple(arrays["torn"].tolist()),
        ties,
        touches,
    )


def _numbers(poses: Iterable[Pose2]) -> NDArray[np.float64]:
    return np.array([(pose.x, pose.y, pose.yaw) for pose in poses]).reshape(-1, 3)


def _poses(numbers: NDArray[np.float64]) -> tuple[Pose2, ...]:
    return tuple(Pose2(*row) for row in numbers.tolist())


def _steps(points: NDArray[np.float32]) -> NDArray[np.int16]:
    near = np.abs(points).max(axis=1, initial=0.0) < _FARTHEST_M
    return np.rint(points[near] / _STEP_M).astype(np.int16)


def _parts(steps: NDArray[np.int16], counts: NDArray[np.int32]) -> Sequence[NDArray[np.float32]]:
    if counts.sum() != len(steps):
        raise ValueError("points are missing")
    points = (steps * np.float32(_STEP_M)).astype(np.float32).reshape(-1, 2)
    return np.split(points, np.cumsum(counts)[:-1])
