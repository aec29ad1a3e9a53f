"""What `flightstack view` does."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from autopilot_bridge.errors import BridgeError
from estimators.errors import EstimatorError, EstimatorFailure, LogError
from estimators.interface import Estimator
from estimators.library import estimator_class, parameters_from
from estimators.logs import Log, open_log
from estimators.logs.dialect import load_dialect
from estimators.scene.of_estimators import shown_by_estimator
from estimators.scene.shown import Shown
from missions.cli.exit_codes import FAILED
from missions.cli.options import in_options, report
from missions.errors import PlanError
from missions.flown.run_folder import LOG_NAME
from missions.process.ending import wait_for_interrupt
from missions.view.of_log import draw_log
from missions.view.opening import open_viewer, require_library
from missions.view.target import SERVED, ViewKind, ViewTarget, parse_view
from missions.view.viewer import ViewError


def view(
    paths: Sequence[Path],
    target: str | None,
    estimator: str | None,
    settings: Sequence[str],
    dialect: str | None,
) -> int:
    """`flightstack view`."""
    try:
        where = parse_view(target or ViewKind.WINDOW)
        load_dialect(dialect)
        if settings and estimator is None:
            raise PlanError("`set` has no effect without `estimator`; give both, or leave it out")
        make = None
        if estimator is not None:
            found = estimator_class(estimator)
            make = partial(found, parameters_from(found, settings))
    except (PlanError, BridgeError, EstimatorError) as error:
        raise click.UsageError(in_options(error)) from error
    if where.path is not None and len(paths) > 1:
        raise click.UsageError(f"{len(paths)} logs for one file {where.path}; view one of them, or give web")
    try:
        require_library(where)
        logs = [open_log(_log_of(path), dialect=dialect) for path in paths]
        _show(logs, where, make)
    except (ViewError, LogError, EstimatorError, EstimatorFailure) as error:
        report(in_options(error))
        return FAILED
    return 0


def _log_of(path: Path) -> Path:
    """The log of a run folder, or the path."""
    if not path.is_dir():
        if not path.exists():
            raise click.UsageError(f"{path} does not exist; give a run folder or a log")
        return path
    log = path / LOG_NAME
    if not log.is_file():
        raise click.UsageError(f"{path} has no {LOG_NAME}; give a run folder or a log")
    return log


def _title(log: Log) -> str:
    """The run's folder, or the file."""
    return log.path.resolve().parent.name if log.path.name == LOG_NAME else log.path.name


def _show(logs: Sequence[Log], where: ViewTarget, make: Callable[[], Estimator[Any]] | None) -> None:
    """Draw the logs one after the other; a page is served until Ctrl-C.

    Raises:
        ViewError, EstimatorError: as `open_viewer` and `shown_by_estimator` say.
    """
    extras = _extras(logs, make)
    viewer = open_viewer(where)
    try:
        for log, extra in zip(logs, extras, strict=True):
            if not draw_log(log, viewer, _title(log), extra):
                click.echo(f"{log.path} has no position, so that there is no map", err=True)
        click.echo(f"view: {viewer.where}")
        if where.kind in SERVED:
            wait_for_interrupt()
    finally:
        viewer.close()


def _extras(logs: Sequence[Log], make: Callable[[], Estimator[Any]] | None) -> list[list[Shown]]:
    """What an estimator shows of each log; of a team's logs it is with the first."""
    if make is None:
        return [[] for _ in logs]
    if make().TEAM:
        return [shown_by_estimator(logs, make), *([] for _ in logs[1:])]
    return [shown_by_estimator([log], make) for log in logs]
