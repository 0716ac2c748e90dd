"""Sweeps in the rig: the same rows wherever they are run, going on after an end, and what is told."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from florence_sweep.experiment import Case, Experiment, load_experiment
from florence_sweep.outcome import NOT_RUN, Outcome
from florence_sweep.running import run_case
from florence_sweep.store import Results
from florence_sweep.workers import by_dask, by_processes
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, NOT_THERE, OK, USAGE
from florence_bt.core.errors import FlorenceError

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("sweep")]

EXPERIMENT = """
mission: goto_room
inputs: {room: kitchen}
home: flat
people: nobody
runs: 3
seed: 40
limit: 8 s
good: [untouched]
vary:
  links:
    perfect: {}
    late: {links: {/tf: {delay: 0.1 s}}}
  sensors:
    usual: {}
    slips: {sensors: {base: {slip_sigma: 0.02}}}
"""


@pytest.fixture
def experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Experiment:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rounds.yaml").write_text(EXPERIMENT)
    return load_experiment(tmp_path / "rounds.yaml")


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The rows of the experiment, by one process."""
    file = tmp_path_factory.mktemp("rows") / "rounds.yaml"
    file.write_text(EXPERIMENT)
    return in_order(by_processes(load_experiment(file).cases(), 1))


def in_order(outcomes: Iterator[Outcome]) -> list[str]:
    return [each.without_wall() for each in sorted(outcomes, key=lambda each: each.number)]


def test_rows_are_runs_and_what_varies_makes_a_difference(rows: list[str]) -> None:
    assert len(rows) == 12 and all('"status": "STOPPED"' in row for row in rows)
    # Three seeds, with wheels that slip and without: what is late is not noticed in eight seconds.
    assert len({row.partition('"seed"')[2] for row in rows}) >= 6


def test_two_processes_give_the_same_rows_as_one_bit_for_bit(experiment: Experiment, rows: list[str]) -> None:
    assert in_order(by_processes(experiment.cases(), 2)) == rows


WORKER = "--nthreads", "1", "--no-nanny", "--no-dashboard"


class Cluster:
    """A scheduler of Dask and two workers, each a process of its own."""

    def __init__(self, folder: Path) -> None:
        self.address_file = folder / "scheduler.json"
        self.children = [
            self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"),
            *(
                self._start("dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard")
                for _ in range(2)
            ),
        ]

    def _start(self, program: str, *words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{program}", *words]
        return subprocess.Popen(
            [*command, "--scheduler-file", str(self.address_file)],
            cwd=self.address_file.parent,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    @property
    def address(self) -> str:
        from distributed import Client

        while not self.address_file.exists():
            assert self.children[0].poll() is None
            time.sleep(0.1)
        with Client(scheduler_file=str(self.address_file), set_as_default=False) as client:
            client.wait_for_workers(2)
            return str(client.scheduler.address)

    def kill_a_worker(self) -> None:
        self.children[1].send_signal(signal.SIGKILL)

    def close(self) -> None:
        for child in reversed(self.children):
            child.kill()
            child.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    started = Cluster(tmp_path)
    yield started
    started.close()


def test_dask_gives_the_same_rows_though_a_worker_is_killed_in_the_middle(
    experiment: Experiment, rows: list[str], cluster: Cluster
) -> None:
    found = []
    for outcome in by_dask(experiment.cases(), cluster.address):
        found.append(outcome)
        if len(found) == 3:
            cluster.kill_a_worker()
    assert in_order(iter(found)) == rows


def test_an_address_at_which_nobody_answers_is_told(
    experiment: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("florence_sweep.workers._CONNECT_S", 0.5)
    with pytest.raises(FlorenceError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1"):
        list(by_dask(experiment.cases(), "tcp://127.0.0.1:1"))


# ---- the command ---------------------------------------------------------------------------------------


def test_a_sweep_that_was_ended_goes_on_where_it_was(experiment: Experiment, rows: list[str]) -> None:
    results = Results.of(experiment, Path("sweeps/rounds.sqlite"))
    for case in [*experiment.cases()][:5]:
        results.add(run_case(case))
    done = CliRunner().invoke(app, ["sweep", "rounds.yaml", "--jobs", "2"])
    assert done.exit_code == OK, done.output
    assert "5 of 12 runs are there" in done.output and "[12/12]" in done.output
    assert in_order(iter(results.outcomes())) == rows


def test_the_interrupt_key_ends_a_sweep_and_what_was_done_is_kept(experiment: Experiment) -> None:
    program = [sys.executable, "-m", "florence_bt.cli", "sweep", "rounds.yaml", "--jobs", "1"]
    child = subprocess.Popen(program, stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert child.stdout is not None
    assert "[1/12]" in child.stdout.readline()
    os.killpg(child.pid, signal.SIGINT)
    child.communicate()
    assert child.returncode == 130
    assert 1 <= len(Results(Path("sweeps/rounds.sqlite")).outcomes()) < 12


def test_a_page_shows_the_worst_runs_with_the_command_that_runs_them_again(experiment: Experiment) -> None:
    text = EXPERIMENT.replace("good: [untouched]", "").partition("vary:")[0].replace("runs: 3", "runs: 2")
    Path("short.yaml").write_text(text)
    done = CliRunner().invoke(app, ["sweep", "short.yaml", "--jobs", "1", "--html", "short.html"])
    assert done.exit_code == OK, done.output
    page = Path("short.html").read_text()
    assert "florence sweep sweeps/short.sqlite --case 1" in page and page.count("data:image/png;base64") == 2
    again = CliRunner().invoke(app, ["sweep", "sweeps/short.sqlite", "--case", "1"])
    assert again.exit_code == FAILED and Path("sweeps/short_1.png").stat().st_size > 10_000
    of_results = CliRunner().invoke(app, ["sweep", "sweeps/short.sqlite", "--beside", "sweeps/short.sqlite"])
    assert of_results.exit_code == OK and "only second" in of_results.output


@pytest.mark.parametrize(
    ("words", "told", "code"),
    [
        (["goto_usr"], "goto_user", USAGE),
        (["goto_user", "--vary", "people"], "people=sitting", USAGE),
        (["none.yaml"], "none.yaml", USAGE),
        (["none.sqlite"], "there is no such file", USAGE),
        (["rounds.yaml", "--case", "99"], "0 to 11", USAGE),
        (["rounds.yaml", "--vary", "people=lying"], "in the file", USAGE),
        (["rounds.yaml", "--dask", "tcp://127.0.0.1:1"], "no Dask scheduler answers", NOT_THERE),
    ],
)
def test_what_cannot_be_swept_is_told_before_anything_runs(
    words: list[str], told: str, code: int, experiment: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("florence_sweep.workers._CONNECT_S", 0.5)
    done = CliRunner().invoke(app, ["sweep", *words])
    assert done.exit_code == code and told in done.output, done.output


# ---- one case ------------------------------------------------------------------------------------------


def case_of(text: str) -> Case:
    Path("one.yaml").write_text(text)
    return next(load_experiment(Path("one.yaml")).cases())


FAULT = """
mission: goto_room
inputs: {room: kitchen}
home: flat
people: nobody
limit: 60 s
faults: [{skill: go_to_hotspot, code: no_route}]
"""


def test_a_skill_fails_as_the_experiment_says(experiment: Experiment) -> None:
    failing = FAULT.replace("go_to_hotspot", "navigate_to").replace("no_route", "blocked")
    outcome = run_case(case_of(failing))
    assert outcome.status == "FAILED" and "fails in this experiment" in outcome.reason
    later = failing.replace("}]", ", from: 5 min}]")
    assert run_case(case_of(later)).status == "SUCCEEDED"


def test_a_home_without_such_a_room_is_no_run(experiment: Experiment) -> None:
    outcome = run_case(case_of(FAULT.partition("faults")[0].replace("nobody", "cellar")))
    assert outcome.status == NOT_RUN and "cellar" in outcome.reason and not outcome.good
