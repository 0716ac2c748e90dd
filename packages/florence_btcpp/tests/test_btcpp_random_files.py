"""Whatever stands in a file: an import ends in missions that can be read, or in errors with places."""

import random
from xml.sax.saxutils import quoteattr

import pytest
from florence_btcpp.node_models import category_of, known_nodes
from florence_btcpp.vocabulary import (
    POST_CONDITIONS,
    PRE_CONDITIONS,
)

from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from tests.sweeps import sweep

TAGS = sorted(set(known_nodes()) | {"SubTree", "Action", "Foo", "turn"})
VALUES = [
    *(
        "{a}",
        "{b}",
        "{=}",
        "{@r}",
        "1",
        "-1",
        "2.5",
        "true",
        "x",
        "",
        "florence:{",
        "florence:$a",
        "json:{}",
        "a:=1",
    ),
    *(
        "a==1",
        "a>b&&c",
        "1;2;3",
        "x;y",
        "{",
        "}",
        "$x",
        "a ? 1 : 2",
        "a+='x'",
        "'q'",
        "${$a}",
        "null",
        "~",
        "a: b",
    ),
    *(
        "[1",
        "- x",
        "#c",
        "A B",
        "\n",
        "é",
        "FAST",
        "!a",
        "-b",
        "a:=FAST;b:=a;c:=b+1",
        "!!int 3",
        "&x y",
        "*x",
        "\t",
    ),
]
NAMES = [
    *(
        "ID",
        "name",
        "code",
        "if",
        "else",
        "value",
        "output_key",
        "msec",
        "num_attempts",
        "variable",
        "case_1",
        "queue",
    ),
    *(
        "success_count",
        "goal",
        "angle",
        "_autoremap",
        "_florence",
        "_florence_when",
        "_florence_because",
        "p1",
        "P2",
    ),
    *(
        "_florence_reason",
        "_florence_set",
        "seconds",
        "values",
        "cases",
        "names",
        "on",
        "attempt",
        "when",
        "entry",
    ),
    *(*PRE_CONDITIONS, *POST_CONDITIONS),
]


def element(dice, depth):
    tag = dice.choice(TAGS)
    attributes = {dice.choice(NAMES): dice.choice(VALUES) for _ in range(dice.randint(0, 4))}
    if tag in ("SubTree", "Action"):
        attributes["ID"] = dice.choice(["T1", "T2", "T3", "nope", "turn", "FlorenceSet"])
    category = category_of(tag)
    count = {"Control": dice.randint(1, 3), "Decorator": 1}.get(category or "", 0)
    if tag.startswith("Switch"):
        count, attributes["variable"] = int(tag[6:]) + 1, "{a}"
    if depth <= 0 and count:
        tag, attributes, count = "Foo", {}, 0
    written = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
    return f"<{tag}{written}>{''.join(element(dice, depth - 1) for _ in range(count))}</{tag}>"


@pytest.mark.parametrize("seed", sweep(range(120), every=4))
def test_random_file(exchange_with, seed):
    dice = random.Random(seed)
    trees = "".join(f'<BehaviorTree ID="T{n}">{element(dice, 3)}</BehaviorTree>' for n in (1, 2, 3))
    exchange = exchange_with(collect_declarations())
    imported = exchange.imported(f'<root BTCPP_format="4" main_tree_to_execute="T1">{trees}</root>')
    assert all(finding.line >= 1 and finding.message for finding in imported.findings)
    if not imported.files:
        assert any(finding.severity == "error" for finding in imported.findings)
        return
    folder = exchange.folder / "m"
    folder.mkdir()
    for name, text in imported.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    library = MissionLibrary.load([folder], built_in=False)
    assert library.findings == [] and [mission.findings for mission in library] == [()] * 3
    check(library.missions(), library, exchange.declarations)
    try:
        exchange.export("t1", library)
    except ConfigError as error:
        assert error.file is not None and error.line is not None
