"""What ``florence mutate`` says of a mission."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from pathlib import Path

from florence_bt.assurance.mutating.campaign import Campaign, counts_of
from florence_bt.assurance.mutating.judging import (
    EQUIVALENT,
    PROPERTIES,
    REFUSED,
    SCENARIOS,
    UNDECIDED,
    UNNOTICED,
    Judged,
)
from florence_bt.assurance.mutating.mission_mutations import FAMILIES

COLUMNS = {
    REFUSED: "refused by the check",
    SCENARIOS: "noticed by scenarios",
    PROPERTIES: "by properties",
    EQUIVALENT: "equivalent",
    UNDECIDED: "not told apart",
    UNNOTICED: "unnoticed",
}
"""Verdicts -> the heads of their columns."""


def report_of(campaign: Campaign, written: Path | None = None) -> str:
    """Write what came of the changes of a mission, for people.

    Args:
        campaign: What came of them.
        written: The file to which the scenarios were written; None: they were not.
    """
    lines = [_headline(campaign), "", *_table(campaign)]
    for each in campaign.left:
        lines += ["", *_change(each, campaign.mission.file, campaign.mission.text)]
    if campaign.drafts:
        count = len(campaign.drafts)
        what = "1 scenario notices" if count == 1 else f"{count} scenarios notice"
        where = (
            f"written to {written}"
            if written is not None
            else "--write adds them to the scenarios of the mission"
        )
        lines += ["", f"  {what} what a scenario can: {where}.", ""]
        lines += [line for each in campaign.drafts for line in each.text("    ").splitlines()]
    return "\n".join(lines)


def _headline(campaign: Campaign) -> str:
    left = len(campaign.left)
    count = len(campaign.judged)
    head = f"{campaign.mission.name}: {count} small change{'s' * (count != 1)}, "
    if not left:
        return head + "all that make a difference are noticed"
    return head + f"{left} of them {'is' if left == 1 else 'are'} not noticed"


def _table(campaign: Campaign) -> Iterator[str]:
    counts = counts_of(campaign.judged)
    rows = [
        [family, *(str(counts[family].get(verdict, 0) or "") for verdict in COLUMNS)]
        for family in FAMILIES
        if family in counts
    ]
    sums = [str(sum(row.get(verdict, 0) for row in counts.values())) for verdict in COLUMNS]
    table = [["changed", "tried", *COLUMNS.values()]]
    table += [[row[0], str(sum(counts[row[0]].values())), *row[1:]] for row in rows]
    table.append(["all", str(len(campaign.judged)), *sums])
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    for row in table:
        cells = [row[0].ljust(widths[0])] + [
            cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)
        ]
        yield f"  {'  '.join(cells)}".rstrip()


def _change(judged: Judged, file: Path, text: str) -> Iterator[str]:
    mutation = judged.mutation
    yield f"  {_verdict(judged)}: {mutation.what}"
    yield f"    {file}:{mutation.line}"
    yield from (f"    {line}" for line in diff_of(text, mutation.text))
    if judged.draft is not None:
        yield f"    A scenario notices it: {judged.by}"
    elif judged.verdict == UNNOTICED:
        yield "    The verifier tells it from the mission as it is, but no scenario was found that does."


def _verdict(judged: Judged) -> str:
    if judged.verdict == UNDECIDED:
        return f"not told apart within {judged.states} states"
    return "unnoticed"


def diff_of(before: str, after: str) -> Sequence[str]:
    """Return a unified diff of two texts, without the names of files."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), n=1, lineterm="")
    return list(lines)[2:]
