"""Watching keys: who watches hears of changes of values, and of nothing else."""

from __future__ import annotations

import math

import pytest

from florence_bt.behaviours.keys import KeyStore


@pytest.fixture
def watched():
    keys = KeyStore({"a": 1, "b": "x"})
    told: list[str] = []
    return keys, told, keys.watch(("a", "c", "a"), told.append)


def test_a_change_is_told_once_and_only_to_who_watches_that_key(watched):
    keys, told, _ = watched
    keys.write("a", 2)
    keys.write("b", "y")
    assert told == ["a"]


@pytest.mark.parametrize("value", [1.0, True])
def test_an_equal_value_of_another_type_is_a_change(watched, value):
    keys, told, _ = watched
    keys.write("a", 1)
    assert told == []
    keys.write("a", value)
    assert told == ["a"]


def test_the_first_value_and_the_loss_of_one_are_changes(watched):
    keys, told, _ = watched
    keys.write("c", 1)
    keys.reset({"a": 1})
    assert told == ["c", "c"]
    keys.reset({"a": 1})
    assert told == ["c", "c"]


def test_not_a_number_never_stays_the_same(watched):
    keys, told, _ = watched
    for _ in range(2):
        keys.write("a", math.nan * 1.0)
    assert told == ["a", "a"]


def test_the_new_value_is_there_when_it_is_told():
    keys = KeyStore({"a": 1})
    seen = []
    keys.watch(("a",), lambda key: seen.append(keys.read(key)))
    keys.write("a", 5)
    keys.reset({"a": 6})
    assert seen == [5, 6]


def test_a_watch_that_has_ended_hears_nothing_and_leaves_nothing(watched):
    keys, told, end = watched
    others: list[str] = []
    end_other = keys.watch(("a",), others.append)
    end()
    end()
    keys.write("a", 9)
    assert told == [] and others == ["a"]
    end_other()
    assert not keys._watchers


def test_a_value_that_cannot_be_held_changes_nothing(watched):
    keys, told, _ = watched
    with pytest.raises(TypeError):
        keys.reset({"a": [1]})
    assert keys.read("a") == 1 and told == []
