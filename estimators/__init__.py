"""Onboard estimators, and the logs that they can be fed from.

A log goes through an estimator, and is compared with what the autopilot or the truth reports:

    from estimators import comparisons, open_log, replay

    log = open_log("flight.tlog")
    runners = replay(log, "attitude").fleet.runners.values()
    found = [comparisons([log], runner) for runner in runners]
"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
