"""Sweeps over seeds and generated inputs: a fixed part is in every run, all of it in ``make test-all``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings


def sweep(values: Iterable[Any], *, every: int) -> list[Any]:
    """Return parameters of which only each ``every``-th, from the first on, is without the mark ``sweep``."""
    return [
        value if number % every == 0 else pytest.param(*_parts(value), marks=pytest.mark.sweep)
        for number, value in enumerate(values)
    ]


def examples(number: int) -> int:
    """Return how many examples of hypothesis a test tries that has a number of them in ``make test-all``."""
    return max(min(number, FEWEST), number * settings.default.max_examples // ALL_EXAMPLES)


ALL_EXAMPLES = 100
"""Of a test without a number of its own, in ``make test-all``."""
FEWEST = 25


def _parts(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)
