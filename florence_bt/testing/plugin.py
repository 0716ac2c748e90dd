"""The pytest plugin: the fixture ``florence``, and scenario files as tests.

pytest loads this module in every session where Florence is installed. It loads nothing else before a test
asks for the fixture, or a project names its scenario files in the setting ``florence_scenarios``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from florence_bt.testing.stage import Stage


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


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take the scenario files that the project names."""
    wanted = parent.config.getini("florence_scenarios")
    if file_path.suffix != ".yaml" or not any(
        file_path == path or path in file_path.parents for path in wanted
    ):
        return None
    from florence_bt.testing.collection import ScenarioModule

    return ScenarioModule.from_parent(parent, path=file_path)


@pytest.fixture
def florence(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Stage]:
    """Runs missions with mocked skills on a clock that is moved by hand."""
    from florence_bt.testing.stage import Stage

    stage = Stage(request.config.getini("florence_missions"), scratch=tmp_path)
    yield stage
    stage.check_mocks()
