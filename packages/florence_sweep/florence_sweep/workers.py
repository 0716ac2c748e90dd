"""Who does the runs: processes of this machine, or the workers of a Dask cluster, with the same outcomes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.installation import how_to_get
from florence_sweep.experiment import Case
from florence_sweep.outcome import BROKEN, Outcome
from florence_sweep.running import run_case, without_run
from florence_sweep.store import code_version

Work = Callable[[Case], Outcome]
_AHEAD = 2
"""So many cases for each process or thread are handed out at a time."""
_TRIES = 2
"""So often a case is tried alone whose process has died."""
_CONNECT_S = 10.0
"""Wall seconds in which a Dask scheduler must answer."""


def by_processes(cases: Iterable[Case], jobs: int, work: Work = run_case) -> Iterator[Outcome]:
    """Run cases side by side, and yield each outcome when it is there.

    A process that dies takes no other run along: those that were waiting or running are run again, each in a
    process of its own; one whose process dies each time is :data:`~florence_sweep.outcome.BROKEN`.

    Args:
        cases: What is run.
        jobs: How many processes.
        work: Runs one.
    """
    left = iter(cases)
    while lost := (yield from _side_by_side(left, jobs, work)):
        for case in lost:
            yield _alone(case, work)


def _side_by_side(left: Iterator[Case], jobs: int, work: Work) -> Generator[Outcome, None, list[Case]]:
    """Run cases until all are done, or a process has died; return those that were lost with it."""
    running: dict[Future[Outcome], Case] = {}
    pool = _pool(jobs)
    try:
        while True:
            for case in itertools.islice(left, _AHEAD * jobs - len(running)):
                running[pool.submit(work, case)] = case
            if not running:
                return []
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                outcome = future.result()
                del running[future]
                yield outcome
    except BrokenProcessPool:
        return list(running.values())
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _alone(case: Case, work: Work) -> Outcome:
    for _ in range(_TRIES):
        pool = _pool(1)
        try:
            return pool.submit(work, case).result()
        except BrokenProcessPool:
            continue
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return without_run(case, BROKEN, "the process that runs it dies each time")


def _pool(jobs: int) -> ProcessPoolExecutor:
    # Each begins anew: a fork of a process with threads may wait for one that it has not.
    return ProcessPoolExecutor(jobs, mp_context=get_context("spawn"))


def by_dask(cases: Iterable[Case], address: str, work: Work = run_case) -> Iterator[Outcome]:
    """Run cases on the workers of a Dask cluster, and yield each outcome when it is there.

    A worker that dies takes no run along: Dask gives its runs to another one.

    Args:
        cases: What is run.
        address: Of the scheduler, such as ``tcp://10.0.0.1:8786``.
        work: Runs one.

    Raises:
        ConfigError: Dask is not installed.
        FlorenceError: Nobody answers at that address, or a worker has other code than this machine.
    """
    try:
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker
    except ModuleNotFoundError as error:
        raise ConfigError("--dask needs distributed", valid=[how_to_get("distributed")]) from error
    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise FlorenceError(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        _refuse_other_code(client)
        left = iter(cases)
        running: dict[Any, Case] = {}

        def hand_out(count: int) -> list[Any]:
            fresh = {
                client.submit(work, case, pure=False, retries=_TRIES): case
                for case in itertools.islice(left, count)
            }
            running.update(fresh)
            return list(fresh)

        first = hand_out(_AHEAD * max(sum(client.nthreads().values()), 1))
        done = as_completed(first, loop=client.loop)
        for future in done:
            case = running.pop(future)
            try:
                outcome = future.result()
            except KilledWorker:
                outcome = without_run(case, BROKEN, "the worker that runs it dies each time")
            done.update(hand_out(1))
            yield outcome


def _refuse_other_code(client: Any) -> None:
    """Refuse workers whose outcomes would not be those of this machine."""
    here = code_version()
    for worker, there in client.run(code_version).items():
        if there != here:
            raise FlorenceError(f"the Dask worker {worker} has another Florence ({there}, here {here})")
