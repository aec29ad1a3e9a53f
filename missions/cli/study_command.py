"""The command of one study: its own options and those of every study."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.declared_options import Given, declared_options
from missions.cli.later import later
from missions.studies.options import StudyRunOptions

if TYPE_CHECKING:
    from missions.studies.study import Study


_BODIES: Final = "missions.cli.bodies.study"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyCommand:
    """A study on the command line.

    Attributes:
        help: text of `flightstack study NAME --help`.
        build: makes the study from the values of its own options.
        options: its own options, besides those of every study.
        kind: class of the command.
    """

    help: str
    build: Callable[[Given], "Study[Any, Any]"]
    options: tuple[click.Parameter, ...] = ()
    kind: type[click.Command] = click.Command

    def command(self, name: str) -> click.Command:
        """The command.

        Args:
            name: name of the study, or path of the file that has it.
        """

        def run(**given: Any) -> int:
            code: int = later(_BODIES, "run")(self, name, given)
            return code

        return self.kind(
            name,
            callback=run,
            params=[*self.options, *engine_options()],
            help=self.help,
            context_settings={"show_default": True},
        )


def engine_options() -> list[click.Parameter]:
    """The options of every study."""
    return [
        *declared_options(StudyRunOptions),
        click.Option(
            ["--ray"], metavar="ADDRESS",
            help="Ray cluster: HOST:PORT of its head, ray://HOST:PORT, auto, or local for one of this "
            "machine. Needs the extra `ray`.",
        ),
        click.Option(
            ["--out"], metavar="DIR|URI",
            help="Folder, also s3://, gs:// and others of pyarrow.fs. [default: runs/STUDY-N]",
        ),
        click.Option(["--resume"], metavar="DIR|URI", help="Continue the study in this folder."),
        click.Option(["--vector"], is_flag=True, help="Pictures also as SVG and PDF."),
        click.Option(["--no-picture"], is_flag=True, help="No pictures."),
    ]  # fmt: skip


def file_command() -> StudyCommand:
    """The command of a user's study file."""
    return StudyCommand(
        help=(
            "Run a study of your own: a Python file with `STUDY = Study(...)`, or with `def "
            "study(arguments)` that "
            "returns one.\n\n--arg NAME=VALUE gives the function its arguments, a mapping of texts."
        ),
        options=(
            click.Option(
                ["--arg"], multiple=True, metavar="NAME=VALUE", help="An argument of your own; repeat."
            ),
        ),
        build=later(_BODIES, "study_of_file"),
    )
