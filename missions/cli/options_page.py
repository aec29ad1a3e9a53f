"""The tables of docs/options.md, from the declarations of the fields.

python -m missions.cli.options_page docs/options.md

writes the tables into the page, between its two marks.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import click

from estimators.library import estimator_class
from estimators.names import ESTIMATORS
from flightsim.foundation.options import Declared, declared, unit_of
from flightsim.foundation.user_options import choices_of, written
from missions.cli.declared_options import DeclaredOption, Scope
from missions.cli.main import command_line
from missions.cli.mission_commands import COMMANDS
from missions.cli.options import in_options

BEGIN: Final = "<!-- begin: tables of python -m missions.cli.options_page -->"
END: Final = "<!-- end -->"


def tables() -> str:
    """All tables, as Markdown."""
    return "\n".join((*_missions(), *_commands(), *_estimators()))


def with_tables(page: str) -> str:
    """A page with the tables between its marks.

    Raises:
        ValueError: it has no marks.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"the page lacks {BEGIN} or {END}")
    return f"{before}{begin}\n\n{tables()}\n{end}{after}"


def _missions() -> Iterator[str]:
    yield "## Missions: options of `flightstack fly`\n"
    for name, command in COMMANDS.items():
        yield f"### {name}\n"
        yield "| option | default | what it is |\n|---|---|---|"
        for option in command.options:
            if isinstance(option, DeclaredOption):
                yield _row_of(option, " (embedded world)" if option.scope is Scope.EMBEDDED else "")
        yield ""


def commands_of(group: click.Group, path: str = "") -> Iterator[tuple[str, click.Command]]:
    """All commands below a group, each with the words that call it."""
    with click.Context(group) as context:
        for name in group.list_commands(context):
            command = group.get_command(context, name)
            if isinstance(command, click.Group):
                yield from commands_of(command, f"{path}{name} ")
            elif command is not None:
                yield f"{path}{name}", command


def _commands() -> Iterator[str]:
    yield "## Commands: options of each\n"
    tables: dict[tuple[str, ...], list[str]] = {}
    for name, command in commands_of(command_line):
        if rows := tuple(_row_of(each) for each in command.params if isinstance(each, DeclaredOption)):
            tables.setdefault(rows, []).append(name)
    for rows, names in tables.items():  # commands with the same options have one table
        yield f"### {', '.join(names)}\n"
        yield "| option | default | what it is |\n|---|---|---|"
        yield from rows
        yield ""


def _row_of(option: DeclaredOption, more: str = "") -> str:
    default = "" if option.is_flag else in_options(option.user.default_text)
    words = " ".join((option.opts[0], option.user.placeholder)).strip()
    return _row(f"`{words}`", default, in_options(option.user.option.help) + more)


def _estimators() -> Iterator[str]:
    yield "## Estimators: parameters of `--set NAME=VALUE`\n"
    for name in ESTIMATORS:
        yield f"### {name}: parameters\n"
        yield "| parameter | default | what it is |\n|---|---|---|"
        for each in declared(estimator_class(name).PARAMETERS):
            yield _row(f"`{each.name}`", _default(each), in_options(_what(each)))
        yield ""


def _default(each: Declared) -> str:
    """Default of a parameter, in its own unit; in the user's too, where that is another one."""
    shown = written(each.default)
    if each.in_degrees and each.default not in (None, 0.0):
        shown += f" ({written(each.for_users(each.default))} {unit_of(each.name)})"
    return "; ".join(part for part in (shown, each.option.varies) if part)


def _what(each: Declared) -> str:
    choices = ", ".join(choices_of(each.kind))
    return f"{each.option.help} [{choices}]" if choices else each.option.help


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")
