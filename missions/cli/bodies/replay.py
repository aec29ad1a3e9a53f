"""What `flightstack replay` does."""

import sys
from typing import Any

import click

from estimators.errors import EstimatorError
from estimators.logs import LogError
from estimators.reports import notes_of, table_lines, warnings_of
from estimators.reports.figure import vector_figures
from missions.cli.bodies.viewing import viewing
from missions.cli.declared_options import specified
from missions.cli.exit_codes import FAILED
from missions.cli.options import in_options, report
from missions.errors import PlanError
from missions.estimation.over_logs import Done, ReplayRequest, check_out, failed, replay_logs
from missions.estimation.report import EstimationResult
from missions.view.target import parse_view
from missions.view.viewer import Viewer, ViewError


def replay(**given: Any) -> int:
    """`flightstack replay`."""
    for path in given["logs"]:
        if path.is_dir():
            raise click.UsageError(f"{path} is a directory; give the path of a log")
        if not path.exists():
            raise click.UsageError(f"{path} does not exist; give the path of a log")
    several = len(given["logs"]) > 1
    terminal = sys.stderr.isatty()

    def on_done(label: str, result: EstimationResult | str) -> None:
        if isinstance(result, str):
            report(result)
        elif failed(result):
            report(f"{label}: {result.reason}; results in {result.folder} are partial")
        elif terminal and several:
            click.echo(f"{label}: done", err=True)

    try:
        if several and given["view"] is not None and parse_view(given["view"]).path is not None:
            raise PlanError(
                f"`view` {given['view']} is one file for several logs; give web, or replay one log"
            )
        with viewing(given["view"]) as view, vector_figures(wanted=given["vector"]):
            return _replayed(given, view, on_done)
    except (EstimatorError, LogError, PlanError) as error:
        raise click.UsageError(in_options(error, own=True)) from error
    except ViewError as error:
        raise click.ClickException(in_options(error)) from error


def _replayed(given: dict[str, Any], view: Viewer | None, on_done: Done) -> int:
    request = specified(
        ReplayRequest,
        logs=given["logs"],
        estimator=given["estimator"],
        settings=given["settings"],
        dialect=given["dialect"],
        out=given["out"],
        picture=not given["no_picture"],
        command=" ".join(["flightstack", *sys.argv[1:]]),
        view=view,
    )
    check_out(request)
    results = replay_logs(request, on_done)
    done = [(label, result) for label, result in results if isinstance(result, EstimationResult)]
    for line in table_lines([(label, result.compared) for label, result in done]):
        click.echo(line)
    for label, result in done:
        for note in notes_of(result.summary):
            click.echo(f"{label}: {note}")
        for warning in warnings_of(result.summary):
            report(f"{label}: {warning}")
        samples, speed = result.summary["samples"], result.summary["wall_time_s"]
        click.echo(f"{label}: {result.outcome}, {samples} estimates in {speed:.2f} s; run: {result.folder}")
    return FAILED if any(failed(result) for _, result in results) else 0
