"""The filter in the frames of the firmwares (2 s): a position that keeps up with the GPS, far from home."""

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import layout
from flightsim.foundation.firmware_frames import ArduPilotFrame, Px4Frame
from flightsim.foundation.geodesy import LocalFrame
from tests.navigation.bench import Bench
from tests.navigation.kinematic_flight import HOME, fly, smooth

_LENGTH_M = 4000.0


def _path(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """From rest 4 km to the east, at most at 94 m/s."""
    east = _LENGTH_M * smooth(time_s, 15.0, 80.0)
    return np.stack((0.0 * east, east, 0.0 * east), axis=-1)


@pytest.mark.parametrize("kind", [Px4Frame, ArduPilotFrame])
def test_a_position_far_from_home_is_as_good_as_in_wgs84(kind: type[LocalFrame]) -> None:
    truths = fly(45.0, path=_path)  # while it is fast
    same, other = (Bench(truths, frame_at=each).run(45.0) for each in (LocalFrame, kind))
    np.testing.assert_allclose(
        other.error(), same.error(), atol=0.1
    )  # the meridians meet: 3 cm/s to the north
    positions = [bench.filter.state[layout.POS_NED_M][1] for bench in (same, other)]
    assert positions[1] - positions[0] == pytest.approx((kind(HOME).stretch[1] - 1.0) * positions[0], abs=0.2)
    assert positions[0] > 1000.0
