"""The view of a run in the terminal, as lines: pure text, no terminal in here.

The lines at the top answer what the robot does now, where, for how long, and what failed before. The tree
below shows what there is room for: the way to what runs first, then what failed, then what is done.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from py_trees.common import Status
from rich.cells import cell_len, chop_cells
from rich.console import Console
from rich.text import Text

from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import TreeRow, draw_rows
from florence_bt.trees.drawings.folding import fold_calls, parents_of, ways_to_what_runs

STYLES = {Status.SUCCESS: "green", Status.FAILURE: "red", Status.RUNNING: "bold cyan", Status.INVALID: "dim"}
_ENDS = {"SUCCEEDED": "succeeded", "FAILED": "failed", "STOPPED": "was stopped", "ABORTED": "was aborted"}
"""Ends of a run in words, by the states of the status."""
_STATE_STYLES = {"SUCCEEDED": "bold green", "FAILED": "bold red", "ABORTED": "bold red"}
_INDENT = 2
"""Columns a level: a deep tree must fit into 80."""
_LABEL = 8
"""Columns of the words at the beginning of the lines at the top."""
KEYS_OF_RUN, KEYS_OF_STATUS = "q leave  Ctrl-C stop the mission", "q leave"
KEYS_OF_DEMO = "q, Ctrl-C stop and end all"
"""Meaning of ``q`` and Ctrl-C, for the line at the bottom."""
LEAST_COLUMNS, LEAST_LINES = 60, 12
"""In a smaller terminal there are plain lines."""


class Detail(enum.IntEnum):
    """A level of detail in which a tree is shown."""

    FOLDED = 0
    """A detail with one line for what is done, and none for what was not reached."""
    VISITED = 1
    """Everything but what was not reached."""
    ALL = 2


class _ShownNode(NamedTuple):
    """A node that is shown: its place among all, and what stands behind its name."""

    place: int
    row: TreeRow


def lines_of(rows: Sequence[TreeRow], detail: Detail) -> list[_ShownNode]:
    """Choose the nodes of a tree that are shown."""
    parents = parents_of(rows)
    ways = ways_to_what_runs(rows, parents)
    hidden: set[int] = set()
    shown = []
    for place, (row, parent) in enumerate(zip(rows, parents, strict=True)):
        if parent in hidden or (row.status is Status.INVALID and detail < Detail.ALL):
            hidden.add(place)
            continue
        if detail is Detail.FOLDED and place not in ways and row.status is not Status.INVALID:
            row = _folded(rows, place)
            end = _end(rows, place)
            hidden.update(range(place + 1, end))
        shown.append(_ShownNode(place, row))
    return [line for line in shown if line.place not in hidden]


def _end(rows: Sequence[TreeRow], place: int) -> int:
    """Return the place behind the last node below one."""
    depth = rows[place].depth
    return next((later for later in range(place + 1, len(rows)) if rows[later].depth <= depth), len(rows))


def _folded(rows: Sequence[TreeRow], place: int) -> TreeRow:
    """Return the line of a branch that is over: with the leaf that failed, or how many nodes there are."""
    row, below = rows[place], rows[place + 1 : _end(rows, place)]
    if not below:
        return row
    failures = [each for each in below if each.status is Status.FAILURE and each.says]
    if row.status is Status.FAILURE and failures and not row.says:
        leaf = failures[-1]
        return row._replace(says=f"{leaf.title}: {leaf.says}")
    done = sum(each.status is not Status.INVALID for each in below)
    return row._replace(title=f"{row.title} (+{done})") if done else row


def running_leaves(rows: Sequence[TreeRow]) -> list[int]:
    """Return the places of the nodes that run and below which none does."""
    parents = parents_of(rows)
    ways = ways_to_what_runs(rows, parents)
    inner = {parents[place] for place in ways}
    return sorted(place for place in ways if place not in inner)


def way_to(rows: Sequence[TreeRow], place: int) -> list[str]:
    """Return the names from the root to a node."""
    parents, names = parents_of(rows), []
    above: int | None = place
    while above is not None:
        names.append(rows[above].title)
        above = parents[above]
    return names[::-1]


def choose(lines: Sequence[_ShownNode], rows: Sequence[TreeRow], room: int) -> list[_ShownNode]:
    """Choose the lines that matter most when there is not room for all, and return them in order."""
    parents = parents_of(rows)
    ways, leaves = ways_to_what_runs(rows, parents), set(running_leaves(rows))

    def importance(line: _ShownNode) -> tuple[int, int]:
        if line.place in leaves:
            return 0, line.place
        if line.place in ways:
            return 1, -line.row.depth
        return (2 if line.row.status is Status.FAILURE else 3), -line.place

    return sorted(sorted(lines, key=importance)[:room])


class Failure(NamedTuple):
    """The failures of one leaf.

    Attributes:
        when: How long the run had taken at the last one; empty when nobody saw it happen.
        title: The leaf.
        says: Why it failed last.
        times: How often it has failed.
    """

    when: str
    title: str
    says: str
    times: int = 1


class Failures:
    """Remembers which leaves of a run failed, in their order in time: a tree forgets it in the next round."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Forget: another run is shown."""
        self._now: dict[tuple[str, ...], str] | None = None
        self._seen: dict[tuple[str, ...], Failure] = {}

    def look(self, rows: Sequence[TreeRow], took: str) -> list[Failure]:
        """Take the nodes of a run that has taken so long; return its new failures, the latest last."""
        parents = parents_of(rows)
        failing = {parent for row, parent in zip(rows, parents, strict=True) if row.status is Status.FAILURE}
        found = {
            tuple(way_to(rows, place)): row
            for place, row in enumerate(rows)
            if row.status is Status.FAILURE and place not in failing
        }
        known = self._now or {}
        new = []
        for way, row in found.items():
            if known.get(way) == row.says:
                continue
            before = self._seen.pop(way, None)
            times = 1 if before is None else before.times + 1
            when = took if self._now is not None else ""
            self._seen[way] = Failure(when, row.title, row.says, times)
            new.append(self._seen[way])
        self._now = {way: row.says for way, row in found.items()}
        return new

    def last(self, count: int) -> list[Failure]:
        """Return the leaves that failed last, the latest first."""
        return list(self._seen.values())[: -count - 1 : -1]


@dataclass(frozen=True, slots=True)
class ScreenView:
    """The view that the person at the keyboard wants.

    Attributes:
        detail: How much; None shows as much as there is room for.
        top: The first line that is shown; None follows what runs.
        search: What is looked for, empty for nothing.
        typing: Whether it is being typed.
        hit: The line where it was found last.
    """

    detail: Detail | None = None
    top: int | None = None
    search: str = ""
    typing: bool = False
    hit: int | None = None


@dataclass(slots=True)
class Screen:
    """Draws a run into a number of lines and columns.

    Attributes:
        keys: What the keys do that the caller has: ``q leave``.
        tree: The run that is shown.
        where: Where the robot is; empty when nobody knows.
        said: What was said beside, the last line is shown.
        view: What is wanted.
    """

    keys: str = KEYS_OF_STATUS
    tree: RunTree = field(default_factory=RunTree)
    where: str = ""
    said: str = ""
    view: ScreenView = field(default_factory=ScreenView)
    _failures: Failures = field(default_factory=Failures)
    _folded: Sequence[TreeRow] = ()
    _size: tuple[int, int] = (80, 24)

    def show(self, tree: RunTree) -> None:
        """Take a newer state of a run."""
        if tree.run_id != self.tree.run_id:
            self._failures.begin()
        self.tree, self._folded = tree, fold_calls(tree.nodes)
        self._failures.look(self._folded, tree.took)

    @property
    def _rows(self) -> Sequence[TreeRow]:
        """The nodes of which it chooses: called missions are folded unless all is wanted."""
        return self.tree.nodes if self.view.detail is Detail.ALL else self._folded

    # ---- keys ---------------------------------------------------------------------------------------------

    def press(self, key: str) -> None:
        """Take a key that moves or searches."""
        view = self.view
        if view.typing:
            self.view = self._typed(key)
        elif key in _MOVES:
            self.view = replace(view, top=self._moved(key), hit=None)
        elif key == "f":
            self.view = ScreenView(detail=view.detail)
        elif key in ("u", "enter"):
            unfolded = view.detail is not None and view.detail >= Detail.VISITED
            self.view = replace(view, detail=None if unfolded else Detail.VISITED)
        elif key == "a":
            self.view = replace(view, detail=None if view.detail is Detail.ALL else Detail.ALL)
        elif key == "/":
            self.view = replace(view, search="", typing=True, hit=None)
        elif key == "escape":
            self.view = replace(view, search="")
        elif key in ("n", "N") and view.search:
            self.view = self._found(1 if key == "n" else -1)

    def _typed(self, key: str) -> ScreenView:
        view = self.view
        if key == "enter":
            self.view = replace(view, typing=False, detail=max(view.detail or Detail.VISITED, Detail.VISITED))
            return self._found(0)
        if key == "escape":
            return replace(view, search="", typing=False)
        if key == "backspace":
            return replace(view, search=view.search[:-1])
        return replace(view, search=view.search + key) if len(key) == 1 else view

    def _found(self, step: int) -> ScreenView:
        lines, starts = self._tree_lines()
        hits = [place for place, line in enumerate(lines) if self.view.search.lower() in line.plain.lower()]
        if not self.view.search or not hits:
            return self.view
        room = self._room_for_tree()
        middle = self._top(len(lines), starts, room) + room // 2
        at = middle if self.view.hit is None else self.view.hit
        if step > 0:
            hit = next((place for place in hits if place > at), hits[0])
        elif step < 0:
            hit = next((place for place in reversed(hits) if place < at), hits[-1])
        else:
            hit = min(hits, key=lambda place: abs(place - at))
        return replace(self.view, top=max(hit - room // 2, 0), hit=hit)

    def _moved(self, key: str) -> int:
        lines, starts = self._tree_lines()
        room = self._room_for_tree()
        move = _MOVES[key](self._top(len(lines), starts, room), room, len(lines))
        return max(min(move, len(lines) - room), 0)

    # ---- drawing ------------------------------------------------------------------------------------------

    def draw(self, columns: int, lines: int) -> list[Text]:
        """Draw everything.

        Returns:
            As many lines as there are, none wider than the columns.
        """
        self._size = (columns, lines)
        top = self._heading()
        body = self._body(max(lines - len(top) - 2, 1))
        drawn = [*top, self._rule(), *body]
        drawn = drawn[: lines - 1]
        drawn += [Text()] * (lines - 1 - len(drawn))
        drawn.append(self._footer())
        for line in drawn:
            line.truncate(columns, overflow="ellipsis")
        return drawn

    def _room_for_tree(self) -> int:
        return max(self._size[1] - len(self._heading()) - 2, 1)

    def _heading(self) -> list[Text]:
        columns, lines = self._size
        # How many further lines each part may have.
        rich = max((lines - 12) // 6, 0)
        most = 1 + max(rich, int(lines > LEAST_LINES + 1))
        drawn = [self._head()]
        drawn += [Text(note, "dim") for note in self.tree.notes[:rich]]
        rows = self._rows
        leaves = [rows[place] for place in running_leaves(rows)]
        if self.where:
            drawn += _labelled("where", [self.where], columns, most)
        if leaves:
            drawn += _labelled("now", [_one_line(leaf) for leaf in leaves[: 1 + rich]], columns, most)
        for place, failure in enumerate(self._failures.last(1 + rich // 2)):
            label, room = ("failed", min(most, 2)) if place == 0 else ("", 1)
            drawn += _labelled(label, [self._failure(failure)], columns, room, "red")
        for result in self.tree.endings[-1 - rich :]:
            drawn += [Text(line) for line in _wrapped(result, columns)[: 1 + rich]]
        if self.said:
            drawn.append(Text(self.said, "yellow"))
        return drawn

    def _head(self) -> Text:
        tree = self.tree
        if not tree.mission:
            return Text(tree.head, "bold")
        facts = tree.facts
        if cell_len(tree.head) > self._size[0]:
            facts = tree.facts_without_id
        head = Text(f"{tree.mission}: ", "bold")
        head.append(tree.state, _STATE_STYLES.get(tree.state, "bold cyan"))
        return head.append("".join(f" · {fact}" for fact in facts))

    def _failure(self, failure: Failure) -> str:
        facts = [f"{failure.times} times, last"] if failure.times > 1 else []
        facts += [f"at {failure.when}"] if failure.when else []
        when = f" ({' '.join(facts)})" if facts else ""
        return f"{failure.title}{when}{f' -- {failure.says}' if failure.says else ''}"

    def _rule(self) -> Text:
        lines, starts = self._tree_lines()
        room = self._room_for_tree()
        if self.view.top is None and self.view.detail is None:
            more = len(lines) - room
            further = f"; {more} more {'line' if more == 1 else 'lines'}: ↑" if more > 0 else ""
            title = f" follows what runs{further} "
        else:
            top = self._top(len(lines), starts, room)
            title = f" lines {top + 1} to {min(top + room, len(lines))} of {len(lines)} "
        return Text(f"──{title}{'─' * max(self._size[0] - len(title) - 2, 0)}", "dim")

    def _detail(self) -> Detail:
        """Decide how much is shown: what is wanted, or as much as there is room for."""
        if self.view.detail is not None:
            return self.view.detail
        visited = lines_of(self._rows, Detail.VISITED)
        return Detail.VISITED if len(visited) <= self._room_for_tree() else Detail.FOLDED

    def _tree_lines(self) -> tuple[list[Text], list[int]]:
        """Return the lines of the whole tree, and for each node shown where its own begin."""
        wrap = self.view.detail is not None or self.view.top is not None
        drawn: list[Text] = []
        starts = []
        for line in lines_of(self._rows, self._detail()):
            starts.append(len(drawn))
            drawn += draw_row(line.row, self._size[0], wrap=wrap)
        return drawn, starts

    def _top(self, count: int, starts: Sequence[int], room: int) -> int:
        """Return the first line that is shown of a tree that is scrolled through."""
        top = self.view.top
        if top is None:
            shown = lines_of(self._rows, self._detail())
            leaves = set(running_leaves(self._rows))
            at = [start for start, line in zip(starts, shown, strict=True) if line.place in leaves]
            top = max((at[-1] if at else 0) - room + 2, 0)
        return max(min(top, count - room), 0)

    def _body(self, room: int) -> list[Text]:
        rows, view = self._rows, self.view
        if view.top is None and view.detail is None:
            chosen = choose(lines_of(rows, self._detail()), rows, room)
            drawn = []
            # How long a node has run that waits for those below says little.
            inner = ways_to_what_runs(rows, parents_of(rows)).difference(running_leaves(rows))
            for place, row in chosen:
                drawn += draw_row(row._replace(seconds=None) if place in inner else row, self._size[0])
            return drawn
        lines, starts = self._tree_lines()
        top = self._top(len(lines), starts, room)
        part = lines[top : top + room]
        if view.search:
            for line in part:
                line.highlight_regex(f"(?i){re.escape(view.search)}", "reverse")
        return part

    def _footer(self) -> Text:
        view = self.view
        if view.typing:
            return Text(f"/{view.search}▏  Enter finds, Esc leaves it", "reverse")
        lines, _ = self._tree_lines()
        if view.search and not any(view.search.lower() in line.plain.lower() for line in lines):
            return Text(
                f"{view.search!r} is not there; a shows all nodes, / looks for something else", "reverse"
            )
        if view.search:
            return Text(f"n and N go to the next and the last {view.search!r}, Esc ends it", "reverse")
        fold = "fold" if view.detail in (Detail.VISITED, Detail.ALL) else "unfold"
        follow = "" if view.top is None else "f follow  "
        return Text(f"{self.keys}  ↑↓ scroll  {follow}u {fold}  a all  / find", "reverse")


_MOVES: dict[str, Callable[[int, int, int], int]] = {
    "up": lambda top, room, count: top - 1,
    "k": lambda top, room, count: top - 1,
    "down": lambda top, room, count: top + 1,
    "j": lambda top, room, count: top + 1,
    "page up": lambda top, room, count: top - room,
    "b": lambda top, room, count: top - room,
    "page down": lambda top, room, count: top + room,
    " ": lambda top, room, count: top + room,
    "home": lambda top, room, count: 0,
    "g": lambda top, room, count: 0,
    "end": lambda top, room, count: count,
    "G": lambda top, room, count: count,
}
"""Key -> the first line that is shown then, from the one that is now, the room and how many there are."""


def _one_line(row: TreeRow) -> str:
    took = f" ({row.seconds:.0f} s)" if row.seconds is not None else ""
    return f"{row.title}{took}{f' -- {row.says}' if row.says else ''}"


def draw_row(row: TreeRow, columns: int, *, wrap: bool = False) -> list[Text]:
    """Draw one node into lines that are no wider than the columns; with ``wrap`` into as many as it needs."""
    indent = min(row.depth * _INDENT, columns // 2)
    text = _one_line(row)
    room = max(columns - indent - 4, 8)
    first, *rest = _wrapped(text, room) if wrap else [text]
    style = STYLES[row.status]
    line = Text(" " * indent).append(row.mark, style).append(f" {first}", "dim" if style == "dim" else "")
    line.truncate(columns, overflow="ellipsis")
    return [line, *(Text(f"{' ' * (indent + 4)}{more}") for more in rest)]


def _labelled(label: str, texts: Iterable[str], columns: int, most: int, style: str = "bold") -> list[Text]:
    """Draw texts behind a word; each takes at most so many lines."""
    drawn = []
    for text in texts:
        lines = _wrapped(text, columns - _LABEL)
        if len(lines) > most:
            lines[most - 1 :] = [f"{lines[most - 1]} …"]
        for line in lines:
            drawn.append(Text(label.ljust(_LABEL), style).append(line, "default not bold"))
            label = ""
    return drawn


def _wrapped(text: str, columns: int) -> list[str]:
    """Break a text at blanks into lines; a word that is too long is broken itself."""
    lines = [""]
    for word in text.split(" "):
        if lines[-1] and cell_len(lines[-1]) + 1 + cell_len(word) > columns:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
        if cell_len(lines[-1]) > columns:
            lines[-1:] = chop_cells(lines[-1], columns)
    return lines


def print_status(
    tree: RunTree, console: Console, *, whole: bool = True, unfolded: bool = False, durations: bool = False
) -> None:
    """Print a run with its tree; laid out for a terminal, elsewhere as the mission server writes it.

    Args:
        tree: The run.
        console: Where to print.
        whole: Whether what was not reached is listed, too.
        unfolded: Whether called missions have all their nodes.
        durations: Whether nodes tell how long they took.
    """
    columns = console.width if console.is_terminal else None
    drawn = [Text(line) for line in _broken((tree.head, *tree.notes), columns)]
    nodes = tree.nodes if unfolded else fold_calls(tree.nodes)
    shown = lines_of(nodes, Detail.ALL if whole else Detail.VISITED)
    rows = [node.row if durations else node.row._replace(seconds=None) for node in shown]
    if columns and rows:
        drawn += [line for row in rows for line in draw_row(row, columns, wrap=True)]
    else:
        drawn += [Text(line) for line in (draw_rows(rows, durations=True) or tree.text).splitlines()]
    drawn += [Text(line) for line in _broken(tree.endings, columns)]
    console.print(Text("\n").join(drawn), soft_wrap=True)


def _broken(texts: Iterable[str], columns: int | None) -> list[str]:
    """Break texts into lines of so many columns; None leaves them whole."""
    return [line for text in texts for line in (_wrapped(text, columns) if columns else [text])]


def print_end(tree: RunTree, console: Console, *, whole: bool = True) -> None:
    """Print a run that is over; on a terminal the last line says how it ended.

    The head line, which says it, too, has scrolled away above a long tree.
    """
    print_status(tree, console, whole=whole)
    if console.is_terminal:
        verdict = Text(f"{tree.mission} ")
        verdict.append(_ENDS.get(tree.state, tree.state), _STATE_STYLES.get(tree.state, "bold"))
        console.print(verdict.append(f" after {tree.took}" if tree.took else ""), soft_wrap=True)
