"""The barometer's sample belongs to the time before its lag: which past height it is compared with."""

import math

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


class Heights:
    """The height part of a filter that has been running, at 0 m, and sinks by 1 m/s."""

    def __init__(self, **parameters: float) -> None:
        self.parameters = NavigationParameters(**parameters)
        self.solution = Solution(self.parameters, physics_rate_hz=RATE_HZ)
        self.solution.steps = NOW_US // PERIOD_US
        self.readings, self.clocks, self.health = SensorReadings(), Clocks(), NavigationHealth()
        self.contradictions = Contradictions()
        self.terrain = TerrainEstimator(self.parameters)
        self.terrain.landed(NOW_US, 3.0 - self.parameters.ground_clearance_m)
        parts = AidingParts(
            readings=self.readings,
            solution=self.solution,
            health=self.health,
            clocks=self.clocks,
            contradictions=self.contradictions,
            standby=Standby(self.solution, self.clocks),
        )
        self.aiding = HeightAiding(self.parameters, parts, terrain=self.terrain)
        self.solution.core[s.X_VEL : s.X_VEL + 3] = 4.0, 5.0, 1.0
        self.solution.history[:, s.HISTORY_VEL + 2] = 1.0

    def sample(self, pressure_pa: float = 101_325.0) -> int:
        self.readings.barometer.time_us = NOW_US
        self.readings.barometer.values[BARO_PRESSURE_PA] = pressure_pa
        return self.aiding.prepare_barometer(NOW_US)

    def fix(self, down_m: float, velocity_down_m_s: float) -> None:
        self.solution.obs[fusion.GPS_POS + 2] = down_m
        self.solution.obs[fusion.GPS_VEL : fusion.GPS_VEL + 3] = 4.0, 5.0, velocity_down_m_s

    @property
    def down_m(self) -> float:
        return float(self.solution.core[s.X_POS + 2])


@pytest.mark.parametrize("pressure_pa", [math.nan, math.inf, -1.0])
def test_impossible_pressures_are_not_used(pressure_pa: float) -> None:
    assert Heights().sample(pressure_pa) == -1


def test_a_pressure_from_before_the_history_is_not_used() -> None:
    heights = Heights()
    heights.solution.steps = 2
    assert heights.sample() == -1


def test_the_first_pressure_gives_the_offset_and_the_next_ones_do_not() -> None:
    heights = Heights()
    heights.sample()
    first = heights.solution.core[s.X_BARO_OFFSET]
    heights.sample(100_000.0)
    assert heights.solution.core[s.X_BARO_OFFSET] == first


def test_an_accepted_pressure_is_a_height() -> None:
    heights = Heights()
    heights.sample()
    heights.aiding.note_barometer(NOW_US, accepted=True)
    assert (heights.clocks.baro_us, heights.clocks.height_us) == (NOW_US, NOW_US)


def test_the_first_gps_height_sets_the_height() -> None:
    heights = Heights()
    heights.fix(-20.0, 2.5)
    heights.aiding.follow_gps(0, NOW_US)
    assert heights.down_m == pytest.approx(-20.0)
    assert heights.solution.core[s.X_VEL : s.X_VEL + 3] == pytest.approx([4.0, 5.0, 2.5])
    assert heights.clocks.gps_height_us == NOW_US
    assert heights.clocks.gps_height_refused_us == -1
    assert (heights.health.height_resets, heights.health.height_reset_down_m) == (1, pytest.approx(-20.0))
    assert heights.terrain.down_m == pytest.approx(3.0 - 20.0)
    assert heights.solution.core[s.X_BARO_OFFSET] == 0.0  # no barometer yet: nothing to move along
    heights.fix(-50.0, 0.0)
    heights.aiding.follow_gps(0, NOW_US)  # the next one is fused, not set
    assert heights.down_m == pytest.approx(-20.0)


def test_a_known_barometer_moves_along() -> None:
    heights = Heights()
    heights.sample()
    before = heights.solution.core[s.X_BARO_OFFSET]
    heights.fix(-20.0, 2.5)
    heights.aiding.follow_gps(0, NOW_US)
    assert heights.solution.core[s.X_BARO_OFFSET] == pytest.approx(before - 20.0)


def test_a_gps_height_refused_for_long_sets_the_height() -> None:
    heights = Heights()
    heights.fix(0.0, 0.0)
    heights.aiding.follow_gps(0, NOW_US)
    heights.clocks.gps_judged_us = NOW_US
    heights.aiding.note_gps(NOW_US, accepted=False)
    assert heights.clocks.gps_height_refused_us == NOW_US
    timeout_us = round(heights.parameters.gps_timeout_s * 1e6)
    heights.fix(-30.0, 0.0)
    for later_us, set_again in ((200_000, False), (timeout_us, False), (timeout_us + 1, True)):
        heights.clocks.gps_judged_us = NOW_US + later_us
        heights.aiding.note_gps(NOW_US + later_us, accepted=False)
        heights.aiding.follow_gps(0, NOW_US + later_us)
        assert (heights.down_m == pytest.approx(-30.0)) is set_again
    assert heights.health.height_resets == 2


def test_an_accepted_gps_height_ends_the_refusal() -> None:
    heights = Heights()
    heights.clocks.gps_judged_us = NOW_US
    heights.aiding.note_gps(NOW_US, accepted=False)
    heights.aiding.note_gps(NOW_US + 1, accepted=True)
    assert heights.clocks.gps_height_refused_us == -1
    assert (heights.clocks.gps_height_us, heights.clocks.height_us) == (NOW_US + 1, NOW_US + 1)


@pytest.mark.parametrize(
    ("gps_age_us", "with_gps"), [(0, True), (1_000_000, True), (1_000_001, False), (None, False)]
)
def test_a_barometer_refused_for_long(gps_age_us: int | None, with_gps: bool) -> None:
    """With GPS heights its offset is learnt again; without them the height jumps to it."""
    heights = Heights()
    heights.sample()
    heights.solution.core[s.X_POS + 2] = -12.0
    offset = float(heights.solution.core[s.X_BARO_OFFSET])
    height = float(heights.solution.obs[fusion.BARO_HEIGHT])
    heights.clocks.baro_us = heights.clocks.aligned_us = NOW_US
    timeout_us = round(heights.parameters.height_timeout_s * 1e6)
    for later_us in (timeout_us, timeout_us + 1):
        now_us = NOW_US + later_us
        heights.clocks.gps_height_us = -1 if gps_age_us is None else now_us - gps_age_us
        heights.aiding.note_barometer(now_us, accepted=False)
        if later_us == timeout_us:
            assert heights.down_m == -12.0
            assert heights.solution.core[s.X_BARO_OFFSET] == offset
    if with_gps:
        assert heights.down_m == -12.0
        assert heights.solution.core[s.X_BARO_OFFSET] == pytest.approx(height - 12.0)
        assert heights.solution.core[s.X_VEL + 2] == 1.0
    else:
        assert heights.down_m == pytest.approx(offset - height)
        assert heights.solution.core[s.X_VEL : s.X_VEL + 3] == pytest.approx([4.0, 5.0, 0.0])
        assert heights.health.height_resets == 1
        assert heights.terrain.down_m == pytest.approx(3.0 + heights.down_m + 12.0)
    assert heights.clocks.baro_us == NOW_US + timeout_us + 1
