"""What running estimators show: their newest estimates, and their beliefs."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from estimators.errors import EstimatorFailure, described
from estimators.fleet import Fleet
from estimators.interface import Estimate, EstimateSet, Estimator
from estimators.log_replay import replay
from estimators.runner import Runner
from estimators.scene.shown import Estimates, Showing, Shown, Subject

if TYPE_CHECKING:
    from estimators.logs import Log

__all__ = ["EstimatorShows", "shown_by_estimator"]

_ESTIMATES_US: Final = 200_000
_BELIEF_US: Final = 1_000_000


class EstimatorShows:
    """Looks at estimators while they run: at their estimates five times a second, at their beliefs each
    second.

    Args:
        name: of the estimators.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._showing: dict[int, Showing] = {}
        self._due_us: dict[tuple[int, str], int] = {}

    def look_at(self, runner: Runner) -> list[Shown]:
        """What is new after an UPDATED message.

        Raises:
            EstimatorFailure: the estimator's `shown` raised an error.
        """
        system_id = runner.system_id or 0
        base = f"estimators/{self._name}/{system_id}" if system_id else f"estimators/{self._name}"
        subject = Subject(base=base, system_id=system_id)
        estimator = runner.estimator
        newest: Sequence[Estimate] | Sequence[EstimateSet] = estimator.estimates
        found = []
        for estimate in newest:
            item = _item(estimate)
            key = "/".join((type(estimate).__name__, *item.names))
            if self._is_due(system_id, key, estimate.time_us, _ESTIMATES_US):
                found.append(Shown(subject, "", estimate.time_us, estimator.origin, item))
        if newest and self._is_due(system_id, "", newest[0].time_us, _BELIEF_US):
            showing = self._showing.setdefault(system_id, Showing(subject))
            try:
                found += showing.changes(newest[0].time_us, estimator.shown(), estimator.origin)
            except Exception as error:
                raise EstimatorFailure(f"{estimator.NAME}.shown() failed: {described(error)}") from error
        return found

    def _is_due(self, system_id: int, key: str, time_us: int, period_us: int) -> bool:
        due_us = self._due_us.get((system_id, key))
        if due_us is not None and due_us - period_us <= time_us < due_us:
            return False
        self._due_us[system_id, key] = time_us + period_us
        return True


def _item(estimate: Any) -> Estimates:
    of_set = hasattr(estimate, "rows")
    rows = estimate.rows() if of_set else [estimate.row()]
    columns = tuple(estimate.COLUMNS)
    return Estimates(
        columns=columns,
        values=np.array(rows, dtype=np.float64).reshape(-1, len(columns)),
        of_set=of_set,
        system_id=estimate.subject,
    )


def shown_by_estimator(logs: "Sequence[Log]", make: Callable[[], Estimator[Any]]) -> list[Shown]:
    """Run an estimator over a log, or over the logs of a team.

    Raises:
        EstimatorError: it is for one vehicle, and there are several logs; or the logs lack what it needs.
        EstimatorFailure: it raised an error.
    """
    shows = EstimatorShows(Fleet(make).name)
    found: list[Shown] = []
    result = replay(logs, make, on_estimate=lambda runner: found.extend(shows.look_at(runner)))
    if result.failure:
        raise EstimatorFailure(result.failure)
    return found
