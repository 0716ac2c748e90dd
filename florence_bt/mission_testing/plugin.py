"""The pytest plugin: the fixture ``florence``, and scenario files as tests.

pytest loads this module in every session where Florence is installed. It loads nothing else before a test
asks for the fixture, or a project names its scenario files in the setting ``florence_scenarios``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from florence_bt.mission_testing.stage import Stage


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the settings ``florence_missions`` and ``florence_scenarios``."""
    parser.addini(
        "florence_missions",
        "folders of missions, relative to the root of the project; later ones shadow earlier ones",
        type="paths",
        default=[],
    )
    parser.addini(
        "florence_scenarios",
        "scenario files and folders of them that pytest runs as tests, relative to the root of the project",
        type="paths",
        default=[],
    )


def pytest_configure(config: pytest.Config) -> None:
    """See that what the settings name exists.

    Raises:
        UsageError: A file or a folder does not.
    """
    for setting in ("florence_missions", "florence_scenarios"):
        for path in config.getini(setting):
            if not path.exists():
                raise pytest.UsageError(f"{setting}: there is no file or folder '{path}'")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take the scenario files that the project names."""
    wanted = parent.config.getini("florence_scenarios")
    if not wanted or file_path.suffix not in (".yaml", ".yml"):
        return None
    if file_path not in wanted and not _is_in_folder(file_path, wanted):
        return None
    from florence_bt.mission_testing.scenarios.collection import ScenarioModule

    return ScenarioModule.from_parent(parent, path=file_path)


def _is_in_folder(file: Path, folders: Sequence[Path]) -> bool:
    """Whether a scenario file is below one of these folders; missions beside it are none."""
    if not any(folder in file.parents for folder in folders):
        return False
    from florence_bt.mission_testing.scenarios.files import looks_like_scenarios

    return looks_like_scenarios(file)


@pytest.fixture
def florence(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Stage]:
    """Runs missions with mocked skills on a clock that is moved by hand."""
    from florence_bt.mission_testing.stage import Stage

    stage = Stage(request.config.getini("florence_missions"), scratch=tmp_path)
    failed_before = request.session.testsfailed
    yield stage
    if request.session.testsfailed == failed_before:  # else the test has told it, or something worse
        stage.check_mocks()
