"""Progress in a pipe: a line every few seconds, also while the program computes."""

import re
import threading

import click
import pytest

from missions.cli.bodies.status_line import PipeLines


class Printed:
    """Gathers lines; each of them sets an event."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.lines: list[str] = []
        self.more = threading.Event()
        monkeypatch.setattr(click, "echo", self._add)

    def _add(self, text: str, **_: object) -> None:
        self.lines.append(text)
        self.more.set()

    def next(self) -> str:
        self.more.clear()
        assert self.more.wait(30.0)
        return self.lines[-1]


def test_the_newest_text_is_printed_again_and_again(monkeypatch: pytest.MonkeyPatch) -> None:
    printed, pipe = Printed(monkeypatch), PipeLines(period_s=0.01)
    with pipe.running():
        pipe.doing("compiling the flight code")
        assert re.fullmatch(r"compiling the flight code: \d+ s so far", printed.next())
        pipe.show("12.0 s: pattern, 10.0 m")
        while printed.next() != "12.0 s: pattern, 10.0 m":
            pass
    count = len(printed.lines)
    assert not printed.more.wait(0.0) or len(printed.lines) == count  # nothing after the end


def test_nothing_is_printed_before_something_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    printed, pipe = Printed(monkeypatch), PipeLines(period_s=1e-4)
    with pipe.running():
        for _ in range(10_000):
            pass
    assert printed.lines == []


def test_a_short_program_prints_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    printed, pipe = Printed(monkeypatch), PipeLines()
    with pipe.running():
        pipe.show("text")
    assert printed.lines == []
