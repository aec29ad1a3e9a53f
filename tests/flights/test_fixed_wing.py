"""Aircraft in the whole stack, commanded and observed over MAVLink: take-off, circles, missions, landing."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight, Item
from tests.flights.flight import FLAVOURS
from tests.slow import slow, slow_after

WIND = Environment(wind_ned_m_s=(3.0, -2.0, 0.0), turbulence=Turbulence.LIGHT)
IN_AIR, LANDING, ON_GROUND = 2, 4, 1


def circuit(flight: AircraftFlight) -> list[Item]:
    """Take-off, a left-hand circuit at 50 m, and a landing at home along the runway."""

    def at(along_m: float, right_m: float) -> tuple[float, float]:
        return flight.on_runway(along_m, right_m)

    land = flight.on_runway(60.0)
    return [
        Item(dialect.MAV_CMD_NAV_TAKEOFF, *at(300.0, 0.0), 40.0, (10.0, 0.0, 0.0, math.nan)),
        Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(600.0, 0.0), 50.0),
        Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(600.0, -400.0), 50.0),
        Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(-650.0, -400.0), 50.0),
        Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(-650.0, 0.0), 45.0),
        Item(dialect.MAV_CMD_NAV_WAYPOINT, *at(-420.0, 0.0), 35.0),
        Item(dialect.MAV_CMD_NAV_LAND, *land, 0.0),
    ]


def fly_to_the_ground(flight: AircraftFlight, limit_s: float = 300.0) -> float:
    """Until the aircraft stands; returns the rate of descent when the wheels touched."""
    sink_m_s = [0.0]
    touched = [False]

    def look() -> bool:
        if not touched[0]:
            touched[0] = bool(flight.truth[t.ON_GROUND] > 0.0)
            if not touched[0]:
                sink_m_s[0] = float(flight.truth[t.VEL_NED_M_S][2])
        return touched[0] and flight.speed_m_s < 0.3

    flight.fly_until(look, limit_s, "standing on the ground")
    return sink_m_s[0]


@pytest.mark.parametrize("seed", [4, 6, 7])
@pytest.mark.sampled(1)
def test_gusts_that_swing_a_parked_aircraft_are_not_taken_for_the_gyros_bias(seed: int) -> None:
    """A rate of a few degrees per second at rest is no bias that a gyro has after its calibration."""
    air = Environment(wind_ned_m_s=(-3.0, -5.2, 0.0), turbulence=Turbulence.MODERATE)
    flight = AircraftFlight("ardupilot", environment=air, seed=seed)
    flight.fly(25.0)
    error_rad = math.remainder(flight.newest["ATTITUDE"].yaw - flight.yaw_rad, 2.0 * math.pi)
    assert abs(math.degrees(error_rad)) < 5.0


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_takes_off_from_the_runway_and_circles(flavour: str) -> None:
    flight = AircraftFlight(flavour, environment=WIND)
    flight.start()
    line, height = [], []

    def look() -> None:
        if flight.height_m < 10.0:
            line.append(abs(flight.cross_track_m((0.0, 0.0), flight.on_runway(1.0))))
        height.append(flight.height_over_home_m)

    flight.fly(25.0, look)
    assert max(line) < 4.0  # it holds the centre line
    assert max(height) > 20.0 and flight.actuators_finite
    place = (250.0, 100.0)
    assert flight.circle(*place, 70.0, 110.0) == 0
    flight.fly(60.0)
    radii, altitudes, courses = [], [], []

    def watch() -> None:
        north, east, _ = flight.position_ned_m
        radii.append(flight.distance_m(*place))
        altitudes.append(flight.height_over_home_m)
        courses.append(math.atan2(east - place[1], north - place[0]))

    flight.fly(60.0, watch)
    turned = np.unwrap(courses)
    assert turned[-1] - turned[0] > math.pi  # clockwise seen from above
    assert np.mean(radii) == pytest.approx(110.0, rel=0.05) and np.std(radii) < 6.0
    assert np.mean(altitudes) == pytest.approx(70.0, abs=2.0) and np.std(altitudes) < 1.5


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_circles_to_the_left(flavour: str) -> None:
    flight = AircraftFlight(flavour)
    flight.take_off(60.0)
    assert flight.circle(100.0, 200.0, 60.0, -120.0) == 0
    flight.fly(50.0)
    angles = []
    flight.fly(
        20.0,
        lambda: angles.append(math.atan2(flight.position_ned_m[1] - 200.0, flight.position_ned_m[0] - 100.0)),
    )
    turned = np.unwrap(angles)
    assert turned[-1] - turned[0] < -1.5
    assert flight.distance_m(100.0, 200.0) == pytest.approx(120.0, abs=6.0)


@pytest.mark.parametrize(
    ("flavour", "launch"),
    [("px4", "catapult"), ("ardupilot", "hand"), slow("px4", "hand"), slow("ardupilot", "catapult")],
)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_launched(flavour: str, launch: str) -> None:
    flight = AircraftFlight(flavour, launch=launch, environment=WIND)
    flight.get_ready()
    flight.fly(5.0)
    assert flight.speed_m_s < 0.1  # held, and at rest, until it is armed
    flight.set_mode("takeoff")
    flight.arm()
    lowest = [math.inf]
    started = [False]

    def look() -> None:
        started[0] = started[0] or flight.speed_m_s > 5.0
        if started[0]:
            lowest[0] = min(lowest[0], flight.height_m)

    flight.fly(30.0, look)
    assert started[0] and lowest[0] > 0.7
    assert flight.height_over_home_m > 20.0


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_no_crew_launches_an_aircraft_that_does_not_ask(flavour: str) -> None:
    flight = AircraftFlight(flavour, launch="catapult")
    flight.get_ready()
    if flavour == "ardupilot":
        flight.set_mode("guided")
    flight.arm()
    flight.fly(15.0)
    assert flight.speed_m_s < 0.1 and flight.armed


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_mission_from_the_ground_to_the_ground(flavour: str) -> None:
    flight = AircraftFlight(flavour, environment=WIND)
    flight.get_ready()
    flight.upload(circuit(flight))
    flight.set_mode("mission")
    flight.arm()
    seen: set[int] = set()
    heights: list[float] = []
    across: list[float] = []
    corners = [flight.on_runway(600.0, -400.0), flight.on_runway(-650.0, -400.0)]

    def look() -> bool:
        current = flight.newest.get("MISSION_CURRENT")
        reached = flight.newest.get("MISSION_ITEM_REACHED")
        if reached is not None:
            seen.add(reached.seq)
        if current is not None and current.seq == 3 + (flavour == "ardupilot"):
            north, east, _ = flight.position_ned_m
            if min(math.dist((north, east), corner) for corner in corners) > 200.0:
                across.append(flight.cross_track_m(*corners))
                heights.append(flight.height_over_home_m)
        return flight.truth[t.HEIGHT_ABOVE_GROUND_M] < 8.0 and len(across) > 10

    flight.fly_until(look, 260.0, "final approach")
    assert np.sqrt(np.mean(np.square(across))) < 3.0
    assert np.sqrt(np.mean(np.square(np.array(heights) - 50.0))) < 2.0
    sink_m_s = fly_to_the_ground(flight)
    assert sink_m_s < 2.0
    land = flight.on_runway(60.0)
    heading = math.radians(flight.sitl.spec.place.heading_deg)
    assert abs(flight.cross_track_m(land, flight.on_runway(61.0))) < 3.0
    turned_rad = (flight.yaw_rad - heading + math.pi) % (2.0 * math.pi) - math.pi
    assert abs(turned_rad) < math.radians(10.0)
    stood_s = flight.time_s
    flight.wait_disarmed(40.0)
    if flavour == "px4":
        assert flight.time_s - stood_s < 8.0  # 2 s after the landing is detected
    else:
        assert 15.0 < flight.time_s - stood_s < 30.0  # LAND_DISARMDELAY
    first = int(flavour == "ardupilot")
    assert {first + k for k in range(5)} <= seen


@pytest.mark.parametrize("flavour", slow_after(1, FLAVOURS))
@pytest.mark.slow
def test_returns_home(flavour: str) -> None:
    flight = AircraftFlight(flavour, environment=WIND)
    flight.take_off(60.0, (400.0, 300.0))
    flight.set_mode("return")
    flight.fly(90.0)
    height_m: list[float] = []
    flight.fly(20.0, lambda: height_m.append(flight.height_over_home_m))
    assert np.mean(height_m) == pytest.approx(100.0, abs=4.0)  # RTL_RETURN_ALT, RTL_ALTITUDE
    assert flight.distance_m(0.0, 0.0) < 130.0


@pytest.mark.slow
def test_px4_lands_where_commanded() -> None:
    flight = AircraftFlight("px4")
    flight.take_off(50.0, (0.0, 0.0))
    flight.set_mode("land")
    sink_m_s = fly_to_the_ground(flight)
    assert sink_m_s < 2.0
    flight.wait_disarmed(10.0)


@pytest.mark.slow
def test_px4_offboard_attitude() -> None:
    flight = AircraftFlight("px4", environment=WIND)
    flight.take_off(80.0)
    flight.repeat(20.0, lambda _: flight.attitude_setpoint(20.0, 5.0, 0.65))
    flight.fly(0.5)
    flight.set_mode("offboard")
    assert flight.heartbeats[-1][2] == 0x91
    flight.fly(3.0)
    rolls: list[float] = []
    flight.fly(10.0, lambda: rolls.append(flight.roll_deg))
    assert np.mean(rolls) == pytest.approx(20.0, abs=1.5)
    flight.stop_repeating()
    lost_s = flight.time_s
    flight.fly(4.0)
    assert flight.text_time("Failsafe activated", lost_s) - lost_s == pytest.approx(1.0, abs=0.2)
    assert flight.mode == "position" and flight.heartbeats[-1][3] == 5
    flight.fly(20.0)
    assert abs(flight.roll_deg) < 15.0 and flight.height_m > 40.0


@pytest.mark.slow
def test_arduplane_guided_attitude() -> None:
    flight = AircraftFlight("ardupilot", environment=WIND)
    flight.take_off(80.0)
    flight.repeat(10.0, lambda _: flight.attitude_setpoint(-25.0, 0.0, 0.0, 0xC6))
    flight.fly(4.0)
    rolls, heights = [], []

    def look() -> None:
        rolls.append(flight.roll_deg)
        heights.append(flight.height_over_home_m)

    flight.fly(15.0, look)
    assert flight.mode == "guided"
    assert np.mean(rolls) == pytest.approx(-25.0, abs=1.5)
    flight.stop_repeating()
    flight.fly(40.0)
    assert flight.roll_deg > -10.0  # 3 s after the last one it circles again, to the right
    assert flight.distance_m(150.0, 150.0) < 150.0


@pytest.mark.slow
def test_arduplane_guided_changes() -> None:
    flight = AircraftFlight("ardupilot")
    flight.take_off(60.0)
    assert flight.result(dialect.MAV_CMD_GUIDED_CHANGE_HEADING, 1, 90.0, 5.0) == 0
    flight.fly(25.0)
    headings: list[float] = []
    flight.fly(10.0, lambda: headings.append(math.degrees(flight.yaw_rad)))
    assert np.mean(headings) == pytest.approx(90.0, abs=2.0) and np.std(headings) < 1.0
    assert flight.command_int(dialect.MAV_CMD_GUIDED_CHANGE_ALTITUDE, (0, 0, 0, 0), 0.0, 0.0, 90.0) == 0
    assert flight.result(dialect.MAV_CMD_GUIDED_CHANGE_SPEED, 0, 27.0, 0.0) == 0
    flight.fly(40.0)
    assert flight.height_over_home_m == pytest.approx(90.0, abs=2.0)
    assert flight.newest["VFR_HUD"].airspeed == pytest.approx(27.0, abs=1.0)
    flight.set_mode("hold")
    assert flight.result(dialect.MAV_CMD_GUIDED_CHANGE_HEADING, 1, 90.0, 5.0) == 4


def test_arduplane_boots_initialising() -> None:
    flight = AircraftFlight("ardupilot")
    flight.fly(1.5)
    assert flight.heartbeats[0][1:] == (16, 17, 2)
    flight.fly(1.5)
    assert flight.heartbeats[-1][1:] == (0, 81, 3)
    assert flight.result(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 4
    flight.fly(20.0)
    assert flight.result(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 0


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_same_seed_same_bytes(flavour: str) -> None:
    def recorded() -> bytes:
        received = bytearray()
        flight = AircraftFlight(flavour, seed=7, environment=WIND)
        flight.sitl.connect(0).on_receive = received.extend
        flight.start()
        flight.fly(20.0)
        return bytes(received)

    assert recorded() == recorded()
