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
