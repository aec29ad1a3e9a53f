"""What the picture of a search for a tag shows."""

import numpy as np

from estimators.reports.figure import blank_figure
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.options import FlightOptions
from missions.base.report import Debriefing
from missions.flown.records import FlightRecords
from missions.flown.score import score
from missions.pattern_search.picture import draw_search
from missions.vehicle.notes import CommandedPath, FlightNotes
from missions.vision_search.picture import _different
from missions.vision_search.search import Moment

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=490.0)
SQUARE = np.array([[0.0, 0.0, -10.0], [0.0, 40.0, -10.0], [30.0, 40.0, -10.0], [30.0, 0.0, -10.0]])


def test_area_and_detection_are_labelled():
    notes = FlightNotes(system_id=1, autopilot="px4", kind="multicopter")
    notes.commanded = CommandedPath(
        origin=HOME, points_ned_m=SQUARE, waypoints_ned_m=SQUARE, acceptance_m=2.0
    )
    notes.marks.update(search_north_m=12.0, search_east_m=7.0, search_exposed_us=5e6)
    records = FlightRecords.of_frames([])
    debriefing = Debriefing(
        records=records, flights=[(notes, score(records, notes))], options=FlightOptions()
    )
    axes = blank_figure(4.0, 4.0).add_subplot()
    draw_search(debriefing, "tag 0 found after 5.0 s", axes)
    assert axes.get_legend_handles_labels()[1] == ["searched area", "tag, as detected"]
    assert [text.get_text() for text in axes.texts] == ["tag 0 found after 5.0 s"]
    box = axes.dataLim
    assert (box.x0, box.y0, box.x1, box.y1) == (0.0, 0.0, 40.0, 30.0)


def test_moments_of_a_vision_search_differ():
    """A target that is found at once leaves one moment, which is drawn once."""
    moments = [
        Moment(time_us=time_us, shares=np.full((2, 2), 0.25), places=(), estimate=None)
        for time_us in (1, 1, 5, 5)
    ]
    assert [moment.time_us for moment in _different(moments)] == [1, 5]
