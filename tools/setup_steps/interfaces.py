"""Builds the ROS interface packages of ``interfaces/`` into ``.venv``, as many at once as there are cores.

The packages do not depend on each other. Those that other distributions bring too (nav2_msgs, tf2_msgs,
py_trees_ros_interfaces) are built only where the environment lacks them.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from . import machine
from .dependencies import LOCK
from .progress import Log, Step, content_hash

SOURCES = machine.ROOT / "interfaces"
STAMPS = machine.STATE / "interfaces"
BUILD = machine.STATE / "build"
BUILT_WITH = ("ros-", "numpy", "cmake", "empy", "lark")
"""Pins that decide what is built."""
CMAKE_OPTIONS = (
    "-DCMAKE_BUILD_TYPE=Release",
    # Generated code that copies fields: more optimisation makes the build longer and nothing faster.
    "-DCMAKE_C_FLAGS_RELEASE=-O1 -DNDEBUG",
    "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG",
    "-DBUILD_TESTING=OFF",
)


def steps(log: Log) -> list[Step]:
    """One step that builds every package that is not up to date."""
    return [
        Step(
            "ROS interfaces",
            STAMPS / "all.stamp",
            lambda: content_hash([_recipe(), SOURCES]),
            lambda: _build_all(log),
        )
    ]


def _recipe() -> str:
    """What the result depends on beside the package itself."""
    return content_hash(
        [str(sys.version_info[:2]), LOCK, SOURCES / "python_include_dirs.cmake", Path(__file__)]
    )


def _build_all(log: Log) -> None:
    packages = [file.parent for file in sorted(SOURCES.glob("*/package.xml"))]
    tasks = [_task(log, package) for package in packages if not _comes_from_elsewhere(package.name)]
    pending = [task for task in tasks if not task.up_to_date()]
    # The largest one first: the others fit beside it.
    pending.sort(key=lambda task: -len(list((SOURCES / task.title).rglob("*"))))
    print(f" {len(pending)} to build", end="", flush=True)
    with ThreadPoolExecutor(max(1, min(len(pending), os.cpu_count() or 1))) as pool:
        running = [pool.submit(_timed, task) for task in pending]
        try:
            for one in running:
                one.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            log.end_commands()
            raise


def _timed(task: Step) -> None:
    begin = time.monotonic()
    task.run()
    print(f"\n      {task.title} {time.monotonic() - begin:.0f} s", end="", flush=True)


def _task(log: Log, package: Path) -> Step:
    return Step(
        package.name,
        STAMPS / f"{package.name}.stamp",
        lambda: content_hash([_recipe(), package]),
        lambda: _build(log, package),
    )


def _comes_from_elsewhere(name: str) -> bool:
    """Whether the environment has the package without our having built it."""
    installed = machine.VENV / "share" / name / "package.xml"
    return installed.is_file() and not (BUILD / name).is_dir()


def _build(log: Log, package: Path) -> None:
    build, stamp = BUILD / package.name, STAMPS / f"{package.name}.stamp"
    _remove_installed(build / "install_manifest.txt")
    if not stamp.is_file():
        # An interrupted build is not trusted.
        shutil.rmtree(build, ignore_errors=True)
    stamp.unlink(missing_ok=True)
    build.mkdir(parents=True, exist_ok=True)
    environment = {
        "PATH": os.pathsep.join([str(machine.VENV / "bin"), os.environ.get("PATH", os.defpath)]),
        "VIRTUAL_ENV": str(machine.VENV),
        "AMENT_PREFIX_PATH": str(machine.VENV),
        "CMAKE_PREFIX_PATH": str(machine.VENV),
    }
    cmake = machine.VENV / "bin" / "cmake"
    log.call(
        [
            *(cmake, "-S", package, "-B", build, "-G", "Ninja"),
            f"-DCMAKE_INSTALL_PREFIX={machine.VENV}",
            f"-DPython3_EXECUTABLE={machine.PYTHON}",
            *CMAKE_OPTIONS,
        ],
        environment,
    )
    log.call([cmake, "--build", build, "--target", "install"], environment)


def _remove_installed(manifest: Path) -> None:
    """Take away what an earlier build installed: a deleted message must not live on."""
    if manifest.is_file():
        for file in manifest.read_text().splitlines():
            Path(file).unlink(missing_ok=True)
