"""Aircraft of the `jsbsim` package land on the point, flown by the link, measured by the truth."""

import math

import pytest

from autopilot_bridge.mavlink import dialect
from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight, Item
from tests.flights.aircraft_figures import MissionFigures, Plan, fly_plan

HEIGHT_M = 40.0  # of the approach


def lands(model: str, flavour: str, turbulence: Turbulence, climbed_m: float, seed: int) -> MissionFigures:
    """Take off, level off and land straight ahead, 6 m/s of wind against it; calm without turbulence."""
    calm = turbulence is Turbulence.NONE
    heading_deg = 353.0 if flavour == "ardupilot" else 0.0
    air = Environment.from_wind(
        speed_m_s=0.0 if calm else 6.0, from_deg=heading_deg + 20.0, turbulence=turbulence
    )
    flight = AircraftFlight(
        flavour,
        seed=seed,
        model=model,
        environment=air,
        parameters={"RTL_AUTOLAND": 2.0} if flavour == "ardupilot" else None,
    )
    slope_m = climbed_m + 18.0 * flight.vehicle.autopilot.context.fixed_wing.airspeed_trim_m_s
    land = flight.on_runway(slope_m + HEIGHT_M / math.tan(math.radians(4.95)))
    items = (
        Item(dialect.MAV_CMD_NAV_TAKEOFF, *flight.on_runway(climbed_m), HEIGHT_M, (10.0, 0.0, 0.0, math.nan)),
        Item(dialect.MAV_CMD_DO_LAND_START),
        Item(dialect.MAV_CMD_NAV_WAYPOINT, *flight.on_runway(slope_m), HEIGHT_M),
        Item(dialect.MAV_CMD_NAV_LAND, *land, 0.0),
    )
    return fly_plan(
        flight, Plan(start=flight.on_runway(climbed_m), corners=(), height_m=HEIGHT_M, items=items, land=land)
    )


@pytest.mark.slow
def test_a_cessna_lands_softly_in_calm() -> None:
    figures = lands("c172x", "px4", Turbulence.NONE, 1160.0, 1)
    assert abs(figures.touch_along_m) < 40.0 and abs(figures.touch_across_m) < 5.0
    assert figures.touch_sink_m_s < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize(("model", "climbed_m"), [("c172x", 1160.0), ("j3cub", 600.0)])
def test_light_singles_land_in_moderate_turbulence(model: str, climbed_m: float, flavour: str) -> None:
    """The worst gust at the touch is luck: one landing of four may be beyond."""
    flown = [lands(model, flavour, Turbulence.MODERATE, climbed_m, seed) for seed in range(4)]
    away_m = sorted(abs(figures.touch_along_m) for figures in flown)
    sinks_m_s = sorted(figures.touch_sink_m_s for figures in flown)
    assert away_m[-2] < 60.0, away_m
    assert sinks_m_s[-2] < 3.0, sinks_m_s
    assert max(abs(figures.touch_across_m) for figures in flown) < 5.0
