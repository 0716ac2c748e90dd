"""``florence report``: one HTML file of a recorded run, to be sent to somebody."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from florence_bt.app.demo.pictures import PICTURE
from florence_bt.app.mission_files.output import write_output
from florence_bt.app.runs.journal_view import journal_folder, read_run
from florence_bt.runtime.journal.rows import JournaledEvent, JournaledRun
from florence_bt.runtime.journal.text import TimelineRow, journal_text, timeline_rows
from florence_bt.runtime.run import RunStatus
from florence_bt.trees.drawings.ascii import MARKS, STOPPED
from florence_bt.trees.language.declarations import collect_declarations

_MARKS = {mark: status.name.lower() for status, mark in MARKS.items()} | {STOPPED: "stopped"}
_MARK = re.compile("|".join(map(re.escape, _MARKS)))
_COLOURS = {RunStatus.SUCCEEDED: "#2a7f3b", RunStatus.FAILED: "#b3261e"}
_OTHER_COLOUR = "#8a6d00"
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 0 auto; max-width: 72rem; padding: 1rem; }
h1 { font-size: 1.4rem; margin: 0; }
h2 { font-size: 1.1rem; margin: 2rem 0 .5rem; }
.state { color: #fff; border-radius: .3rem; padding: .1rem .5rem; font-size: 1rem; }
.reason { font-size: 1.1rem; margin: .6rem 0; }
pre { overflow-x: auto; background: #f6f6f4; padding: .8rem; font-size: 13px; line-height: 1.35; }
img { max-width: 100%; height: auto; }
.success { color: #2a7f3b; }
.failure { color: #b3261e; font-weight: bold; }
.running, .stopped { color: #8a6d00; }
.invalid { color: #999; display: none; }
body:has(#all:checked) .invalid { display: inline; }
table { border-collapse: collapse; width: 100%; font-size: 13px; }
td { padding: .15rem .5rem; border-top: 1px solid #e4e4e0; vertical-align: top; }
td.at { text-align: right; white-space: nowrap; }
td.bar { width: 25%; padding: .4rem 0; }
.bar div { height: .7rem; min-width: 2px; border-radius: 2px; background: #7a9cc6; }
.bar div.failed { background: #cf6a63; }
@media (max-width: 40rem) { td.bar { display: none; } }
"""


_OURS = b"td.bar {"
"""Is in every report, and in no other file: only a report is replaced."""


def write_report(folder: Path | None, run_id: str, out: Path | None) -> Path:
    """Write the report of a run.

    Args:
        folder: The folder of the journal; that of :func:`journal_folder` when not given.
        run_id: The run; the latest one when empty.
        out: The file; by default ``report.html`` in the folder of the run.

    Returns:
        The file.

    Raises:
        ConfigError: There is no journal, no such run, or the file cannot be written.
    """
    place = journal_folder(folder)
    run, events = read_run(place, run_id)
    picture = place / run.run_id / PICTURE
    page = report(run, events, picture.read_bytes() if picture.is_file() else None)
    file = out or place / run.run_id / "report.html"
    write_output(file, page, make_folder=True, mark=_OURS)
    return file


def report(run: JournaledRun, events: Sequence[JournaledEvent], picture: bytes | None) -> str:
    """Return the page of a run: what it was to do, how it ended and why, its way, its tree, its timeline.

    Args:
        run: The run.
        events: Its events, in order.
        picture: The map with the way that was driven, a PNG; None without one.
    """
    head, *tree = journal_text(run, events).splitlines()
    facts, tree = (tree[0], tree[1:]) if tree and not _MARK.match(tree[0]) else ("", tree)
    return "\n".join(
        [
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{_text(run.run_id)}</title>',
            f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style>',
            f'<h1>{_text(run.mission)} <span class="state" style="background: '
            f'{_COLOURS.get(run.status, _OTHER_COLOUR)}">{_text(run.state)}</span></h1>',
            f'<p class="reason">{_text(run.reason)}</p>' if run.reason else "",
            f"<p>{_text(head)}<br>{_text(facts)}</p>",
            *_picture(picture),
            "<h2>What became of each node</h2>",
            '<label><input type="checkbox" id="all"> also nodes that were not reached</label>',
            f"<pre>{''.join(map(_tree_line, tree))}</pre>",
            "<h2>What happened when</h2>",
            *_timeline(timeline_rows(events, collect_declarations())),
            "</html>",
        ]
    )


def _picture(picture: bytes | None) -> Iterator[str]:
    if picture is not None:
        data = base64.b64encode(picture).decode()
        yield "<h2>Where it drove</h2>"
        yield f'<img alt="the map with the way that was driven" src="data:image/png;base64,{data}">'


def _tree_line(line: str) -> str:
    mark = _MARK.search(line)
    kind = f' class="{_MARKS[mark[0]]}"' if mark else ""
    return f"<span{kind}>{_text(line)}\n</span>"


def _timeline(rows: Sequence[TimelineRow]) -> Iterator[str]:
    """Yield a table with a bar for each skill, as long as it ran."""
    whole = max((row.at + (row.duration or 0.0) for row in rows), default=0.0) or 1.0
    yield "<table>"
    for row in rows:
        bar = ""
        if row.duration is not None:
            left, width = (100.0 * part / whole for part in (row.at, row.duration))
            kind = "" if row.code in ("", "success") else ' class="failed"'
            bar = f'<div{kind} style="margin-left: {left:.2f}%; width: {width:.2f}%"></div>'
        cells = f'<td class="at">+{row.at:.1f} s</td><td class="bar">{bar}</td><td>{_text(row.text)}</td>'
        yield f"<tr>{cells}</tr>"
    yield "</table>"


def _text(text: str) -> str:
    return html.escape(text)
