"""A folder of XML files is one project: its files call each other's trees."""

# ruff: noqa: E501  (XML on one line)

import pytest
from florence_btcpp.importer import import_trees

from florence_bt.core.errors import ConfigError


def write(folder, name, trees):
    file = folder / f"{name}.xml"
    file.parent.mkdir(exist_ok=True)
    file.write_text(f'<root BTCPP_format="4">{trees}</root>')


def tree(name, nodes):
    return f'<BehaviorTree ID="{name}">{nodes}</BehaviorTree>'


def test_files_call_the_trees_of_each_other(tmp_path):
    write(tmp_path, "a", tree("A", '<SubTree ID="B" p="{x}"/>'))
    write(tmp_path, "sub/b", tree("B", '<Act p="{p}"/>'))
    (tmp_path / "package.xml").write_text("<package/>")
    imported = import_trees(tmp_path, {})
    assert (sorted(imported.missions), imported.main) == (["a", "b"], None)
    assert "run: b" in imported.files["a.yaml"]
    assert len([name for name in imported.files if name.endswith(".skills.yaml")]) == 1
    left_out = [f.message for f in imported.findings if f.file.endswith("package.xml")]
    assert left_out == ["a file that begins with <package> is left out"]


def test_a_file_calls_its_own_trees_where_names_are_the_same(tmp_path):
    write(tmp_path, "go", tree("MainTree", '<SubTree ID="Help"/>') + tree("Help", "<A/>"))
    write(tmp_path, "come", tree("MainTree", '<SubTree ID="Help"/>') + tree("Help", "<B/>"))
    imported = import_trees(tmp_path, {})
    assert sorted(imported.missions) == ["come_help", "come_main_tree", "go_help", "go_main_tree"]
    assert "run: go_help" in imported.files["go_main_tree.yaml"]
    assert "run: come_help" in imported.files["come_main_tree.yaml"]


def test_a_file_that_another_includes_is_read_once(tmp_path):
    write(tmp_path, "a", '<include path="b.xml"/>' + tree("A", '<SubTree ID="B"/>'))
    write(tmp_path, "b", tree("B", "<Act/>"))
    assert sorted(import_trees(tmp_path, {}).missions) == ["a", "b"]


@pytest.mark.parametrize(
    ("files", "problem"),
    [(0, "the folder has no XML file"), (101, "the folder has 101 XML files"), (1, "the folder has no tree")],
)
def test_folders_that_are_no_project(tmp_path, files, problem):
    for number in range(files):
        (tmp_path / f"{number}.xml").write_text("<package/>")
    with pytest.raises(ConfigError, match=problem):
        import_trees(tmp_path, {})


def test_files_of_the_same_name_in_sub_folders(tmp_path):
    write(tmp_path, "a/tree", tree("MainTree", '<SubTree ID="Help"/>') + tree("Help", "<A/>"))
    write(tmp_path, "b/tree", tree("MainTree", '<SubTree ID="Help"/>') + tree("Help", "<B/>"))
    write(tmp_path, "c/plain", "<BehaviorTree><A/></BehaviorTree>")
    write(tmp_path, "d/plain", "<BehaviorTree><B/></BehaviorTree>")
    imported = import_trees(tmp_path, {})
    assert sorted(imported.missions) == [
        *("a_tree_help", "a_tree_main_tree", "b_tree_help", "b_tree_main_tree", "c_plain", "d_plain")
    ]
    assert "run: b_tree_help" in imported.files["b_tree_main_tree.yaml"]


BAD_FILES = {
    "not_xml": "<root><BehaviorTree",
    "empty": "",
    "version": '<root BTCPP_format="9"><BehaviorTree ID="Bad"><A/></BehaviorTree></root>',
    "rules": '<root BTCPP_format="4"><BehaviorTree ID="Bad"><Inverter><A/><B/></Inverter></BehaviorTree></root>',
    "two_roots": '<root BTCPP_format="4"><BehaviorTree ID="Bad"><A/><B/></BehaviorTree></root>',
    "itself": '<root BTCPP_format="4"><BehaviorTree ID="Bad"><SubTree ID="Bad"/></BehaviorTree></root>',
    "deep": f'<root BTCPP_format="4"><BehaviorTree ID="Bad">{"<Inverter>" * 60}<A/>{"</Inverter>" * 60}</BehaviorTree></root>',
    "entities": '<!DOCTYPE root [<!ENTITY x "y">]><root>&x;</root>',
    "long_name": f'<root BTCPP_format="4"><BehaviorTree ID="Bad"><A x="{"y" * 10_001}"/></BehaviorTree></root>',
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_one_bad_file_is_left_out_and_the_others_are_imported(tmp_path, name):
    write(tmp_path, "good", tree("Good", "<A/>"))
    (tmp_path / f"{name}.xml").write_text(BAD_FILES[name])
    imported = import_trees(tmp_path, {})
    assert imported.missions == ("good",)
    left_out = [f for f in imported.findings if f.file == str(tmp_path / f"{name}.xml")]
    assert [f.severity for f in left_out] == ["warning"]
    assert left_out[0].message.startswith("the file is left out: ")


@pytest.mark.parametrize("path", ["nowhere.xml", "/etc/passwd", "bad.xml", ""])
def test_a_wrong_include_leaves_out_only_what_it_names(tmp_path, path):
    write(tmp_path, "a", f'<include path="{path}"/>' + tree("A", "<Act/>"))
    write(tmp_path, "b", tree("B", "<Act/>"))
    (tmp_path / "bad.xml").write_text("<root>")
    imported = import_trees(tmp_path, {})
    assert sorted(imported.missions) == ["a", "b"]
    assert {f.severity for f in imported.findings} == {"warning", "notice"}


def test_a_folder_of_bad_files_only(tmp_path):
    (tmp_path / "bad.xml").write_text("<root>")
    imported = import_trees(tmp_path, {})
    assert (imported.files, {f.severity for f in imported.findings}) == ({}, {"warning", "error"})
    assert any("not XML" in f.message for f in imported.findings)
