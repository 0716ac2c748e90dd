"""Assertions on a play that do not hold, and wrong ones."""

import pytest

from florence_bt.core.errors import ConfigError

FAILING = [
    (lambda play: play.assert_failed(), "is SUCCEEDED, not FAILED"),
    (lambda play: play.assert_status("STOPPED"), "is SUCCEEDED, not STOPPED"),
    (lambda play: play.assert_why(code="no_path"), "the code is 'ok', not 'no_path'"),
    (lambda play: play.assert_why(reason="door"), "does not contain 'door'"),
    (lambda play: play.assert_why(leaf="navigate_to"), "not 'navigate_to' but nothing"),
    (lambda play: play.assert_succeeded(user="(3 m, 2 m, 1 deg)"), "the output user is"),
    (lambda play: play.assert_succeeded(usr="(3 m, 2 m, 1 deg)"), "no output 'usr'"),
    (lambda play: play.assert_keys({"room": "hall"}), "the key room is kitchen, not hall"),
    (lambda play: play.assert_called("navigate_to", times=2), "was started once, not twice"),
    (lambda play: play.assert_called("navigate_to", goal="(0 m, 0 m, 0 deg)"), "started never (once in all)"),
    (lambda play: play.assert_not_called("navigate_to"), "was started once, not never"),
    (lambda play: play.assert_called("turn"), "was started never, not at least once"),
    (lambda play: play.assert_order("navigate_to", "get_hotspot"), "was not called after navigate_to"),
    (lambda play: play.assert_calls(["get_hotspot"], only=True), "a further call came"),
    (lambda play: play.assert_calls(["navigate_to"], only=True), "as number 1, but 0 s  get_hotspot"),
    (lambda play: play.assert_trace("0 s  get_hotspot: FAILURE"), "the trace differs"),
    (lambda play: play.assert_tree("[+] greet"), "the tree differs"),
    (lambda play: play.assert_duration("10 s"), "took 11 s, not 10 s"),
    (lambda play: play.assert_duration("10 s", at_most=True), "not at most 10 s"),
]


@pytest.mark.parametrize(("assertion", "says"), FAILING)
def test_an_assertion_that_does_not_hold_shows_the_tree_and_the_calls(stage, assertion, says):
    play = stage.run("greet")
    with pytest.raises(AssertionError) as caught:
        assertion(play)
    text = str(caught.value)
    assert says in text.splitlines()[0]
    assert "[+] greet (sequence)" in text
    assert "10 s  look_for_user(window=2 s, user_id=0, x=0 m, y=0 m): ok after 1 s" in text


@pytest.mark.parametrize(
    "assertion",
    [
        lambda play: play.assert_called("navigat_to"),
        lambda play: play.assert_why(leaf="navigat_to"),
        lambda play: play.assert_called("navigate_to", gaol="(0 m, 0 m, 0 deg)"),
        lambda play: play.assert_called("navigate_to", goal="3 m"),
        lambda play: play.assert_status("DONE"),
        lambda play: play.calls("a//b"),
    ],
)
def test_a_wrong_assertion_is_an_error_of_its_own(stage, assertion):
    with pytest.raises(ConfigError):
        assertion(stage.run("greet"))
