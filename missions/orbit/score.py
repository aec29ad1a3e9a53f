"""Score of how well the orbit was held, from the truth in the records."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import GAP_S, broken_at_gaps, gaps_of, interpolated
from estimators.references import TARGET_SYSTEM
from estimators.tracking.metrics import rms
from flightsim.foundation.geodesy import LocalFrame
from missions.base.report import Debriefing
from missions.flown.records import FlightRecords, place_of, positions_ned_m
from missions.orbit.options import OrbitOptions
from missions.vehicle.notes import FlightNotes

Array = NDArray[np.float64]

ORBIT: Final = "orbit"
"""Name of the phase that is scored."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitTruth:
    """True positions of aircraft and target, at those of the aircraft's times at which both were received.

    Attributes:
        time_s: (n,) vehicle time.
        aircraft_ned_m, target_ned_m: (n, 3) from the initial position of the aircraft.
        radius_m: (n,) horizontal distance.
    """

    time_s: Array
    aircraft_ned_m: Array
    target_ned_m: Array
    radius_m: Array

    def during(self, start_us: int, end_us: int) -> "OrbitTruth":
        """The part between two vehicle times."""
        kept = (self.time_s >= start_us * 1e-6) & (self.time_s <= end_us * 1e-6)
        return OrbitTruth(
            time_s=self.time_s[kept],
            aircraft_ned_m=self.aircraft_ned_m[kept],
            target_ned_m=self.target_ned_m[kept],
            radius_m=self.radius_m[kept],
        )

    def broken_at_gaps(self, stride: int = 1) -> "OrbitTruth":
        """Each `stride`-th moment, with one of NaN in each gap, so that no line is drawn there."""
        parts = (self.aircraft_ned_m, self.target_ned_m, self.radius_m)
        rows = np.flatnonzero(np.diff(self.time_s) > GAP_S)
        shown = np.union1d(np.arange(0, len(self.time_s), stride), np.concatenate((rows, rows + 1)))
        time_s, aircraft, target, radius = broken_at_gaps(
            self.time_s[shown], *(part[shown] for part in parts)
        )
        return OrbitTruth(time_s=time_s, aircraft_ned_m=aircraft, target_ned_m=target, radius_m=radius)


def orbit_truth(records: FlightRecords, system_id: int) -> OrbitTruth | None:
    """The true orbit from the truth frames of a vehicle and of the first target; None without them."""
    own = records.truth(system_id)
    target = records.truth(TARGET_SYSTEM, 1)
    if len(own) < 2 or len(target) < 2:
        return None
    frame = LocalFrame(place_of(own[0]))
    time_s = own["time_usec"] * 1e-6
    aircraft, theirs = positions_ned_m(own, frame), positions_ned_m(target, frame)
    at = interpolated(time_s, target["time_usec"] * 1e-6, theirs)
    both = np.isfinite(at[:, 0])
    time_s, aircraft, at = time_s[both], aircraft[both], at[both]
    offset = at - aircraft
    return OrbitTruth(
        time_s=time_s, aircraft_ned_m=aircraft, target_ned_m=at, radius_m=np.hypot(offset[:, 0], offset[:, 1])
    )


def orbit_figures(debriefing: Debriefing, options: OrbitOptions) -> Mapping[str, Any]:
    """The figures of the first vehicle's orbit; figures that were not measured are None.

    * radius_mean_error_percent: error of the mean distance to the target over the orbit.
    * radius_std_m: standard deviation of that distance.
    * radius_max_error_m: largest difference from the commanded radius.
    * altitude_error_m: largest difference of the true height above the start from the commanded altitude.
    * orbit_s: duration of the orbit.
    * orbit_not_received_s: the part of it of which the truth was not received, and which no figure contains.
    * radius_estimate_..., altitude_estimate_error_m: the same figures from the mission's estimates in flight,
      by its filter and by pressure.
    * target_losses, detections_used, detections_rejected: since the entry, where GPS was lost.
    """
    notes = debriefing.flights[0][0]
    marks = notes.marks
    figures: dict[str, Any] = {
        "radius_m": options.radius_m,
        "radius_mean_error_percent": None,
        "radius_std_m": None,
        "radius_max_error_m": None,
        "altitude_error_m": None,
        "altitude_rms_error_m": None,
        "gps_lost_at_s": _rounded(marks.get("gps_lost_at_s")),
        "gps_back_at_s": _rounded(marks.get("gps_back_at_s")),
        "orbit_captured_after_s": _rounded(marks.get("orbit_captured_after_s")),
        "orbit_s": None,
        "orbit_not_received_s": None,
        "radius_estimate_mean_m": _rounded(marks.get("radius_estimate_mean_m")),
        "radius_estimate_std_m": _rounded(marks.get("radius_estimate_std_m")),
        "altitude_estimate_error_m": _rounded(marks.get("altitude_estimate_error_m")),
        "detections_used": None if "detections_used" not in marks else int(marks["detections_used"]),
        "detections_rejected": (
            None if "detections_rejected" not in marks else int(marks["detections_rejected"])
        ),
        "target_losses": None if "target_losses" not in marks else int(marks["target_losses"]),
    }
    truth = orbit_truth(debriefing.records, notes.system_id)
    window = _window(notes)
    if window is None:
        return figures
    figures["orbit_s"] = _rounded((window[1] - window[0]) * 1e-6)
    orbit = None if truth is None else truth.during(*window)
    if orbit is None or not len(orbit.time_s):
        return figures
    ends_s = np.array(window) * 1e-6
    gaps = gaps_of(np.concatenate((ends_s[:1], orbit.time_s, ends_s[1:])))
    figures["orbit_not_received_s"] = _rounded(sum(end - begin for begin, end in gaps))
    error = orbit.radius_m - options.radius_m
    height = -orbit.aircraft_ned_m[:, 2] - options.altitude_m
    figures |= {
        "radius_mean_error_percent": _rounded(100.0 * float(error.mean()) / options.radius_m),
        "radius_std_m": _rounded(float(orbit.radius_m.std())),
        "radius_max_error_m": _rounded(float(np.abs(error).max())),
        "altitude_error_m": _rounded(float(np.abs(height).max())),
        "altitude_rms_error_m": _rounded(rms(height)),
    }
    return figures


def _window(notes: FlightNotes) -> tuple[int, int] | None:
    phase = notes.phase(ORBIT)
    return None if phase is None else (phase.start_us, phase.end_us)


def _rounded(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, 3)
