"""The geofence of each firmware: walls, breaches, actions, and when it switches itself."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.events import FailsafeKind, FenceBreached, FenceSwitched
from autopilot_bridge.commander.fence_keeper import place_ahead
from autopilot_bridge.commander.fence_watch import FenceWatch
from autopilot_bridge.commander.geofence import Geofence
from autopilot_bridge.commander.geofence_parameters import ALL_FENCES, AutoEnable, FenceParameters, FenceType
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.flight.context import LandedState
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav
from flightsim import interface
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.commander.rig import ORIGIN, Rig
from tests.services.plane_rig import PlaneRig

FRAME = LocalFrame(ORIGIN)
HOME = (0.0, 0.0, 0.0)


def vertex(north: float, east: float, count: int, *, inside: bool = True) -> MissionItem:
    lat, lon, _ = FRAME.geodetic_from_ned(north, east, 0.0)
    kept = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
    avoided = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
    return MissionItem(command=kept if inside else avoided, frame=5, param1=float(count), x=lat, y=lon)


def square(north: float, east: float, half: float, *, inside: bool = True) -> tuple[MissionItem, ...]:
    corners = ((-half, -half), (-half, half), (half, half), (half, -half))
    return tuple(vertex(north + n, east + e, 4, inside=inside) for n, e in corners)


def circle(north: float, east: float, radius: float, *, inside: bool = True) -> MissionItem:
    lat, lon, _ = FRAME.geodetic_from_ned(north, east, 0.0)
    kept, avoided = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
    return MissionItem(command=kept if inside else avoided, frame=5, param1=radius, x=lat, y=lon)


def store_of(*items: MissionItem) -> MissionStore:
    store = MissionStore()
    store.replace(items, 1)
    return store


# shapes


@pytest.mark.parametrize("inside", [True, False])
def test_a_polygon_across_180_degrees_covers_the_other_way_round_for_px4_only(inside: bool) -> None:
    """PX4 1.16.1, geofence.cpp: insidePolygon compares longitudes without wrap. ArduPilot wraps."""
    frame = LocalFrame(GeodeticPosition(lat_deg=10.0, lon_deg=179.999, alt_m=0.0))
    command = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION + (not inside)
    corners = ((9.9, 179.9), (9.9, -179.9), (10.1, -179.9), (10.1, 179.9))
    plan = store_of(*(MissionItem(command=command, frame=5, param1=4.0, x=x, y=y) for x, y in corners))
    for unwrapped in (True, False):
        parameters = FenceParameters(enabled=True, unwrapped=unwrapped)
        for east_m in (0.0, 500.0):  # on both sides of 180 degrees, in the polygon
            broken = Geofence(plan).broken((0.0, east_m, -10.0), HOME, frame, parameters, ALL_FENCES)
            assert (broken == FenceType.SHAPES) == (inside if unwrapped else not inside)


@pytest.mark.parametrize("join", [True, False])
def test_inclusions_join_or_must_all_be_kept(join: bool) -> None:
    """PX4 asks for one of them; ArduPilot for all, unless FENCE_OPTIONS joins them."""
    fence = Geofence(store_of(*square(0.0, 0.0, 20.0), circle(30.0, 0.0, 20.0)))
    parameters = FenceParameters(enabled=True, inclusions_join=join)

    def broken(north: float) -> bool:
        return bool(fence.broken((north, 0.0, -5.0), HOME, FRAME, parameters, ALL_FENCES))

    assert not broken(15.0)
    assert broken(0.0) is not join
    assert broken(45.0) is not join
    assert broken(60.0)


def test_nothing_is_inside_a_circle_of_no_radius() -> None:
    parameters = FenceParameters(enabled=True, inclusions_join=True)

    def broken(*items: MissionItem) -> bool:
        return bool(Geofence(store_of(*items)).broken((0.0, 0.0, -5.0), HOME, FRAME, parameters, ALL_FENCES))

    empty = circle(0.0, 0.0, 0.0)
    assert broken(empty)
    assert not broken(empty, *square(0.0, 0.0, 20.0))
    assert not broken(circle(0.0, 0.0, 0.0, inside=False))


def test_exclusions_are_kept_out_of() -> None:
    fence = Geofence(
        store_of(
            *square(0.0, 0.0, 50.0),
            *square(20.0, 0.0, 5.0, inside=False),
            circle(-20.0, 0.0, 5.0, inside=False),
        )
    )
    parameters = FenceParameters(enabled=True)
    for north, inside in ((0.0, True), (20.0, False), (-20.0, False), (-27.0, True), (60.0, False)):
        found = fence.broken((north, 0.0, -5.0), HOME, FRAME, parameters, ALL_FENCES)
        assert (found == FenceType(0)) is inside, north


def test_what_makes_no_sense_is_no_wall() -> None:
    fence = Geofence(store_of(vertex(0, 0, 3), vertex(1, 0, 3), circle(0.0, 0.0, math.nan)))
    assert not fence.broken((1e4, 0.0, 0.0), HOME, FRAME, FenceParameters(enabled=True), ALL_FENCES)
    assert not fence.broken((math.nan, 0.0, 0.0), HOME, FRAME, FenceParameters(radius_m=1.0), ALL_FENCES)


HOME_AWAY = (120.0, -340.0, -7.0)
COMPASS_RAD = [math.radians(bearing) for bearing in range(0, 360, 45)]


@pytest.mark.parametrize("bearing_rad", COMPASS_RAD)
def test_the_cylinder_stands_around_home(bearing_rad: float) -> None:
    """A radius from home and heights above home, wherever home is in the local frame."""
    fence = Geofence(MissionStore())
    parameters = FenceParameters(enabled=True, radius_m=50.0, height_max_m=30.0)

    def broken(distance_m: float, height_m: float) -> FenceType:
        place = (
            HOME_AWAY[0] + distance_m * math.cos(bearing_rad),
            HOME_AWAY[1] + distance_m * math.sin(bearing_rad),
            HOME_AWAY[2] - height_m,
        )
        return fence.broken(place, HOME_AWAY, FRAME, parameters, ALL_FENCES)

    assert broken(49.9, 29.9) == FenceType(0)
    assert broken(50.1, 29.9) == FenceType.CIRCLE
    assert broken(49.9, 30.1) == FenceType.HEIGHT_MAX


@pytest.mark.parametrize("bearing_rad", COMPASS_RAD)
def test_the_distance_outside_is_measured_from_home(bearing_rad: float) -> None:
    watch = FenceWatch(MissionStore())
    place = (
        HOME_AWAY[0] + 62.0 * math.cos(bearing_rad),
        HOME_AWAY[1] + 62.0 * math.sin(bearing_rad),
        HOME_AWAY[2] - 10.0,
    )
    parameters = FenceParameters(enabled=True, radius_m=50.0)
    assert (watch.breaches, watch.breach_time_us) == (0, 0)  # FENCE_STATUS before the first breach
    watch.update(place, HOME_AWAY, FRAME, parameters, time_us=1, armed=True, airborne=True, landing=False)
    assert watch.distance_m == pytest.approx(12.0, abs=1e-9)


def test_return_point() -> None:
    lat, lon, _ = FRAME.geodetic_from_ned(7.0, 8.0, 0.0)
    given = MissionItem(command=mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, frame=3, x=lat, y=lon)
    assert Geofence(store_of(given, *square(0, 0, 9))).return_point(FRAME) == pytest.approx(
        (7.0, 8.0), abs=0.01
    )
    assert Geofence(store_of(*square(3.0, 4.0, 9.0))).return_point(FRAME) == pytest.approx(
        (3.0, 4.0), abs=0.01
    )
    assert Geofence(store_of(circle(5.0, 6.0, 9.0))).return_point(FRAME) == pytest.approx(
        (5.0, 6.0), abs=0.01
    )
    assert Geofence(store_of(circle(5.0, 6.0, 9.0, inside=False))).return_point(FRAME) is None


# breaches


class Watch:
    """A fence watched at a place."""

    def __init__(self, **parameters: object) -> None:
        self.parameters = FenceParameters(**{"enabled": True, "counts_breaches": True, **parameters})
        self.watch = FenceWatch(MissionStore())
        self.time_us = 0

    def at(
        self, north: float, height: float, *, armed: bool = True, airborne: bool = True, landing: bool = False
    ) -> list[object]:
        self.time_us += 100_000
        return list(
            self.watch.update(
                (north, 0.0, -height),
                HOME,
                FRAME,
                self.parameters,
                time_us=self.time_us,
                armed=armed,
                airborne=airborne,
                landing=landing,
            )
        )


def test_breaches_are_counted_wall_by_wall_and_once_more_farther_out() -> None:
    w = Watch(radius_m=100.0, height_max_m=50.0, backup_radius_m=20.0, backup_height_m=20.0)
    assert w.at(90.0, 10.0) == []
    (event,) = w.at(105.0, 10.0)
    assert isinstance(event, FenceBreached) and event.walls == FenceType.CIRCLE
    assert w.at(110.0, 10.0) == []
    (event,) = w.at(110.0, 55.0)
    assert isinstance(event, FenceBreached) and event.walls == FenceType.HEIGHT_MAX
    (event,) = w.at(126.0, 55.0)
    assert isinstance(event, FenceBreached) and event.walls == FenceType.CIRCLE
    assert w.watch.breaches == 3
    assert w.watch.distance_m == pytest.approx(26.0)
    w.at(50.0, 10.0)
    assert not w.watch.broken
    assert w.at(105.0, 10.0)  # a new one


def test_the_floor_counts_once_the_vehicle_was_above_it() -> None:
    w = Watch(floor=True, height_min_m=10.0, shapes=False)
    assert w.at(0.0, 0.0, airborne=False) == []
    assert w.at(0.0, 5.0) == []
    w.at(0.0, 12.0)
    assert w.at(0.0, 9.0)
    assert w.watch.broken == FenceType.HEIGHT_MIN
    w.at(0.0, 12.0)
    assert w.at(0.0, 9.0, landing=True) == []
    assert not w.watch.broken


@pytest.mark.parametrize("rule", list(AutoEnable))
def test_the_fence_switches_itself(rule: AutoEnable) -> None:
    w = Watch(enabled=False, radius_m=100.0, auto_enable=rule)

    def on(*args: float, **kwargs: bool) -> bool:
        w.at(*args, **kwargs)
        return w.watch.enabled(w.parameters)

    assert not on(0.0, 0.0, armed=False, airborne=False)
    assert on(0.0, 0.0, airborne=False) is (rule is AutoEnable.WHEN_ARMED)
    assert on(0.0, 10.0) is (rule is not AutoEnable.OFF)
    assert on(0.0, 10.0, landing=True) is (rule in (AutoEnable.ON_TAKEOFF_KEPT, AutoEnable.WHEN_ARMED))
    assert not on(0.0, 0.0, armed=False, airborne=False)


def test_switching_walls() -> None:
    w = Watch(radius_m=100.0, height_max_m=50.0)
    w.watch.switch(FenceType.CIRCLE, on=False)
    assert w.at(200.0, 10.0) == []
    w.watch.switch(FenceType.CIRCLE, on=True)
    assert w.at(200.0, 10.0)
    w.parameters = FenceParameters(enabled=False, radius_m=100.0)
    assert w.at(200.0, 10.0) == [] and not w.watch.broken


# ArduCopter


def copter(**parameters: float) -> Rig:
    rig = Rig("ardupilot", FENCE_ENABLE=1, **parameters)
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.put_in_air(10.0)
    return rig


def put(rig: Rig, north: float, height: float = 10.0, seconds: float = 0.3) -> None:
    """The vehicle is there, whatever it wants."""
    position = rig.context.nav[nav.POS_NED_M]
    rig.spoil = lambda: position.__setitem__(slice(None), (north, 0.0, -height))
    rig.run(seconds)


@pytest.mark.parametrize(
    ("action", "mode"),
    [
        (0, FlightMode.GUIDED),
        (1, FlightMode.RETURN),
        (2, FlightMode.LAND),
        (3, FlightMode.RETURN),  # SmartRTL: without a path to go back by, RTL
        (4, FlightMode.BRAKE),
        (5, FlightMode.LAND),
    ],
)
@pytest.mark.parametrize(
    ("wall", "place", "text"),
    [
        (2, (160.0, 10.0), "Circle fence breached"),
        (1, (0.0, 101.0), "Max Alt fence breached"),
        (3, (160.0, 101.0), "Max Alt and Circle fences breached"),
    ],
)
def test_copter_actions(action: int, mode: FlightMode, wall: int, place: tuple, text: str) -> None:
    rig = copter(FENCE_ACTION=action, FENCE_TYPE=wall)
    put(rig, *place)
    assert rig.commander.mode is mode
    assert text in rig.texts()
    put(rig, 0.0)
    assert "Fence breach cleared" in rig.texts()
    assert rig.commander.mode is mode  # a mode change like any other


def test_far_outside_a_copter_lands() -> None:
    rig = copter(FENCE_ACTION=1, FENCE_TYPE=2, FENCE_RADIUS=50.0)
    put(rig, 60.0)
    assert rig.commander.mode is FlightMode.RETURN
    rig.commander.set_mode(FlightMode.GUIDED)
    put(rig, 65.0)
    assert rig.commander.mode is FlightMode.GUIDED  # the pilot has taken over
    put(rig, 85.0)
    assert rig.commander.mode is FlightMode.RETURN  # 20 m farther out it counts once more
    put(rig, 190.0)
    assert rig.commander.mode is FlightMode.LAND


def test_a_copter_can_keep_its_mode_until_it_is_back() -> None:
    rig = copter(FENCE_ACTION=1, FENCE_TYPE=2, FENCE_OPTIONS=1)
    put(rig, 160.0)
    verdict = rig.commander.set_mode(FlightMode.GUIDED)
    assert not verdict.accepted and verdict.reasons == (Reason.FENCE_RECOVERY,)
    rig.run(0.1)
    assert "Mode change to GUIDED failed: in fence recovery" in rig.texts()
    put(rig, 0.0)
    assert rig.commander.set_mode(FlightMode.GUIDED).accepted


def test_a_fence_that_switches_on_after_takeoff() -> None:
    rig = Rig("ardupilot", FENCE_AUTOENABLE=1, FENCE_TYPE=2)
    rig.commander.set_mode(FlightMode.GUIDED)
    assert not rig.commander.fence.enabled(rig.commander.parameters.fence)
    rig.put_in_air(10.0)
    rig.run(0.3)
    assert "Circle fence auto-enabled" in rig.texts()
    assert rig.happened(FenceSwitched)
    put(rig, 160.0)
    assert rig.commander.mode is FlightMode.RETURN


@pytest.mark.parametrize(
    ("parameters", "place", "reason", "text"),
    [
        ({"FENCE_TYPE": 2}, 160.0, Reason.OUTSIDE_FENCE, "vehicle outside fence"),
        ({"FENCE_TYPE": 4}, 0.0, Reason.FENCE_MISSING, "Fences enabled, but none selected"),
        ({"FENCE_TYPE": 9, "FENCE_ALT_MIN": 98.0}, 0.0, Reason.FENCE_PARAMETERS, "FENCE_MARGIN too big"),
    ],
)
def test_arming_with_a_fence(parameters: dict, place: float, reason: Reason, text: str) -> None:
    rig = Rig("ardupilot", FENCE_ENABLE=1, **parameters)
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.context.nav[nav.POS_NED_M] = (place, 0.0, 0.0)
    rig.run(0.3)
    verdict = rig.commander.arm()
    assert reason in verdict.reasons
    rig.run(0.1)
    assert f"Arm: {text}" in rig.texts()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_places_outside_are_not_flown_to(flavour: str) -> None:
    limits = (
        {"GF_MAX_HOR_DIST": 50.0, "GF_ACTION": 2}
        if flavour == "px4"
        else {"FENCE_ENABLE": 1, "FENCE_RADIUS": 50.0}
    )
    rig = Rig(flavour, **limits)
    if flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    rig.put_in_air(10.0)
    guidance = rig.commander.guidance
    assert not guidance.reposition(north_m=70.0, east_m=0.0, down_m=-10.0).accepted
    rig.run(0.1)
    assert ("Reposition is outside geofence" in rig.texts()) is (flavour == "px4")
    assert guidance.reposition(north_m=30.0, east_m=0.0, down_m=-10.0).accepted
    if flavour == "px4":  # which only looks where a breach does something
        rig.set_parameter("GF_ACTION", 1)
        rig.run(0.2)
        assert guidance.reposition(north_m=70.0, east_m=0.0, down_m=-10.0).accepted


# PX4


@pytest.mark.parametrize(
    ("action", "mode"),
    [
        (0, FlightMode.HOLD),
        (1, FlightMode.HOLD),
        (2, FlightMode.HOLD),
        (3, FlightMode.RETURN),
        (4, FlightMode.TERMINATION),
        (5, FlightMode.LAND),
    ],
)
def test_px4_polygon_actions(action: int, mode: FlightMode) -> None:
    rig = Rig("px4", GF_ACTION=action)
    rig.fence.replace(square(0.0, 0.0, 30.0), 7)
    rig.put_in_air(10.0)
    put(rig, 40.0)
    assert rig.commander.mode is mode
    assert bool(rig.commander.failsafes.kinds & {FailsafeKind.GEOFENCE}) is (action not in (0, 4))
    if action == 1:
        assert "Failsafe warning triggered" in rig.texts()


def test_px4_outside_is_not_armed() -> None:
    rig = Rig("px4", GF_ACTION=2)
    rig.fence.replace(square(100.0, 0.0, 30.0), 7)
    rig.run(0.3)
    assert Reason.OUTSIDE_FENCE in rig.commander.arm().reasons
    rig.set_parameter("GF_ACTION", 0)
    rig.run(0.3)
    assert rig.commander.arm().accepted


def test_px4_predicts_the_breach() -> None:
    rig = Rig("px4", GF_ACTION=2, GF_PREDICT=1, GF_MAX_HOR_DIST=50.0)
    rig.put_in_air(10.0)
    context = rig.context
    context.nav[nav.VEL_NED_M_S] = (10.0, 0.0, 0.0)
    north, _, down = place_ahead(context, (30.0, 0.0, -10.0))
    p = context.multicopter
    brake_m = 0.5 * 100.0 / p.acceleration_m_s2 + 10.0 * p.acceleration_m_s2 / p.jerk_m_s3
    assert north == pytest.approx(30.0 + brake_m)
    assert down == -10.0
    speed = context.nav[nav.VEL_NED_M_S]
    position = context.nav[nav.POS_NED_M]

    def fast() -> None:
        position[:] = (40.0, 0.0, -10.0)
        speed[:] = (10.0, 0.0, 0.0)

    rig.spoil = fast
    rig.run(0.3)
    assert FailsafeKind.GEOFENCE in rig.commander.failsafes.kinds


def test_px4_fence_by_the_receivers_position() -> None:
    rig = Rig("px4", GF_ACTION=3, GF_MAX_HOR_DIST=50.0)
    rig.put_in_air(10.0)
    rig.set_parameter("GF_SOURCE", 1)
    north_m = 0.0

    def receiver() -> None:
        gps = rig.readings.gps.values
        lat, lon, alt = FRAME.geodetic_from_ned(north_m, 0.0, -10.0)
        gps[interface.GPS_LAT_DEG], gps[interface.GPS_LON_DEG] = lat + 1e-9 * (rig.time_us % 7), lon
        gps[interface.GPS_ALT_M] = alt
        rig.context.nav[nav.POS_NED_M] = (80.0, 0.0, -10.0)  # what the filter estimates

    rig.spoil = receiver
    rig.run(0.3)
    assert rig.commander.mode is FlightMode.HOLD
    north_m = 60.0
    rig.run(0.3)
    assert rig.commander.mode is FlightMode.RETURN


# ArduPlane


def plane(**parameters: float) -> PlaneRig:
    return PlaneRig("ardupilot", **{"FENCE_ENABLE": 1, "FENCE_TYPE": 2, **parameters}).fly()


@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, FlightMode.GUIDED), (1, FlightMode.RETURN), (2, FlightMode.GUIDED), (8, FlightMode.RETURN)],
)
def test_plane_actions(action: int, mode: FlightMode) -> None:
    """Those of other vehicles are none."""
    rig = plane(FENCE_ACTION=action, FENCE_RADIUS=300.0)
    put(rig, 400.0, 100.0)
    assert rig.commander.mode is mode
    assert "Circle fence breached" in rig.texts()


def test_a_plane_keeps_to_its_recovery() -> None:
    rig = plane(FENCE_ACTION=1)
    put(rig, 400.0, 100.0)
    assert not rig.commander.set_mode(FlightMode.FBWA).accepted
    rig.run(0.1)
    assert "Mode change to FBWA denied, in fence recovery" in rig.texts()
    rig.set_parameter("FENCE_OPTIONS", 0)
    assert rig.commander.set_mode(FlightMode.FBWA).accepted


@pytest.mark.parametrize(
    ("parameters", "height_m"),
    [({}, 45.0), ({"FENCE_RET_ALT": 60.0}, 60.0), ({"FENCE_ALT_MIN": 99.0}, 100.0)],
)
def test_a_plane_goes_to_its_return_point(parameters: dict, height_m: float) -> None:
    rig = plane(FENCE_ACTION=6, **{"FENCE_TYPE": 7, "FENCE_ALT_MAX": 100.0, **parameters})
    lat, lon, _ = FRAME.geodetic_from_ned(50.0, -60.0, 0.0)
    rig.fence.replace(
        (
            MissionItem(command=mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, frame=3, x=lat, y=lon),
            *square(0.0, 0.0, 200.0),
        ),
        3,
    )
    put(rig, 250.0, 90.0)
    assert rig.commander.mode is FlightMode.GUIDED
    north, east, down = rig.centre().tolist()
    assert (north, east) == pytest.approx((50.0, -60.0), abs=0.1)
    assert -down == pytest.approx(height_m, abs=0.5)


def test_a_plane_returns_to_a_rally_point() -> None:
    rig = plane(FENCE_ACTION=6, FENCE_RET_RALLY=1)
    lat, lon, _ = FRAME.geodetic_from_ned(120.0, 30.0, 0.0)
    rig.context.rally = store_of(
        MissionItem(command=mavlink.MAV_CMD_NAV_RALLY_POINT, frame=3, x=lat, y=lon, z=70.0)
    )
    put(rig, 400.0, 100.0)
    assert rig.centre() == pytest.approx(np.array([120.0, 30.0, -70.0]), abs=0.2)


def test_a_landed_vehicle_is_disarmed_outside() -> None:
    rig = copter(FENCE_ACTION=1, FENCE_TYPE=2)
    rig.context.nav[nav.POS_NED_M] = (0.0, 0.0, 0.0)
    rig.context.landed_state = LandedState.ON_GROUND
    put(rig, 160.0, 0.0)
    assert not rig.commander.armed


def test_nonsense_parameters_never_raise() -> None:
    with pytest.raises(ValueError, match="radius_m inf"):
        FenceParameters(radius_m=math.inf)
