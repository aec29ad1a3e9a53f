"""The figures of an orbit's flight: by truth where there is any, else as the mission estimated."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from estimators.references import TARGET_SYSTEM
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.base.report import Debriefing
from missions.flown.records import FlightRecords
from missions.flown.score import score
from missions.orbit.mission import orbit_lines
from missions.orbit.options import OrbitOptions
from missions.orbit.picture import draw_orbit
from missions.orbit.score import ORBIT, orbit_figures, orbit_truth
from missions.vehicle.notes import FlightNotes

START = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=0.0)
OPTIONS = OrbitOptions(radius_m=150.0)
MARKS = {
    "radius_estimate_mean_m": 150.4,
    "radius_estimate_std_m": 1.9,
    "altitude_estimate_error_m": 3.25,
    "target_losses": 1.0,
    "detections_used": 5900.0,
    "detections_rejected": 12.0,
}


def debriefing(*phases, marks=MARKS, records=None):
    """Of a vehicle elsewhere: nothing of it is true, but what it said."""
    notes = FlightNotes(system_id=1, marks=dict(marks))
    for name, start_us, end_us in phases:
        notes.begin(name, start_us)
        notes.end(end_us)
    records = FlightRecords.of_frames(()) if records is None else records
    return Debriefing(records=records, flights=[(notes, score(records, notes))], options=OPTIONS)


def test_a_vehicle_elsewhere_is_reported_with_the_position_that_the_mission_assumed():
    figures = orbit_figures(debriefing((ORBIT, 100_000_000, 700_000_000)), OPTIONS)
    assert figures["orbit_s"] == pytest.approx(600.0)
    assert figures["radius_mean_error_percent"] is None
    assert (figures["detections_used"], figures["detections_rejected"]) == (5900, 12)
    circle, unknown = orbit_lines(figures)
    assert circle.startswith("orbit of 150 m for 600 s, as the mission estimates: mean radius 150.4 m")
    for words in ("standard deviation 1.9 m", "within 3.2 m", "target lost 1 times", "5900 detections"):
        assert words in circle
    assert "does not report" in unknown


def test_of_an_orbit_that_was_never_reached_nothing_is_said():
    figures = orbit_figures(debriefing(("entry", 100_000_000, 300_000_000), marks={}), OPTIONS)
    assert figures["orbit_s"] is None
    assert orbit_lines(figures) == ()


def truth_frames(system_id, component_id, seconds, place_ne_m):
    """The truth of a system, ten times a second, but not in the gap from 30 s to 40 s of `seconds`."""
    encoder, frame = FrameEncoder(system_id, component_id), LocalFrame(START)
    for time_s in seconds:
        north_m, east_m = place_ne_m(time_s)
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, -100.0)
        place = round(lat * 1e7), round(lon * 1e7), round(100e3)
        upright = [1.0, 0.0, 0.0, 0.0]
        yield encoder.encode(
            dialect.MAVLink_hil_state_quaternion_message(
                round(time_s * 1e6), upright, 0.0, 0.0, 0.0, *place, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )


@pytest.mark.parametrize("lost", ["target", "both"])
def test_of_a_gap_of_the_link_no_distance_is_stated_and_no_line_is_drawn(lost, tmp_path):
    """The target goes round the aircraft's circle's centre in the gap: a straight line is far from both."""
    everything = np.arange(0.0, 100.0, 0.1)
    known = everything[(everything <= 30.0) | (everything >= 40.0)]

    def target(time_s):
        angle = math.tau * max(0.0, min(1.0, (time_s - 30.0) / 10.0))
        return 300.0 * math.sin(angle) + 4.0 * time_s, 0.0

    def aircraft(time_s):
        north_m, east_m = target(time_s)
        return north_m + 150.0 * math.cos(0.1 * time_s), east_m + 150.0 * math.sin(0.1 * time_s)

    own = known if lost == "both" else everything
    frames = [*truth_frames(1, 25, own, aircraft), *truth_frames(TARGET_SYSTEM, 1, known, target)]
    flown = debriefing((ORBIT, 10_000_000, 90_000_000), records=FlightRecords.of_frames(frames))
    figures = orbit_figures(flown, OPTIONS)
    assert figures["radius_max_error_m"] < 0.1
    assert figures["orbit_not_received_s"] == pytest.approx(10.0, abs=0.2)
    assert "orbit of 150 m for 80 s (10 s of it not received)" in orbit_lines(figures)[0]
    shown = orbit_truth(flown.records, 1).broken_at_gaps(7)
    steps = np.diff(shown.time_s)
    assert np.nanmax(steps) < 2.0 and np.count_nonzero(np.isnan(shown.time_s)) == 1
    draw_orbit(tmp_path / "track.png", "gap", flown, OPTIONS)
