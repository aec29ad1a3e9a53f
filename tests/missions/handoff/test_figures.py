"""The truth of a handoff where the link had gaps."""

from types import SimpleNamespace

import numpy as np
import pytest

from estimators.references import TARGET_SYSTEM
from missions.flown.records import FlightRecords
from missions.handoff.figures import handoff_truth
from tests.missions.orbit.test_score import truth_frames


@pytest.mark.parametrize("lost", ["tracker", "target"])
def test_in_a_gap_of_the_link_nothing_is_known_of_aircraft_and_targets(lost):
    everything = np.arange(0.0, 60.0, 0.1)
    known = everything[(everything <= 30.0) | (everything >= 40.0)]
    records = FlightRecords.of_frames(
        (
            *truth_frames(1, 25, everything, lambda time_s: (0.0, 10.0 * time_s)),
            *truth_frames(2, 25, known if lost == "tracker" else everything, lambda time_s: (50.0, 0.0)),
            *truth_frames(TARGET_SYSTEM, 1, known if lost == "target" else everything, lambda _: (5.0, 0.0)),
        )
    )
    truth = handoff_truth(records, (1, 2))
    assert truth is not None

    def placed(time_us):
        return truth.placed(1, [SimpleNamespace(time_us=time_us, target_m=(-46.0, 0.0))])[0]  # type: ignore[list-item]

    assert truth.nearest(20e6, placed(20e6)) == (0, pytest.approx(1.0, abs=0.05))
    assert truth.nearest(35e6, placed(35e6)) is None
    assert truth.nearest(35e6, np.array([4.0, 0.0])) == (
        None if lost == "target" else (0, pytest.approx(1.0, abs=0.05))
    )
