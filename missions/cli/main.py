"""The command line: `flightstack`.

Heavy modules (numba, JSBSim, matplotlib) are imported by the command that needs them, so that help and error
messages appear quickly.
"""

import contextlib
import errno
import gc
import importlib
import io
import os
import sys
from typing import Final

import click

from flightsim.foundation.packages import MissingPackage, missing
from missions.cli.exit_codes import DONE, FAILED, INTERRUPTED, USAGE
from missions.cli.options import report
from missions.process.supervision import supervised

_COMMANDS: Final = {
    "fly": ("missions.cli.fly", "fly", "Fly a mission: on an embedded SITL, or on any vehicle."),
    "sitl": ("missions.cli.sitl", "sitl", "SITL for other people's clients."),
    "report": ("missions.cli.report", "report", "Pages of runs and logs; results of a killed program."),
    "check": ("missions.cli.check", "check", "Runs and logs against limits, for continuous integration."),
    "log": ("missions.cli.log", "log", "Look into logs, and make others of them."),
    "view": ("missions.cli.view", "view", "Runs and logs in a viewer: vehicles, beliefs, errors, events."),
    "estimate": ("missions.cli.estimate", "estimate", "An estimator on a live link, a process of its own."),
    "replay": ("missions.cli.replay", "replay", "Logs through an estimator, and how far off it was."),
    "vision": ("missions.cli.vision", "vision", "Tags in a video: a live stream's, or a log's."),
    "vehicle": ("missions.cli.vehicle", "vehicle", "Talk to a vehicle: info, parameters, logs, health."),
    "map": ("missions.cli.map", "magnetic_map", "Make magnetic maps, look into them, and export them."),
    "study": ("missions.cli.study", "study", "Monte Carlo: the papers' experiments."),
}

YOUNG_OBJECTS: Final = 50_000  # imports make as many that stay: looked through once, and not 250 times
_VERBOSE: Final = "flightstack.verbose"
_NOT_WRITTEN: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)


class _Commands(click.Group):
    """Commands that are imported when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        module, name, _ = _COMMANDS[cmd_name]
        command: click.Command = getattr(importlib.import_module(module), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in _COMMANDS and not args[0].startswith("-"):
            raise click.UsageError(f"no command {args[0]!r}; there are {', '.join(_COMMANDS)}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> object:
        """Run a command. A reader that closes the output early is not an error, and no message is shown."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            _let_go_of_output()
            raise click.exceptions.Exit(FAILED) from None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, _, text) in _COMMANDS.items()])


def _print_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if not asked or context.resilient_parsing:
        return
    from missions.cli.versions import installation, program_version  # looks through all packages

    click.echo("\n".join(installation()) if context.meta.get(_VERBOSE) else program_version())
    context.exit()


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    is_eager=True,  # known when --version is processed, in any order
    expose_value=False,
    callback=lambda context, _, asked: context.meta.update({_VERBOSE: asked}),
    help="List of the packages, with --version.",
)
@click.option(
    "--version", is_flag=True, expose_value=False, callback=_print_version, help="Version, and exit."
)
def command_line() -> None:
    """MAVLink software-in-the-loop flights: missions, SITL, logs.

    Exit codes: 0 done, 1 the mission failed, 2 usage, 130 interrupted by Ctrl-C; a flight
    143 by SIGTERM, 129 by SIGHUP.
    """


def main(arguments: list[str] | None = None) -> None:
    """Entry point: runs the command line and exits. Every error is printed as one line on stderr."""
    _open_closed_streams()
    gc.set_threshold(YOUNG_OBJECTS)
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["vehicle"]:  # MAVSDK is native code
        crashed = "the MAVSDK library crashed, and what was under way is not done; try again"
        sys.exit(supervised(lambda: run_command_line(arguments), crashed=crashed))
    sys.exit(run_command_line(arguments))


def run_command_line(arguments: list[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    try:
        result = command_line.main(args=arguments, prog_name="flightstack", standalone_mode=False)
    except click.exceptions.Exit as stop:
        return int(stop.exit_code)
    except click.Abort:
        click.echo("interrupted", err=True)
        return INTERRUPTED
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return USAGE
    except click.ClickException as error:
        message = " ".join(error.format_message().split())
        report(message)
        return int(error.exit_code)
    except KeyboardInterrupt:
        click.echo("interrupted", err=True)
        return INTERRUPTED
    except ModuleNotFoundError as error:
        text = str(error) if isinstance(error, MissingPackage) else missing(error.name)
        if not text:
            raise
        report(text)
        return FAILED
    except OSError as error:
        text = str(error)
        if error.filename is None and error.errno in _NOT_WRITTEN:
            _let_go_of_output()
            text = f"can't write the output: {error.strerror}"
        report(text)
        return FAILED
    return result if isinstance(result, int) else DONE


def _open_closed_streams() -> None:
    """Replace standard streams that were closed (`2>&-`) by the null device; let a console without UTF-8 show
    a question mark for what it does not have.

    Output to them is discarded, as the user requested, and no file or socket gets the number of one of them.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        stream = getattr(sys, name)
        if stream is not None:
            if number and isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
            continue
        null = os.open(os.devnull, os.O_RDWR)
        if null != number:
            try:
                os.fstat(number)
            except OSError:
                os.dup2(null, number)
                os.close(null)
                null = number
        setattr(sys, name, os.fdopen(null, "w" if number else "r", encoding="utf-8"))


def _let_go_of_output() -> None:
    """Discard output that could not be written; otherwise the interpreter would try again at exit and print
    an error.
    """
    if sys.stdout is not None:
        with contextlib.suppress(OSError), open(os.devnull, "wb") as nothing:
            os.dup2(nothing.fileno(), sys.stdout.fileno())
