"""The robot's voice over real ROS: programs that speak, hang and fail, and answers by the service."""

from __future__ import annotations

import shutil

import pytest

pytest.importorskip("rclpy")

from florence_interfaces.srv import AnswerQuestion, MissionStatus, RunMission
from std_msgs.msg import String

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Outcome, success
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.runtime.node import MissionNode
from florence_bt.skills.speech.node import SpeechNode
from florence_bt.skills.speech.voice import LONGEST_TEXT
from florence_bt.trees.language.declarations import collect_declarations

pytestmark = pytest.mark.ros
SENTENCE = {"text": "Please drink\nsomething."}


class Bench:
    """A voice, the skills of a mission server, and a listener."""

    def __init__(self, ros, program):
        self.ros = ros
        self.voice = ros.add(SpeechNode(parameters={"program": program}))
        self.skills = make_skills(ros.add(FlorenceNode("skills")))
        self.listener = ros.add(FlorenceNode("listener"))
        self.speaking = []
        self.listener.create_subscription(
            String, "speaking", lambda message: self.speaking.append(message.data), LATCHED
        )
        ros.spin_until(self.skills["say"].server_is_there, what="the voice")

    def say(self, inputs=SENTENCE):
        return self.skills["say"].start(inputs)

    def result_of(self, run):
        self.ros.spin_until(run.poll, what="the end of the sentence")
        return run.poll()


def test_a_program_reads_the_sentence_and_the_skill_ends_with_it(ros, tmp_path):
    heard = tmp_path / "heard"
    bench = Bench(ros, f"sh -c 'cat > {heard}'")
    ros.spin_until(lambda: bench.speaking == [""], what="silence, whatever an earlier node has left")
    assert bench.result_of(bench.say()) == success()
    assert heard.read_text() == "Please drink something.\n"
    said = ["", "Please drink something.", ""]
    ros.spin_until(lambda: bench.speaking == said, what="the end of the sentence")


def test_a_stop_ends_the_sentence_and_all_its_processes(ros, tmp_path):
    begun, ended = tmp_path / "begun", tmp_path / "ended"
    bench = Bench(ros, f"sh -c 'cat > {begun}; sleep 600 | cat; touch {ended}'")
    run = bench.say()
    ros.spin_until(lambda: begun.exists() and "Please drink something." in run.feedback, what="the sentence")
    run.cancel()
    assert bench.result_of(run).outcome is Outcome.CANCELLED
    ros.spin_until(lambda: bench.speaking[-2:] == ["Please drink something.", ""], what="silence")
    assert not ended.exists()
    again = bench.say({"text": "Again."})
    ros.spin_until(lambda: begun.read_text() == "Again.\n", what="the next sentence")
    again.cancel()
    bench.result_of(again)


def test_what_a_program_complains_of_is_the_reason(ros):
    bench = Bench(ros, "sh -c 'echo no sound card >&2; exit 3'")
    result = bench.result_of(bench.say())
    assert (result.code, result.reason) == ("not_said", "sh ended with 3: no sound card")
    bench.result_of(bench.say())


@pytest.mark.parametrize("text", [" \n", "x" * (LONGEST_TEXT + 1)])
def test_what_cannot_be_said_is_refused(ros, text):
    bench = Bench(ros, "print")
    assert bench.result_of(bench.say({"text": text})).code == "rejected"


def test_a_program_that_is_not_installed_is_told_at_the_start(ros):
    with pytest.raises(ConfigError, match="espeak-nq"):
        SpeechNode(parameters={"program": "espeak-nq -v de"})


@pytest.mark.skipif(shutil.which("espeak-ng") is None, reason="apt install espeak-ng")
def test_espeak_speaks(ros, tmp_path):
    sound = tmp_path / "sound.wav"
    bench = Bench(ros, f"espeak-ng -v de -w {sound}")
    assert bench.result_of(bench.say()) == success()
    assert sound.read_bytes()[:4] == b"RIFF" and sound.stat().st_size > 20_000


QUIZ = """\
mission: quiz
outputs: {answer: {type: text, description: what came}}
tree:
  sequence:
    - say: {text: Did you drink?}
    - wait_for_answer: {time_limit: 10 min, choices: [yes, not yet]}
      out: {answer: answer}
"""


def test_the_answer_of_a_mission_comes_by_the_service(ros, tmp_path):
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "quiz.yaml").write_text(QUIZ)
    folders = {"mission_folders": (str(tmp_path / "missions"),), "runs_folder": str(tmp_path / "runs")}
    ros.add(SpeechNode())
    ros.add(MissionNode(make_skills, collect_declarations(), parameters=folders))
    caller = ros.add(FlorenceNode("caller"))

    def call(kind, name, **fields):
        client = caller.create_client(kind, f"florence_bt/{name}")
        ros.spin_until(client.service_is_ready)
        future = client.call_async(kind.Request(**fields))
        ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    assert not call(AnswerQuestion, "answer").accepted
    assert not call(AnswerQuestion, "answer", text="yes").accepted
    assert not call(AnswerQuestion, "answer", text="\x1b[2J").accepted
    call(RunMission, "run_mission", mission="quiz")
    question = ros.spin_until(lambda: (said := call(AnswerQuestion, "answer")).accepted and said)
    assert "Did you drink?" in question.message
    assert call(AnswerQuestion, "answer", text="yes").accepted, "also while the robot still speaks"
    end = ros.spin_until(lambda: (now := call(MissionStatus, "status")).state == "SUCCEEDED" and now)
    assert "yes" in end.tree
    assert not call(AnswerQuestion, "answer", text="no").accepted
    call(RunMission, "run_mission", mission="quiz")
    told = ros.spin_until(
        lambda: (said := call(AnswerQuestion, "answer").message.splitlines())[1:] and said,
        what="the answers that the mission names",
    )
    assert "Did you drink?" in told[0] and told[1:] == ["  yes", "  not yet"]
