"""`flightstack report`: summary and picture of a flight from the log that is left."""

from pathlib import Path

import click

from autopilot_bridge.errors import BridgeError
from missions.cli.options import in_options
from missions.errors import MissionError, PlanError


@click.command()
@click.argument("path", metavar="FOLDER|LOG", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Folder for the results of a LOG. [default: runs/LOG-N]",
)
@click.option("--no-picture", is_flag=True, help="No picture track.png.")
def report(path: Path, out: Path | None, no_picture: bool) -> int:
    """Make summary.json and track.png of a flight whose program has crashed or was killed.

    FOLDER is its run folder, which is completed; LOG is a telemetry log. Nothing is overwritten.
    """
    from missions.flown.recovery import recover

    try:
        made = recover(path, out, picture=not no_picture)
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    except (MissionError, BridgeError) as error:
        raise click.ClickException(in_options(error)) from error
    summary = made.summary
    click.echo(f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.1f} s with {summary['autopilot']}")
    for block in summary["vehicles"]:
        click.echo(f"vehicle {block['system_id']}: the log ends in {block['last_state']}")
    click.echo(f"written: {', '.join(made.written)} in {made.folder}")
    return 0
