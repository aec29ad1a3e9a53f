"""What `flightstack estimate` does."""

import sys
from typing import Any

import click

from autopilot_bridge.errors import AddressError, BridgeError
from estimators.errors import EstimatorError
from estimators.reports.summary import FAILED, INTERRUPTED, table_lines, warnings_of
from missions.cli import exit_codes
from missions.cli.bodies.signing import key_from, warn_if_open
from missions.cli.bodies.status_line import StatusLine
from missions.cli.bodies.viewing import viewing
from missions.cli.declared_options import specified
from missions.cli.options import in_options, report
from missions.errors import PlanError
from missions.estimation.live import LiveProgress, LiveRequest
from missions.estimation.live import estimate as run_estimator
from missions.view.viewer import Viewer, ViewError


class _LiveProgressLine:
    """Reports missing inputs when they change and, on a terminal, the progress."""

    def __init__(self) -> None:
        self._line = StatusLine()
        self._reported: tuple[str, ...] = ()

    def __call__(self, progress: LiveProgress) -> None:
        # rates change all the time and are not compared
        lacking = tuple(text.split(" at ")[0] for text in progress.lacking)
        if lacking != self._reported:
            self._reported = lacking
            self._line.end()
            for text in progress.lacking:
                report(text)
            if not lacking:
                report("all that is needed comes now")
        self._line.show(f"{progress.time_s:9.1f} s  {progress.estimates} estimates")

    def end(self) -> None:
        """End the progress line."""
        self._line.end()


def estimate(**given: Any) -> int:
    """`flightstack estimate`."""
    try:
        with viewing(given["view"]) as view:
            return _estimated(given, view)
    except ViewError as error:
        raise click.ClickException(in_options(error)) from error


def _estimated(given: dict[str, Any], view: Viewer | None) -> int:
    progress = _LiveProgressLine()
    try:
        key = key_from(given["signing_key"])
        result = run_estimator(
            specified(
                LiveRequest,
                estimator=given["name"],
                connect=given["connect"],
                settings=given["settings"],
                publish=given["publish"],
                request_rates=not given["no_request"],
                out=given["out"],
                picture=not given["no_picture"],
                command=" ".join(["flightstack", *sys.argv[1:]]),
                signing_key=key,
                on_open=lambda: warn_if_open((given["connect"],), key),
                view=view,
                on_warning=report,
            ),
            progress,
        )
    except (AddressError, BridgeError, EstimatorError, PlanError) as error:
        raise click.UsageError(in_options(error, own=True)) from error
    finally:
        progress.end()
    for line in table_lines([(given["connect"], result.compared)]):
        click.echo(line)
    for warning in warnings_of(result.summary):
        report(warning)
    if result.outcome == FAILED:
        report(f"{result.reason}; results in {result.folder} are partial")
        return exit_codes.FAILED
    samples = result.summary["samples"]
    click.echo(f"{result.outcome}: {samples} estimates; run: {result.folder}")
    return exit_codes.INTERRUPTED if result.outcome == INTERRUPTED else 0
