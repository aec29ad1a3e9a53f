"""True places of the simulated targets, from the records of a flight."""

import numpy as np
from numpy.typing import NDArray

from estimators.references import TARGET_SYSTEM
from flightsim.foundation.geodesy import LocalFrame
from missions.flown.records import FlightRecords, positions_ned_m

Array = NDArray[np.float64]


def true_targets(records: FlightRecords, frame: LocalFrame) -> list[tuple[Array, Array]]:
    """Times (us) and places (n, 2) of each true target, from the truth in the log; empty: there is none."""
    found, component = [], 1
    while len(own := records.truth(TARGET_SYSTEM, component)):
        found.append((own["time_usec"].astype(np.float64), positions_ned_m(own, frame)[:, :2]))
        component += 1
    return found
