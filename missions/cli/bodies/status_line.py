"""The status line of a terminal, which other output does not disturb."""

import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from shutil import get_terminal_size
from typing import Any, Final, TextIO, cast

import click

from autopilot_bridge.clock.pacing import wall_time_s
from flightsim.foundation.kernels import when_compiling

__all__ = ["PipeLines", "StatusLine", "announce_compiling"]

PIPE_PERIOD_S: Final = 10.0
COMPILING: Final = "compiling the flight code"


@contextmanager
def announce_compiling(say: Callable[[str], None]) -> Iterator[None]:
    """Context in which it is said once that flight code is compiled, if the cache does not have all of it."""
    with when_compiling(lambda: say(f"{COMPILING}: half a minute or so, the first time")):
        yield


class PipeLines:
    """Progress in a pipe or a file: the newest text as a line on stderr every few seconds, also while the
    program computes and reports nothing.

    Args:
        period_s: wall time between two lines.
    """

    def __init__(self, period_s: float = PIPE_PERIOD_S) -> None:
        self._period_s = period_s
        self._text: Callable[[], str] = str
        self._other_line = False
        self._done = threading.Event()

    def show(self, text: Callable[[], str] | str) -> None:
        """The newest text, or what makes it: a text stays true while nothing else is reported."""
        self._text = text if callable(text) else lambda: text

    def doing(self, what: str) -> None:
        """What is done now and reports no progress: its line says for how long."""
        begun_s = wall_time_s()
        self._text = lambda: f"{what}: {wall_time_s() - begun_s:.0f} s so far"

    def said(self) -> None:
        """Another line was printed: the next one can wait."""
        self._other_line = True

    @contextmanager
    def running(self) -> Iterator[None]:
        """Context in which lines are printed."""
        printer = threading.Thread(target=self._print, name="progress", daemon=True)
        printer.start()
        try:
            yield
        finally:
            self._done.set()
            printer.join()

    def _print(self) -> None:
        while not self._done.wait(self._period_s):
            text = self._text()
            if text and not self._other_line:
                with suppress(OSError, ValueError):  # whoever read it is gone
                    click.echo(text, err=True)
            self._other_line = False


class StatusLine:
    """A line on a terminal in which each text replaces the last one. In a pipe it shows nothing."""

    def __init__(self) -> None:
        self._stream = sys.stderr
        self.terminal = self._stream.isatty()
        self._width = 0
        self._others_line = False  # other code has begun a line, and not ended it

    def show(self, text: str) -> None:
        """Replace the text; what does not fit into a line of the terminal is cut off."""
        if self.terminal and not self._others_line:
            text = text[: max(1, get_terminal_size().columns - 1)]
            click.echo(f"\r{text:<{self._width}}", nl=False, file=self._stream)
            self._width = len(text)

    def erase(self) -> None:
        """Leave the line empty, for other output on it."""
        if self._width:
            click.echo(f"\r{'':<{self._width}}\r", nl=False, file=self._stream)
            self._width = 0

    def end(self) -> None:
        """Keep the last text, and continue on the next line."""
        if self._width:
            click.echo("", file=self._stream)
            self._width = 0

    @contextmanager
    def shared(self) -> Iterator[None]:
        """Context in which other code prints to the terminal: the line is erased for each text of it and
        shown again below. Output to a pipe or a file is left alone.
        """
        streams = sys.stdout, sys.stderr
        if self.terminal:
            sys.stdout, sys.stderr = (
                cast(TextIO, _AboveLine(stream, self)) if stream.isatty() else stream for stream in streams
            )
        try:
            yield
        finally:
            sys.stdout, sys.stderr = streams

    def make_room(self, text: str) -> None:
        """Process a text that other code is about to print on the same terminal."""
        self.erase()
        self._others_line = not text.endswith("\n")


class _AboveLine:
    """A stream to a terminal that has a status line; all but writing is the stream's own."""

    def __init__(self, stream: TextIO, line: StatusLine) -> None:
        self._stream = stream
        self._line = line

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        if text:
            self._line.make_room(text)
        return self._stream.write(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)
