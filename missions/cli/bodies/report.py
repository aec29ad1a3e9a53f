"""What `flightstack report` does."""

from pathlib import Path

import click

from autopilot_bridge.errors import BridgeError
from missions.cli.options import in_options
from missions.errors import MissionError, PlanError
from missions.flown.recovery import recover


def report(path: Path, out: Path | None, no_picture: bool) -> int:
    """`flightstack report`."""
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
