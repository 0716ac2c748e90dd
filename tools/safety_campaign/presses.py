"""Presses on the page, in a real browser, while its line and its processes fail.

A stop must never be lost, and the word on the page must be true all the time; a release, a start, a drive by
hand and going on must never be late. The browser comes through a proxy (:mod:`tools.faulty_proxy`).
"""

from __future__ import annotations

import itertools
import math
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from florence_interfaces.msg import ManualOverride, RunState
from playwright import sync_api as playwright
from std_msgs.msg import Bool

from florence_bt.ros.qos import LATCHED
from tools.faulty_proxy import FaultyProxy
from tools.safety_campaign.running_system import DRIVE_S, CampaignFailed, RunningSystem
from tools.tables import table

CHROMIUM = shutil.which("chromium")
BREAKS_S = (0.7, 2.2, 4.2, 8.2)
SURE_S = 1.0
"""So long after the press the page may say that it is sending."""
SEEN_S = 0.3
"""By how much the times of what is on the page and of what the base does may differ."""
LOST_S = 60.0
"""A stop that has not arrived so long after the fault is over is lost. A page that dies for the third time is
started again after 20 s."""
LATE_S = 1.0
"""Time after the press from which something is late."""
BUSY_PROGRAMS = 4
GIVEN_UP = 6
"""Bring-ups that may end early, because something that everything else needs did not happen."""
MOST_ENDS = 3
"""Times that one process may end in a bring-up, which is how often the supervisor starts it again."""
VIEWS = ("desktop", "phone", "two pages")
RECORDER = """
window.words = []; window.presses = [];
for (const event of ["pointerdown", "pointerup"])
  window.addEventListener(event, () => window.presses.push([event, Date.now() / 1000]), true);
setInterval(() => {
  const word = document.querySelector(".florence-bar .word");
  if (word) window.words.push([Date.now() / 1000, word.dataset.state, word.innerText]);
}, 50);
"""


@dataclass(frozen=True)
class Hitch:
    """Something that fails while somebody presses.

    Attributes:
        name: What fails, for people.
        begin: Lets it fail; gives what ends it.
        lasts_s: How long it fails.
        ends: The process that it may end.
    """

    name: str
    begin: Callable[[RunningSystem, FaultyProxy], Callable[[], None]]
    lasts_s: float
    ends: str = ""


def _line(fault: Any, lag_s: float = 0.5) -> Callable[[RunningSystem, FaultyProxy], Callable[[], None]]:
    def begin(system: RunningSystem, proxy: FaultyProxy) -> Callable[[], None]:
        proxy.begin(fault, lag_s)
        return lambda: proxy.begin("none")

    return begin


def _stopped(group: str) -> Callable[[RunningSystem, FaultyProxy], Callable[[], None]]:
    def begin(system: RunningSystem, proxy: FaultyProxy) -> Callable[[], None]:
        pid = system.pid(group)
        system.send(group, signal.SIGSTOP)

        def end() -> None:
            if system.pid(group) == pid:
                system.send(group, signal.SIGCONT)

        return end

    return begin


def _killed(group: str) -> Callable[[RunningSystem, FaultyProxy], Callable[[], None]]:
    def begin(system: RunningSystem, proxy: FaultyProxy) -> Callable[[], None]:
        system.send(group, signal.SIGKILL)
        return lambda: None

    return begin


def _starved(group: str) -> Callable[[RunningSystem, FaultyProxy], Callable[[], None]]:
    """Let a process run for a tenth of the time."""

    def begin(system: RunningSystem, proxy: FaultyProxy) -> Callable[[], None]:
        words = "import os, signal, sys, time\npid = int(sys.argv[1])\nwhile True:\n"
        for name, pause in (("STOP", 0.09), ("CONT", 0.01)):
            words += f"    os.kill(pid, signal.SIG{name}); time.sleep({pause})\n"
        pid = system.pid(group)
        starver = subprocess.Popen([sys.executable, "-c", words, str(pid)])

        def end() -> None:
            starver.kill()
            starver.wait()
            if system.pid(group) == pid:
                os.kill(int(str(pid)), signal.SIGCONT)

        return end

    return begin


def _busy_machine(system: RunningSystem, proxy: FaultyProxy) -> Callable[[], None]:
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(BUSY_PROGRAMS)]

    def end() -> None:
        for each in busy:
            each.kill()
            each.wait()

    return end


HITCHES: tuple[Hitch, ...] = (
    *(Hitch("the line breaks", _line("break"), seconds) for seconds in BREAKS_S),
    *(Hitch("the line holds everything", _line("hold"), seconds) for seconds in BREAKS_S),
    Hitch("the line delays by 0.3 s", _line("delay", 0.3), 4.0),
    Hitch("the line delays by 1 s", _line("delay", 1.0), 6.0),
    Hitch("the line reorders", _line("reorder", 1.5), 5.0),
    Hitch("the page is stopped", _stopped("page"), 2.5),
    Hitch("the page is stopped until it is killed", _stopped("page"), 9.0, "page"),
    Hitch("the page is killed", _killed("page"), 1.0, "page"),
    Hitch("the page is starved", _starved("page"), 4.0),
    Hitch("the mission server is stopped", _stopped("missions"), 3.0),
    Hitch("the mission server is killed", _killed("missions"), 1.0, "missions"),
    Hitch("the mission server is starved", _starved("missions"), 4.0),
    Hitch("navigation is stopped", _stopped("navigation"), 3.0),
    Hitch("navigation is killed", _killed("navigation"), 1.0, "navigation"),
    Hitch("four programs want every core", _busy_machine, 4.0),
    Hitch("nothing fails", lambda system, proxy: lambda: None, 1.0),
)


@dataclass(frozen=True)
class Press:
    """The outcome of one press.

    Attributes:
        hitch: What failed meanwhile.
        view: Where somebody pressed; see :data:`VIEWS`.
        button: ``stop``, ``release``, ``start``, ``go on`` or ``drive``.
        arrived_s: From the press to what it asks for; infinite when it had no effect.
        lost: Whether a stop had no effect.
        late: Whether anything else had its effect too late.
        untrue: What the page said that was not so; empty when all was true.
    """

    hitch: str
    view: str
    button: str
    arrived_s: float
    lost: bool = False
    late: bool = False
    untrue: str = ""


class Bench:
    """A system, the proxy before its page, and browsers behind it."""

    def __init__(self, system: RunningSystem, proxy: FaultyProxy, browser: Any) -> None:
        self.system, self.proxy = system, proxy
        self.pages = {
            "desktop": self._open(browser, viewport={"width": 1280, "height": 800}),
            "phone": self._open(browser, viewport={"width": 390, "height": 844}, has_touch=True),
        }
        self.overrides: list[tuple[float, bool]] = []
        self._behind = math.inf
        self.runs: list[tuple[float, str, str]] = []
        node = system.node
        node.create_subscription(ManualOverride, "manual_override_state", self._on_override, LATCHED)
        node.create_subscription(RunState, "florence_bt/run_state", self._on_run, LATCHED)

    def _on_override(self, message: ManualOverride) -> None:
        """Note what the driver says and when it said so: a busy machine delivers it later."""
        self._behind = min(self._behind, time.monotonic() - message.sent_at)
        self.overrides.append((message.sent_at + self._behind, bool(message.on)))

    def _on_run(self, message: RunState) -> None:
        self.runs.append((time.monotonic(), message.state, message.run_id))

    def _open(self, browser: Any, **options: Any) -> Any:
        context = browser.new_context(**options)
        context.add_init_script(RECORDER)
        page = context.new_page()
        for _ in range(60):
            try:
                page.goto(f"http://localhost:{self.proxy.port}/")
                page.wait_for_function("window.words && words.length && words.at(-1)[1] === 'free'")
                return page
            except playwright.Error:
                self.system.spin(1.0)
        raise CampaignFailed(f"the page does not open:\n{self.system.output}")

    def calm(self) -> None:
        """Release the robot, let no mission run, and wait until every page knows it."""
        self.proxy.begin("none")
        for on in (True, False):  # what runs ends
            self.system.wait(lambda on=on: self._switched(on), "the override and its release")
            self.system.spin(0.3)
        for page in self.pages.values():
            again = page.get_by_role("button", name="open the page again")
            if again.count():  # as its word says: the program of the page was started again
                again.click()
            self.wait_for_word(page, "free")
            page.evaluate("() => { words.length = presses.length = 0; }")
        self.system.status()  # of the mission server that is there now
        self.overrides.clear()
        self.runs.clear()

    def _switched(self, on: bool) -> bool:
        self.system.switch.publish(Bool(data=on))
        self.system.spin(0.2)
        return self.system.overridden is on

    def wait_for_word(self, page: Any, state: str, limit_s: float = 60.0) -> None:
        """Wait until a page is in a state, with the callbacks of ROS served."""
        end = time.monotonic() + limit_s
        while (now := page.evaluate("() => words.length ? words.at(-1).slice(1) : ['', '']"))[0] != state:
            if time.monotonic() > end:
                raise CampaignFailed(f"the page does not say {state!r} but {now}:\n{self.system.output}")
            self.system.spin(0.1)

    def moves(self, begin: float, end: float) -> bool:
        """Tell whether the base moved all through a span of monotonic seconds."""
        there = [truth for truth in self.system.truths if begin <= truth["monotonic"] <= end]
        return bool(there) and all(any(truth["wheels"]) for truth in there)

    def overridden_at(self, when: float) -> set[bool]:
        """Return what the driver said of the override around a moment."""
        before = [on for at, on in self.overrides if at <= when - SEEN_S][-1:]
        return set(before) | {on for at, on in self.overrides if abs(at - when) < SEEN_S}


def press_many(
    count: int,
    seed: int,
    say: Callable[[str], None] = print,
    hitches: tuple[Hitch, ...] = HITCHES,
) -> list[Press]:
    """Press STOP so often, and the other buttons as often, over every hitch in turn."""
    dice = random.Random(seed)
    presses: list[Press] = []
    buttons = itertools.cycle(("release", "start", "drive", "go on"))
    turns = [
        (hitch, VIEWS[number % 3], "stop") for number, hitch in zip(range(count), itertools.cycle(hitches))
    ]
    turns += [
        (hitch, VIEWS[number % 2], button)
        for number, hitch, button in zip(range(count), itertools.cycle(hitches), buttons)
    ]
    numbers, given_up = itertools.count(seed), 0
    while turns:
        try:
            with _bench(next(numbers)) as bench:
                _press_in(bench, turns, presses, dice, say)
        except CampaignFailed as error:
            given_up += 1
            say(f"given up before {turns[0]}: {error}")
            if given_up > GIVEN_UP:
                raise
        say(f"{len(presses)} of {2 * count} presses")
    return presses


def _press_in(
    bench: Bench,
    turns: list[tuple[Hitch, str, str]],
    presses: list[Press],
    dice: random.Random,
    say: Callable[[str], None],
) -> None:
    """Take one turn after the other, as long as the supervisor starts again what dies."""
    ends: Counter[str] = Counter()
    while turns:
        hitch, view, button = turns[0]
        if hitch.ends and ends[hitch.ends] >= MOST_ENDS:
            return
        ends[hitch.ends] += 1
        presses.append(_press_once(bench, hitch, view, button, dice))
        turns.pop(0)
        last = presses[-1]
        say(f"{'FAULT: ' if last.lost or last.late or last.untrue else ''}{last}")


@contextmanager
def _bench(seed: int) -> Iterator[Bench]:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        port: int = server.getsockname()[1]
    with (
        RunningSystem(seed, "--page", "--page-port", str(port)) as system,
        FaultyProxy(port, seed) as proxy,
        playwright.sync_playwright() as started,
    ):
        browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            yield Bench(system, proxy, browser)
        finally:
            browser.close()


def _press_once(bench: Bench, hitch: Hitch, view: str, button: str, dice: random.Random) -> Press:
    bench.calm()
    prepare, do, measure = _BUTTONS[button]
    pages = list(bench.pages.values()) if view == "two pages" else [bench.pages[view]]
    prepare(bench, pages[0])
    bench.system.forget()
    end = hitch.begin(bench.system, bench.proxy)
    began = time.monotonic()
    bench.system.spin(dice.uniform(0.0, min(1.0, hitch.lasts_s)))
    for page in pages:
        do(page)
    try:
        bench.system.spin(max(0.0, began + hitch.lasts_s - time.monotonic()))
    finally:
        end()
    return measure(bench, pages, hitch, view)


# ---- the buttons: what comes before, the press, and what came of it ---------------------------------------


def _offset() -> float:
    return time.time() - time.monotonic()


def _pressed_at(page: Any, event: str = "pointerdown") -> float:
    """Return when somebody pressed on a page last, in monotonic seconds of this machine."""
    times = [at for name, at in page.evaluate("() => presses") if name == event]
    return float(times[-1]) - _offset()


def _drive(bench: Bench, page: Any) -> None:
    end = time.monotonic() + DRIVE_S
    while True:
        try:
            bench.system.drive_by_mission()
            break
        except CampaignFailed:  # the robot is made safe after what died before
            if time.monotonic() > end:
                raise
            bench.system.spin(1.0)
    bench.system.wait(lambda: bench.system.truth["moving"], "a drive", DRIVE_S)


def _press_stop(page: Any) -> None:
    page.locator(".florence-bar .stop").click(no_wait_after=True)


def _measure_stop(bench: Bench, pages: list[Any], hitch: Hitch, view: str) -> Press:
    system = bench.system
    pressed = min(_pressed_at(page) for page in pages)

    def stopped() -> bool:
        return any(on and at > pressed for at, on in bench.overrides) and not system.truth["moving"]

    came = system.spin_until(stopped, LOST_S)
    for page in pages:
        if came:
            bench.wait_for_word(page, "stopped")
    arrived = next((at for at, on in bench.overrides if on and at > pressed), float("inf")) - pressed
    untrue = "; ".join(filter(None, (_untrue(bench, page) for page in pages)))
    return Press(hitch.name, view, "stop", arrived, lost=not came, untrue=untrue)


def _untrue(bench: Bench, page: Any) -> str:
    """Say what a page has said after its press that was not so."""
    pressed, offset = _pressed_at(page), _offset()
    confirmed = False
    for at, state, word in page.evaluate("() => words"):
        when = at - offset
        if when < pressed + 0.1:
            continue
        if state == "stopped":
            confirmed = True
            if True not in bench.overridden_at(when) or bench.moves(when - SEEN_S, when + SEEN_S):
                return f"{when - pressed:.1f} s after the press it said {word!r}, and the robot was not"
        elif not confirmed and state == "sending" and when > pressed + SURE_S + SEEN_S:
            return f"{when - pressed:.1f} s after the press it still said {word!r}"
        elif not confirmed and state not in ("sending", "unsure"):
            return f"{when - pressed:.1f} s after the press it said {word!r}"
    return ""


def _hold(bench: Bench, page: Any) -> None:
    bench.system.switch.publish(Bool(data=True))
    bench.wait_for_word(page, "stopped")


def _press_release(page: Any) -> None:
    button = page.locator(".florence-bar .release")
    if button.is_enabled():
        button.click(no_wait_after=True)
    else:  # what is old cannot be released: the press of somebody who tries all the same
        page.evaluate("() => presses.push(['pointerdown', Date.now() / 1000])")


def _measure_release(bench: Bench, pages: list[Any], hitch: Hitch, view: str) -> Press:
    pressed = _pressed_at(pages[0])
    bench.system.spin(4.0)
    arrived = next((at for at, on in bench.overrides if not on and at > pressed), float("inf")) - pressed
    return Press(hitch.name, view, "release", arrived, late=LATE_S + SEEN_S < arrived < float("inf"))


def _choose(bench: Bench, page: Any) -> None:
    page.get_by_role("button", name="Start…").click()
    asked = page.get_by_role("dialog").get_by_label("mission")
    asked.fill("patrol")
    page.get_by_role("option", name="patrol", exact=True).click()


def _press_start(page: Any) -> None:
    page.get_by_role("dialog").get_by_role("button", name="Start").click(no_wait_after=True)


def _measure_start(bench: Bench, pages: list[Any], hitch: Hitch, view: str) -> Press:
    pressed = _pressed_at(pages[0])
    bench.system.spin(4.0)
    pages[0].keyboard.press("Escape")
    began = _ran_from(bench, pressed) - pressed
    return Press(hitch.name, view, "start", began, late=LATE_S + SEEN_S < began < float("inf"))


def _ran_from(bench: Bench, pressed: float) -> float:
    """Return when a mission began to run, or went on, after a press; infinite when none did."""
    return next((at for at, state, _ in bench.runs if at > pressed and state == "ACTIVE"), float("inf"))


def _moments_of_motion(bench: Bench) -> list[float]:
    return [truth["monotonic"] for truth in bench.system.truths if any(truth["wheels"])]


def _take_hand(bench: Bench, page: Any) -> None:
    page.get_by_role("button", name="Drive by hand").click()
    bench.wait_for_word(page, "stopped")
    box = page.get_by_role("slider", name="drive by hand").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.2)
    page.mouse.down()
    bench.system.wait(lambda: bench.system.truth["moving"], "the drive by hand")


def _let_go(page: Any) -> None:
    page.mouse.up()


def _measure_drive(bench: Bench, pages: list[Any], hitch: Hitch, view: str) -> Press:
    let_go = _pressed_at(pages[0], "pointerup")
    bench.system.spin(4.0)
    last = max(_moments_of_motion(bench), default=let_go) - let_go
    pages[0].get_by_role("button", name="Drive by hand").click()
    return Press(hitch.name, view, "drive", last, late=last > LATE_S + SEEN_S)


def _pause(bench: Bench, page: Any) -> None:
    _drive(bench, page)
    bench.system.pause("a campaign")
    bench.system.wait(lambda: not bench.system.truth["moving"], "the pause")


def _press_go_on(page: Any) -> None:
    page.get_by_role("button", name="go on with the mission").click(no_wait_after=True)


def _measure_go_on(bench: Bench, pages: list[Any], hitch: Hitch, view: str) -> Press:
    pressed = _pressed_at(pages[0])
    bench.system.spin(4.0)
    went_on = _ran_from(bench, pressed) - pressed
    return Press(hitch.name, view, "go on", went_on, late=LATE_S + SEEN_S < went_on < float("inf"))


_BUTTONS: dict[str, tuple[Any, Any, Any]] = {
    "stop": (_drive, _press_stop, _measure_stop),
    "release": (_hold, _press_release, _measure_release),
    "start": (_choose, _press_start, _measure_start),
    "drive": (_take_hand, _let_go, _measure_drive),
    "go on": (_pause, _press_go_on, _measure_go_on),
}


def presses_table(presses: list[Press]) -> str:
    """Write what came of stops by hitch, and of the rest by button."""
    stops = [press for press in presses if press.button == "stop"]
    rows = []
    for name in [*dict.fromkeys(press.hitch for press in stops), "all"]:
        mine = [press for press in stops if name in ("all", press.hitch)]
        arrived = sorted(press.arrived_s for press in mine)
        rows.append(
            (
                name,
                str(len(mine)),
                str(sum(press.lost for press in mine)),
                str(sum(bool(press.untrue) for press in mine)),
                f"{arrived[len(arrived) // 2]:.2f} s",
                f"{arrived[-1]:.2f} s",
            )
        )
    head = ("while", "stops", "lost", "word on the page untrue", "confirmed after: median", "longest")
    others = []
    for button in ("release", "start", "go on", "drive"):
        mine = [press for press in presses if press.button == button]
        done = [press.arrived_s for press in mine if press.arrived_s < float("inf")]
        others.append((button, str(len(mine)), str(len(done)), str(sum(press.late for press in mine))))
    return "\n\n".join((table(head, rows), table(("button", "presses", "had their effect", "late"), others)))
