"""Files that are broken, enormous or hostile: a clear error with its line, at once."""

# ruff: noqa: E501  (XML and missions on one line)

import pytest
from florence_btcpp.xml_source import MAX_DEPTH, parse_xml, read_xml

from florence_bt.core.errors import ConfigError
from florence_bt.core.text_files import MAX_BYTES

BOMB = b"""<?xml version="1.0"?>
<!DOCTYPE root [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;">]>
<root>&c;</root>"""
OUTSIDE = b'<!DOCTYPE root [<!ENTITY x SYSTEM "file:///etc/passwd">]>\n<root>&x;</root>'

BAD = [
    (b"", 1, "no element found"),
    (b"<root>", 1, "no element found"),
    (b"<root>\n<a></root>", 2, "mismatched tag"),
    (b"<root>\n<a b='1' b='2'/></root>", 2, "duplicate attribute"),
    (b"<root>\n\xff\xfe</root>", 2, "not well-formed"),
    (b"<root>\n\x00</root>", 2, "not well-formed"),
    (b"mission: not_xml", 1, "not XML: syntax error"),
    (b'<?xml version="1.0" encoding="klingon"?><root/>', 1, "unknown encoding"),
    (b"<root>\n&nothing;</root>", 2, "undefined entity"),
    (BOMB, 2, "a document type is not allowed"),
    (OUTSIDE, 1, "a document type is not allowed"),
    (b"<root><T>" + b"<a>" * (MAX_DEPTH + 1), 1, f"nested more than {MAX_DEPTH} deep"),
    (b"<root>" + b"<a/>" * 60_000 + b"</root>", 1, "more than 5000 elements"),
    (
        b"<root><a b='" + b"x" * 10_001 + b"'/></root>",
        1,
        "an attribute of <a> has more than 10000 characters",
    ),
    (b"<root><a>" + b"x" * 10_001 + b"</a></root>", 1, "the text in <a> has more than 10000 characters"),
    (b"<root>" + b"a<!---->" * 60_000 + b"</root>", 1, "the text in <root> has more than 10000 characters"),
    (b"x" * (MAX_BYTES + 1), None, f"more than {MAX_BYTES} bytes"),
]


@pytest.mark.parametrize(("data", "line", "message"), BAD)
def test_bad_xml(tmp_path, data, line, message):
    with pytest.raises(ConfigError, match=message) as caught:
        parse_xml(data, tmp_path / "bad.xml")
    assert (caught.value.line, caught.value.file) == (line, str(tmp_path / "bad.xml"))


def test_a_file_of_100_megabytes_is_not_read_to_its_end(tmp_path):
    file = tmp_path / "big.xml"
    with file.open("wb") as big:
        big.truncate(100_000_000)
    with pytest.raises(ConfigError, match="more than"):
        read_xml(file)


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path, tmp_path / "nowhere.xml"):
        with pytest.raises(ConfigError, match="there is no such file"):
            read_xml(path)


def test_other_encodings_and_places():
    text = '<?xml version="1.0" encoding="{}"?>\n<root>\n  <a name="ä"/>\n</root>'
    for encoding in ("utf-8", "latin-1", "utf-16"):
        from pathlib import Path

        root = parse_xml(text.format(encoding).encode(encoding), Path("a.xml"))
        assert root.children[0].get("name") == "ä"
    assert (root.children[0].position.line, root.children[0].position.column) == (3, 3)


def test_an_element_with_endless_attributes_is_refused(tmp_path):
    file = tmp_path / "wide.xml"
    ports = " ".join(f'p{number}="x"' for number in range(20_000))
    file.write_text(f'<root BTCPP_format="4"><BehaviorTree ID="M"><A {ports}/></BehaviorTree></root>')
    with pytest.raises(ConfigError, match="<A> has more than 500 attributes"):
        read_xml(file)
