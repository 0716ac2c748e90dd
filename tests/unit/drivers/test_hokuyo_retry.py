"""How long a sensor in trouble may go on, how long the pauses are, and conversations at their deadlines."""

from __future__ import annotations

from florence_bt.core.errors import CommandRejected, DeviceError, DeviceTimeout
from florence_bt.drivers.hokuyo.codec import ScipReply
from florence_bt.drivers.hokuyo.conversation import Answer, Ask, Conversation, Listen, Retune, Script
from florence_bt.drivers.hokuyo.retry_policy import RetryPolicy


def test_pauses_double_up_to_ten_times_until_the_sensor_has_worked_as_long() -> None:
    policy = RetryPolicy(2.0, 5.0)
    assert (policy.failures, policy.pause_s) == (0, 0.0)
    assert [policy.fail() for _ in range(7)] == [2.0, 4.0, 8.0, 16.0, 20.0, 20.0, 20.0]
    assert policy.failures == 7
    policy.begin()
    policy.scan(100.0)
    policy.scan(119.9)
    assert policy.failures == 7
    policy.scan(120.0)
    assert policy.failures == 0
    assert (policy.fail(), policy.failures) == (2.0, 1)
    policy.begin()
    policy.scan(200.0)
    policy.begin()
    policy.scan(202.0)
    assert policy.failures == 1, "a stream that begins anew works from then on"
    policy.scan(204.0)
    assert policy.failures == 0
    policy.fail()
    policy.reset_failures()
    assert policy.failures == 0


def test_the_time_of_a_check_counts_from_the_first_word_of_it() -> None:
    policy = RetryPolicy(1.0, 5.0)
    assert policy.limit(99.0) == 99.0
    assert policy.interrupt("status 21", 10.0)
    assert not policy.interrupt("status 22", 13.0), "it is told once"
    assert policy.why == "status 21"
    assert policy.limit(14.0) == 14.0
    assert policy.limit(99.0) == 15.0
    policy.scan(14.0)
    assert (policy.why, policy.limit(99.0)) == ("", 99.0)
    assert policy.interrupt("status 98", 20.0), "it is a new one"
    assert policy.limit(99.0) == 25.0
    policy.fail()
    assert (policy.why, policy.limit(99.0)) == ("", 99.0)
    policy.interrupt("status 21", 30.0)
    policy.begin()
    assert (policy.why, policy.limit(99.0)) == ("", 99.0)


def asks(*steps: Ask | Listen | Retune, answers: list[Answer] | None = None) -> Script:
    for step in steps:
        answer = yield step
        if answers is not None and answer is not None:
            answers.append(answer)
    return "done"


def reply(echo: str, status: str = "00") -> ScipReply:
    return ScipReply(echo, status)


def test_a_question_is_asked_as_often_as_it_may_one_time_out_apart() -> None:
    talk = Conversation(asks(Ask("QT", attempts=2)), 1.0, 10.0)
    assert (talk.take_bytes(), talk.take_bytes(), talk.deadline) == (b"QT\n", b"", 11.0)
    talk.poll(10.9)
    assert talk.take_bytes() == b""
    talk.poll(11.0)
    assert (talk.take_bytes(), talk.deadline, talk.done) == (b"QT\n", 12.0, False)
    talk.poll(12.0)
    assert (talk.done, talk.deadline, talk.answered) == (True, None, False)
    assert isinstance(talk.error, DeviceTimeout) and "no answer to QT" in str(talk.error)


def test_an_answer_leads_on_with_the_times_of_question_and_answer() -> None:
    answers: list[Answer] = []
    talk = Conversation(asks(Ask("TM0", ("00", "02")), Ask("TM1"), answers=answers), 1.0, 0.0)
    talk.poll(1.0)
    talk.receive(reply("TM1"), 1.1)
    assert (answers, talk.answered) == ([], True)
    talk.receive(reply("TM0", "02"), 1.2)
    talk.receive(reply("TM1"), 1.5)
    assert [(each.reply.echo, each.sent, each.arrived) for each in answers] == [
        ("TM0", 1.0, 1.2),
        ("TM1", 1.2, 1.5),
    ]
    assert (talk.done, talk.result, talk.error) == (True, "done", None)
    assert talk.take_bytes() == b"TM0\nTM0\nTM1\n"


def test_a_refusal_is_asked_about_again_and_raised_when_all_attempts_are_used_up() -> None:
    talk = Conversation(asks(Ask("BM", attempts=2)), 1.0, 0.0)
    talk.receive(reply("BM", "01"), 0.1)
    assert not talk.done, "it may be ready at the next attempt"
    talk.poll(1.0)
    talk.receive(reply("BM", "01"), 1.1)
    assert talk.done
    assert isinstance(talk.error, CommandRejected) and "the laser cannot be switched on" in str(talk.error)


def test_silence_after_a_refusal_is_silence() -> None:
    """What was said to the first attempt is old when the second one is not answered at all."""
    talk = Conversation(asks(Ask("BM", attempts=2)), 1.0, 0.0)
    talk.receive(reply("BM", "01"), 0.1)
    talk.poll(1.0)
    talk.poll(2.0)
    assert isinstance(talk.error, DeviceTimeout) and "no answer to BM" in str(talk.error)


def test_a_listener_takes_what_begins_as_it_wants_but_what_it_ignores() -> None:
    answers: list[Answer] = []
    script = asks(Listen("MD", 3.0, ("00", "98")), Listen("GD"), answers=answers)
    talk = Conversation(script, 1.0, 0.0)
    assert (talk.take_bytes(), talk.deadline) == (b"", 3.0)
    for number, (echo, status) in enumerate((("MD0044", "00"), ("MD0044", "98"), ("GD0044", "99"))):
        talk.receive(reply(echo, status), 0.1 * number)
    assert answers == []
    talk.receive(reply("MD0044", "99"), 0.5)
    assert [each.reply.status for each in answers] == ["99"]
    assert talk.deadline == 1.5, "the time-out of replies, where the script names none"
    talk.poll(1.4)
    assert not talk.done
    talk.poll(1.5)
    assert isinstance(talk.error, DeviceTimeout) and "no scan arrived in time" in str(talk.error)


def test_another_speed_costs_a_line_feed_and_no_time() -> None:
    talk = Conversation(asks(Retune(19200), Retune(115200), Ask("VV")), 1.0, 0.0)
    assert (talk.bit_rate, talk.take_bytes(), talk.deadline) == (115200, b"\n\nVV\n", 1.0)
    assert Conversation(asks(Ask("VV")), 1.0, 0.0).bit_rate is None


def test_a_script_may_catch_a_failure_and_one_that_is_closed_says_no_more() -> None:
    def patient() -> Script:
        try:
            yield Ask("VV", attempts=1)
        except DeviceTimeout:
            yield Ask("QT", attempts=1)
        raise DeviceError("enough")

    talk = Conversation(patient(), 1.0, 0.0)
    talk.take_bytes()
    talk.poll(1.0)
    assert (talk.take_bytes(), talk.deadline) == (b"QT\n", 2.0)
    talk.receive(reply("QT"), 1.5)
    assert (talk.done, str(talk.error)) == (True, "enough")

    talk = Conversation(asks(Ask("VV")), 1.0, 0.0)
    talk.close()
    talk.receive(reply("VV"), 0.1)
    talk.poll(9.0)
    assert (talk.done, talk.deadline, talk.take_bytes(), talk.error) == (True, None, b"", None)
