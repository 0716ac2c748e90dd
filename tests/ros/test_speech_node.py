"""The robot's voice over real ROS: programs that speak, hang and fail, and answers by the service."""

from __future__ import annotations

import shutil

import pytest

pytest.importorskip("rclpy")

from florence_interfaces.srv import AnswerQuestion, MissionStatus, RunMission, StopMission
from std_msgs.msg import String

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.core.errors import ConfigError
from florence_bt.core.message_skills import NOT_ASKED
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
BESIDE = """\
mission: beside
tree:
  parallel:
    - say: {text: Tea or coffee?}
    - wait_for_answer: {time_limit: 10 min, choices: [tea, coffee]}
"""


class Asking:
    """A mission server with a voice, and somebody who calls it."""

    def __init__(self, ros, folder):
        self.ros = ros
        missions = folder / "missions"
        missions.mkdir()
        (missions / "quiz.yaml").write_text(QUIZ)
        (missions / "beside.yaml").write_text(BESIDE)
        folders = {"mission_folders": (str(missions),), "runs_folder": str(folder / "runs")}
        ros.add(SpeechNode())
        ros.add(MissionNode(make_skills, collect_declarations(), parameters=folders))
        self.caller = ros.add(FlorenceNode("caller"))
        self.said = ""
        self.caller.create_subscription(String, "speaking", self._on_speaking, LATCHED)

    def _on_speaking(self, message):
        self.said = message.data

    def call(self, kind, name, **fields):
        client = self.caller.create_client(kind, f"florence_bt/{name}")
        self.ros.spin_until(client.service_is_ready)
        future = client.call_async(kind.Request(**fields))
        self.ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    def run(self, mission):
        assert self.call(RunMission, "run_mission", mission=mission).accepted

    def answer(self, text="", question=""):
        return self.call(AnswerQuestion, "answer", text=text, question=question)

    def question(self):
        """Wait for the question."""
        (asked,) = self.ros.spin_until(lambda: self.answer().questions, what="the question")
        return asked

    def end(self):
        """Wait for the end of the run."""
        ends = ("SUCCEEDED", "STOPPED")
        return self.ros.spin_until(lambda: (now := self.call(MissionStatus, "status")).state in ends and now)


@pytest.fixture
def asking(ros, tmp_path):
    return Asking(ros, tmp_path)


def test_the_answer_of_a_mission_comes_by_the_service(asking):
    assert not asking.answer().accepted and not asking.answer("yes").accepted
    assert not asking.answer("\x1b[2J").accepted and not asking.answer("yes", "\x1b[2J").accepted
    asking.run("quiz")
    asked = asking.question()
    assert (asked.text, list(asked.choices)) == ("Did you drink?", ["yes", "not yet"])
    assert asking.answer().message.splitlines() == ["open: 'Did you drink?'", "  yes", "  not yet"]
    told = asking.answer("Not yet.")
    assert told.accepted and not told.questions
    assert "not yet" in asking.end().tree


def test_what_the_robot_says_is_no_question(asking):
    asking.run("quiz")
    asking.ros.spin_until(lambda: asking.said == "Did you drink?", what="the sentence")
    told = asking.answer("yes")
    assert asking.said, "the robot still speaks"
    assert not told.accepted and not told.questions
    asked = asking.question()
    assert list(asked.choices) == ["yes", "not yet"] and not asking.said
    assert asking.call(MissionStatus, "status").state == "RUNNING", "what was typed early does not count"


def test_a_node_that_waits_beside_the_sentence_asks_while_the_robot_speaks(asking):
    asking.run("beside")
    asking.ros.spin_until(lambda: asking.question().text == "Tea or coffee?", what="the words")
    assert asking.said, "the robot still speaks"
    assert asking.answer("tea", asking.question().id).accepted
    assert asking.end().state == "SUCCEEDED"


def test_an_answer_belongs_to_the_question_that_it_was_given_to(asking):
    asking.run("quiz")
    before = asking.question()
    asking.call(StopMission, "stop")
    assert asking.end().state == "STOPPED"
    assert not asking.answer("yes", before.id).accepted and not asking.answer("yes").accepted
    asking.run("quiz")
    asked = asking.question()
    late = asking.answer("yes", before.id)
    assert not late.accepted and late.message == NOT_ASKED and late.questions == [asked]
    assert asking.answer("yes", asked.id).accepted and asking.end().state == "SUCCEEDED"
    assert not asking.answer("yes", asked.id).accepted, "it was answered"
