"""A mission of the editor in the rig: what is to be seen, how it ends, and that it can be stopped."""

from __future__ import annotations

import asyncio
import json

import pytest

pytest.importorskip("mujoco")

from florence_page.editor import trial as trial_module
from florence_page.editor.helpers import Trials
from florence_page.editor.trial import Trial
from florence_page.editor.trial_request import TrialRequest

from florence_bt.core.errors import FlorenceError

WAITS = "mission: wait\ntree:\n  wait: 1 h\n"
TURN = "mission: spin\ninputs:\n  angle: {type: angle}\ntree:\n  turn: {angle: $angle}\n"


def play(tmp_path, **more):
    """Play a mission; give all that was shown, as it stands in the end, and the end."""
    shown = {}
    request = TrialRequest(name="spin", text=TURN, person="absent", inputs={"angle": "90 deg"}, **more)
    end = Trial(request, tmp_path).run(lambda parts: shown.update(json.loads(json.dumps(parts))))
    return shown, end


def test_a_run_shows_the_flat_the_robot_and_its_tree_and_tells_how_it_ended(tmp_path):
    shown, end = play(tmp_path)
    assert shown["map"]["size"][0] > 5.0 and shown["picture"]
    assert len(shown["scene"]["pose"]) == 3 and len(shown["scene"]["scan"]) > 50
    assert (shown["run"]["mission"], shown["run"]["state"]) == ("spin", "SUCCEEDED")
    assert shown["marks"]["statuses"] == "+" and shown["tree"][0][1] == -1
    assert end["status"] == "SUCCEEDED" and end["seconds"] > 1.0
    assert "spin" in end["journal"] and end["facts"] == ["The robot touched nothing."]


def test_what_a_mission_cannot_do_is_told(tmp_path):
    request = TrialRequest(name="spin", text=TURN, person="absent")
    with pytest.raises(FlorenceError, match="angle"):
        Trial(request, tmp_path).run(lambda parts: None)


def test_a_mission_that_does_not_end_is_stopped_after_half_an_hour_of_its_own_time(tmp_path, monkeypatch):
    assert trial_module.TRIAL_LIMIT_S == 30 * 60
    monkeypatch.setattr(trial_module, "TRIAL_LIMIT_S", 2.0)
    request = TrialRequest(name="wait", text=WAITS, person="absent")
    end = Trial(request, tmp_path).run(lambda parts: None)
    assert end["status"] == "STOPPED" and 2.0 <= end["seconds"] < 4.0
    assert "not over after 2 s" in end["journal"]


def test_one_mission_at_a_time_and_it_can_be_stopped():
    async def go():
        trials = Trials()
        request = TrialRequest(name="wait", text=WAITS, person="absent", speed=1.0)
        await trials.start(request)
        with pytest.raises(FlorenceError, match="already"):
            await trials.start(request)
        while not trials.seen and trials.running:
            await asyncio.sleep(0.05)
        await trials.stop()
        await trials.close()
        return trials

    trials = asyncio.run(go())
    assert trials.last["status"] == "STOPPED" and not trials.running
    assert trials.picture.startswith(b"\x89PNG")
