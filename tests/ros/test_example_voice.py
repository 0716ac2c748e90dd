"""The program of the tutorial that stands in for a loudspeaker and a button, as a process."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.core.outcome import success
from florence_bt.ros.node import FlorenceNode

pytestmark = pytest.mark.ros
PROGRAM = Path(__file__).parents[2] / "examples" / "missions" / "voice.py"


@pytest.fixture
def voice(ros, tmp_path):
    with (tmp_path / "output").open("w") as output:
        process = subprocess.Popen(
            [sys.executable, PROGRAM], stdin=subprocess.PIPE, stdout=output, stderr=output, text=True
        )
        yield process, tmp_path / "output"
        process.stdin.close()
        process.kill()
        process.wait()


def test_the_voice_shows_what_is_said_and_sends_what_is_typed(ros, voice):
    process, output = voice
    skills = make_skills(ros.add(FlorenceNode("missions")))
    ros.spin_until(lambda: skills["say"].server_is_there(), what="a listener")
    said = skills["say"].start({"text": "Here I am."})
    ros.spin_until(lambda: said.poll() and output.read_text(), what="the text")
    assert (said.poll(), output.read_text()) == (success(), "robot: Here I am.\n")

    ros.spin_until(skills["wait_for_answer"].server_is_there, what="the topic of the answers")
    waiting = skills["wait_for_answer"].start({"time_limit": 600.0})
    process.stdin.write("study\n")
    process.stdin.flush()
    ros.spin_until(waiting.poll, what="the answer")
    assert waiting.poll() == success(answer="study")

    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 0
    assert output.read_text() == "robot: Here I am.\n"
