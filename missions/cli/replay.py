"""`flightstack replay`: runs an estimator over logs."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from estimators.errors import EstimatorError
from estimators.names import ESTIMATORS
from missions.cli.options import FiniteRange, in_options, report
from missions.errors import PlanError

if TYPE_CHECKING:
    from missions.estimation.report import EstimationResult

_FAILED = 1
_SECONDS = FiniteRange(min=0.0, max=1e9)


@click.command()
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@click.option(
    "--estimator",
    required=True,
    metavar="NAME|FILE.py",
    help=f"Estimator: {', '.join(ESTIMATORS)}, or a Python file with an Estimator of your own.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option(
    "--system-id", type=click.IntRange(1, 255), metavar="N", help="Vehicle. [default: all in a log]"
)
@click.option(
    "--against",
    type=click.Choice(["autopilot", "truth", "both"]),
    default="both",
    show_default=True,
    help="Reference that the estimates are compared with; of both, the autopilot's word leads the summary.",
)
@click.option(
    "--from",
    "from_s",
    type=_SECONDS,
    metavar="S",
    help="Begin at this time, seconds since the vehicle's boot, as log info prints it.",
)
@click.option("--to", "to_s", type=_SECONDS, metavar="S", help="End at this time.")
@click.option(
    "--boot",
    type=click.IntRange(min=0),
    metavar="N",
    help="Boot of the vehicle, as log info numbers them. [default: all]",
)
@click.option(
    "--dialect", metavar="NAME|FILE.xml", help="Dialect of the logs. [default: all of MAVLink's messages]"
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Run folder, or folder of theirs. [default: runs/ESTIMATOR-N]",
)
@click.option("--no-picture", is_flag=True, help="No picture errors.png.")
def replay(**given: Any) -> int:
    """Run an estimator over each LOG and compare it with the autopilot and, where the log has it, the truth.

    Each log gets a run folder: summary.json, estimates.npz, estimates.csv, errors.png. Errors are those of
    the part in the air. For an estimator of a team (magnetic-identification, multi-target, target-fusion,
    vision-search)
    the logs are those of one team.

    Exit codes: 0 done, 1 a log could not be read or lacks what the estimator needs, 2 usage.
    """
    from estimators.logs import LogError
    from estimators.reports import notes_of, table_lines, warnings_of
    from missions.estimation.over_logs import ReplayRequest, check_out, failed, replay_logs
    from missions.estimation.report import EstimationResult

    for path in given["logs"]:
        if path.is_dir():
            raise click.UsageError(f"{path} is a directory; give the path of a log")
        if not path.exists():
            raise click.UsageError(f"{path} does not exist; give the path of a log")
    several = len(given["logs"]) > 1
    terminal = sys.stderr.isatty()

    def on_done(label: str, result: "EstimationResult | str") -> None:
        if isinstance(result, str):
            report(result)
        elif failed(result):
            report(f"{label}: {result.reason}; results in {result.folder} are partial")
        elif terminal and several:
            click.echo(f"{label}: done", err=True)

    try:
        request = ReplayRequest(
            logs=given["logs"],
            estimator=given["estimator"],
            settings=given["settings"],
            system_id=given["system_id"],
            against=given["against"],
            from_s=given["from_s"],
            to_s=given["to_s"],
            boot=given["boot"],
            dialect=given["dialect"],
            out=given["out"],
            picture=not given["no_picture"],
            command=" ".join(["flightstack", *sys.argv[1:]]),
        )
        check_out(request)
        results = replay_logs(request, on_done)
    except (EstimatorError, LogError, PlanError) as error:
        raise click.UsageError(in_options(error, own=True)) from error
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
    return _FAILED if any(failed(result) for _, result in results) else 0
