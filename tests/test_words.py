"""Packages, pages and examples use the field's words (docs/contributing.md), in names and in text."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
AVOIDED = (
    *("heard", "told", "somebody", "nobody", "anybody", "believe", "believes", "believed"),
    "expected[ _]wind",
)
"""Words of the list that have no other meaning here."""
WORD = re.compile(rf"(?<![a-z])(?:{'|'.join(AVOIDED)})(?![a-z])", re.IGNORECASE)
PAGES = ("README.md", "CHANGELOG.md", "docs/**/*.md")
SOURCES = ("flightsim", "autopilot_bridge", "estimators", "missions", "examples")
FILES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in (*PAGES, *(f"{top}/**/*.{kind}" for top in SOURCES for kind in ("py", "toml")))
    for path in ROOT.glob(pattern)
)


def avoided(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if WORD.search(line)]


def test_words_of_the_field() -> None:
    found = {file: avoided((ROOT / file).read_text(encoding="utf-8")) for file in FILES}
    assert {file: lines for file, lines in found.items() if lines}.keys() == {"docs/contributing.md"}


def test_the_test_sees_words() -> None:
    """Parts of names count, parts of other words do not."""
    assert avoided("x = _heard_us\nthreshold\nIs told so.\nsatellite") == ["x = _heard_us", "Is told so."]


def test_one_name_is_for_one_thing() -> None:
    """The names of the page's table are defined once; those that say too little are not defined."""
    page = (ROOT / "docs/contributing.md").read_text(encoding="utf-8")
    table = page.split("One name is for one thing.")[1].split("`tests/test_words.py`")[0]
    rows, refused = table.split("alone say too little")[0].rsplit("\n\n", 1)
    names = {
        name
        for row in re.findall(r"^\| (`.*?) \|", rows, re.MULTILINE)
        for name in re.findall(r"`(\w+)`", row)
    }
    assert len(names) > 8
    defined = [
        name
        for file in FILES
        if file.endswith(".py")
        for name in re.findall(
            r"^(?:class (\w+)|(\w+) = tuple\[)", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE
        )
        for name in name
        if name
    ]
    assert {name: defined.count(name) for name in names if defined.count(name) != 1} == {}
    assert not set(re.findall(r"`(\w+)`", refused)) & set(defined)
