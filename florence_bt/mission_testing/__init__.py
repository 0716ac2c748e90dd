"""Tests of missions: mocked skills, a clock that is moved by hand, the real executor.

The pytest fixture ``florence`` (:mod:`florence_bt.mission_testing.plugin`) is a :class:`MissionTester`;
docs/manual/testing.md teaches its use. The names below are loaded when they are first used, because pytest
imports this package in every session.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from florence_bt.mission_testing.mission_tester import MissionTester
    from florence_bt.mission_testing.mocks.board import Mock, MockError, SkillCall
    from florence_bt.mission_testing.mocks.scripts import MockReply, fail, never, raises, succeed
    from florence_bt.mission_testing.test_run import TestRun

__all__ = [
    "MissionTester",
    "Mock",
    "MockError",
    "MockReply",
    "SkillCall",
    "TestRun",
    "fail",
    "never",
    "raises",
    "succeed",
]

_HOMES = {
    **dict.fromkeys(("Mock", "MockError", "SkillCall"), "mocks.board"),
    **dict.fromkeys(("MockReply", "fail", "never", "raises", "succeed"), "mocks.scripts"),
    "MissionTester": "mission_tester",
    "TestRun": "test_run",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
