"""Skills that messages answer: a condition with its answers, changes and timers, and a wait for a message."""

import math
from types import SimpleNamespace

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.message_skills import SOURCE_LOOK_S, MessageCondition, MessageWait
from florence_bt.core.outcome import Outcome, failure, success
from florence_bt.core.serving import WaitBinding
from florence_bt.skills.speech.bindings import BINDINGS

(WAIT_FOR_ANSWER,) = (served for served in BINDINGS if isinstance(served, WaitBinding))


def judge(inputs, message):
    return success() if message >= inputs["least"] else failure("low", f"{message} is left")


@pytest.fixture
def clock():
    return ManualClock(100.0)


@pytest.fixture
def battery(clock):
    return MessageCondition(clock, "topic /battery", judge, 5.0)


def code(battery, least=3):
    return battery.start({"least": least}).poll().code


def test_the_last_message_is_judged_by_the_inputs(battery):
    assert code(battery) == "server_lost"
    battery.take(4)
    assert (code(battery), code(battery, least=5)) == ("ok", "low")
    battery.take("full")
    assert code(battery) == "bad_input"


def test_only_changes_of_the_answer_are_reported(battery):
    heard = []
    end = battery.watch({"least": 3}, lambda: heard.append(code(battery)))
    for message in (5, 4, 2, 1, 0, 3):
        battery.take(message)
    assert heard == ["ok", "low", "ok"]
    end()
    battery.take(0)
    assert heard == ["ok", "low", "ok"]


def test_silence_is_a_change_and_needs_no_timer_while_nobody_watches(battery, clock):
    battery.take(4)
    assert clock.next_time() is None
    heard = []
    end = battery.watch({"least": 3}, lambda: heard.append((clock.now(), code(battery))))
    clock.advance(3.0)
    battery.take(4)
    clock.advance(60.0)
    assert heard == [(108.0, "server_lost")] and clock.next_time() is None
    battery.take(4)
    assert heard[1:] == [(163.0, "ok")]
    end()
    end()
    assert clock.next_time() is None


def test_the_last_message_of_a_source_that_is_gone_does_not_count(clock):
    there = [True]
    station = MessageCondition(clock, "topic /station", judge, math.inf, lambda: there[0])
    station.take(4)
    clock.advance(3600.0)
    assert code(station) == "ok" and clock.next_time() is None
    heard = []
    end = station.watch({"least": 3}, lambda: heard.append(code(station)))
    there[0] = False
    assert code(station) == "server_lost"
    clock.advance(SOURCE_LOOK_S)
    there[0] = True
    clock.advance(SOURCE_LOOK_S)
    assert heard == ["server_lost", "ok"]
    end()
    assert clock.next_time() is None


def test_a_wait_for_a_source_that_is_not_there_or_goes_away_is_over(clock):
    there = [False]
    button = MessageWait(clock, "topic /button", WAIT_FOR_ANSWER, lambda: there[0], search_s=5.0)
    nobody = button.start({"time_limit": 3600.0})
    clock.advance(4.9)
    assert nobody.poll() is None
    clock.advance(0.1)
    assert nobody.poll().code == "server_lost"
    there[0] = True
    run, patient = button.start({"time_limit": 3600.0}), button.start({"time_limit": 3600.0})
    clock.advance(60.0)
    button.take(SimpleNamespace(data="pressed"))
    assert run.poll().code == patient.poll().code == "ok" and clock.next_time() is None
    lost = button.start({"time_limit": 3600.0})
    clock.advance(60.0)
    there[0] = False
    clock.advance(SOURCE_LOOK_S)
    assert lost.poll().code == "server_lost" and clock.next_time() is None


@pytest.fixture
def answers(clock):
    return MessageWait(clock, "topic answer", WAIT_FOR_ANSWER)


def test_a_wait_ends_with_the_first_message_that_comes_after_its_start(answers, clock):
    woken = []
    answers.take(SimpleNamespace(data="too early"))
    run = answers.start({"time_limit": 30.0})
    run.on_change(lambda: woken.append(run.poll()))
    clock.advance(29.0)
    assert run.poll() is None and run.feedback == "waiting for topic answer"
    answers.take(SimpleNamespace(data="yes"))
    answers.take(SimpleNamespace(data="no"))
    assert run.poll() == success(answer="yes") and woken == [success(answer="yes")]
    assert clock.next_time() is None


def test_an_answer_has_an_end(answers):
    run = answers.start({"time_limit": 30.0})
    answers.take(SimpleNamespace(data="no" * 1000))
    assert run.poll().outputs["answer"] == "no" * 100


def test_a_wait_without_a_message_fails_in_time(answers, clock):
    long, short = answers.start({"time_limit": 30.0}), answers.start({"time_limit": 2.0})
    clock.advance(2.0)
    assert long.poll() is None
    assert short.poll() == failure("no_answer", "nobody answered within 2 s")
    answers.take(SimpleNamespace(data="yes"))
    assert long.poll() == success(answer="yes") and short.poll().code == "no_answer"


def test_a_wait_that_is_cancelled_is_over_at_once(answers, clock):
    run = answers.start({"time_limit": 30.0})
    run.cancel()
    run.cancel()
    answers.take(SimpleNamespace(data="yes"))
    assert run.poll().outcome is Outcome.CANCELLED and clock.next_time() is None
