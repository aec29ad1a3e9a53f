"""The status line of a terminal, which other output does not disturb."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from typing import Any, TextIO, cast

import click

from flightsim.foundation.kernels import when_compiling

__all__ = ["StatusLine", "announce_compiling"]


@contextmanager
def announce_compiling(say: Callable[[str], None]) -> Iterator[None]:
    """Context in which it is said once that flight code is compiled, if the cache does not have all of it."""
    with when_compiling(lambda: say("compiling the flight code: half a minute or so, the first time")):
        yield


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
