"""Command lines of the documentation: where they stand, and whether the program takes them."""

import re
import shlex
from typing import Final

import click

from missions.cli.main import command_line

_COMMAND: Final = re.compile(r"^(?:#)? {4,}(flightstack .*?)(?:  +#.*)?$", re.MULTILINE)


def commands_in(text: str) -> list[str]:
    """The indented command lines of a page, a docstring or a comment; synopses are left out."""
    return [line for line in _COMMAND.findall(text) if "[" not in line]


def parse(line: str) -> None:
    """Parse a command line with the program's own parser, without running it.

    Raises:
        click.UsageError: it is not accepted.
    """
    words = shlex.split(line)[1:]
    with click.Context(command_line, info_name="flightstack") as parent:
        command = command_line.get_command(parent, words[0])
        assert command is not None, f"no command {words[0]}"
        command.make_context(words[0], words[1:], parent=parent)
