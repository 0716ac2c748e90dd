"""Python and the libraries, by their metadata, and the packages with skills, which are imported."""

from __future__ import annotations

import ctypes.util
import importlib.metadata
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from florence_bt.app.doctor.finding import HealthFinding, good, note, problem, warning
from florence_bt.core.installation import in_checkout
from florence_bt.trees.language.declarations import collect_declarations

GROUP = "libraries"
PYTHONS = ((3, 11), (3, 12))


@dataclass(frozen=True, slots=True)
class Library:
    """A Python package.

    Attributes:
        name: Its name on the package index.
        least: The smallest version that works.
        purpose: What does not work without it.
        needed: Whether nothing works without it.
    """

    name: str
    least: tuple[int, ...]
    purpose: str
    needed: bool = False


LIBRARIES = (
    Library("py-trees", (2, 6), "missions", needed=True),
    Library("PyYAML", (6,), "missions", needed=True),
    Library("numpy", (1, 26), "sensors, navigation, people"),
    Library("numba", (0, 60), "sensors, navigation, people"),
    Library("scipy", (1, 12), "people"),
    Library("opencv-python-headless", (4, 10), "people"),
    Library("onnxruntime", (1, 20), "people"),
    Library("pyserial", (3, 5), "the base and the laser"),
    Library("pyusb", (1, 2), "tilt, light and accelerometer of the Kinect"),
    Library("xacro", (2,), "the robot's description"),
    Library("mujoco", (3, 2), "the simulated flat"),
)

Version = Callable[[str], str]


def check_libraries(
    version_of: Version = importlib.metadata.version,
    find_library: Callable[[str], str | None] = ctypes.util.find_library,
) -> Iterator[HealthFinding]:
    """Check Python, its packages and the C library of the Kinect.

    Args:
        version_of: The version of an installed package; raises PackageNotFoundError.
        find_library: The file of a C library, or None.
    """
    yield _python(sys.version_info[:3])
    for library in LIBRARIES:
        yield _library(library, version_of)
    for finding in collect_declarations().findings:
        advice = "repair the package, or uninstall it: its skills are missing"
        yield warning(GROUP, finding.file, finding.message, advice)
    if find_library("freenect"):
        yield good(GROUP, "libfreenect", "installed")
    else:
        yield note(
            GROUP,
            "libfreenect",
            "not installed: no pictures from a real Kinect",
            "sudo apt install libfreenect0.5",
        )


def _python(version: tuple[int, ...]) -> HealthFinding:
    found = ".".join(str(part) for part in version)
    if version[:2] in PYTHONS:
        return good(GROUP, "Python", found)
    return warning(GROUP, "Python", found, "use Python 3.11 or 3.12: others are not tested")


def _library(library: Library, version_of: Version) -> HealthFinding:
    report = problem if library.needed else warning
    wanted = ".".join(str(part) for part in library.least)
    install = "make setup" if in_checkout() else f"pip install '{library.name}>={wanted}'"
    try:
        found = version_of(library.name)
    except importlib.metadata.PackageNotFoundError:
        return report(GROUP, library.name, f"not installed: without it no {library.purpose}", install)
    numbers = tuple(int(part) for part in re.findall(r"\d+", found)[:3])
    if numbers < library.least:
        return report(GROUP, library.name, f"{found} is too old for {library.purpose}", install)
    return good(GROUP, library.name, found)
