"""`flightstack estimate`: an estimator on a live link, in its own process."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from autopilot_bridge.errors import AddressError, BridgeError
from estimators.errors import EstimatorError
from estimators.names import ESTIMATORS
from missions.cli.options import FiniteRange, in_options, report
from missions.cli.signing import key_from, key_option, warn_if_open
from missions.cli.status_line import StatusLine
from missions.errors import PlanError

if TYPE_CHECKING:
    from missions.estimation.live import LiveProgress

_FAILED, _INTERRUPTED = 1, 130
_SECONDS = FiniteRange(min=0.0, min_open=True, max=1e9)


class _LiveProgressLine:
    """Reports missing inputs when they change and, on a terminal, the progress."""

    def __init__(self) -> None:
        self._line = StatusLine()
        self._reported: tuple[str, ...] = ()

    def __call__(self, progress: "LiveProgress") -> None:
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


_HELP: Final = f"""Run an estimator on a live link: {", ".join(ESTIMATORS)}, or a Python file.

It receives a vehicle's messages, sends its estimates from its own component id, and logs everything: a
replay of flight.tlog in the run folder gives the same estimates.

Exit codes: 0 done, 1 the link was silent or lacks messages that the estimator needs (the data received
are kept), 2 usage, 130 interrupted before --duration was over.
"""


@click.command(help=_HELP)
@click.argument("name", metavar="NAME|FILE.py")
@click.option(
    "--connect", required=True, metavar="URL", help="Vehicle's link: udpin:0.0.0.0:14550, serial:..."
)
@click.option("--duration", type=_SECONDS, metavar="S", help="Vehicle time. [default: until Ctrl-C]")
@click.option(
    "--system-id", type=click.IntRange(1, 255), metavar="N", help="Vehicle. [default: the first one received]"
)
@click.option(
    "--component-id",
    type=click.IntRange(191, 194),
    default=191,
    show_default=True,
    help="Component id of the estimator.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option("--publish/--no-publish", default=True, show_default=True, help="Send estimates on the link.")
@click.option("--no-request", is_flag=True, help="No requests of the rates that are needed.")
@click.option(
    "--silence", type=_SECONDS, default=10.0, show_default=True, metavar="S",
    help="End when nothing was received from the vehicle for so long, wall seconds.",
)  # fmt: skip
@click.option(
    "--against", type=click.Choice(["autopilot", "truth", "both"]), default="both", show_default=True,
    help="Reference that the estimates are compared with afterwards.",
)  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/ESTIMATOR-N]")
@click.option("--no-picture", is_flag=True, help="No picture errors.png.")
@key_option()
def estimate(**given: Any) -> int:
    from estimators.reports.summary import FAILED, INTERRUPTED, table_lines, warnings_of
    from missions.estimation.live import LiveRequest
    from missions.estimation.live import estimate as run_estimator

    progress = _LiveProgressLine()
    try:
        key = key_from(given["signing_key"])
        result = run_estimator(
            LiveRequest(
                estimator=given["name"],
                connect=given["connect"],
                settings=given["settings"],
                duration_s=given["duration"],
                system_id=given["system_id"],
                component_id=given["component_id"],
                publish=given["publish"],
                request_rates=not given["no_request"],
                silence_s=given["silence"],
                against=given["against"],
                out=given["out"],
                picture=not given["no_picture"],
                command=" ".join(["flightstack", *sys.argv[1:]]),
                signing_key=key,
                on_open=lambda: warn_if_open((given["connect"],), key),
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
        return _FAILED
    samples = result.summary["samples"]
    click.echo(f"{result.outcome}: {samples} estimates; run: {result.folder}")
    return _INTERRUPTED if result.outcome == INTERRUPTED else 0
