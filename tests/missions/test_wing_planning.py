"""Patterns for aircraft: corners they can turn, sizes that suit them, refusals that say what to change, and
the guidance along a path, flown by a point mass in wind.
"""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from missions.base.options import FlightOptions, Via
from missions.errors import PlanError
from missions.library import MISSIONS
from missions.occupancy.options import OccupancyOptions
from missions.orbit.options import OrbitOptions
from missions.pattern_search.wings.flight import with_leads
from missions.pattern_search.wings.guidance import PathRoll, PathRollParameters, TurnEffect
from missions.pattern_search.wings.place import PlaceOnPath
from missions.patterns import Polyline, named_lissajous, parallel_sweep, sector
from missions.planning.corners import Corner
from missions.planning.flyable import flyable_path
from missions.planning.turns import check_turns, roll_in_m
from missions.planning.way_in import Entry
from missions.vehicle.limits import FixedWingLimits

AEROSONDE = FixedWingLimits(
    airspeed_min_m_s=18.0,
    airspeed_trim_m_s=25.0,
    airspeed_max_m_s=35.0,
    bank_max_rad=math.radians(45.0),
    bank_parameter="FW_R_LIM",
)


@given(turn=st.floats(0.05, 2.9), radius=st.floats(20.0, 800.0), ramp_share=st.floats(0.01, 0.6))
def test_a_corner_turns_as_commanded_and_no_tighter(turn: float, radius: float, ramp_share: float) -> None:
    corner = Corner.of(turn, radius, ramp_share * radius)
    assert corner.course_rad[-1] == pytest.approx(turn, abs=1e-9)
    assert corner.curvature_per_m.max() <= 1.0 / radius + 1e-12
    assert corner.curvature_per_m[0] == corner.curvature_per_m[-1] == 0.0
    # it ends on the second leg, as far from the corner as it began before it
    reach = corner.reach_m
    end = (reach + reach * math.cos(turn), reach * math.sin(turn))
    assert corner.points_m[-1] == pytest.approx(end, abs=1e-5 * radius)
    steps = np.hypot(*np.diff(corner.points_m, axis=0).T)
    assert steps == pytest.approx(np.diff(corner.arc_m), rel=2e-3)


def test_a_corner_without_roll_in_is_an_arc() -> None:
    corner = Corner.of(math.radians(120.0), 100.0, 1e-6)
    assert corner.reach_m == pytest.approx(100.0 * math.tan(math.radians(60.0)), rel=1e-6)


def test_curvature_and_course_of_a_path_are_those_of_its_points() -> None:
    path = flyable_path(parallel_sweep(width_m=1200.0, height_m=900.0, spacing_m=300.0), 90.0, 25.0)
    east, north = np.gradient(path.points_m[:, 1], path.arc_m), np.gradient(path.points_m[:, 0], path.arc_m)
    assert np.hypot(north, east) == pytest.approx(np.ones(len(path.arc_m)), abs=2e-3)
    assert np.abs(np.angle(np.exp(1j * (np.arctan2(east, north) - path.course_rad)))).max() < 0.02
    bend = np.gradient(path.course_rad, path.arc_m)
    assert np.abs(bend - path.curvature_per_m).max() < 1e-3


def test_leads_go_on_straight_and_keep_the_pattern_where_it_was() -> None:
    path = flyable_path(named_lissajous("L2", width_m=1400.0, height_m=1400.0), 80.0, 25.0)
    route = path.with_leads(200.0, 100.0)
    assert route.arc_m[0] == pytest.approx(-200.0)
    assert route.length_m == pytest.approx(path.length_m + 100.0)
    for arc in (0.0, 300.0, path.length_m):
        assert route.at(arc)[0] == pytest.approx(path.at(arc)[0], abs=1e-9)
    (north, east), course, bend = route.at(-200.0)
    start = path.at(0.0)
    back = (start[0][0] - 200.0 * math.cos(start[1]), start[0][1] - 200.0 * math.sin(start[1]))
    assert (north, east) == pytest.approx(back)
    assert course == pytest.approx(start[1])
    assert bend == 0.0


@pytest.mark.parametrize("from_m", [(0.0, 0.0), (-300.0, 200.0), (500.0, -800.0)])
def test_the_entry_circle_touches_the_way_in(from_m: tuple[float, float]) -> None:
    route = with_leads(flyable_path(named_lissajous("L2", width_m=1400.0, height_m=1400.0), 80.0, 25.0), 30.0)
    entry = Entry.to(route, 80.0, from_m)
    to_circle = np.array((entry.north_m, entry.east_m)) - entry.centre_m
    assert np.hypot(*to_circle) == pytest.approx(entry.radius_m)
    # the circle's direction at that place is the way's
    tangent = np.array((-to_circle[1], to_circle[0])) / entry.radius_m * (1.0 if entry.clockwise else -1.0)
    assert tangent == pytest.approx((math.cos(entry.course_rad), math.sin(entry.course_rad)), abs=1e-9)


def flown(name: str, limits: FixedWingLimits, **chosen: object) -> FlightOptions:
    mission = MISSIONS[name]
    options = mission.adapted(FlightOptions(**chosen), limits)  # type: ignore[arg-type]
    mission.check(options, limits)
    return options


@settings(deadline=None, max_examples=15)
@given(speed=st.floats(12.0, 45.0), bank_deg=st.floats(30.0, 60.0), wind_share=st.floats(0.0, 0.4))
def test_defaults_are_flyable_for_any_aircraft(speed: float, bank_deg: float, wind_share: float) -> None:
    limits = FixedWingLimits(
        airspeed_min_m_s=0.7 * speed,
        airspeed_trim_m_s=speed,
        airspeed_max_m_s=1.4 * speed,
        bank_max_rad=math.radians(bank_deg),
        wind_m_s=wind_share * speed,
    )
    for name in ("sector", "parallel-sweep", "expanding-square"):
        assert flown(name, limits).via is Via.SETPOINTS
    flown("lissajous", limits, pattern="L1")
    flown("lissajous", limits)


@pytest.mark.parametrize("pattern", ["L1", "L2", "L3", "L4"])
@pytest.mark.parametrize("wind", [0.0, 6.0])
def test_every_named_pattern_has_a_flyable_default_size(pattern: str, wind: float) -> None:
    limits = FixedWingLimits(
        airspeed_trim_m_s=25.0, airspeed_max_m_s=35.0, bank_max_rad=math.radians(45.0), wind_m_s=wind
    )
    options = flown("lissajous", limits, pattern=pattern)
    assert options.width_m >= 1000.0


@pytest.mark.parametrize("height_m", [200.0, 380.0, 700.0, 900.0, 1210.0])
def test_a_sweep_of_a_chosen_size_gets_legs_it_can_turn_between(height_m: float) -> None:
    options = flown("parallel-sweep", AEROSONDE, width_m=1500.0, height_m=height_m)
    assert height_m / options.spacing_m == pytest.approx(round(height_m / options.spacing_m))


@pytest.mark.parametrize("vehicles", [3, 5])
def test_a_team_flies_in_layers_below_the_ceiling(vehicles: int) -> None:
    heights = [
        flown("lissajous", AEROSONDE, vehicles=vehicles, index=k).own_altitude_m for k in range(vehicles)
    ]
    assert max(heights) <= AEROSONDE.altitude_max_m
    assert min(np.diff(heights)) >= 15.0


def test_what_is_chosen_stays() -> None:
    options = flown("lissajous", AEROSONDE, via=Via.WAYPOINTS, given=frozenset({"via"}))
    assert options.via is Via.WAYPOINTS


@pytest.mark.parametrize(
    ("name", "chosen", "said"),
    [
        ("lissajous", {"width_m": 300.0, "height_m": 300.0}, "`width_m, height_m` [0-9]+, .*`speed_m_s`"),
        ("parallel-sweep", {"spacing_m": 60.0}, "`spacing_m`"),
        ("sector", {"width_m": 200.0, "height_m": 200.0}, "`width_m, height_m` [0-9]+, or lower `speed_m_s`"),
        ("lissajous", {"speed_m_s": 60.0}, "35 m/s"),
        ("lissajous", {"altitude_m": 400.0}, "`altitude_m`"),
        ("parallel-sweep", {"periods": 2.0}, "straight back"),
        ("lissajous", {"period_s": 60.0, "via": Via.SETPOINTS}, "`period_s`"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_what_to_change(
    name: str, chosen: dict[str, object], said: str
) -> None:
    with pytest.raises(PlanError, match=said):
        flown(name, AEROSONDE, **chosen)


def test_the_refusal_names_a_size_that_can_be_flown() -> None:
    small = named_lissajous("L3", width_m=800.0, height_m=800.0)
    with pytest.raises(PlanError, match=r"FW_R_LIM") as refusal:
        check_turns(small, 25.0, AEROSONDE)
    factor = float(str(refusal.value).split("`width_m, height_m` ")[1].split(" times")[0])
    check_turns(named_lissajous("L3", width_m=800.0 * factor, height_m=800.0 * factor), 25.0, AEROSONDE)


def test_polylines_are_checked_by_what_their_corners_take() -> None:
    radius = AEROSONDE.turn_radius_m(25.0)
    reach = Corner.of(math.radians(120.0), radius, roll_in_m(25.0, AEROSONDE)).reach_m
    check_turns(sector(radius_m=2.0 * reach + 1.0), 25.0, AEROSONDE)
    with pytest.raises(PlanError):
        check_turns(sector(radius_m=2.0 * reach - 1.0), 25.0, AEROSONDE)
    assert check_turns(Polyline(((0.0, 0.0), (300.0, 0.0))), 25.0, AEROSONDE) == radius


def follow(wind: tuple[float, float], offset_m: float, effect: float = 1.0) -> np.ndarray:
    """Distances of a point mass that banks with a lag, from 20 s on.

    Its banks give a share of a coordinated turn's acceleration; the law measures it ten times a second.
    """
    measured = TurnEffect()
    path = flyable_path(named_lissajous("L2", width_m=2100.0, height_m=2100.0), 100.0, 25.0)
    route = with_leads(path, 30.0)
    law = PathRoll(route, PathRollParameters(), measured)
    place = object.__new__(PlaceOnPath)
    place.arc_m = float(route.arc_m[0])
    (north, east), course, _ = route.at(place.arc_m)
    north, east = north - offset_m * math.sin(course), east + offset_m * math.cos(course)
    heading, roll, airspeed, dt = course, 0.0, 25.0, 0.02
    across = []
    for k in range(6000):
        vel = (airspeed * math.cos(heading) + wind[0], airspeed * math.sin(heading) + wind[1])
        north, east = north + dt * vel[0], east + dt * vel[1]
        place.arc_m = max(place.arc_m, route.nearest(north, east, from_arc_m=place.arc_m, ahead_m=80.0))
        (pn, pe), course, _ = route.at(place.arc_m)
        place.across_m = (east - pe) * math.cos(course) - (north - pn) * math.sin(course)
        place.vel_north_m_s, place.vel_east_m_s = vel
        place.ground_speed_m_s = math.hypot(*vel)
        roll += dt / 0.4 * (law.roll_rad(place, heading, k * 20_000) - roll)
        heading += dt * effect * GRAVITY_M_S2 * math.tan(roll) / airspeed
        if k % 5 == 0:
            measured.update(k * 20_000, vel, roll, heading)
        across.append(place.across_m)
    assert measured.share == pytest.approx(effect, abs=0.06)
    return np.array(across[1000:])


@pytest.mark.parametrize("wind", [(0.0, 0.0), (6.0, 0.0), (-3.0, 7.0)])
@pytest.mark.parametrize("offset_m", [0.0, -60.0])
@pytest.mark.sampled(1)
def test_banks_follow_a_path_in_wind(wind: tuple[float, float], offset_m: float) -> None:
    across = follow(wind, offset_m)
    assert np.sqrt((across**2).mean()) < 1.0
    assert np.abs(across).max() < 3.0


@pytest.mark.parametrize("effect", [0.7, 1.15])
@pytest.mark.sampled(1)
def test_banks_follow_a_path_when_the_aircraft_slips_in_its_turns(effect: float) -> None:
    across = follow((-3.0, 4.0), 0.0, effect)
    assert np.sqrt((across**2).mean()) < 1.0
    assert np.abs(across).max() < 4.0


def test_gains_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="damping"):
        PathRollParameters(damping=0.0)


def test_an_equivalent_airspeed_is_faster_and_turns_wider_in_thin_air() -> None:
    """Densities of ISO 2533: 1.225 kg/m^3 at sea level, 1.15587 at 600 m."""
    low = FixedWingLimits(wind_m_s=0.0, bank_max_rad=math.radians(45.0))
    high = replace(low, air_altitude_m=600.0)
    assert high.true_airspeed_m_s(25.0) == pytest.approx(25.0 * math.sqrt(1.225 / 1.15587), rel=1e-4)
    assert low.turn_radius_m(25.0) == pytest.approx(1.2 * 25.0**2 / GRAVITY_M_S2)
    assert high.turn_radius_m(25.0) == pytest.approx(low.turn_radius_m(25.0) * 1.225 / 1.15587, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "chosen"),
    [
        ("lissajous", {"width_m": 50.0, "height_m": 50.0}),
        ("lissajous", {"width_m": 120.0, "height_m": 120.0, "pattern": "L2"}),
        ("lissajous", {"width_m": 300.0, "height_m": 150.0, "ratio": (3.0, 4.0)}),
        ("parallel-sweep", {"width_m": 50.0, "height_m": 50.0}),
        ("parallel-sweep", {"width_m": 300.0, "height_m": 120.0}),
        ("parallel-sweep", {"spacing_m": 50.0}),
        ("expanding-square", {"width_m": 60.0, "height_m": 60.0}),
        ("expanding-square", {"spacing_m": 60.0}),
        ("sector", {"width_m": 50.0, "height_m": 50.0}),
    ],
)
def test_one_refusal_tells_what_will_be_flown(name: str, chosen: dict[str, Any]) -> None:
    """Whoever follows the advice is not refused again."""
    limits = FixedWingLimits(
        airspeed_trim_m_s=25.0, airspeed_max_m_s=35.0, bank_max_rad=math.radians(45.0), wind_m_s=5.0
    )
    with pytest.raises(PlanError) as refusal:
        flown(name, limits, **chosen)
    advice = r"`(width_m, height_m|spacing_m)` ([0-9.]+)(?:x([0-9.]+))?(?: or more)?,"
    requested = re.search(advice, str(refusal.value))
    assert requested is not None, refusal.value
    if requested[1] == "spacing_m":
        flown(name, limits, **(chosen | {"spacing_m": float(requested[2])}))
        return
    wide_m, high_m = float(requested[2]), float(requested[3] or requested[2])
    flown(name, limits, **(chosen | {"width_m": wide_m, "height_m": high_m}))


@pytest.mark.parametrize("name", ["lissajous", "orbit", "occupancy"])
def test_a_teams_layers_are_no_thinner_than_a_height_is_held(name: str) -> None:
    limits = FixedWingLimits(
        airspeed_trim_m_s=25.0, airspeed_max_m_s=35.0, bank_max_rad=math.radians(45.0), wind_m_s=5.0
    )
    mission = MISSIONS[name]
    kind = {"lissajous": FlightOptions, "orbit": OrbitOptions, "occupancy": OccupancyOptions}[name]
    for separation_m, thin in ((9.0, True), (10.0, False)):
        options = mission.adapted(kind(separation_m=separation_m, vehicles=2), limits)
        if not thin:
            mission.check(options, limits)
            continue
        with pytest.raises(PlanError, match=r"layers of 9 m are too thin.*`separation_m` 10"):
            mission.check(options, limits)
        mission.check(mission.adapted(kind(separation_m=separation_m), limits), limits)  # alone
