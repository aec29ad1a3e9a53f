"""Questions to the user on the terminal, and the confirmation before a flight with a real vehicle."""

import asyncio
import os
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import Final

import click

from autopilot_bridge.links import VEHICLE_FORMS, SerialPort, parse_address
from autopilot_bridge.links.reach import Reach, reach_of
from flightsim.foundation.plain_text import plain_text
from missions.errors import MissionError
from missions.preflight.before_flight import Confirm, Look

_AGAINST_ADVICE: Final = "fly anyway"
_CHUNK_BYTES: Final = 4096
YES_WORDS: Final = "yes (or y)"
"""The answers that `is_yes` accepts, for the text of a question."""


def is_yes(answer: str) -> bool:
    """Whether an answer is a yes; any other answer, or no answer, is not."""
    return answer.strip().lower() in ("y", "yes")


def can_ask() -> bool:
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
    if sys.platform == "win32":  # a console can't be watched there
        return await _line_by_thread(loop)
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


async def _line_by_thread(loop: asyncio.AbstractEventLoop) -> str:
    """A line of standard input that a thread reads; it doesn't keep the process from ending."""
    typed: asyncio.Future[str] = loop.create_future()

    def take(line: str) -> None:
        if not typed.done():
            typed.set_result(line)

    def read() -> None:
        line = sys.stdin.readline()
        with suppress(RuntimeError):  # the loop was closed: the question is no longer open
            loop.call_soon_threadsafe(take, line)

    threading.Thread(target=read, daemon=True).start()
    return await typed


def leaves_this_machine(connections: Sequence[str]) -> bool:
    """Whether a link is a serial line, or a network beyond this machine.

    Raises:
        AddressError: a connection string is invalid.
    """
    addresses = [parse_address(text, VEHICLE_FORMS) for text in connections]
    return any(isinstance(a, SerialPort) or reach_of(a) is Reach.NETWORK for a in addresses)


def confirmation(
    connections: Sequence[str],
    *,
    yes: bool,
    check: bool,
    screen: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Confirm:
    """Return how a flight is confirmed, unless its vehicles prove to be simulations.

    Args:
        connections: connection strings of the vehicles.
        yes: ask no question; fly when the checks find no problem.
        check: ask for simulations too.
        screen: makes a context in which nothing else writes to the terminal.

    Raises:
        click.UsageError: the link leads away from this machine or `check` is set, there is no terminal to ask
            on, and --yes is missing.
    """
    must_ask = (
        f"{', '.join(connections)}: may be a real vehicle, and there is no terminal to confirm the "
        "flight; give --yes to fly it when the checks find no problem"
    )
    if (check or leaves_this_machine(connections)) and not yes and not can_ask():
        raise click.UsageError(must_ask)

    async def confirm(looks: Sequence[Look]) -> bool:
        problems = sum(len(look.problems) for look in looks)
        with screen():
            for look in looks:
                click.echo(f"vehicle {look.system_id}:", err=True)
                for finding in look.findings:
                    click.echo(f"  {plain_text(str(finding))}", err=True)
            if yes:
                return not problems
            if not can_ask():
                raise MissionError(f"not flown: {must_ask}")
            if not problems:
                return is_yes(await ask(f"Fly? Type {YES_WORDS}"))
            count = "1 problem" if problems == 1 else f"{problems} problems"
            return (await ask(f"{count}. Fly? Type {_AGAINST_ADVICE}")).lower() == _AGAINST_ADVICE

    return confirm
