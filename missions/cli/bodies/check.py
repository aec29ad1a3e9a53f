"""What `flightstack check` does."""

from collections.abc import Sequence
from pathlib import Path

import click

from autopilot_bridge.errors import BridgeError
from estimators.logs.new_file import new_file
from missions.cli.exit_codes import DONE, FAILED
from missions.cli.options import in_options
from missions.errors import PlanError
from missions.runs import check as checks
from missions.runs.limits import read_limits


def check(paths: Sequence[Path], limits: Path, against: Path | None, junit: Path | None) -> int:
    """`flightstack check`."""
    if junit is not None and junit.exists():
        raise click.UsageError(f"{junit} exists, and nothing is overwritten; choose another --junit")
    try:
        wanted = read_limits(limits)
        verdicts = [verdict for path in paths for verdict in checks.check_run(path, wanted, against)]
        if junit is not None:
            with new_file(junit) as part:
                part.write_bytes(checks.junit(verdicts))
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    except BridgeError as error:
        raise click.ClickException(in_options(error)) from error
    for path in paths:
        if len(paths) > 1:
            click.echo(f"{path}:")
        for verdict in verdicts:
            if verdict.run == str(path):
                click.echo(verdict.text)
    failed = sum(bool(verdict.failures) for verdict in verdicts)
    click.echo(f"{len(verdicts) - failed} passed, {failed} failed")
    return FAILED if failed else DONE
