"""`flightstack study`: Monte Carlo studies of the package, of users' files, and of any mission."""

from typing import Final

import click

from missions.cli.study_command import file_command
from missions.cli.study_library import STUDIES
from missions.cli.study_results import compare, show
from missions.cli.sweep import SWEEP

_OTHERS: Final = {"sweep": SWEEP.command("sweep"), "show": show, "compare": compare}


class _Studies(click.Group):
    """The group of studies. An unknown name is reported with a list of the known ones."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*STUDIES, *_OTHERS]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in STUDIES:
            return STUDIES[cmd_name].command(cmd_name)
        if cmd_name.endswith(".py"):
            return file_command().command(cmd_name)
        return _OTHERS.get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            raise click.UsageError(
                f"no study {args[0]!r}; there are {', '.join(STUDIES)}, sweep for any mission, and the "
                "path of a "
                "file of your own (.py)"
            )
        return super().resolve_command(ctx, args)


@click.group(cls=_Studies)
def study() -> None:
    """Monte Carlo studies: of this package, of a Python file, or a sweep over any mission.

    Exit codes: 0 done, 1 a trial has no row, or results could not be written (what was computed is kept), 2
    usage, 130 interrupted by Ctrl-C, 143 by SIGTERM; --resume continues an interrupted study.
    """
