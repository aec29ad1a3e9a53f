"""Documents that the parsers of the standard library don't bear."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightsim.foundation.documents import read_json, read_toml, read_xml
from flightsim.foundation.file_content import FileError

_BILLION = "".join(f'<!ENTITY e{n + 1} "{f"&e{n};" * 10}">' for n in range(9))


@pytest.mark.parametrize(
    ("read", "text", "reason"),
    [
        (read_toml, "a = " + "[" * 50_000, "nested too deep"),
        (read_toml, "a" + ".a" * 50_000 + " = 1", "nested too deep"),  # gigabytes in tomllib
        (read_toml, "a = " + "{a = " * 50_000, "nested too deep"),
        (read_toml, "a = " + "9" * 400, r"its number 9+\.\.\. is larger than any number"),
        (read_toml, "a = " + "9" * 5000, "not TOML"),
        (read_toml, "a = ", "not TOML: Invalid value"),
        (read_json, "[" * 100_000, "nested too deep"),
        (read_json, '{"a":' * 100 + "1" + "}" * 100, "nested too deep"),
        (read_json, "[" + "9" * 400 + "]", r"its number 9+\.\.\. is larger"),
        (read_json, "9" * 5000, "a number in it is larger"),
        (read_json, '{\n"a" 1}', "not JSON: line 2: Expecting ':' delimiter"),
        (read_xml, "<a>" * 100_000, "nested too deep"),
        (read_xml, f'<!DOCTYPE a [<!ENTITY e0 "lol">{_BILLION}]><a>&e9;</a>', "not XML: .*amplification"),
        (read_xml, '<?xml version="1.0" encoding="klingon"?><a/>', "not XML: unknown encoding"),
        (read_xml, "<a><b></a>", "not XML: mismatched tag"),
    ],
    ids=range(15),
)
def test_what_is_too_much_or_damaged_has_one_reason(
    tmp_path: Path, read: Callable[[Path], Any], text: str, reason: str
) -> None:
    path = tmp_path / "a.file"
    path.write_text(text)
    with pytest.raises(FileError, match=rf"a\.file can't be read: .*{reason}"):
        read(path)


def test_documents_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.file"
    path.write_text("[a.b]\nc = 9223372036854775807\ntext = '" + "a." * 40 + "'\n")
    assert read_toml(path)["a"]["b"]["c"] == 2**63 - 1
    path.write_text('{"a": [1, 2.5, null]}')
    assert read_json(path) == {"a": [1, 2.5, None]}
    path.write_text("<a><b c='d'/></a>")
    assert read_xml(path).getroot()[0].attrib == {"c": "d"}
