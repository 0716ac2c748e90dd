from __future__ import annotations

import os
import signal
import sys
import threading
import time
import weakref
from contextlib import nullcontext

import pytest

from florence_bt.app.bringup.signals import as_keyboard_interrupt, held_back, ignored, once


@pytest.fixture(autouse=True)
def handlers_as_before():
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    assert {number: signal.getsignal(number) for number in before} == before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_every_signal_that_asks_for_the_end_is_like_ctrl_c(number):
    # The tests themselves may run under nohup.
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), as_keyboard_interrupt():
            signal.raise_signal(number)
    finally:
        signal.signal(number, before)


class Thing:
    """Something that weak references can point to."""


@pytest.fixture
def own_handlers():
    """The tests themselves may run under nohup."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_the_impatient_interrupt_a_block_once(own_handlers):
    done = []
    with pytest.raises(KeyboardInterrupt), as_keyboard_interrupt(), once():
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.raise_signal(number)
            with held_back() as came:
                signal.raise_signal(signal.SIGINT)
                assert came()
            done.append("all of the end")
    assert done
    with pytest.raises(KeyboardInterrupt), as_keyboard_interrupt():
        with once():
            done.append("nothing came")
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("block", [nullcontext, once])
def test_a_signal_is_not_lost_where_python_lets_no_exception_out(own_handlers, block):
    hook = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt), as_keyboard_interrupt(), block():
        thing = Thing()
        watcher = weakref.ref(thing, lambda _: os.kill(os.getpid(), signal.SIGINT))
        del thing
        assert watcher() is None
        end = time.monotonic() + 300.0
        while time.monotonic() < end:
            time.sleep(0.001)
    assert sys.unraisablehook is hook


def test_other_lost_exceptions_are_told_as_before(monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", told.append)
    with as_keyboard_interrupt():
        thing = Thing()
        watcher = weakref.ref(thing, lambda _: 1 / 0)
        del thing
        assert watcher() is None
    assert [lost.exc_type for lost in told] == [ZeroDivisionError]


def test_what_nohup_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with as_keyboard_interrupt(), held_back() as came:
            signal.raise_signal(signal.SIGHUP)
            assert not came()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_signal_that_was_held_back_comes_when_the_block_is_over():
    done = []
    with pytest.raises(KeyboardInterrupt), as_keyboard_interrupt(), held_back() as came:
        assert not came()
        signal.raise_signal(signal.SIGTERM)
        assert came()
        done.append("the rest of the block")
    assert done


def test_blocks_within_blocks_deliver_at_the_end_of_the_outermost():
    done = []
    with pytest.raises(KeyboardInterrupt), held_back() as outer:
        with held_back():
            signal.raise_signal(signal.SIGINT)
        assert outer()
        done.append("after the inner block")
    assert done


def test_a_signal_goes_before_an_error_that_it_met():
    with pytest.raises(KeyboardInterrupt), held_back():
        signal.raise_signal(signal.SIGINT)
        raise ValueError("on the way")


def test_ignored_signals_do_nothing_and_their_handlers_come_back():
    before = signal.getsignal(signal.SIGINT)
    with ignored():
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            assert signal.getsignal(number) is signal.SIG_IGN
            signal.raise_signal(number)
    assert signal.getsignal(signal.SIGINT) is before


def test_on_other_threads_nothing_happens():
    seen = []

    def work():
        with as_keyboard_interrupt(), held_back() as came, ignored():
            seen.append(came())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [False]
