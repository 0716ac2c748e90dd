"""Processes that work side by side for a tool."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context


def processes(jobs: int) -> ProcessPoolExecutor:
    """Make so many; each begins anew: a fork of a process with threads may wait for one that it has not."""
    return ProcessPoolExecutor(jobs, mp_context=get_context("spawn"))
