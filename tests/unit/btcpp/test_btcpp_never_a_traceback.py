"""Whatever stands in a file: it is imported, or refused with an error that a person understands."""

import string
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.app.bringup.config import load_config
from florence_bt.btcpp import import_trees
from florence_bt.core.errors import ConfigError

NUMBERS = st.integers(-(10**30), 10**30).map(str) | st.floats().map(str) | st.integers(0, 16**20).map(hex)
SIGNS = ":= = += -= *= /= + - * / % & | ^ ~ ! && || ( ) ? : ; , == <"
NAMED = "'a' true false a b A_B {a} {=} json: nan inf"
WORDS = NUMBERS | st.sampled_from([*SIGNS.split(), *NAMED.split()])
SCRIPTS = st.lists(WORDS, max_size=12).map(" ".join) | st.text(string.printable, max_size=30)
VALUES = SCRIPTS | st.text(st.characters(exclude_categories=("Cs", "Cc", "Cn")), max_size=20)
TAGS = st.sampled_from(
    [
        *(
            "Script",
            "ScriptCondition",
            "SetBlackboard",
            "Sleep",
            "A",
            "SubTree",
            "LoopInt",
            "LoopString",
            "Repeat",
        ),
        *(
            "Timeout",
            "Switch2",
            "Precondition",
            "RateController",
            "PipelineSequence",
            "RoundRobin",
            "RecoveryNode",
        ),
        *("Sequence", "Parallel", "FollowPath", "GoalUpdatedController", "FlorenceSet", "FlorenceSwitch"),
    ]
)
NAMES = st.sampled_from(
    [
        *(
            "code",
            "value",
            "output_key",
            "msec",
            "p",
            "out",
            "ID",
            "_skipIf",
            "_while",
            "_onSuccess",
            "queue",
            "if",
        ),
        *(
            "num_cycles",
            "variable",
            "case_1",
            "hz",
            "goal",
            "path",
            "error_code_id",
            "name",
            "values",
            "cases",
        ),
    ]
)


def element(children):
    attributes = st.dictionaries(NAMES, VALUES, max_size=4)
    parts = st.tuples(TAGS, attributes, children)
    return parts.map(
        lambda p: (
            f"<{p[0]}{''.join(f' {k}={quoteattr(v)}' for k, v in p[1].items())}>{''.join(p[2])}</{p[0]}>"
        )
    )


TREES = st.recursive(
    element(st.just([])), lambda below: element(st.lists(below, min_size=1, max_size=3)), max_leaves=6
)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz") / "t.xml"


def imported(file, nodes):
    file.write_text(
        f'<root BTCPP_format="4"><BehaviorTree ID="M">{nodes}</BehaviorTree></root>', encoding="utf-8"
    )
    try:
        import_trees(file, {})
    except ConfigError as error:
        assert error.problem


@settings(max_examples=150, deadline=None)
@given(nodes=TREES)
def test_trees(file, nodes):
    imported(file, nodes)


@settings(max_examples=150, deadline=None)
@given(script=SCRIPTS, condition=SCRIPTS)
def test_scripts(file, script, condition):
    asked = f"<A p='{{a}}' _skipIf={quoteattr(condition)}/>"
    imported(file, f"<Sequence><Script code={quoteattr(script)}/>{asked}</Sequence>")


@settings(max_examples=150, deadline=None)
@given(text=st.text(":{}[],'\"\n -?|>#&*!%@`~.0123456789abex", max_size=40).map(lambda text: f"node: {text}"))
def test_configurations(file, text):
    path = Path(file).with_name("robot.yaml")
    path.write_text(text, encoding="utf-8")
    try:
        load_config(path)
    except ConfigError as error:
        assert error.problem
