"""What a flight of an aircraft came to, by the truth: how well legs, circles and landings were flown."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from tests.flights.aircraft import AircraftFlight, Item
from tests.flights.turn_geometry import Place, course, ground_speed, turn_over_m

AIRSPEED_M_S = 25.0
"""Trim airspeed of the aircraft flown."""
SETTLED_AFTER_M = 200.0
"""A leg counts from here on: 8 s of flight, in which the turn onto it has died away. Only where the quickest
turn onto it that wings and wind allow (`turn_geometry`) isn't over by then, it counts from where that is:
behind turns back, and some in a wind from behind."""
SETTLED_BEFORE_M = 100.0
"""... up to here, where the turn to the next one may begin."""
_SEA_LEVEL_DENSITY_KG_M3 = 1.225
_BANK_RAD = math.radians(45.0)  # limit of both flavours, on this aircraft
_REVERSAL_S = 1.0  # from limit to limit, at the roll rate of its wings
_SWITCH_S = 0.32 * 0.7 * 10.0  # PX4: NPFG_SW_DST_MLT, _DAMPING and _PERIOD times the ground speed
_WP_RADIUS_M = 50.0  # ArduPlane; less for turns of less than a right angle
_LANDS_S = 600.0  # from the first flare, three go-arounds included


def equivalent_airspeed_m_s(flight: AircraftFlight) -> float:
    """Of the truth, gusts included."""
    return math.sqrt(2.0 * float(flight.truth[t.DYNAMIC_PRESSURE_PA]) / _SEA_LEVEL_DENSITY_KG_M3)


def rms(values: list[float] | NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A plan in metres from home: take-off, waypoints, and a landing at home along the runway.

    Attributes:
        start: place of the take-off item.
        corners: north and east of the waypoints.
        height_m: of the waypoints above home.
        items: without ArduPilot's item 0.
        land: where the wheels shall touch.
    """

    start: Place
    corners: tuple[Place, ...]
    height_m: float
    items: tuple[Item, ...]
    land: Place


def plan(
    flight: AircraftFlight, corners: list[Place], height_m: float, *, approach_height_m: float = 40.0
) -> Plan:
    """As QGroundControl plans it: PX4's landing pattern (loiter to altitude), ArduPlane's (waypoints).

    Args:
        flight: whose flavour and runway count.
        corners: waypoints given along the runway that starts at home, and to its right.
        height_m: of the waypoints.
        approach_height_m: where the glide slope of 5 degrees begins.
    """
    at = flight.on_runway
    land = at(50.0)
    away_m = approach_height_m / math.tan(math.radians(5.0))
    places = [at(*corner) for corner in corners]
    start = at(350.0)
    items = [Item(dialect.MAV_CMD_NAV_TAKEOFF, *start, 40.0, (10.0, 0.0, 0.0, math.nan))]
    items += [Item(dialect.MAV_CMD_NAV_WAYPOINT, *place, height_m) for place in places]
    items.append(Item(dialect.MAV_CMD_DO_LAND_START))
    if flight.flavour == "px4":
        radius_m = 100.0
        centre = at(50.0 - away_m, -radius_m)
        items.append(
            Item(dialect.MAV_CMD_NAV_LOITER_TO_ALT, *centre, approach_height_m, (1.0, -radius_m, 0.0, 1.0))
        )
    else:
        items.append(
            Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(-away_m - 250.0, -150.0), approach_height_m + 10.0)
        )
        items.append(Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(50.0 - away_m), approach_height_m))
    items.append(Item(dialect.MAV_CMD_NAV_LAND, *land, 0.0))
    return Plan(start=start, corners=tuple(places), height_m=height_m, items=tuple(items), land=land)


def settled_after_m(flavour: str, before: Place, corner: Place, after: Place, wind: Place) -> float:
    """From where on the leg `corner`..`after` counts: `SETTLED_AFTER_M`, or later where nothing could turn
    onto it so soon.
    """
    turn_rad = abs((course(corner, after) - course(before, corner) + math.pi) % (2.0 * math.pi) - math.pi)
    if flavour == "px4":
        turn_in_m = _SWITCH_S * ground_speed(course(before, corner), AIRSPEED_M_S, wind)
    else:
        turn_in_m = _WP_RADIUS_M * min(1.0, turn_rad / (0.5 * math.pi))
    over_m = turn_over_m(
        before,
        corner,
        after,
        turn_in_m=turn_in_m,
        airspeed_m_s=AIRSPEED_M_S,
        bank_rad=_BANK_RAD,
        reversal_s=_REVERSAL_S,
        wind=wind,
    )
    return max(SETTLED_AFTER_M, over_m)


@dataclass(slots=True, kw_only=True)
class MissionFigures:
    """A mission by the truth.

    Attributes:
        across_m, height_m, airspeed_m_s: errors of ten a second on the settled parts of the legs.
        touch_along_m, touch_across_m: where the wheels touched, from the place to land.
        touch_sink_m_s: rate of descent then.
        go_arounds: how often it went around before.
        lowest_airspeed_m_s: equivalent, from the take-off to the flare.
    """

    across_m: list[float]
    height_m: list[float]
    airspeed_m_s: list[float]
    touch_along_m: float = math.nan
    touch_across_m: float = math.nan
    touch_sink_m_s: float = math.nan
    go_arounds: int = 0
    lowest_airspeed_m_s: float = math.inf

    def __str__(self) -> str:
        return (
            f"across {rms(self.across_m):.2f} height {rms(self.height_m):.2f} "
            f"(mean {np.mean(self.height_m):+.2f}) airspeed {rms(self.airspeed_m_s):.2f} "
            f"(mean {np.mean(self.airspeed_m_s):+.2f}) touch {self.touch_along_m:+.1f} "
            f"{self.touch_across_m:+.1f} m sink {self.touch_sink_m_s:.2f} "
            f"lowest {self.lowest_airspeed_m_s:.1f}"
        )


def fly_plan(flight: AircraftFlight, what: Plan, *, limit_s: float = 600.0) -> MissionFigures:
    """Upload, take off, fly and land; notes the true errors."""
    flight.get_ready()
    flight.upload(what.items)
    flight.set_mode("mission")
    flight.arm()
    figures = MissionFigures(across_m=[], height_m=[], airspeed_m_s=[])
    standing_m = flight.height_over_home_m  # heights are over the centre of gravity as it stood
    first = 2 + (flight.flavour == "ardupilot")  # the item that ends the first leg between waypoints
    legs = dict(enumerate(zip(what.corners, what.corners[1:], strict=False), start=first))
    wind = flight.sitl.spec.air.wind_ned_m_s[:2]
    befores = (what.start, *what.corners)
    settled_m = {
        seq: settled_after_m(flight.flavour, befores[seq - first], *leg, wind) for seq, leg in legs.items()
    }
    flying = [False]

    def look() -> bool:
        truth = flight.truth
        airspeed_m_s = equivalent_airspeed_m_s(flight)
        flying[0] = flying[0] or flight.height_m > 20.0
        if flying[0] and flight.height_m > 8.0:
            figures.lowest_airspeed_m_s = min(figures.lowest_airspeed_m_s, airspeed_m_s)
        current = flight.newest.get("MISSION_CURRENT")
        leg = legs.get(current.seq) if current is not None else None
        if leg is not None:
            start, end = leg
            north, east, _ = flight.position_ned_m
            length_m = math.dist(start, end)
            along_m = (
                (north - start[0]) * (end[0] - start[0]) + (east - start[1]) * (end[1] - start[1])
            ) / length_m
            if settled_m[current.seq] <= along_m <= length_m - SETTLED_BEFORE_M:
                figures.across_m.append(flight.cross_track_m(start, end))
                figures.height_m.append(flight.height_over_home_m - standing_m - what.height_m)
                figures.airspeed_m_s.append(airspeed_m_s - AIRSPEED_M_S)
        return bool(flying[0] and truth[t.HEIGHT_ABOVE_GROUND_M] < 5.0)

    flight.fly_until(look, limit_s, "flare")
    last = [0.0, 0.0, 0.0]

    def touches() -> bool:
        if flight.truth[t.ON_GROUND] > 0.0:
            return True
        north, east, _ = flight.position_ned_m
        last[:] = north, east, float(flight.truth[t.VEL_NED_M_S][2])
        return False

    for _ in range(round(_LANDS_S * 1e6) // flight.sitl.step_us):  # physics steps: the sink is gone one later
        if touches():
            break
        flight.sitl.advance()
    else:
        raise AssertionError(f"no touch-down; mode {flight.mode}, {flight.texts[-4:]}")
    heading = math.radians(flight.sitl.spec.place.heading_deg)
    north, east = last[0] - what.land[0], last[1] - what.land[1]
    figures.touch_along_m = north * math.cos(heading) + east * math.sin(heading)
    figures.touch_across_m = east * math.cos(heading) - north * math.sin(heading)
    figures.touch_sink_m_s = last[2]
    figures.go_arounds = sum(text.startswith("Landing aborted") for _, text in flight.texts)
    return figures
