"""The skill without a robot: on a clock that is moved by hand."""

import pytest
from florence_greeter.greeting import UnknownLanguage, greeting
from florence_greeter.skills import GREET_USER, GreetUser

from florence_bt.core.clock import ManualClock


def start(**inputs):
    said, clock = [], ManualClock()
    return GreetUser(said.append, clock).start(GREET_USER.complete(inputs)), said, clock


def test_words():
    assert greeting("Ana") == "Hello, Ana!"
    assert greeting("", "de", evening=True) == "Gute Nacht!"
    with pytest.raises(UnknownLanguage, match="only in de, en, es"):
        greeting("Ana", "fr")


def test_it_is_done_when_it_has_been_spoken():
    run, said, clock = start(name="Ana", language="es")
    assert (said, run.poll(), run.feedback) == (["Hola, Ana!"], None, "speaking")
    clock.advance(1.0)
    assert run.poll().outputs == {"words": "Hola, Ana!"}


def test_a_cancel_ends_it_at_once():
    run, said, clock = start(name="Ana")
    run.cancel()
    assert (run.poll().code, said[-1]) == ("cancelled", "")
    clock.advance(5.0)
    assert run.poll().code == "cancelled"


def test_an_unknown_language_is_a_failure_with_a_reason():
    run, said, _ = start(name="Ana", language="fr")
    assert (run.poll().code, said) == ("unknown_language", [])


def test_the_mission(florence):
    """The fixture comes with Florence; see its docs/manual/testing.md."""
    florence.mock("get_hotspot", "SUCCESS (pose=(4 m, 5 m, 30 deg))")
    florence.mock("navigate_to", "running 10 s, then SUCCESS")
    florence.mock("*_tracker", "SUCCESS")
    florence.mock("look_for_user", "SUCCESS (user=(3 m, 2 m, 0 deg), distance=2 m, user_id=7)")
    florence.mock("greet_user", 'running 1 s, then SUCCESS (words="Hola!")')
    florence.run("welcome_user", room="kitchen", language="es").assert_succeeded(words="Hola!")
