"""Where and how softly aircraft land: distance from the point along and across the runway, sink at the touch.

    python benchmarks/aircraft_landings.py [--model aerosonde] [--turbulence moderate] [--wind 6]
        [--from 0 30 60 -45] [--autopilot px4 ardupilot] [--seeds 8] [--first-seed 1000] [--each]

Every landing is a whole flight of the SITL with its sensors and navigation filter: a plan that takes off,
levels off and lands straight ahead, so that most of the flight is the approach. What is printed is the truth:
the last physics step before the first wheel touched. The wind's direction is given from the runway's,
clockwise: 0 blows against the landing.
"""

import argparse
import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.sitl import Sitl, SitlVehicle
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from flightsim.foundation.geodesy import LocalFrame
from flightsim.world_spec import VehicleSpec, WorldSpec

GLIDE_SLOPE_RAD = math.radians(5.0)
HEIGHT_M = 40.0  # where the slope begins
TAKEOFF_M_PER_M_S2 = 0.45  # way to roll and climb, over the square of the trim airspeed
TAKEOFF_M = 250.0
LEVEL_S = 18.0  # from there to the slope
LIMIT_S = 900.0
WITHIN_M = 20.0  # what is requested
SOFT_M_S = 2.0
SEA_LEVEL_DENSITY_KG_M3 = 1.225


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One landing; its wind comes from `wind_from_deg`, clockwise from the runway's direction."""

    model: str
    flavour: str
    turbulence: Turbulence
    wind_m_s: float
    wind_from_deg: float
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Touch:
    """Where the wheels first touched, from the place to land, and the rate of descent then.

    Attributes:
        go_arounds: how often it was low over the runway before, and climbed again.
    """

    along_m: float
    across_m: float
    sink_m_s: float
    ground_speed_m_s: float
    airspeed_m_s: float
    pitch_deg: float
    go_arounds: int


def plan_of(vehicle: SitlVehicle, course_rad: float) -> tuple[tuple[MissionItem, ...], float]:
    """Take-off, a waypoint and a landing in one line; how far from the start the place to land is."""
    home = vehicle.autopilot.commander.home.position
    assert home is not None
    frame = LocalFrame(home)
    trim_m_s = vehicle.autopilot.context.fixed_wing.airspeed_trim_m_s
    climbed_m = TAKEOFF_M + TAKEOFF_M_PER_M_S2 * trim_m_s**2
    slope_starts_m = climbed_m + LEVEL_S * trim_m_s
    lands_m = slope_starts_m + HEIGHT_M / math.tan(GLIDE_SLOPE_RAD)

    def item(command: int, along_m: float, height_m: float, param1: float = 0.0) -> MissionItem:
        north_m, east_m = along_m * math.cos(course_rad), along_m * math.sin(course_rad)
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
        return MissionItem(command=command, x=lat, y=lon, z=height_m, param1=param1, param4=math.nan)

    takeoff = item(dialect.MAV_CMD_NAV_TAKEOFF, climbed_m, HEIGHT_M, 10.0)
    items = [
        takeoff,
        MissionItem(command=dialect.MAV_CMD_DO_LAND_START, frame=dialect.MAV_FRAME_MISSION),
        item(dialect.MAV_CMD_NAV_WAYPOINT, slope_starts_m, HEIGHT_M),
        item(dialect.MAV_CMD_NAV_LAND, lands_m, 0.0),
    ]
    if vehicle.autopilot.commander.policy.mission_first_item:  # item 0 is home
        items.insert(0, takeoff)
    return tuple(items), lands_m


def land(case: Case) -> Touch:
    """Fly it."""
    flavour = case.flavour
    specification = VehicleSpec(autopilot=flavour, model=case.model)
    configuration = WorldSpec(vehicles=(specification,), seed=case.seed)
    heading_deg = configuration.place.heading_deg
    environment = Environment.from_wind(
        speed_m_s=case.wind_m_s, from_deg=heading_deg + case.wind_from_deg, turbulence=case.turbulence
    )
    sitl = Sitl(WorldSpec(vehicles=(specification,), seed=case.seed, air=environment))
    try:
        return fly(sitl, case, math.radians(heading_deg))
    finally:
        sitl.close()


def fly(sitl: Sitl, case: Case, course_rad: float) -> Touch:
    """From boot to the touch."""
    vehicle = sitl.vehicles[0]
    commander, truth = vehicle.autopilot.commander, vehicle.vehicle.truth
    limit_us = round(LIMIT_S * 1e6)
    while not (commander.armable and commander.home.position):
        sitl.advance()
        if sitl.time_us > limit_us:
            raise RuntimeError(f"{case} doesn't get ready")
    items, lands_m = plan_of(vehicle, course_rad)
    home = commander.home.position
    commander.missions.replace(items, plan_id=1)
    commander.set_mode(FlightMode.MISSION)
    commander.arm()
    commander.guidance.start_mission()
    flown = low = False
    go_arounds = 0
    last: NDArray[np.float64] = truth.copy()
    while not (flown and truth[t.ON_GROUND] > 0.0):
        last[:] = truth
        height_m = truth[t.HEIGHT_ABOVE_GROUND_M]
        flown = flown or height_m > 0.5 * HEIGHT_M
        go_arounds += low and height_m > 0.5 * HEIGHT_M
        low = flown and height_m < (0.5 if low else 0.25) * HEIGHT_M
        sitl.advance()
        if sitl.time_us > limit_us:
            raise RuntimeError(f"{case} doesn't land within {LIMIT_S} s: {commander.mode}")
    north_m, east_m, _ = LocalFrame(home).ned_from_geodetic(
        math.degrees(last[t.LAT_RAD]), math.degrees(last[t.LON_RAD]), float(last[t.ALT_M])
    )
    c, s = math.cos(course_rad), math.sin(course_rad)
    north_m_s, east_m_s, down_m_s = (float(part) for part in last[t.VEL_NED_M_S])
    w, x, y, z = (float(part) for part in last[t.Q_NED_FROM_FRD])
    return Touch(
        along_m=north_m * c + east_m * s - lands_m,
        across_m=east_m * c - north_m * s,
        sink_m_s=down_m_s,
        ground_speed_m_s=math.hypot(north_m_s, east_m_s),
        airspeed_m_s=math.sqrt(2.0 * float(last[t.DYNAMIC_PRESSURE_PA]) / SEA_LEVEL_DENSITY_KG_M3),
        pitch_deg=math.degrees(math.asin(2.0 * (w * y - x * z))),
        go_arounds=go_arounds,
    )


def table(name: str, touches: list[Touch]) -> str:
    """Median, 95 % and worst of distance and sink; how many were worse than 20 m or 2 m/s; go-arounds."""
    along = np.array([touch.along_m for touch in touches])
    across = np.array([touch.across_m for touch in touches])
    sink = np.array([touch.sink_m_s for touch in touches])

    def spread(values: NDArray[np.float64]) -> str:
        return f"{np.median(values):6.2f} {np.percentile(values, 95):6.2f} {values.max():6.2f}"

    beyond = int(np.sum((np.abs(along) > WITHIN_M) | (sink > SOFT_M_S)))
    around = sum(touch.go_arounds for touch in touches)
    return (
        f"{name:<34s} {len(touches):4d}  {along.mean():+6.2f} {spread(np.abs(along))}   "
        f"{spread(np.abs(across))}   {spread(sink)}   {beyond:3d} {around:7d}"
    )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--model", nargs="+", default=["aerosonde"])
    parser.add_argument("--autopilot", nargs="+", default=["px4", "ardupilot"])
    parser.add_argument("--turbulence", nargs="+", default=["light", "moderate"])
    parser.add_argument("--wind", type=float, default=6.0, help="m/s")
    parser.add_argument("--from", dest="winds_from", type=float, nargs="+", default=[0.0, 30.0, -60.0])
    parser.add_argument("--seeds", type=int, default=6, help="landings of each kind")
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--each", action="store_true", help="print every landing too")
    arguments = parser.parse_args()
    write = sys.stdout.write
    write(f"{'':34s}    n    mean  |along| m{'':13s}|across| m{'':11s}sink m/s{'':12s}beyond  around\n")
    write(f"{'':34s}                50%    95%  worst     50%    95%  worst     50%    95%  worst\n")
    for model in arguments.model:
        for strength in arguments.turbulence:
            turbulence = Turbulence(strength)
            everything: list[Touch] = []
            for flavour in arguments.autopilot:
                for wind_from_deg in arguments.winds_from:
                    touches = []
                    for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
                        case = Case(
                            model=model,
                            flavour=flavour,
                            turbulence=turbulence,
                            wind_m_s=arguments.wind,
                            wind_from_deg=wind_from_deg,
                            seed=seed,
                        )
                        touches.append(land(case))
                        if arguments.each:
                            write(f"  {seed} {touches[-1]}\n")
                    write(table(f"{model} {strength} {flavour} {wind_from_deg:+.0f}", touches) + "\n")
                    sys.stdout.flush()
                    everything += touches
            write(table(f"{model} {strength}: all", everything) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
