"""What `flightstack report` does."""

from collections.abc import Sequence
from pathlib import Path

import click

from autopilot_bridge.errors import BridgeError
from estimators.errors import EstimatorError
from estimators.logs import open_log
from missions.cli.options import in_options
from missions.cli.options import report as say
from missions.errors import MissionError, PlanError
from missions.flown.recovery import recover
from missions.flown.run_folder import PICTURE_NAME, SUMMARY_NAME, create_run_folder
from missions.runs.report_page import REPORT_NAME, Reported, add_page, write_report


def report(paths: Sequence[Path], out: Path | None, no_picture: bool) -> int:
    """`flightstack report`."""
    try:
        if len(paths) > 1 or not _is_recovered(paths[0], no_picture):
            return _page(paths, out, no_picture)
        folder = _recover(paths[0], out, no_picture)
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    except (MissionError, BridgeError, EstimatorError) as error:
        raise click.ClickException(in_options(error)) from error
    if not no_picture and (left_out := add_page(folder)):
        say(left_out)
    return 0


def _is_recovered(path: Path, no_picture: bool) -> bool:
    """Whether results are made of the log alone: of a folder that lacks them, or of a telemetry log."""
    if path.is_dir():
        return no_picture or not all((path / name).exists() for name in (SUMMARY_NAME, PICTURE_NAME))
    return not path.is_file() or open_log(path).format == "tlog"


def _recover(path: Path, out: Path | None, no_picture: bool) -> Path:
    made = recover(path, out, picture=not no_picture)
    summary = made.summary
    click.echo(f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.1f} s with {summary['autopilot']}")
    for block in summary["vehicles"]:
        click.echo(f"vehicle {block['system_id']}: the log ends in {block['last_state']}")
    click.echo(f"written: {', '.join(made.written)} in {made.folder}")
    return made.folder


def _page(paths: Sequence[Path], out: Path | None, no_picture: bool) -> int:
    """Write the page of a complete run or of another log, or the page of several."""
    if no_picture:
        raise click.UsageError("--no-picture leaves nothing to do: there is only the page to make")
    for path in paths:
        if not path.exists():
            raise PlanError(f"{path} does not exist; give a run folder or a log")
    runs = [Reported.of(path) for path in paths]
    if len(paths) == 1 and paths[0].is_dir():
        if out is not None:
            raise PlanError(f"`out` is for the page of a log or of several runs; {paths[0]} is a run folder")
        folder = paths[0]
    else:
        folder = create_run_folder(out, paths[0].stem if len(paths) == 1 else "report")
    write_report(folder / REPORT_NAME, runs)
    click.echo(f"written: {folder / REPORT_NAME}")
    return 0
