"""The results of a sweep as one HTML file that opens anywhere."""

from __future__ import annotations

import base64
import html
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_sweep.experiment import DRAWN, DRAWN_TEXT, Case, Experiment
from florence_sweep.outcome import BROKEN, Outcome
from florence_sweep.pictures import drawn
from florence_sweep.store import Results
from florence_sweep.summary import (
    Table,
    comparison_of,
    comparisons_along,
    measures_of,
    reasons_of,
    table_of,
    table_of_experiment,
    why,
    worst_of,
)

_STYLE = """
body { font-family: system-ui, sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 1em 0; }
th, td { border-bottom: 1px solid #ddd; padding: 0.3em 0.8em; text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #888; }
figure { margin: 2em 0; }
img { max-width: 100%; }
pre { background: #f5f5f5; padding: 1em; overflow-x: auto; }
"""


def report(
    results: Results,
    experiment: Experiment,
    command: Callable[[Outcome], str],
    beside: Results | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> str:
    """Return the page of a sweep; the worst runs are run again for their pictures.

    Args:
        results: The results.
        experiment: What they are of.
        command: Returns what to type to see one run again.
        beside: The results of other code or of another mission on the same seeds.
        say: Told what takes time.
    """
    outcomes, cases = results.outcomes(), list(experiment.cases())
    parts = [
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{_text(results.name)}</title>',
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style>',
        f"<h1>{_text(results.name)}</h1>",
        f"<p>{len(outcomes)} of {len(cases)} runs, with florence-bt {_text(results.code)}. "
        "In brackets: where the share lies with 95 % (Wilson).</p>",
        *_table("What came of them", table_of_experiment(experiment, outcomes)),
        *_about_detections(cases),
    ]
    if (measures := measures_of(experiment, outcomes))[1]:
        parts += _table("What was measured besides", measures)
    for table in comparisons_along(experiment, outcomes):
        parts += _table("Side by side, on the same seeds", table)
    if len(experiment.factors) > 1:
        parts += _table("Each combination", table_of(outcomes))
    if beside is not None:
        title = f"Beside {beside.file.name} (florence-bt {beside.code})"
        parts += _table(title, comparison_of(beside.outcomes(), outcomes))
    parts += _table("Why runs were not good", reasons_of(outcomes))
    parts += _worst(outcomes, cases, command, say)
    parts += ["<h2>The experiment</h2>", f"<pre>{_text(results.experiment)}</pre></html>"]
    return "\n".join(parts)


def _about_detections(cases: Sequence[Case]) -> Iterator[str]:
    if any(case.setup.detections == DRAWN for case in cases):
        yield f"<p>{_text(DRAWN_TEXT)}</p>"


def _table(title: str, table: Table) -> Iterator[str]:
    head, lines = table
    yield f"<h2>{_text(title)}</h2>"
    if not lines:
        yield "<p>None.</p>"
        return
    yield "<table><thead><tr>" + "".join(f"<th scope=col>{_text(cell)}</th>" for cell in head)
    yield "</tr></thead>"
    for line in lines:
        yield "<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in line) + "</tr>"
    yield "</table>"


def _worst(
    outcomes: Sequence[Outcome],
    cases: Sequence[Case],
    command: Callable[[Outcome], str],
    say: Callable[[str], None],
) -> Iterator[str]:
    worst = worst_of(outcomes)
    yield "<h2>The runs to look at first</h2>"
    if not worst:
        yield "<p>Every run was good.</p>"
    for each in worst:
        say(f"running {each.number} again for its picture")
        title = f"{each.number}: {each.variation or 'run'}, seed {each.seed}: {why(each)}"
        yield f"<figure><figcaption><h3>{_text(title)}</h3><p>{_text(each.people)}. {_text(each.reason)}</p>"
        yield f"<pre>{_text(command(each))}</pre></figcaption>"
        if each.status != BROKEN:
            yield _picture(cases[each.number])
        yield "</figure>"


def _picture(case: Case) -> str:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.png"
        try:
            drawn(case, file)
        except ConfigError as error:
            return f"<p>{_text(str(error))}</p>"
        data = base64.b64encode(file.read_bytes()).decode()
    return f'<img alt="the map with the way that was driven" src="data:image/png;base64,{data}">'


def _text(text: str) -> str:
    return html.escape(text)
