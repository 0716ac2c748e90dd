"""Builds the ROS interface packages of ``interfaces/`` into ``.venv``, as many at once as there are cores.

The packages do not depend on each other. Those that other distributions bring too (nav2_msgs, tf2_msgs,
py_trees_ros_interfaces) are built only where the environment lacks them. What was built is kept in a cache
folder outside of the checkout, by the hash of everything it was made from: a second checkout, or a branch of
yesterday, takes it from there.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from . import machine
from .dependencies import LOCK
from .progress import Log, Step, content_hash, stamped

SOURCES = machine.ROOT / "interfaces"
INSTALLED = machine.STATE / "interfaces"
"""For each package that was built here the list of its files in ``.venv``, and what they were made from."""

BUILT_WITH = ("ros-", "numpy", "cmake", "empy", "lark", "catkin-pkg")
"""Pins that decide what is built."""
CMAKE_OPTIONS = (
    "-DFLORENCE_PYTHON_ONLY=ON",
    "-DCMAKE_BUILD_TYPE=Release",
    # Generated code that copies fields: optimising it doubles the compile time and saves microseconds.
    "-DCMAKE_C_FLAGS_RELEASE=-O0 -DNDEBUG",
    "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG",
    "-DBUILD_TESTING=OFF",
)


def step(log: Log) -> Step:
    """Make the step that builds, or takes from the cache, every package that is not up to date."""
    return stamped(
        "ROS interfaces",
        INSTALLED / "all.stamp",
        lambda: content_hash([_recipe(), SOURCES]),
        lambda: _provide_all(log),
    )


def cache_folder() -> Path:
    """Return where built packages are kept for a user's checkouts; ``.venv`` if that is not writable."""
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "florence_bt" / "interfaces"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        writable = False
    else:
        writable = os.access(folder, os.W_OK)
    return folder if writable else machine.STATE / "cache"


def keep(entry: Path, built: Path) -> None:
    """Put a built package into the cache, whole or not at all.

    Args:
        entry: Folder that it becomes.
        built: Folder on the same file system that it is now.
    """
    try:
        built.rename(entry)
    except OSError:
        if not entry.is_dir():
            raise
        # Another set-up was faster with the same package.


def install(entry: Path, prefix: Path, files_list: Path) -> None:
    """Copy a package from the cache in place of what an earlier build put there.

    A deleted message must not live on: the files of before are removed.

    Args:
        entry: The package in the cache, with the folders ``lib`` and ``share``.
        prefix: The environment.
        files_list: Names the files that come from here; written before they are copied.
    """
    if files_list.is_file():
        for name in files_list.read_text().splitlines():
            (prefix / name).unlink(missing_ok=True)
    files = [file.relative_to(entry) for file in sorted(entry.rglob("*")) if not file.is_dir()]
    files_list.parent.mkdir(parents=True, exist_ok=True)
    files_list.write_text("".join(f"{file}\n" for file in files))
    for file in files:
        (prefix / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(entry / file, prefix / file)


def comes_from_elsewhere(name: str) -> bool:
    """Tell whether the environment has the package without our having put it there."""
    return (machine.VENV / "share" / name / "package.xml").is_file() and not _files_list(name).is_file()


def _provide_all(log: Log) -> None:
    packages = [file.parent for file in SOURCES.glob("*/package.xml")]
    # The largest one first: the others fit beside it.
    packages.sort(key=lambda package: -len(list(package.rglob("*"))))
    recipe = _recipe()
    log.side_by_side(
        *(
            lambda package=package: _provide(log, package, content_hash([recipe, package]))
            for package in packages
            if not comes_from_elsewhere(package.name)
        )
    )


def _provide(log: Log, package: Path, made_from: str) -> None:
    """Bring one package into the environment, from the cache or by building it."""
    entry = cache_folder() / f"{package.name}-{made_from[:24]}"
    begin, source = time.monotonic(), "from the cache"
    if not entry.is_dir():
        source = "built"
        _build(log, package, entry)
    install(entry, machine.VENV, _files_list(package.name))
    print(f"      {package.name} {source}, {time.monotonic() - begin:.0f} s", flush=True)


def _build(log: Log, package: Path, entry: Path) -> None:
    environment = {
        "PATH": os.pathsep.join([str(machine.VENV / "bin"), os.environ.get("PATH", os.defpath)]),
        "VIRTUAL_ENV": str(machine.VENV),
        "AMENT_PREFIX_PATH": str(machine.VENV),
        "CMAKE_PREFIX_PATH": str(machine.VENV),
    }
    cmake = machine.VENV / "bin" / "cmake"
    entry.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=entry.parent, prefix="new-") as folder:
        build, built = Path(folder) / "build", Path(folder) / "built"
        log.call(
            [
                *(cmake, "-S", package, "-B", build, "-G", "Ninja"),
                f"-DCMAKE_INSTALL_PREFIX={built}",
                f"-DPython3_EXECUTABLE={machine.PYTHON}",
                *CMAKE_OPTIONS,
            ],
            environment,
        )
        log.call([cmake, "--build", build, "--target", "install"], environment)
        # Nothing in .venv compiles against it, and byte code would name the folder it was made in.
        for unused in (
            built / "include",
            built / "share" / package.name / "cmake",
            *built.rglob("__pycache__"),
        ):
            shutil.rmtree(unused, ignore_errors=True)
        keep(entry, built)


def _recipe() -> str:
    """Hash what the result depends on besides the package: how it is built, and with which versions."""
    pins = [pin for pin in LOCK.read_text().splitlines() if pin.startswith(BUILT_WITH)]
    compilers = [_version(machine.compiler(*names)) for names in (machine.C_COMPILERS, machine.CXX_COMPILERS)]
    return content_hash(
        [
            *(str(sys.version_info[:2]), platform.machine(), *platform.libc_ver(), *compilers, *pins),
            *(SOURCES / "python_include_dirs.cmake", SOURCES / "python_only.cmake", Path(__file__)),
        ]
    )


def _version(program: str) -> str:
    done = subprocess.run(
        [program, "--version"], capture_output=True, text=True, errors="replace", check=False
    )
    return done.stdout.partition("\n")[0]


def _files_list(name: str) -> Path:
    return INSTALLED / f"{name}.files"
