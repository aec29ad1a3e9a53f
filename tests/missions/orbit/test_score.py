"""The figures of an orbit's flight: by truth where there is any, else as the mission estimated."""

import pytest

from missions.base.mission import Debriefing
from missions.flown.records import FlightRecords
from missions.flown.score import score
from missions.orbit.mission import OrbitMission
from missions.orbit.options import OrbitOptions
from missions.orbit.score import ORBIT
from missions.vehicle.notes import FlightNotes

MARKS = {
    "radius_estimate_mean_m": 150.4,
    "radius_estimate_std_m": 1.9,
    "altitude_estimate_error_m": 3.25,
    "target_losses": 1.0,
    "detections_used": 5900.0,
    "detections_rejected": 12.0,
}


def debriefing(*phases, marks=MARKS):
    """Of a vehicle elsewhere: nothing of it is true, but what it said."""
    notes = FlightNotes(system_id=1, marks=dict(marks))
    for name, start_us, end_us in phases:
        notes.begin(name, start_us)
        notes.end(end_us)
    records = FlightRecords.of_frames(())
    return Debriefing(
        records=records, flights=[(notes, score(records, notes))], options=OrbitOptions(radius_m=150.0)
    )


def test_a_vehicle_elsewhere_is_reported_with_the_position_that_the_mission_assumed():
    mission = OrbitMission()
    figures = mission.figures(debriefing((ORBIT, 100_000_000, 700_000_000)))
    assert figures["orbit_s"] == pytest.approx(600.0)
    assert figures["radius_mean_error_percent"] is None
    assert (figures["detections_used"], figures["detections_rejected"]) == (5900, 12)
    circle, unknown = mission.report_lines(figures)
    assert circle.startswith("orbit of 150 m for 600 s, as the mission estimates: mean radius 150.4 m")
    for words in ("standard deviation 1.9 m", "within 3.2 m", "target lost 1 times", "5900 detections"):
        assert words in circle
    assert "does not report" in unknown


def test_of_an_orbit_that_was_never_reached_nothing_is_said():
    mission = OrbitMission()
    figures = mission.figures(debriefing(("entry", 100_000_000, 300_000_000), marks={}))
    assert figures["orbit_s"] is None
    assert mission.report_lines(figures) == ()
