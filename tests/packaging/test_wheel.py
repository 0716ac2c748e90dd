"""The wheel and the source distribution, and the commands of an installation outside of the checkout."""

from __future__ import annotations

import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.installed import build, copy_sources, install, run
from tests.sweeps import sweep

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("packaging")]

MISSION = """\
mission: round
description: Looks round.
tree:
  sequence:
    - turn: {angle: 90 deg}
    - wait: 1 s
"""
SCENARIO = """\
mission: round
given:
  skills: {turn: SUCCESS}
scenarios:
  - name: it looks round
    then: {status: SUCCEEDED}
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel that is made from the source distribution, as ``python -m build`` does it."""
    folder = tmp_path_factory.mktemp("wheel")
    sdist = build("sdist", copy_sources(folder / "sources"), folder / "dist")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (sources,) = (folder / "unpacked").iterdir()
    return build("wheel", sources, folder / "dist")


@pytest.fixture(scope="module")
def florence(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., CompletedProcess[str]]:
    folder = tmp_path_factory.mktemp("installed")
    programs = install(wheel, folder / "env")
    work = folder / "work"
    (work / "missions").mkdir(parents=True)
    (work / "missions" / "round.yaml").write_text(MISSION)
    (work / "scenarios").mkdir()
    (work / "scenarios" / "round.yaml").write_text(SCENARIO)
    return lambda *words: run([str(programs / "florence"), *words], work)


@pytest.mark.sweep
def test_the_sources_make_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    again = build("wheel", copy_sources(tmp_path / "sources"), tmp_path / "dist")
    assert contents(again) == contents(wheel)


def contents(wheel: Path) -> dict[str, int]:
    with zipfile.ZipFile(wheel) as archive:
        return {
            entry.filename: entry.CRC for entry in archive.infolist() if "dist-info/" not in entry.filename
        }


def test_every_file_beside_the_code_is_in_the_wheel(wheel: Path) -> None:
    names = contents(wheel)
    package = Path(__file__).parents[2] / "florence_bt"
    for path in package.rglob("*"):
        name = str(path.relative_to(package.parent))
        if path.is_file() and "__pycache__" not in name and path.suffix != ".md":
            assert name in names


@pytest.mark.parametrize(
    ("words", "said"),
    sweep(
        [
            (("--version",), "florence 0."),
            (("draw", "missions/round.yaml"), "turn"),
            (("test", "scenarios", "--missions", "missions"), "1 passed"),
            (("skills",), "navigate_to"),
            (("missions",), "goto_user"),
            (("check", "missions"), "1 mission checked"),
        ],
        every=2,
    ),
)
def test_a_command(florence: Callable[..., CompletedProcess[str]], words: tuple[str, ...], said: str) -> None:
    done = florence(*words)
    assert done.returncode == 0, done.stdout + done.stderr
    assert said in done.stdout


def test_doctor_finds_its_files(florence: Callable[..., CompletedProcess[str]]) -> None:
    done = florence("doctor")
    assert done.returncode in (0, 1), done.stdout + done.stderr  # whatever is wrong with this machine
    assert "Traceback" not in done.stderr and "make setup" not in done.stdout
