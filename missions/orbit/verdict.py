"""Decides whether a target was orbited, from the mission's measurements in flight: camera and pressure
height.
"""

from typing import Final

from missions.notes import FlightNotes
from missions.orbit.options import OrbitOptions
from missions.orbit.score import ORBIT

RADIUS_SHARE: Final = 0.1
"""Bound of the mean radius's error and of its standard deviation, as a share of the radius."""
ALTITUDE_BOUND_M: Final = 20.0
_DURATION_SHARE: Final = 0.95


def orbit_verdict(notes: FlightNotes) -> str:
    """The reason why the orbit was not flown; "" if it was."""
    options, marks, phase = notes.options, notes.marks, notes.phase(ORBIT)
    if not isinstance(options, OrbitOptions):
        return ""
    if phase is None or "radius_estimate_mean_m" not in marks:
        return "the target was not orbited: the circle was never reached"
    flown_s = (phase.end_us - phase.start_us) * 1e-6
    if flown_s < _DURATION_SHARE * options.duration_s:
        return f"the target was orbited for {flown_s:.0f} s of {options.duration_s:g} s"
    mean_m, std_m = marks["radius_estimate_mean_m"], marks["radius_estimate_std_m"]
    bound_m = RADIUS_SHARE * options.radius_m
    if abs(mean_m - options.radius_m) > bound_m or std_m > bound_m:
        return (
            f"the target was not orbited at {options.radius_m:g} m: by the camera the radius was "
            f"{mean_m:.0f} m with a standard deviation of {std_m:.1f} m; accepted: {bound_m:g} m of each"
        )
    height_m = marks["altitude_estimate_error_m"]
    if height_m > ALTITUDE_BOUND_M:
        return (
            f"the orbit was up to {height_m:.1f} m from its altitude by pressure; accepted: "
            f"{ALTITUDE_BOUND_M:g} m"
        )
    return ""
