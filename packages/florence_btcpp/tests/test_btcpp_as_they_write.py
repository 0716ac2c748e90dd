"""What BehaviorTree.CPP takes and other people write: numbers, ports, raw signs, trees without ID, loops."""

# ruff: noqa: E501  (XML and missions on one line)

import pytest
from florence_btcpp.exporter import export_mission

from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations


def tree(nodes, more=""):
    return f'<root BTCPP_format="4"><BehaviorTree ID="M">{nodes}</BehaviorTree>{more}</root>'


@pytest.fixture
def exchange(exchange_with):
    return exchange_with(collect_declarations())


def errors(library, exchange):
    return [
        f.message for f in check(library.missions(), library, exchange.declarations) if f.severity == "error"
    ]


@pytest.mark.parametrize(
    "number", ["1" * 5000, f"0x{'F' * 5000}", "9223372036854775808", "1e999", "0xFFFFFFFFFFFFFFFF"]
)
def test_a_number_that_they_cannot_hold_has_no_equivalent(exchange, number):
    imported = exchange.imported(tree(f'<Script code="a := {number}"/>'))
    assert [f.severity for f in imported.findings if number[:40] in f.message] == ["warning"]
    assert "not_imported" in imported.files["m.yaml"]


@pytest.mark.parametrize(
    "code", ["a := 0xFF", "a := 9223372036854775807", "a := 9223372036854775807 * 9223372036854775807 * 3"]
)
def test_large_numbers_are_imported(exchange, code):
    assert "not_imported" not in exchange.imported(tree(f'<Script code="{code}"/>')).files["m.yaml"]


def test_long_digits_in_ports_are_imported(exchange):
    digits = "9" * 5000
    exchange.imported(
        tree(f'<Sequence><SetBlackboard value="{digits}" output_key="k"/><A p="{digits}"/></Sequence>')
    )


def test_a_port_has_one_direction_wherever_it_is_used(exchange):
    library = exchange.library_of(tree('<Sequence><A p="{x}"/><B q="{x}"/><A p="{x}"/></Sequence>'))
    assert errors(library, exchange) == []
    xml = export_mission("m", library, library.with_declared(exchange.declarations)).xml
    assert xml.count('p="{x}"') == 2


def test_an_element_reads_a_key_before_it_writes_it(exchange):
    library = exchange.library_of(tree('<Sequence><C in="{y}" to="{y}"/><D z="{y}"/></Sequence>'))
    assert errors(library, exchange) == []
    assert list(library.get("m").inputs) == ["before_y"]


def test_trees_without_an_id_are_called_like_their_file(exchange):
    imported = exchange.imported('<root BTCPP_format="4"><BehaviorTree><A/></BehaviorTree></root>')
    assert imported.missions == ("tree",)
    two = '<root BTCPP_format="4"><BehaviorTree><A/></BehaviorTree><BehaviorTree><B/></BehaviorTree></root>'
    assert exchange.imported(two).missions == ("tree", "tree_2")


def test_raw_signs_in_attributes(exchange):
    text = exchange.imported(
        tree('<Precondition if="a>b && color != BLUE" else="FAILURE"><A x=\'a < b &amp; c\'/></Precondition>')
    ).files["m.yaml"]
    assert '$a > $b and $color != "BLUE"' in text
    assert "a < b & c" in text


def test_raw_signs_elsewhere_are_still_an_error(exchange):
    with pytest.raises(ConfigError, match="not XML: not well-formed") as caught:
        exchange.imported(tree('<A x="a && b"/> && '))
    assert caught.value.line == 1


def test_a_port_called_like_a_modifier(exchange):
    library = exchange.library_of(tree('<Sequence><A out="{x}"/><B out="{x}" with="3"/></Sequence>'))
    assert errors(library, exchange) == []


def test_a_text_that_looks_like_something_else(exchange):
    model = (
        '<TreeNodesModel><Action ID="A"><input_port name="p" type="std::string"/></Action></TreeNodesModel>'
    )
    nodes = '<Sequence><SetBlackboard value="true" output_key="k"/><A p="{k}"/><A p="true"/></Sequence>'
    assert errors(exchange.library_of(tree(nodes, model)), exchange) == []
    loop = '<LoopString queue="1;true" value="{k}"><A p="{k}"/></LoopString>'
    assert errors(exchange.library_of(tree(loop, model)), exchange) == []


def test_what_stands_in_a_loop_is_one_node(exchange):
    text = exchange.imported(
        tree(
            '<LoopInt queue="1;2;3" value="{v}"><Sequence><RunOnce then_skip="false"><A/></RunOnce><B p="{v}"/></Sequence></LoopInt>'
        )
    ).files["m.yaml"]
    assert text.count("once:") == 1 and "repeat: 3" in text


def test_the_library_takes_what_is_taken_here():
    library = pytest.importorskip("behaviortreepy")
    trees = '<BehaviorTree><Precondition if="1 < 2 && 3 > 2" else="FAILURE"><AlwaysSuccess/></Precondition></BehaviorTree>'
    loaded = library.BehaviorTreeFactory().create_tree_from_text(f'<root BTCPP_format="4">{trees}</root>')
    assert loaded.tick_exactly_once() == library.NodeStatus.SUCCESS


def test_spaces_and_signs_that_nobody_sees_are_written_in_quotes(exchange):
    xml = tree('<say text="good\u00a0morning\u200b"/>')
    assert '"good\u00a0morning\u200b"' in exchange.imported(xml).files["m.yaml"]
    assert errors(exchange.library_of(xml), exchange) == []
