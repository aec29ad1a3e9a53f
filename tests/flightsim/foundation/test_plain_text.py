"""Texts of a vehicle on a terminal."""

import pytest

from flightsim.foundation.plain_text import plain_text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Low battery", "Low battery"),
        ("2 m \u00b0", "2 m \u00b0"),
        ("a\tb", "a b"),
        ("\x1b[2J\x1b[1;1Hready, no problem", "\\x1b[2J\\x1b[1;1Hready, no problem"),
        ("line\r\nFly? Type yes", "line\\r\\nFly? Type yes"),
        ("\u202eoverride\x9b", "\\u202eoverride\\x9b"),
        ("\ud800", "\\ud800"),
    ],
)
def test_nothing_that_a_terminal_executes_is_left(text: str, shown: str) -> None:
    assert plain_text(text) == shown
    assert plain_text(text).isprintable()
