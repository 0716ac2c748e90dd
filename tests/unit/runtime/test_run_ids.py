from __future__ import annotations

from florence_bt.runtime.run import RunIds


def test_a_run_has_the_time_of_its_trigger_in_its_id():
    times = iter(["20240501T101500Z", "20240501T101500Z", "20240501T235959Z"])
    ids = RunIds(lambda: next(times))
    made = [ids.next("goto_user") for _ in range(3)]
    assert made == [
        "20240501T101500Z-001-goto_user",
        "20240501T101500Z-002-goto_user",
        "20240501T235959Z-003-goto_user",
    ]


def test_ids_still_sort_when_the_clock_is_set_back():
    times = iter(["20240501T101500Z", "20200101T000000Z"])
    ids = RunIds(lambda: next(times))
    made = [ids.next("a") for _ in range(2)]
    assert made == sorted(made) and len(set(made)) == 2
