"""A folder of XML files is one project: its files call each other's trees."""

import pytest

from florence_bt.btcpp import import_trees
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
