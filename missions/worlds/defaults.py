"""The world that a mission is flown in unless the user describes another."""

from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.world_spec import WorldSpec
from missions.base.given_text import parse_wind
from missions.base.mission import WorldDefaults


def default_world(defaults: WorldDefaults, *, count: int, seed: int) -> WorldSpec:
    """The world that `flightstack fly` makes for a mission where only vehicles and seed are chosen."""
    speed_m_s, from_deg = parse_wind(defaults.wind)
    return WorldSpec.of_team(
        count,
        model=defaults.model,
        autopilot=defaults.autopilot or "px4",
        home=None if defaults.home is None else Home.parse(defaults.home),
        seed=seed,
        air=Environment.from_wind(speed_m_s=speed_m_s, from_deg=from_deg, turbulence=defaults.turbulence),
    )
