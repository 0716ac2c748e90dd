"""What somebody sees who sees only this screen: what the robot does, where, for how long, what failed."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from rich.cells import cell_len
from rich.console import Console

from florence_bt.app.runs.screen import KEYS_OF_DEMO, Screen, print_end, print_status
from florence_bt.runtime.viewers.run_tree import RunTree
from tests.unit.app.written_trees import written_tree

HEAD = "goto_user: RUNNING · 21.4 s · run 20261127T131931Z-001-goto_user · asked by florence demo"
TREE = """\
[>] goto_user (sequence) (21.4 s)
    [+] get user room (0.0 s)
    [>] try one place after the other (21.4 s)
        [>] sequence (21.3 s)
            [+] find the user (finally) (12.0 s)
                [+] sequence (on_failure) (12.0 s)
                    [x] go there (9.0 s) -- blocked by a chair
                    [+] look round (3.0 s)
            [x] greet (sequence) (1.0 s)
                [x] say hello (1.0 s) -- the loudspeaker is silent
            [>] run meet_user (8.2 s)
                [>] sequence (8.2 s)
                    [>] drive to them (8.1 s) -- driving
            [ ] say goodbye
    [ ] go home"""
STATUS = f"{HEAD}\ninputs room='study'\n{TREE}\nwarning: the battery is low"
DEEP = f"{HEAD}\n" + "\n".join(
    [
        *(f"{'    ' * depth}[>] node {depth} ({depth + 0.5} s)" for depth in range(30)),
        f"{'    ' * 30}[>] drive to them -- driving",
        *(f"{'    ' * 29}[ ] later {number}" for number in range(30)),
    ]
)


def seen(status, columns=80, lines=24, where="", keys=(), screen=None):
    screen = screen or Screen()
    screen.show(written_tree(status))
    screen.where = where
    screen.draw(columns, lines)
    for key in keys:
        screen.press(key)
    drawn = [line.plain for line in screen.draw(columns, lines)]
    assert len(drawn) == lines
    assert all(cell_len(line) <= columns for line in drawn)
    return drawn


def test_before_the_first_mission_the_screen_says_so():
    screen = Screen()
    screen.show(RunTree(warnings=("the journal cannot be written",)))
    drawn = [line.plain for line in screen.draw(80, 24)]
    assert drawn[0] == "no mission has run yet" and "warning: the journal cannot be written" in drawn


def test_what_the_robot_does_where_for_how_long_and_what_failed():
    text = "\n".join(seen(STATUS, where="in the hall; drives to the study (5.1, 1.4): 3.4 m left"))
    assert re.search(r"^where +in the hall; drives to the study \(5.1, 1.4\): 3.4 m left$", text, re.M)
    assert re.search(r"^now +drive to them \(8 s\) -- driving$", text, re.M)
    assert re.search(r"^failed +say hello -- the loudspeaker is silent$", text, re.M)
    assert "the battery is low" in text and "room='study'" in text and "go home" not in text


@pytest.mark.parametrize(("columns", "lines"), [(80, 24), (60, 12), (200, 60), (80, 13)])
@pytest.mark.parametrize("status", [STATUS, DEEP])
def test_the_running_leaf_and_the_nodes_above_it_are_on_every_screen(status, columns, lines):
    drawn = seen(status, columns, lines)
    leaf = next(place for place, line in enumerate(drawn) if line.lstrip().startswith("[>] drive to them"))
    above = sum(line.lstrip().startswith("[>]") for line in drawn[:leaf])
    assert above >= min(lines - 9, 5 if status is STATUS else 30)


def test_done_branches_are_folded_where_there_is_little_room_and_shown_where_there_is_much():
    small, large = seen(STATUS, lines=18), seen(STATUS, lines=40)
    assert any("find the user (finally) (+3)" in line for line in small)
    assert any("greet (sequence) (1 s) -- say hello: the loudspeaker is silent" in line for line in small)
    assert any(line.strip().startswith("[x] go there") for line in large)
    assert not any(line.strip().startswith("[x] go there") for line in small)


def test_the_last_failures_stay_when_the_tree_has_forgotten_them():
    screen = Screen()
    seen(STATUS, screen=screen)
    again = STATUS.replace("[x] say hello (1.0 s) -- the loudspeaker is silent", "[>] say hello").replace(
        "[x] greet", "[>] greet"
    )
    assert any("the loudspeaker is silent" in line for line in seen(again, screen=screen))
    later = STATUS.replace("21.4 s · run", "30.0 s · run")
    assert any("say hello (2 times, last at 30.0 s)" in line for line in seen(later, screen=screen))
    other = STATUS.replace("Z-001", "Z-002").replace(TREE, "[>] goto_user")
    assert not any("say hello" in line for line in seen(other, screen=screen))


def test_keys_scroll_unfold_and_follow_again():
    top = seen(DEEP, keys=["home"])
    assert any("[>] node 0" in line for line in top) and not any(
        "drive to them -" in line for line in top[4:]
    )
    down = seen(DEEP, keys=["home", *["down"] * 3])
    assert not any(re.search(r"\[>\] node [012]\b", line) for line in down)
    assert any("[>] node 3 " in line for line in down)
    assert any("[>] drive to them" in line for line in seen(DEEP, keys=["home", "f"])[4:])
    assert not any("later" in line for line in seen(DEEP, keys=["end"]))
    assert "later 29" in seen(DEEP, keys=["a", "end"])[-2]
    assert seen(DEEP, keys=["a", "end", *["down"] * 5]) == seen(DEEP, keys=["a", "end"])
    assert any("[x] go there" in line for line in seen(STATUS, lines=18, keys=["u", "home"]))
    assert seen(STATUS, keys=["u", "u"]) == seen(STATUS)


def test_a_search_goes_to_what_is_found_also_in_folded_branches():
    assert any("/blocked" in line for line in seen(STATUS, keys=["/", *"blockex", "backspace", "d"]))
    found = seen(STATUS, lines=14, keys=["/", *"BLOCKED", "enter"])
    assert any("blocked by a chair" in line for line in found)
    nothing = seen(STATUS, keys=["/", *"tea", "enter"])
    assert "'tea' is not there" in nothing[-1]
    first = seen(DEEP, keys=["a", "/", *"later", "enter", "n"])
    assert first != seen(DEEP, keys=["a", "/", *"later", "enter", *"nnnnnnnnnnnnnn"])
    rounds = [seen(DEEP, keys=["a", "/", *"later", "enter", *"n" * times]) for times in range(30)]
    for number in (0, 29):
        assert any(f"later {number}" in "\n".join(screen) for screen in rounds), "n goes through all"
    assert seen(STATUS, keys=["/", *"tea", "escape"]) == seen(STATUS)


def test_nothing_is_lost_of_a_long_reason_when_one_scrolls():
    reason = " ".join(f"word{number}" for number in range(60))
    status = STATUS.replace("blocked by a chair", reason)
    text = " ".join(" ".join(seen(status, lines=60, keys=["u", "home"])).split())
    assert reason in text


@pytest.mark.parametrize("whole", [True, False])
def test_a_status_that_is_printed_once_is_laid_out_for_its_terminal(whole):
    console = Console(file=io.StringIO(), width=60, force_terminal=True, color_system=None)
    print_status(written_tree(STATUS), console, whole=whole, durations=True)
    lines = console.file.getvalue().splitlines()
    assert all(len(line) <= 60 for line in lines)
    assert ("  [ ] go home" in lines) is whole
    pipe = Console(file=io.StringIO(), width=60)
    print_status(written_tree(STATUS), pipe, durations=True)
    assert pipe.file.getvalue().rstrip("\n") == STATUS


@pytest.mark.parametrize("name", ["driving", "looking round"])
def test_the_screens_of_the_page_are_those_of_a_terminal(name):
    page = (Path(__file__).parents[3] / "docs" / "manual" / "runtime.md").read_text(encoding="utf-8")
    lines = page.partition(f"<!-- screen: {name} -->\n```\n")[2].partition("\n```\n")[0].splitlines()
    assert len(lines) == 24 and all(cell_len(line) <= 80 for line in lines)
    assert (
        lines[0].startswith("goto_user: RUNNING")
        and lines[-1] == seen(STATUS, screen=Screen(KEYS_OF_DEMO))[-1]
    )
    assert any(line.startswith("where ") for line in lines) and any(line.startswith("now ") for line in lines)


@pytest.mark.parametrize("size", [(80, 24), (60, 12)])
@pytest.mark.parametrize(
    ("state", "says"), [("SUCCEEDED", "succeeded"), ("FAILED", "failed"), ("STOPPED", "was stopped")]
)
def test_the_last_line_of_a_run_says_how_it_ended(size, state, says):
    _, _, rest = DEEP.partition("\n")
    head = f"goto_user: {state} · 34.2 s · run 20261129T010000Z-001-goto_user · asked by somebody"
    status = "\n".join([head, re.sub(r" \(\S+ s\)", "", rest)])
    console = Console(
        file=io.StringIO(), width=size[0], height=size[1], force_terminal=True, color_system=None
    )
    print_end(written_tree(status), console)
    lines = console.file.getvalue().splitlines()
    assert len(lines) > size[1] and lines[-1] == f"goto_user {says} after 34.2 s"
    pipe = Console(file=io.StringIO(), width=size[0])
    print_end(written_tree(status), pipe)
    assert pipe.file.getvalue().rstrip("\n") == status.rstrip("\n"), "for programs: the head line says it"
