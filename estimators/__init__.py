"""Onboard estimators, and the logs that they can be fed from.

A log goes through an estimator, and is compared with what the autopilot or the truth reports:

    from estimators import comparisons, open_log, replay

    log = open_log("flight.tlog")
    runners = replay(log, "attitude").fleet.runners.values()
    found = [comparisons([log], runner) for runner in runners]
"""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from estimators.comparison import Comparison, comparisons
    from estimators.errors import EstimatorError, LogError
    from estimators.interface import Estimate, Estimator, Need
    from estimators.library import make_estimator
    from estimators.log_replay import Replay, replay
    from estimators.logs.formats import open_log
    from estimators.logs.log import Log
    from estimators.logs.report import report_of

__all__ = [
    "Comparison",
    "Estimate",
    "Estimator",
    "EstimatorError",
    "Log",
    "LogError",
    "Need",
    "Replay",
    "comparisons",
    "make_estimator",
    "open_log",
    "replay",
    "report_of",
]

_MODULES: Final = {
    "Comparison": "estimators.comparison",
    "Estimate": "estimators.interface",
    "Estimator": "estimators.interface",
    "EstimatorError": "estimators.errors",
    "Log": "estimators.logs.log",
    "LogError": "estimators.errors",
    "Need": "estimators.interface",
    "Replay": "estimators.log_replay",
    "comparisons": "estimators.comparison",
    "make_estimator": "estimators.library",
    "open_log": "estimators.logs.formats",
    "replay": "estimators.log_replay",
    "report_of": "estimators.logs.report",
}

__getattr__ = lazy_exports(__name__, _MODULES)
