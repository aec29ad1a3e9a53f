"""The airspeed that is expected close to the ground, in a wind that fades."""

import math

import pytest

from autopilot_bridge.flight.fixed_wing.landing_parameters import SurfaceWindParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from autopilot_bridge.flight.fixed_wing.surface_wind import SurfaceWind, wind_share
from flightsim.wind_profile import SURFACE_LAYER

WIND_M_S = 7.0  # at 30 m, as the filter knows it
SINK_M_S = 1.3
STANDING_M = 0.3
WIND = SurfaceWindParameters()
DT_S = 0.02


def share_of(height_m: float, known_at_m: float = WIND.known_at_m) -> float:
    return wind_share(height_m, known_at_m, WIND)


def flown(from_ahead_m_s: float, airspeed_m_s: float, ground_speed_m_s: float) -> AircraftState:
    """On the slope northwards, with the filter's wind from ahead, at sea level."""
    state = AircraftState()
    state.vel_north_m_s, state.vel_down_m_s = ground_speed_m_s, SINK_M_S
    state.ground_speed_m_s = ground_speed_m_s
    state.wind_north_m_s = -from_ahead_m_s
    state.airspeed_m_s = airspeed_m_s
    state.true_airspeed_m_s = state.lasting_airspeed_m_s = ground_speed_m_s + from_ahead_m_s
    return state


def come_down(
    wind: SurfaceWind, from_ahead_m_s: float, airspeed_m_s: float, *, fades: bool = True, to_m: float = 1.0
) -> AircraftState:
    """From 30 m at one airspeed in calm air; the last state."""
    wind.reset(40.0, WIND)
    height_m, state = 30.0, AircraftState()
    while height_m > to_m:
        factor = SURFACE_LAYER.factor(height_m + STANDING_M) / SURFACE_LAYER.factor(30.0) if fades else 1.0
        state = flown(from_ahead_m_s, airspeed_m_s, airspeed_m_s - factor * from_ahead_m_s)
        wind.update(state, height_m, STANDING_M, DT_S, measured=True)
        height_m -= SINK_M_S * DT_S
    return state


def test_the_share_follows_the_logarithmic_law() -> None:
    for height_m in (0.5, 2.0, 10.0, 20.0):
        real = SURFACE_LAYER.factor(height_m) / SURFACE_LAYER.factor(30.0)
        assert share_of(height_m) == pytest.approx(real, abs=0.02)
    assert share_of(0.0) == share_of(0.05) == 0.0
    assert share_of(30.0) == share_of(300.0) == 1.0
    assert share_of(10.0, 10.0) == 1.0 > share_of(10.0)  # known from lower down


def test_a_head_wind_that_fades_costs_airspeed_ahead_of_time() -> None:
    wind = SurfaceWind()
    state = come_down(wind, WIND_M_S, 20.0, to_m=3.0)
    assert state.lasting_airspeed_m_s > 22.0  # the filter still has the wind of 30 m
    later_m = 3.0 + STANDING_M - 1.5 * SINK_M_S
    lost_m_s = WIND_M_S * (share_of(3.0 + STANDING_M) - share_of(later_m))
    assert lost_m_s > 0.8
    assert wind.airspeed_m_s == pytest.approx(20.0 - lost_m_s, abs=0.2)
    assert wind.head_wind_m_s == pytest.approx(share_of(0.5 + STANDING_M) * WIND_M_S)


def test_a_tail_wind_that_fades_is_not_taken_for_a_lull() -> None:
    wind = SurfaceWind()
    state = come_down(wind, -WIND_M_S, 20.0, to_m=1.5)
    assert state.lasting_airspeed_m_s < 17.5  # as if a gust from ahead were about to pass
    assert 20.0 < wind.airspeed_m_s < 21.5
    assert wind.head_wind_m_s < 0.0


def test_a_gust_passes() -> None:
    wind = SurfaceWind()
    come_down(wind, WIND_M_S, 20.0, to_m=3.0)
    calm_m_s = wind.airspeed_m_s
    gust = flown(WIND_M_S, 24.0, 20.0 - WIND_M_S * share_of(3.0 + STANDING_M))
    wind.update(gust, 3.0, STANDING_M, DT_S, measured=True)
    assert wind.airspeed_m_s == pytest.approx(calm_m_s, abs=0.1)
    lull = flown(WIND_M_S, 17.0, gust.ground_speed_m_s)
    wind.update(lull, 3.0, STANDING_M, DT_S, measured=True)
    assert wind.airspeed_m_s == pytest.approx(calm_m_s - 3.0, abs=0.1)


def test_a_wind_that_does_not_fade_is_learned() -> None:
    """Half of what the profile would take off from 30 m to here."""
    wind = SurfaceWind()
    state = come_down(wind, WIND_M_S, 20.0, fades=False, to_m=3.0)
    assert state.lasting_airspeed_m_s == pytest.approx(20.0)
    assumed_m_s = WIND_M_S * (1.0 - share_of(3.0 + STANDING_M - 1.5 * SINK_M_S))
    assert 20.0 - wind.airspeed_m_s < 0.75 * assumed_m_s


def test_an_airspeed_made_up_of_the_filters_wind_is_that_of_the_wind_here() -> None:
    """Without the sensor: by the filter's wind alone the aircraft would fly slower by the wind's loss."""
    wind = SurfaceWind()
    wind.reset(40.0, WIND)
    for ahead_m_s, ground_m_s in ((WIND_M_S, 15.0), (-WIND_M_S, 28.0)):
        made_up = ground_m_s + ahead_m_s
        wind.update(flown(ahead_m_s, made_up, ground_m_s), 1.0, STANDING_M, DT_S, measured=False)
        share = share_of(0.5 + STANDING_M)
        assert wind.airspeed_m_s == pytest.approx(min(made_up, ground_m_s + share * ahead_m_s))


def test_without_a_wind_the_airspeed_counts_and_without_that_nothing() -> None:
    wind = SurfaceWind()
    state = flown(0.0, 21.0, 15.0)
    state.lasting_airspeed_m_s = math.nan
    wind.update(state, 5.0, STANDING_M, DT_S, measured=True)
    assert wind.airspeed_m_s == 21.0 and wind.head_wind_m_s == 0.0
    state.airspeed_m_s = math.nan
    wind.update(state, 5.0, STANDING_M, DT_S, measured=True)
    assert math.isnan(wind.airspeed_m_s)


def test_rougher_ground_takes_more_of_the_wind() -> None:
    rough = SurfaceWindParameters(roughness_m=10.0 * WIND.roughness_m)
    assert share_of(5.0) - wind_share(5.0, 30.0, rough) == pytest.approx(0.16, abs=0.01)
