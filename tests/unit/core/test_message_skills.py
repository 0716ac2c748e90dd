"""A condition that is answered from the last message: its answers, its changes, its timers."""

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.message_skills import MessageCondition
from florence_bt.core.outcome import failure, success


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
