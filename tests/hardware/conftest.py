"""Tests of real devices: ``pytest tests/hardware --device create=/dev/ttyUSB0 --may-drive``.

Without ``--device`` the same tests run against the emulators. ``tests/conftest.py`` declares the options.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest


@pytest.fixture(scope="session")
def device_path(request: pytest.FixtureRequest) -> Callable[..., tuple[str, str] | None]:
    """Gives kind and path of the device that was named for one of some kinds; None for the emulator."""

    def find(*kinds: str) -> tuple[str, str] | None:
        for text in request.config.getoption("--device"):
            kind, equals, path = text.partition("=")
            if not equals:
                raise pytest.UsageError(f"--device {text}: write KIND=PATH, such as {kinds[0]}={text}")
            if kind in kinds:
                return kind, path
        return None

    return find


@pytest.fixture(scope="session")
def may_drive(request: pytest.FixtureRequest) -> bool:
    """Whether a real robot may move."""
    return bool(request.config.getoption("--may-drive"))
