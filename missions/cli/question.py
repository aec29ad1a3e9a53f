"""A question to the user on the terminal, asked by one task while other tasks continue."""

import asyncio
import os
import sys
from contextlib import suppress
from typing import Final

import click

_CHUNK_BYTES: Final = 4096
YES_WORDS: Final = "yes (or y)"
"""The answers that `is_yes` accepts, for the text of a question."""


def is_yes(answer: str) -> bool:
    """Whether an answer is a yes; any other answer, or no answer, is not."""
    return answer.strip().lower() in ("y", "yes")


def somebody_is_there() -> bool:
    """Whether there is a terminal for questions; the input may also be closed."""
    return sys.stdin is not None and not sys.stdin.closed and sys.stdin.isatty()


async def ask(question: str) -> str:
    """Print a question on stderr and wait for a line from the terminal; "" when the terminal closes without
    one.

    This waits as a task, not in `input()`: Ctrl-C ends the wait, and text typed afterwards is not used as an
    answer.
    """
    click.echo(f"{question}: ", nl=False, err=True)
    answer = ""
    try:
        answer = await _line(sys.stdin.fileno())
    finally:
        if not answer.endswith("\n"):
            with suppress(OSError):  # the terminal may have been closed
                click.echo(err=True)
    return answer.strip()


async def _line(terminal: int) -> str:
    loop = asyncio.get_running_loop()
    typed = bytearray()
    done: asyncio.Future[None] = loop.create_future()

    def read() -> None:
        try:
            data = os.read(terminal, _CHUNK_BYTES)
        except OSError:  # the terminal was closed
            data = b""
        typed.extend(data)
        if not done.done() and (not data or b"\n" in typed):
            done.set_result(None)

    loop.add_reader(terminal, read)
    try:
        await done
    finally:
        loop.remove_reader(terminal)
    return typed.decode(errors="replace")
