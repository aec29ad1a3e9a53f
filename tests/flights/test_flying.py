"""Manual flight, attitude targets, orbit, brake, reposition and return, on the whole stack.

A flight is compared with the figures of docs/firmware/px4.md, section 13, and docs/firmware/ardupilot.md,
section 6.
"""

import math
import re

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from tests.flights.flight import FLAVOURS, Flight

GUIDED = {"px4": "offboard", "ardupilot": "guided"}
HEIGHT_M = 12.0


@pytest.fixture(params=FLAVOURS)
def flight(request: pytest.FixtureRequest) -> Flight:
    """In the air, holding."""
    flight = Flight(request.param, seed=2)
    flight.take_off(HEIGHT_M)
    return flight


def local(flight: Flight) -> tuple[float, float, float]:
    m = flight.newest["LOCAL_POSITION_NED"]
    return m.x, m.y, m.z


def fly_with_sticks(flight: Flight, mode: str) -> dict[str, float]:
    """Forward, stop, turn, climb, each with half a stick."""
    flight.sticks()
    flight.fly(0.5)
    flight.set_mode(mode)
    flight.fly(2.0)
    figures: dict[str, float] = {}
    flight.sticks(pitch=0.5)
    flight.fly(4.0)
    figures["tilt_deg"] = flight.tilt_deg
    figures["speed_m_s"] = flight.speed_m_s
    forward = np.array([math.cos(flight.yaw_rad), math.sin(flight.yaw_rad)])
    figures["ahead"] = float(flight.velocity_ned_m_s[:2] @ forward) / flight.speed_m_s
    flight.sticks()
    flight.fly(5.0)
    figures["left_m_s"] = flight.speed_m_s
    figures["height_m"] = flight.height_m
    yaw = flight.yaw_rad
    flight.sticks(yaw=0.5)
    flight.fly(1.5)
    figures["turned_deg"] = math.degrees(math.remainder(flight.yaw_rad - yaw, math.tau))
    flight.sticks(throttle=0.5)
    flight.fly(3.0)
    figures["climb_m_s"] = -float(flight.velocity_ned_m_s[2])
    return figures


@pytest.mark.sampled(1)
@pytest.mark.slow
def test_position_mode_moves_and_stops_with_the_stick(flight: Flight) -> None:
    figures = fly_with_sticks(flight, "position" if flight.flavour == "px4" else "loiter")
    # half a stick after dead zone and expo is 0.23 (PX4) of 10 m/s; ArduPilot has less expo
    assert 2.0 < figures["speed_m_s"] < 6.0
    assert figures["ahead"] > 0.95
    assert figures["left_m_s"] < 0.3
    assert figures["height_m"] == pytest.approx(HEIGHT_M, abs=0.8)
    assert 25.0 < figures["turned_deg"] < 130.0
    assert 0.4 < figures["climb_m_s"] < 2.5


@pytest.mark.slow
def test_altitude_mode_tilts_with_the_stick_and_keeps_the_height(flight: Flight) -> None:
    figures = fly_with_sticks(flight, "altitude" if flight.flavour == "px4" else "alt_hold")
    assert 4.0 < figures["tilt_deg"] < 16.0
    assert figures["ahead"] > 0.9
    assert figures["left_m_s"] > 0.5  # no brakes
    assert figures["height_m"] == pytest.approx(HEIGHT_M, abs=1.0)
    assert 0.4 < figures["climb_m_s"] < 2.5


@pytest.mark.slow
def test_stabilized_mode_gives_thrust_to_the_throttle(flight: Flight) -> None:
    figures = fly_with_sticks(flight, "stabilized" if flight.flavour == "px4" else "stabilize")
    assert 4.0 < figures["tilt_deg"] < 16.0
    assert figures["climb_m_s"] > 2.0
    assert abs(figures["height_m"] - HEIGHT_M) < 8.0  # the middle of the stick is about hover


@pytest.mark.slow
def test_loiter_without_a_pilot_holds() -> None:
    """ArduPilot's simulated radio has its throttle down, which is not taken for a wish to sink."""
    flight = Flight("ardupilot", seed=2)
    flight.take_off(HEIGHT_M)
    flight.set_mode("loiter")
    flight.fly(8.0)
    assert flight.height_m == pytest.approx(HEIGHT_M, abs=0.8)
    assert flight.speed_m_s < 0.3


@pytest.mark.sampled(1)
@pytest.mark.slow
def test_circle(flight: Flight) -> None:
    nan = math.nan
    if flight.flavour == "px4":
        home = flight.newest["HOME_POSITION"]
        flight.send(
            dialect.MAVLink_command_int_message(
                1,
                1,
                0,
                dialect.MAV_CMD_DO_ORBIT,
                0,
                0,
                20.0,
                3.0,
                0.0,
                nan,
                home.latitude,
                home.longitude,
                nan,
            )
        )
        radius_m, speed_m_s = 20.0, 3.0
    else:
        flight.sticks()
        flight.set_mode("circle")
        radius_m, speed_m_s = 10.0, 10.0 * math.radians(20.0)  # CIRCLE_RADIUS, CIRCLE_RATE
    flight.fly(18.0)
    places: list[tuple[float, float, float]] = []
    speeds: list[float] = []
    noses: list[float] = []

    def look() -> None:
        places.append(flight.position_ned_m)
        speeds.append(flight.speed_m_s)
        noses.append(flight.yaw_rad)

    flight.fly(30.0, look)
    north, east, _ = np.array(places).T
    # circle through the points: least squares (Coope 1993)
    matrix = np.column_stack((2.0 * north, 2.0 * east, np.ones_like(north)))
    cn, ce, rest = np.linalg.lstsq(matrix, north**2 + east**2, rcond=None)[0]
    radius = math.sqrt(rest + cn * cn + ce * ce)
    assert radius == pytest.approx(radius_m, abs=0.3)
    assert np.abs(np.hypot(north - cn, east - ce) - radius).max() < 0.4
    assert np.mean(speeds) == pytest.approx(speed_m_s, abs=0.15)
    to_centre = np.arctan2(ce - east, cn - north)
    off = np.degrees(np.abs(np.angle(np.exp(1j * (to_centre - np.array(noses))))))
    assert off.max() < 5.0
    assert flight.mode == ("0x1030000" if flight.flavour == "px4" else "circle")


@pytest.mark.sampled(1)
def test_stops_at_once(flight: Flight) -> None:
    flight.repeat(10.0, lambda _: flight.position_setpoint(velocity_ned_m_s=(6.0, 0.0, 0.0)))
    flight.fly(1.0)
    flight.set_mode(GUIDED[flight.flavour])
    flight.fly(6.0)
    assert flight.speed_m_s == pytest.approx(6.0, abs=0.4)
    start_m = flight.position_ned_m[0]
    flight.stop_repeating()
    flight.set_mode("hold" if flight.flavour == "px4" else "brake")
    flight.fly(6.0)
    assert flight.speed_m_s < 0.3
    assert 4.0 < flight.position_ned_m[0] - start_m < 13.0


@pytest.mark.slow
def test_reposition(flight: Flight) -> None:
    home = flight.newest["HOME_POSITION"]
    yaw = math.nan if flight.flavour == "px4" else 0.0
    flight.send(
        dialect.MAVLink_command_int_message(
            1,
            1,
            0,
            dialect.MAV_CMD_DO_REPOSITION,
            0,
            0,
            -1.0,
            1.0,
            0.0,
            yaw,
            home.latitude + round(30.0 / 111_200.0 * 1e7),
            home.longitude,
            home.altitude * 1e-3 + 18.0,
        )
    )
    fastest = 0.0

    def look() -> None:
        nonlocal fastest
        fastest = max(fastest, flight.speed_m_s)

    flight.fly(15.0, look)
    assert np.allclose(flight.position_ned_m, (30.0, 0.0, -18.0), atol=1.0)
    assert flight.speed_m_s < 0.3
    # MPC_XY_CRUISE 5 m/s; WPNAV_SPEED 10 m/s, which 30 m are too short for (the firmware: 6.7 m/s)
    assert (4.5 < fastest < 5.7) if flight.flavour == "px4" else (6.0 < fastest < 8.5)


@pytest.mark.slow
def test_position_step(flight: Flight) -> None:
    here = local(flight)
    distance_m = 15.0 if flight.flavour == "px4" else 30.0
    flight.repeat(10.0, lambda _: flight.position_setpoint(here))
    flight.fly(1.0)
    flight.set_mode(GUIDED[flight.flavour])
    start_m = flight.position_ned_m[0]
    flight.stop_repeating()
    flight.repeat(10.0, lambda _: flight.position_setpoint((here[0] + distance_m, here[1], here[2])))
    flight.fly(9.0)  # both firmwares are there after 8 to 9 s
    farthest = 0.0

    def look() -> None:
        nonlocal farthest
        farthest = max(farthest, flight.position_ned_m[0] - start_m)
        assert flight.position_ned_m[0] - start_m == pytest.approx(distance_m, abs=0.6)

    flight.fly(4.0, look)
    assert farthest < distance_m + 0.6


@pytest.mark.sampled(1)
@pytest.mark.slow
def test_attitude_targets(flight: Flight) -> None:
    hover = flight.newest["VFR_HUD"].throttle * 0.01 if flight.flavour == "px4" else 0.5

    def target(roll_deg: float, pitch_deg: float, thrust: float) -> None:
        r, p = math.radians(roll_deg) / 2.0, math.radians(pitch_deg) / 2.0
        q = (
            math.cos(r) * math.cos(p),
            math.sin(r) * math.cos(p),
            math.cos(r) * math.sin(p),
            -math.sin(r) * math.sin(p),
        )
        flight.stop_repeating()
        flight.repeat(
            30.0,
            lambda _: dialect.MAVLink_set_attitude_target_message(
                flight.sitl.time_us // 1000, 1, 1, 7, q, 0.0, 0.0, 0.0, thrust
            ),
        )

    target(0.0, 0.0, hover)
    flight.fly(1.0)
    flight.set_mode(GUIDED[flight.flavour])
    for roll_deg, pitch_deg in ((8.0, 0.0), (-8.0, 0.0), (0.0, 8.0), (0.0, -8.0)):
        target(roll_deg, pitch_deg, hover)
        flight.fly(1.0)
        attitude = flight.newest["ATTITUDE"]
        assert math.degrees(attitude.roll) == pytest.approx(roll_deg, abs=0.3)
        assert math.degrees(attitude.pitch) == pytest.approx(pitch_deg, abs=0.3)
    if flight.flavour == "ardupilot":  # thrust is a climb rate: 0.6 gave +0.49 m/s
        target(0.0, 0.0, 0.6)
        flight.fly(3.0)
        assert -flight.velocity_ned_m_s[2] == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize(
    ("flavour", "height_m"), [("px4", 5.0), ("ardupilot", 45.0), ("px4", 45.0), ("ardupilot", 5.0)]
)
@pytest.mark.slow
def test_return_from_afar(flavour: str, height_m: float) -> None:
    flight = Flight(flavour, seed=2)
    flight.take_off(height_m)
    down = local(flight)[2]
    flight.repeat(10.0, lambda _: flight.position_setpoint((200.0, 0.0, down)))
    flight.fly(1.0)
    flight.set_mode(GUIDED[flavour])
    flight.fly_until(lambda: flight.position_ned_m[0] > 198.0, 90.0, "arrival far away")
    flight.stop_repeating()
    flight.set_mode("return")
    highest = fastest = 0.0

    def home() -> bool:
        nonlocal highest, fastest
        highest, fastest = max(highest, flight.height_m), max(fastest, flight.speed_m_s)
        return not flight.armed

    flight.fly_until(home, 200.0, "return and landing")
    altitude_m = 30.0 if flavour == "px4" else 15.0  # RTL_RETURN_ALT, RTL_ALT
    assert highest == pytest.approx(max(altitude_m, height_m), abs=1.2)
    said = [text for _, text in flight.texts if text.startswith("RTL: ")]
    if flavour == "px4":
        started = re.fullmatch(r"RTL: start return at \d+ m \((\d+) m above destination\)", said[0].strip())
        assert started is not None, said
        assert int(started[1]) == pytest.approx(highest, abs=1.5)
        assert [text.strip() for text in said[1:]] == ["RTL: land at destination"]
    else:
        assert said == []
    assert fastest < 11.5
    assert math.hypot(*flight.position_ned_m[:2]) < 1.0
    assert flight.tilt_deg < 3.0


@pytest.mark.slow
def test_px4_changes_its_height_where_it_is() -> None:
    """DO_CHANGE_ALTITUDE: an altitude over mean sea level."""
    flight = Flight("px4", seed=2)
    flight.take_off(HEIGHT_M)
    place = flight.position_ned_m
    flight.command(dialect.MAV_CMD_DO_CHANGE_ALTITUDE, flight.newest["GLOBAL_POSITION_INT"].alt * 1e-3 + 8.0)
    flight.fly(10.0)
    assert flight.height_m == pytest.approx(HEIGHT_M + 8.0, abs=0.7)
    assert math.dist(flight.position_ned_m[:2], place[:2]) < 1.0
