"""Whatever stands in a file: it is imported, or refused with an error that a person understands."""

# ruff: noqa: E501  (XML on one line)

import random
import re
import string
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from florence_btcpp import convert
from florence_btcpp.importer import import_trees
from florence_btcpp.node_models import nav2_nodes
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.app.bringup.config import load_config
from florence_bt.core.errors import ConfigError, FlorenceError
from tests.sweeps import examples, sweep

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


@settings(max_examples=examples(150), deadline=None)
@given(nodes=TREES)
def test_trees(file, nodes):
    imported(file, nodes)


NUMBERED = [
    *("failure_count", "success_count", "num_cycles", "num_attempts", "number_of_retries", "hz", "max_rate"),
    *("distance", "msec", "delay_msec", "seconds", "threshold", "failure_threshold", "wrap_around", "goal"),
    *("value", "items", "queue", "cases", "case_1", "codes", "variable", "if", "else", "if_empty"),
]


@pytest.mark.parametrize("value", ["-1", "0", "{n}", "{none}", "", "1.5", "x", "9" * 20, "inf", "nan", "{}"])
def test_every_node_with_an_odd_number(file, value):
    attributes = " ".join(f"{name}={quoteattr(value)}" for name in NUMBERED)
    for tag in sorted({*convert._HANDLERS, *nav2_nodes()}):
        for below in ("", "<A/>", "<A/><A/>"):
            imported(file, f'<Sequence><Script code="n := 3"/><{tag} {attributes}>{below}</{tag}></Sequence>')


@pytest.mark.slow
@settings(max_examples=examples(150), deadline=None)
@given(script=SCRIPTS, condition=SCRIPTS)
def test_scripts(file, script, condition):
    asked = f"<A p='{{a}}' _skipIf={quoteattr(condition)}/>"
    imported(file, f"<Sequence><Script code={quoteattr(script)}/>{asked}</Sequence>")


TREE = """<root BTCPP_format="4" main_tree_to_execute="M"><BehaviorTree ID="M"><Sequence _skipIf="a &gt; 1" name="x">
<SubTree ID="S" _autoremap="true" k="{k}"/><SubTree ID="S" k="5"/><SetBlackboard output_key="k" value="{j}"/>
<Fallback><A p="{k}" q="1"/><Inverter><A p="fast" q="{j}"/></Inverter><Timeout msec="{t}"><B out="{k}"/></Timeout></Fallback>
<Switch2 variable="{k}" case_1="1" case_2="b"><A/><B/><A p="1;2;3"/></Switch2><Script code="i := i + 1; j = k ? 'a' : 2"/>
<PipelineSequence><RateController hz="1"><A p="{j}"/></RateController><B/></PipelineSequence></Sequence></BehaviorTree>
<BehaviorTree ID="S"><RetryUntilSuccessful num_attempts="{k}"><IfThenElse><C v="{k}"/><SetBlackboard output_key="k" value="1"/>
<Repeat num_cycles="3"><SubTree ID="L"/></Repeat></IfThenElse></RetryUntilSuccessful></BehaviorTree>
<BehaviorTree ID="L"><Parallel success_count="1"><D/><LoopInt queue="1;2" value="{v}"><A p="{v}"/></LoopInt></Parallel></BehaviorTree>
<TreeNodesModel><Action ID="A"><input_port name="p" type="int" default="{p}"/><inout_port name="q"/></Action>
<SubTree ID="S"><inout_port name="k" default="{k}"/><output_port name="v"/></SubTree></TreeNodesModel></root>"""
PIECES = re.findall(r"<[^<>]*>", TREE)
ATTRIBUTES = re.findall(r"""[\w]+="[^"]*\"""", TREE)


def mutant(dice):
    """The tree after some accidents: pieces lost, doubled, moved, nested; attributes exchanged; the end cut off."""
    text = TREE.replace('BTCPP_format="4"', dice.choice(['BTCPP_format="4"', "", 'BTCPP_format="3"']))
    for _ in range(dice.randint(1, 6)):
        one, other = dice.choice(PIECES), dice.choice(PIECES)
        match dice.randint(0, 6):
            case 0:
                text = text.replace(one, other, dice.choice([1, -1]))
            case 1:
                text = text.replace(one, "", 1)
            case 2:
                text = text.replace(one, one + other, 1)
            case 3:
                text = text.replace(dice.choice(ATTRIBUTES), dice.choice(ATTRIBUTES), 1)
            case 4:
                name, depth = (
                    dice.choice(["Inverter", "Sequence", "A", "SubTree"]),
                    dice.choice([3, 39, 200, 300]),
                )
                text = text.replace("<D/>", f"<{name}>" * depth + "<D/>" + f"</{name}>" * depth)
            case 5:
                value = dice.choice(
                    ["", "{}", "{@k}", "((((", "9" * 50, "{" * 20, "a" * 9_000, "+".join("a" * 500), "\0"]
                )
                text = re.sub(
                    re.escape(dice.choice(ATTRIBUTES)), f'p{dice.randint(0, 9)}="{value}"', text, count=1
                )
            case 6 if dice.random() < 0.2:
                text = text[: dice.randint(0, len(text))]
    return text


@pytest.mark.slow
@pytest.mark.parametrize("seed", sweep(range(8), every=4))
def test_files_after_accidents(tmp_path, seed):
    dice = random.Random(seed)
    (tmp_path / "t.xml").write_text("<root><BehaviorTree ID='Other'><A/></BehaviorTree></root>")
    for number in range(40):
        broken = tmp_path / f"{number % 3}" / "t.xml"
        broken.parent.mkdir(exist_ok=True)
        broken.write_text(mutant(dice), encoding="utf-8")
        for path in (broken, tmp_path):
            try:
                done = import_trees(path, {})
            except FlorenceError as error:
                assert path == broken and str(error)
            else:
                assert done.files or any(finding.severity == "error" for finding in done.findings)


@pytest.mark.slow
def test_long_chains_of_trees(tmp_path):
    chain = [
        f'<BehaviorTree ID="T{n}"><SubTree ID="T{n + 1}" _autoremap="true"/></BehaviorTree>'
        for n in range(1200)
    ]
    file = tmp_path / "t.xml"
    for last in (
        '<BehaviorTree ID="T1200"><A p="{x}"/></BehaviorTree>',
        '<BehaviorTree ID="T1200"><SubTree ID="T0"/></BehaviorTree>',
    ):
        file.write_text(f'<root BTCPP_format="4">{"".join(chain)}{last}</root>')
        done = import_trees(file, {})
        assert done.files or any("calls itself" in finding.message for finding in done.findings)


@settings(max_examples=examples(150), deadline=None)
@given(text=st.text(":{}[],'\"\n -?|>#&*!%@`~.0123456789abex", max_size=40).map(lambda text: f"node: {text}"))
def test_configurations(file, text):
    path = Path(file).with_name("robot.yaml")
    path.write_text(text, encoding="utf-8")
    try:
        load_config(path)
    except ConfigError as error:
        assert error.problem
