"""A recorded run in the terminal: forwards, backwards, to the failures, in 80x24 and without a terminal."""

from __future__ import annotations

import os
import pty
import select
import sys
import time

import pytest
from py_trees.common import Status

from florence_bt.app.runs.film import Film
from florence_bt.app.runs.film_screen import draw, film_lines, moved
from florence_bt.app.runs.recorded_mission import read_recorded_mission
from florence_bt.core.errors import ConfigError
from tests.recorded_runs import record_run, resumable_missions


@pytest.fixture
def film(tmp_path):
    """A run that was killed, went on, and failed."""
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    run, did = record_run(folder, runs, "goto_user", 3)
    assert "kill" in did and run.code == "tracker_failed"
    return Film(read_recorded_mission(runs, run.run_id))


def test_going_back_shows_what_going_forwards_has_shown(film):
    forwards = [film.frame(number) for number in range(len(film))]
    film._kept.clear()
    assert [film.frame(number) for number in reversed(range(len(film)))] == forwards[::-1]
    assert film.frame(-3) == forwards[0] and film.frame(10_000) == forwards[-1]


def test_a_frame_shows_tree_keys_and_time_as_they_were_then(film):
    begun, chosen = film.frame(0), film.frame(1)
    assert all(row.status is Status.INVALID for row in begun.rows)
    assert "/room" not in begun.keys and chosen.keys["/room"] and "/room" in chosen.changed
    running = [row.title for row in chosen.rows if row.status is Status.RUNNING]
    assert "get views" in running and chosen.tick == 1 and chosen.at == 0.0
    times = [film.frame(number).at for number in range(len(film))]
    assert times == sorted(times) and film.frame(len(film) - 1).rows[0].status is Status.FAILURE


def test_keys_lead_to_the_failures_and_to_both_ends(film):
    assert len(film.failures) >= 2
    places, at = [], 0
    for _ in film.failures:
        at = moved(film, at, "f")
        places.append(at)
    assert places == film.failures and moved(film, at, "f") == at
    assert moved(film, places[1], "F") == places[0] and moved(film, 0, "F") == 0
    assert moved(film, 3, "g") == 0 and moved(film, 3, "G") == len(film) - 1
    assert moved(film, 0, "left") == 0 and moved(film, 0, "right") == 1 and moved(film, 2, "x") == 2
    failed = film.frame(places[0])
    assert any("failure" in line for line in failed.happened)


@pytest.mark.parametrize(("columns", "lines"), [(80, 24), (60, 12), (200, 60)])
def test_every_step_fits_into_the_terminal(film, columns, lines):
    for number in range(len(film)):
        drawn = draw(film, number, columns, lines)
        assert len(drawn) == lines and all(line.cell_len <= columns for line in drawn)
        assert film.recorded.row.mission in drawn[0].plain


def test_without_a_terminal_the_steps_are_lines(film):
    text = "\n".join(film_lines(film))
    assert film.recorded.row.reason in text and "recovered" in text
    assert text.count("tick") >= len(film)


def test_a_mission_that_goes_another_way_is_shown_up_to_there(tmp_path):
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    run, _ = record_run(folder, runs, "goto_user", 3)
    whole = len(Film(read_recorded_mission(runs, run.run_id)))
    file = folder / "goto_user.yaml"
    file.write_text(
        file.read_text().replace("              - start_tracker:\n", "              - wait: 1 s\n")
    )
    film = Film(read_recorded_mission(runs, run.run_id, [folder]))
    assert 0 < len(film) < whole and "start" in film.ends_early
    assert film.ends_early in "\n".join(film_lines(film))


def test_a_mission_that_differs_at_once_is_refused(tmp_path):
    folder, runs = tmp_path / "missions", tmp_path / "runs"
    resumable_missions(folder)
    run, _ = record_run(folder, runs, "patrol", 2)
    file = folder / "patrol.yaml"
    file.write_text(file.read_text().replace("mission: patrol", "mission: patrol\nkeys: {a: {type: text}}"))
    recorded = read_recorded_mission(runs, run.run_id, [folder])
    object.__setattr__(recorded, "events", recorded.events[3:])
    with pytest.raises(ConfigError):
        Film(recorded)


def test_in_a_terminal_the_keys_work_and_q_leaves(film, tmp_path):
    words = [sys.executable, "-m", "florence_bt.cli", "replay", "--folder", str(tmp_path / "runs")]
    child, control = pty.fork()
    if child == 0:
        os.execve(words[0], words, {**os.environ, "TERM": "xterm", "COLUMNS": "80", "LINES": "24"})
    try:
        assert "step 1 of" in _shown(control, "step 1 of")
        os.write(control, b"G")
        assert f"step {len(film)} of" in _shown(control, f"step {len(film)} of")
        os.write(control, b"q")
        _shown(control, "no such text")
    finally:
        os.close(control)  # whoever is still there is told that the terminal is gone
        _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0


def _shown(control, wanted):
    """Read what a terminal shows until it shows something, or is left; for at most a minute."""
    text, give_up = "", time.monotonic() + 60.0
    while wanted not in text and time.monotonic() < give_up:
        if select.select([control], [], [], 0.5)[0]:
            try:
                text += os.read(control, 65536).decode(errors="replace")
            except OSError:  # it was left
                break
    return text
