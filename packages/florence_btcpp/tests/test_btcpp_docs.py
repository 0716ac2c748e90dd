"""The page about BehaviorTree.CPP says what is so."""

import re
from pathlib import Path

from florence_btcpp.importer import import_trees
from florence_btcpp.node_models import known_nodes
from florence_btcpp.vocabulary import POST_CONDITIONS, PRE_CONDITIONS

from florence_bt.trees.language.declarations import collect_declarations

PAGE = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_the_example_becomes_what_the_page_says(tmp_path):
    xml, mission, skills = re.findall(r"```(?:xml|yaml)\n(.*?)```", PAGE, flags=re.DOTALL)
    file = tmp_path / "fetch.xml"
    file.write_text(xml)
    imported = import_trees(file, collect_declarations())
    assert imported.files["fetch_cup.yaml"] == mission
    assert imported.files["fetch.skills.yaml"].startswith(skills)
    assert imported.skills == ("find_cup", "grasp_cup")


def test_every_element_is_on_the_page():
    known = {*known_nodes(), *PRE_CONDITIONS, *POST_CONDITIONS, "SubTree"}
    named = set(re.findall(r"[A-Z_]\w+", PAGE)) | {"Switch3", "Switch4", "Switch5", "RetryUntilSuccesful"}
    assert sorted(known - named) == []
