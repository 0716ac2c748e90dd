"""The script that runs goto_user beside busy loops: its report, and that it leaves nothing behind."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "tools" / "safety_campaign" / "busy.py"


@pytest.fixture
def busy(monkeypatch):
    spec = importlib.util.spec_from_file_location("busy", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "busy", module)
    spec.loader.exec_module(module)
    return module


def test_the_report_counts_and_names_what_failed(busy, monkeypatch, tmp_path, capsys):
    reasons = {5: "", 6: "no_image: 0 usable images", 7: ""}
    monkeypatch.setattr(
        busy,
        "run_demo",
        lambda seed, folder: busy.BusyRun(seed, not reasons[seed], reasons[seed], 1.0, folder),
    )
    report = busy.goto_user_beside_load(3, 5, loops=0, folder=tmp_path)
    assert [run.seed for run in report.runs] == [5, 6, 7] and report.succeeded == 2
    assert report.text() == "2 of 3 goto_user runs beside 0 busy loops succeeded"
    printed = capsys.readouterr().out
    assert "seed 6: failed: no_image" in printed and str(tmp_path / "6") in printed


def test_the_loops_end_with_the_block(busy, monkeypatch):
    started = []
    popen = busy.subprocess.Popen

    def start(*arguments, **options):
        started.append(popen(*arguments, **options))
        return started[-1]

    monkeypatch.setattr(busy.subprocess, "Popen", start)
    with pytest.raises(KeyboardInterrupt), busy.busy_loops(2, 60.0):
        assert all(loop.poll() is None for loop in started) and len(started) == 2
        raise KeyboardInterrupt
    assert all(loop.returncode is not None for loop in started)


def test_a_run_that_takes_too_long_is_ended_and_has_failed(busy, monkeypatch, tmp_path):
    monkeypatch.setattr(busy, "RUN_LIMIT_S", 0.1)
    monkeypatch.setattr(
        busy, "demo_command", lambda *_: [sys.executable, "-c", "import time; time.sleep(600)"]
    )
    run = busy.run_demo(3, tmp_path)
    assert not run.succeeded and run.reason == "not over after 0 s"


@pytest.mark.parametrize(
    ("program", "result", "reason"),
    [
        ("print('error: no robot'); raise SystemExit(3)", None, "error: no robot"),
        ("raise SystemExit(1)", {"code": "no_path", "reason": "no way"}, "no_path: no way"),
        ("", None, ""),
    ],
)
def test_the_reason_is_that_of_the_mission_or_the_last_line(
    busy, monkeypatch, tmp_path, program, result, reason
):
    monkeypatch.setattr(busy, "demo_command", lambda *_: [sys.executable, "-c", program])
    if result is not None:
        folder = tmp_path / "demo" / "runs" / "one"
        folder.mkdir(parents=True)
        (folder / "result.json").write_text(json.dumps(result))
    run = busy.run_demo(3, tmp_path)
    assert (run.reason, run.succeeded) == (reason, not reason)
