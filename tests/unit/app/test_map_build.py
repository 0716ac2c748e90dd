"""``florence map build``, typed as its users do."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from florence_bt.app.maps.build import build_map
from florence_bt.app.maps.recordings.recording import Choices
from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, OK, USAGE
from florence_bt.core.sensing import FREE, OCCUPIED
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from tests.unit.app.recorded_drives import moments, write_bag, write_carmen

DOCS = Path(__file__).parents[3] / "docs" / "manual" / "mapping.md"


def florence(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments], catch_exceptions=False)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("drive") / "drive", moments())


def test_a_map_is_built_with_its_picture_and_its_drive(tmp_path: Path, bag: Path) -> None:
    out = tmp_path / "maps" / "home.yaml"
    done = florence("map", "build", "--log", bag, "--out", out)
    assert done.exit_code == OK
    assert "faster than the robot drove" in done.stdout
    grid = load_map(out)
    assert (grid.cells == OCCUPIED).sum() > 100
    assert (grid.cells == FREE).sum() > 1000
    picture = cv2.imread(str(out.with_suffix(".drive.png")))
    assert picture is not None and len(np.unique(picture.reshape(-1, 3), axis=0)) > 4
    refused = florence("map", "build", "--log", bag, "--out", out)
    assert refused.exit_code == USAGE
    assert "--overwrite" in refused.stderr
    again = florence(
        *("map", "build", "--log", bag, "--out", out, "--overwrite"),
        *("--continue", out.with_suffix(".drive"), "--resolution", 0.1),
    )
    assert again.exit_code == OK
    assert load_map(out).resolution == 0.1


def test_of_a_cut_recording_the_first_part_is_written(tmp_path: Path) -> None:
    log = write_carmen(tmp_path / "drive.log.gz", moments())
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    done = florence("map", "build", "--log", log, "--out", tmp_path / "home.yaml")
    assert done.exit_code == FAILED
    assert "the map holds what was read before" in done.stderr
    assert (load_map(tmp_path / "home.yaml").cells == OCCUPIED).any()


def test_an_interrupt_leaves_what_was_read(bag: Path) -> None:
    def interrupt(read: float, slam: object) -> None:
        if read > 0.4:
            raise KeyboardInterrupt

    built = build_map(bag, Choices(), SlamParameters(), tell=interrupt)
    assert isinstance(built.problem, KeyboardInterrupt)
    assert (built.grid.cells == OCCUPIED).any()


@pytest.mark.parametrize("options", [("--mount", "1 2 3"), ("--resolution", "0"), ("--scan", "/depth")])
def test_a_wrong_option_is_told_before_anything_is_written(tmp_path: Path, bag: Path, options) -> None:
    done = florence("map", "build", "--log", bag, "--out", tmp_path / "home.yaml", *options)
    assert done.exit_code == USAGE
    assert "would have worked" in done.stderr
    assert not list(tmp_path.iterdir())


def test_every_option_in_the_manual_is_one() -> None:
    shown = florence("map", "build", "--help").stdout
    page = DOCS.read_text()
    build = page[: page.index("How right the maps are")]
    for option in set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", build)):
        assert option in shown or option == "--map", option
