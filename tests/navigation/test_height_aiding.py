"""The barometer's sample belongs to the time before its lag: which past height it is compared with."""

import numpy as np
import pytest

from autopilot_bridge.navigation import NavigationParameters, fusion
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.clocks import Clocks, Contradictions
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.height_aiding import HeightAiding
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.standby import Standby
from autopilot_bridge.navigation.terrain import TerrainEstimator
from flightsim.interface import BARO_PRESSURE_PA, SensorReadings

RATE_HZ = 250
PERIOD_US = 4_000
NOW_US = 400_000
SINK_M_S = 5.0


@pytest.mark.parametrize("lag_s", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("delivered_late_us", [0, 40_000])
def test_a_lagging_barometer_shows_an_earlier_height(lag_s: float, delivered_late_us: int) -> None:
    """A vehicle sinks at 5 m/s; the sample shows where it was, so the learnt offset is free of the lag."""
    parameters = NavigationParameters(barometer_lag_s=lag_s)
    solution = Solution(parameters, physics_rate_hz=RATE_HZ)
    solution.steps = NOW_US // PERIOD_US
    for back in range(solution.rows):
        row = (solution.row - back) % solution.rows
        solution.history[row, s.HISTORY_POS + 2] = SINK_M_S * (NOW_US - back * PERIOD_US) * 1e-6
    readings, clocks = SensorReadings(), Clocks()
    parts = AidingParts(
        readings=readings,
        solution=solution,
        health=NavigationHealth(),
        clocks=clocks,
        contradictions=Contradictions(),
        standby=Standby(solution, clocks),
    )
    aiding = HeightAiding(parameters, parts, terrain=TerrainEstimator(parameters))
    readings.barometer.time_us = NOW_US - delivered_late_us
    readings.barometer.values[BARO_PRESSURE_PA] = 101_325.0  # pressure altitude 0
    age_s = lag_s + delivered_late_us * 1e-6
    row = aiding.prepare_barometer(NOW_US)
    past_down_m = SINK_M_S * (NOW_US * 1e-6 - age_s)
    assert solution.past_position(row)[2] == pytest.approx(past_down_m)
    assert solution.obs[fusion.BARO_DELAY_S] == pytest.approx(age_s)
    assert solution.core[s.X_BARO_OFFSET] == pytest.approx(past_down_m, abs=1e-6)
    assert np.isfinite(solution.obs[fusion.BARO_HEIGHT])
