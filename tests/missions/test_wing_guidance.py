"""Patterns by waypoints, followed by L1 guidance with the parameters that the aircraft reports.

The follower here is the published law (S. Park, J. Deyst, J. How, AIAA 2004-4900) with the period and damping
of ArduPilot's NAVL1_PERIOD and NAVL1_DAMPING. Legs are followed one by one; a leg ends within the radius of
its waypoint.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from missions.base.options import FlightOptions, Via
from missions.errors import PlanError
from missions.library import find_mission
from missions.pattern_search.mission import PatternMission
from missions.pattern_search.wings.flight import with_leads
from missions.pattern_search.wings.pattern import check_wings
from missions.pattern_search.wings.setpoints import path_point
from missions.pattern_search.wings.waypoints import turn_in_m, waypoints_of
from missions.patterns import named_lissajous
from missions.planning.flyable import FlyablePath, flyable_path
from missions.planning.turns import roll_in_m
from missions.vehicle.firmware_records import ARDUPLANE, PX4_PLANE
from missions.vehicle.limits import FixedWingLimits

STOCK_PLANE = {"AIRSPEED_CRUISE": 22.0, "ROLL_LIMIT_DEG": 65.0, "NAVL1_PERIOD": 15.0, "RLL2SRV_TCONST": 0.25}
"""What ArduPilot 4.6.3's simulated plane reports, where it is not the firmware's default."""
STEP_S = 0.05


def followed(
    route: FlyablePath, waypoints: list[tuple[float, float]], radius_m: float, turn_effect: float
) -> np.ndarray:
    """Track (n, 2) of an aircraft at 22 m/s whose banks give a share of a coordinated turn's acceleration."""
    speed, period, damping, roll_s = 22.0, 15.0, 0.75, 0.4
    length = damping * period * speed / math.pi
    (north, east), course, _ = route.at(float(route.arc_m[0]))
    points, bank, track, leg = [(north, east), *waypoints], 0.0, [], 1
    while leg < len(points):
        start, end = np.array(points[leg - 1]), np.array(points[leg])
        along = (end - start) / np.linalg.norm(end - start)
        place = np.array((north, east))
        if np.linalg.norm(end - place) <= radius_m or (place - end) @ along >= 0.0:
            leg += 1
            continue
        across = along[1] * (place - start)[0] - along[0] * (place - start)[1]
        to_leg = math.asin(max(-0.7, min(0.7, across / length)))
        angle = to_leg + math.remainder(math.atan2(along[1], along[0]) - course, math.tau)
        push = 4.0 * damping**2 * speed**2 / length * math.sin(max(-1.5, min(1.5, angle)))
        bank += (math.atan(push / GRAVITY_M_S2) - bank) * STEP_S / roll_s
        course += turn_effect * GRAVITY_M_S2 * math.tan(bank) / speed * STEP_S
        north += speed * math.cos(course) * STEP_S
        east += speed * math.sin(course) * STEP_S
        track.append((north, east))
    return np.array(track)


def planned(name: str) -> tuple[FlightOptions, FixedWingLimits, FlyablePath]:
    mission = find_mission(name)
    assert isinstance(mission, PatternMission)
    limits = ARDUPLANE.limits(STOCK_PLANE)
    assert isinstance(limits, FixedWingLimits)
    options = mission.adapted(FlightOptions(), limits)
    curve = mission.curve(options)
    path = flyable_path(curve, check_wings(curve, options, limits), roll_in_m(options.speed_m_s, limits))
    return options, limits, path


@pytest.mark.parametrize("name", ["sector", "parallel-sweep", "expanding-square", "lissajous"])
@pytest.mark.parametrize("turn_effect", [0.7, 1.0])
@pytest.mark.sampled(2)
def test_l1_guidance_follows_a_pattern_by_its_waypoints(name: str, turn_effect: float) -> None:
    options, limits, path = planned(name)
    route = with_leads(path, 27.0)
    waypoints = [*waypoints_of(path, options), route.at(route.length_m)[0]]
    radius_m = turn_in_m(options, limits)
    assert radius_m <= 255.0
    track = followed(route, waypoints, radius_m, turn_effect)
    points = route.points_m
    # the end of the route is left where the approach begins
    off = np.array([np.hypot(*(points - place).T).min() for place in track[:-60:4]])
    assert math.sqrt((off**2).mean()) < 8.0
    assert off.max() < 22.0


def test_a_radius_that_the_user_chose_is_kept() -> None:
    _, limits, _ = planned("sector")
    assert turn_in_m(FlightOptions(acceptance_m=35.0), limits) == 35.0


def test_bends_are_no_tighter_than_the_guidance_follows() -> None:
    slow, quick = (ARDUPLANE.limits({**STOCK_PLANE, "NAVL1_PERIOD": period}) for period in (25.0, 5.0))
    assert isinstance(slow, FixedWingLimits) and isinstance(quick, FixedWingLimits)
    assert slow.path_radius_m(22.0) == pytest.approx(22.0 * 0.75 * 25.0 / math.pi)
    assert quick.path_radius_m(22.0) == quick.turn_radius_m(22.0)  # the bank decides
    px4 = PX4_PLANE.limits({"NPFG_PERIOD": 40.0, "FW_AIRSPD_TRIM": 15.0})
    assert isinstance(px4, FixedWingLimits)
    assert px4.path_radius_m(15.0) == pytest.approx(15.0 * 0.7 * 40.0 / math.pi)
    assert px4.waypoint_lead_s == 0.0  # an aircraft of PX4 1.16.1 does not read a waypoint's radius


def test_setpoints_bend_as_tightly_as_the_aircraft_can_bank() -> None:
    mission = find_mission("lissajous")
    limits = ARDUPLANE.limits(STOCK_PLANE)
    chosen = FlightOptions(
        width_m=1000.0, height_m=1000.0, given=frozenset({"width_m", "height_m", "via"}), via=Via.SETPOINTS
    )
    options = mission.adapted(chosen, limits)
    assert isinstance(limits, FixedWingLimits)
    assert check_wings(mission.curve(options), options, limits) == limits.turn_radius_m(22.0)  # type: ignore[attr-defined]
    with pytest.raises(PlanError, match=r"its path guidance \(NAVL1_PERIOD\)"):
        mission.check(replace(options, via=Via.WAYPOINTS), limits)


@pytest.mark.parametrize("lead_share", [0.0, 1.0])
def test_points_for_px4_lead_by_what_its_guidance_needs(lead_share: float) -> None:
    """The law of T. Stastny and R. Siegwart (2019) near a path: pi e / (V T damping) towards it."""
    speed, period, damping, radius = 14.0, 10.0, 0.7, 150.0
    gain = 4.0 * math.pi * damping / period
    route = flyable_path(named_lissajous("L1", width_m=2 * radius, height_m=2 * radius), 50.0, 10.0)
    arc, off = 0.0, []
    (north, east), course, _ = route.at(0.0)
    for _ in range(600):
        arc = route.nearest(north, east, from_arc_m=arc, ahead_m=30.0)
        point = path_point(route, arc, speed, lead_share / gain, 100.0)
        assert point.acceleration_ned_m_s2 is None  # PX4 1.16.1 bends the wrong way by it
        assert point.position_ned_m is not None and point.velocity_ned_m_s is not None
        off.append(math.dist((north, east), point.position_ned_m[:2]))
        along = math.atan2(point.velocity_ned_m_s[1], point.velocity_ned_m_s[0])
        across = (east - point.position_ned_m[1]) * math.cos(along)
        across -= (north - point.position_ned_m[0]) * math.sin(along)
        bearing = along - math.pi * across / (speed * period * damping)
        course += gain * math.sin(bearing - course) * 0.1
        north, east = north + speed * math.cos(course) * 0.1, east + speed * math.sin(course) * 0.1
    if lead_share:
        assert max(off) < 1.0
    else:
        assert max(off) > 2.5  # what the lead is for
