"""What a vehicle takes in by messages, on the whole stack: odometry, a leader, a place to land, obstacles."""

import math
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.flight.multicopter.precision_land import PrecisionLandTask, PrecisionPhase
from autopilot_bridge.mavlink import FrameEncoder, dialect
from flightsim import interface
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.payload import CameraParameters, GroundTargetParameters, PayloadParameters, Static
from tests.flights.flight import FLAVOURS, SYSTEM_ID, Flight
from tests.flights.tracker import VISION, Tracker, frame_at_home, wall_to_the_north
from tests.rotations import rotation_matrix

GPS, VIO = 4, 6
OFF, GARBAGE, OK = 1, 3, 0
GUIDED = {"px4": "offboard", "ardupilot": "guided"}
POSITION = {"px4": "position", "ardupilot": "loiter"}
PLACE = (5.0, 3.0, -4.0)


# odometry


def by_odometry(flavour: str, message: str = "odometry") -> tuple[Flight, Tracker]:
    """A vehicle without GPS that hovers in a hall."""
    flight = Flight(flavour, parameters=VISION[flavour])
    flight.inject(GPS, OFF)
    tracker = Tracker(flight)
    flight.repeat(30.0, getattr(tracker, message))
    if flavour == "ardupilot":
        flight.fly(4.0)
        flight.send(dialect.MAVLink_set_gps_global_origin_message(SYSTEM_ID, 473977400, 85455900, 489000))
    flight.get_ready()
    flight.arm()
    nan = math.nan
    height = (0, 0, 0, 0, 0, 0, 4) if flavour == "ardupilot" else (-1, nan, nan, nan, nan, nan, nan)
    flight.command(dialect.MAV_CMD_NAV_TAKEOFF, *height)
    flight.fly_until(lambda: flight.height_m > 2.0, 20.0, "takeoff")
    flight.fly(5.0)
    return flight, tracker


@pytest.mark.parametrize("message", ["odometry", "vision"])
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_a_quadrotor_without_gps_flies_by_odometry(flavour: str, message: str) -> None:
    flight, _ = by_odometry(flavour, message)
    flight.repeat(10.0, lambda _: flight.position_setpoint(PLACE, yaw_rad=0.5))
    flight.fly(0.5)
    flight.set_mode(GUIDED[flavour])
    flight.fly(10.0)
    away: list[float] = []
    flight.fly(10.0, lambda: away.append(math.dist(flight.position_ned_m, PLACE)))
    assert max(away) < 0.15 and flight.yaw_rad == pytest.approx(0.5, abs=0.05)
    local = flight.newest["LOCAL_POSITION_NED"]
    assert (local.x, local.y, local.z) == pytest.approx(PLACE, abs=0.15)
    if flavour == "px4":
        flight.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS)
        flight.fly(0.2)
        flags = flight.newest["ESTIMATOR_STATUS"].flags
        assert flags & dialect.ESTIMATOR_POS_HORIZ_REL
        assert not flags & (dialect.ESTIMATOR_POS_HORIZ_ABS | dialect.ESTIMATOR_CONST_POS_MODE)
    before = flight.time_s
    flight.inject(VIO, GARBAGE)
    expected = "Failsafe activated" if flavour == "px4" else "EKF Failsafe: changed to LAND Mode"
    flight.fly_until(lambda: flight.text_time(expected, before) < math.inf, 10.0, "failsafe")
    flight.wait_disarmed(30.0)
    assert math.dist(flight.position_ned_m, (5.0, 3.0, 0.0)) < 6.0


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_an_origin_gives_positions_on_earth(flavour: str) -> None:
    flight = Flight(flavour, parameters=VISION[flavour])
    flight.inject(GPS, OFF)
    flight.repeat(30.0, Tracker(flight).odometry)
    flight.fly(5.0)
    for lat in (473977400, 100000000):  # the first one counts
        flight.send(dialect.MAVLink_set_gps_global_origin_message(SYSTEM_ID, lat, 85455900, 489000))
        flight.fly(0.5)
    assert flight.newest["GPS_GLOBAL_ORIGIN"].latitude == 473977400
    flight.get_ready()
    flight.fly(1.0)
    assert flight.newest["GLOBAL_POSITION_INT"].lat == pytest.approx(473977400, abs=20)
    assert flight.newest["HOME_POSITION"].latitude == pytest.approx(473977400, abs=20)


# a leader


FOLLOW: dict[str, dict[str, float]] = {
    "px4": {},
    "ardupilot": {
        "FOLL_ENABLE": 1,
        "FOLL_OFS_X": -8,
        "FOLL_OFS_Z": -8,
        "FOLL_OFS_TYPE": 1,
        "FOLL_POS_P": 0.3,
    },
}
LEADER = FrameEncoder(7, 1)


class Leader:
    """Stands, walks north, turns east."""

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        self.start_s = flight.time_s
        self.frame = frame_at_home(flight)

    def motion(self, time_s: float) -> tuple[float, float, float, float]:
        k = time_s - self.start_s
        if k < 10.0:
            return 20.0, 0.0, 0.0, 0.0
        return (20.0 + 3.0 * (k - 10.0), 0.0, 3.0, 0.0) if k < 30.0 else (80.0, 3.0 * (k - 30.0), 0.0, 3.0)

    def deliver(self, time_s: float) -> None:
        north, east, vn, ve = self.motion(time_s)
        lat, lon, alt = self.frame.geodetic_from_ned(north, east, 0.0)
        place = round(lat * 1e7), round(lon * 1e7)
        if self.flight.flavour == "px4":  # as MAVSDK's follow_me sends it
            nan3, nan4 = [math.nan] * 3, [math.nan] * 4
            message: Any = dialect.MAVLink_follow_target_message(
                round(time_s * 1e3), 3, *place, alt, [vn, ve, 0.0], nan3, nan4, nan3, nan3, 0
            )
        else:
            message = dialect.MAVLink_global_position_int_message(
                round(time_s * 1e3), *place, round(alt * 1e3), 0, round(vn * 100), round(ve * 100), 0, 0
            )
        self.flight._link.send(LEADER.encode(message))

    def off(self) -> tuple[float, float, float]:
        north, east, _, _ = self.motion(self.flight.time_s)
        here = self.flight.position_ned_m
        return here[0] - north, here[1] - east, here[2]


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_follows_a_leader_and_holds_when_it_is_lost(flavour: str) -> None:
    flight = Flight(flavour, parameters=FOLLOW[flavour])
    flight.take_off(10.0)
    leader = Leader(flight)
    next_s = [flight.time_s]
    reported = [True]

    def report() -> None:
        if reported[0] and flight.time_s >= next_s[0]:
            next_s[0] += 1.0
            leader.deliver(flight.time_s)

    flight.fly(2.0, report)
    flight.set_mode("follow")
    flight.fly(26.0, report)
    assert leader.off() == pytest.approx((-8.0, 0.0, -8.0), abs=0.8)
    assert flight.velocity_ned_m_s[0] == pytest.approx(3.0, abs=0.3)
    assert abs(math.remainder(flight.yaw_rad, math.tau)) < 0.1  # to the leader
    flight.fly(30.0, report)
    assert leader.off() == pytest.approx((0.0, -8.0, -8.0), abs=0.9)  # behind it again
    reported[0] = False
    flight.fly(8.0)
    place = flight.position_ned_m
    flight.fly(4.0)
    assert flight.mode == "follow" and math.dist(place, flight.position_ned_m) < 0.3


def test_follow_wants_its_parameter() -> None:
    flight = Flight("ardupilot")
    flight.take_off(10.0)
    flight.ask_mode("follow")
    flight.fly(1.0)
    assert flight.mode == "guided"
    assert flight.text_time("Mode change to FOLLOW failed") < math.inf


# a place to land


PAD = (1.5, -1.0)
LOOKS_DOWN = PayloadParameters(camera=CameraParameters())


def to_land(flavour: str, **parameters: float) -> Flight:
    """In the air over a pad that the vehicle's own camera sees, in a turbulent wind."""
    own = {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0} if flavour == "ardupilot" else {}
    flight = Flight(
        flavour,
        seed=3,
        parameters={**own, **parameters},
        environment=Environment.from_wind(speed_m_s=5.0, from_deg=60.0, turbulence="light"),
        payload=LOOKS_DOWN,
        targets=(GroundTargetParameters(motion=Static(north_m=PAD[0], east_m=PAD[1])),),
    )
    flight.take_off(12.0)
    return flight


def land(flight: Flight) -> None:
    flight.set_mode("precision land" if flight.flavour == "px4" else "land")


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_lands_at_the_target_its_camera_sees(flavour: str) -> None:
    flight = to_land(flavour)
    land(flight)
    flight.wait_disarmed(90.0)
    assert math.dist(flight.position_ned_m[:2], PAD) < 0.4


@pytest.mark.slow
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_target_lost_in_the_descent_is_searched_and_then_done_without(flavour: str) -> None:
    flight = Flight(flavour, parameters={"PLND_ENABLED": 1, "PLND_TYPE": 1} if flavour == "ardupilot" else {})
    flight.take_off(12.0)
    seen = [True]

    def sighting(time_s: float) -> Any:
        if not seen[0]:
            return dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
        offset = np.array((*PAD, 0.0)) - flight.position_ned_m
        line = rotation_matrix(flight.truth[t.Q_NED_FROM_FRD]).T @ offset
        return dialect.MAVLink_landing_target_message(
            flight.sitl.time_us,
            0,
            dialect.MAV_FRAME_BODY_FRD,
            math.atan2(line[1], line[2]),
            math.atan2(-line[0], line[2]),
            0.0,
            0.0,
            0.0,
        )

    flight.repeat(20.0, sighting)
    flight.fly(1.0)
    land(flight)
    flight.fly_until(lambda: flight.height_m < 4.0, 60.0, "descent")
    seen[0] = False
    task = flight.vehicle.autopilot.commander.tasks.task
    assert isinstance(task, PrecisionLandTask) and task.phase is PrecisionPhase.DESCEND
    flight.fly_until(lambda: task.phase is PrecisionPhase.SEARCH, 10.0, "search")
    lowest = flight.height_m
    flight.fly_until(lambda: task.phase is PrecisionPhase.FINAL, 60.0, "landing without it")
    assert flight.height_m > lowest - 0.5
    if flavour == "px4":
        assert flight.height_m == pytest.approx(10.0, abs=0.5)  # PLD_SRCH_ALT
    flight.wait_disarmed(40.0)
    assert math.dist(flight.position_ned_m[:2], PAD) < 1.0


# obstacles


@pytest.mark.parametrize("slide", [True, False])
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_stops_before_a_wall(flavour: str, slide: bool) -> None:
    parameters = (
        {"CP_DIST": 3.0, "CP_GO_NO_DATA": float(slide)}
        if flavour == "px4"
        else {"PRX1_TYPE": 2.0, "AVOID_MARGIN": 3.0, "AVOID_BEHAVE": float(not slide)}
    )
    flight = Flight(flavour, parameters=parameters)
    flight.take_off(10.0)
    wall_m = 20.0
    fastest = [0.0]
    nearest = [math.inf]

    def look() -> None:
        fastest[0] = max(fastest[0], flight.speed_m_s)
        nearest[0] = min(nearest[0], wall_m - flight.position_ned_m[0])

    def hold(pitch: float, roll: float) -> None:
        flight.sticks(pitch=pitch, roll=roll)
        flight.repeat(10.0, lambda _: wall_to_the_north(flight, wall_m))

    hold(0.0, 0.0)
    flight.fly(1.0)
    flight.set_mode(POSITION[flavour])
    c, s = math.cos(flight.yaw_rad), math.sin(flight.yaw_rad)
    hold(c, -s)  # north
    flight.fly(14.0, look)
    assert fastest[0] > 3.0 and abs(flight.velocity_ned_m_s[0]) < 0.15
    assert wall_m - flight.position_ned_m[0] == pytest.approx(3.0, abs=0.25)
    hold(0.7 * (c + s), 0.7 * (c - s))  # north-east
    flight.fly(5.0, look)
    assert nearest[0] > 2.7
    if flavour == "ardupilot":
        east_m_s = float(flight.velocity_ned_m_s[1])
        assert east_m_s > 2.0 if slide else abs(east_m_s) < 0.3
    hold(-c, s)
    flight.fly(4.0)
    assert wall_m - flight.position_ned_m[0] > 6.0


def test_no_data_no_flight_and_old_data_are_none() -> None:
    """PX4 doesn't go where no sensor looks (CP_GO_NO_DATA 0), nor by what was seen long ago."""
    flight = Flight("px4", parameters={"CP_DIST": 3.0})
    flight.take_off(10.0)
    flight.sticks(pitch=1.0)
    flight.fly(0.5)
    flight.set_mode("position")
    place = flight.position_ned_m
    flight.fly(6.0)
    assert math.dist(place, flight.position_ned_m) < 0.5
    flight.repeat(10.0, lambda _: wall_to_the_north(flight, 500.0))
    flight.fly(4.0)
    assert flight.speed_m_s > 3.0
    flight.sticks(pitch=1.0)
    flight.fly(5.0)
    assert flight.speed_m_s < 0.3


# failures


def test_every_unit_of_the_world_fails_and_others_are_not_supported() -> None:
    flight = Flight("px4")
    flight.fly(5.0)
    inject = flight.vehicle.autopilot._simulation.inject  # type: ignore[union-attr]
    units = {
        unit: [int(inject(unit, kind, 0)) for kind in range(8)] for unit in (*range(9), *range(100, 106))
    }
    sensors = [0] * 8
    for unit in (0, 1, 2, 3, 4, 6, 7, 100, 103):
        assert units[unit] == sensors, unit
    for unit in (5, 8, 102):  # no optical flow, no pitot tube, no servos
        assert units[unit] == [3] * 8, unit
    assert units[101] == [0, 0, 3, 3, 0, 3, 3, 3]
    assert units[104] == units[105] == [0, 0, 3, 3, 3, 3, 3, 3]


def test_failures_can_be_disabled() -> None:
    flight = Flight("px4", parameters={"SYS_FAILURE_EN": 0})
    flight.fly(3.0)
    assert flight.result(dialect.MAV_CMD_INJECT_FAILURE, GPS, OFF, 0) == 2


@pytest.mark.slow
def test_radio_and_mavlink_signals_fail() -> None:
    flight = Flight("px4", parameters={"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 5})
    flight.sticks()
    flight.take_off(10.0)
    flight.inject(104, OFF)
    flight.fly_until(lambda: flight.mode == "return", 10.0, "return without a pilot")
    flight.inject(104, OK)
    flight.fly(1.0)
    flight.set_mode("position")
    flight.set_mode("hold")
    flight.inject(105, OFF)
    since = flight.time_s
    flight.ask_mode("land")  # not received
    flight.fly_until(lambda: flight.text_time("Failsafe activated", since) < math.inf, 15.0, "link loss")
    flight.fly_until(lambda: flight.mode == "return", 15.0, "return")
    flight.inject(105, OK)
    flight.fly(1.0)
    flight.set_mode("hold")


@pytest.mark.slow
def test_sim_parameters_break_the_world() -> None:
    flight = Flight("ardupilot", parameters={"BATT_FS_LOW_ACT": 0})
    flight.take_off(10.0)

    def put(name: str, value: float) -> None:
        flight.send(dialect.MAVLink_param_set_message(SYSTEM_ID, 1, name.encode(), value, 9))
        flight.fly(0.2)

    put("SIM_WIND_T", 1.0)  # the same at all heights
    put("SIM_WIND_DIR", 90.0)
    put("SIM_WIND_SPD", 8.0)
    flight.fly(6.0)
    assert flight.tilt_deg > 6.0 and flight.speed_m_s < 0.5
    put("SIM_WIND_SPD", 0.0)
    flight.fly(4.0)
    tilts_deg: list[float] = []
    flight.fly(2.0, lambda: tilts_deg.append(flight.tilt_deg))
    assert np.mean(tilts_deg) < 1.5  # hovering, it moves by as much from one moment to the next
    put("SIM_WIND_T", 0.0)  # with the square root of height, up to 60 m
    put("SIM_WIND_SPD", 3.0)
    low_m_s = float(np.hypot(*flight.truth[t.WIND_NED_M_S][:2]))
    height_m = float(flight.truth[t.HEIGHT_ABOVE_GROUND_M])
    assert low_m_s == pytest.approx(3.0 * math.sqrt(height_m / 60.0), abs=0.05)
    put("SIM_WIND_SPD", 0.0)
    volts = flight.newest["SYS_STATUS"].voltage_battery * 1e-3
    put("SIM_BATT_VOLTAGE", 10.6)
    flight.fly(1.0)
    assert flight.newest["SYS_STATUS"].voltage_battery * 1e-3 == pytest.approx(volts - 2.0, abs=0.2)
    put("SIM_RC_FAIL", 1.0)
    flight.fly_until(lambda: flight.mode == "return", 3.0, "radio failsafe")
    put("SIM_RC_FAIL", 0.0)
    flight.set_mode("guided")
    put("SIM_GPS_DISABLE", 1.0)
    flight.fly_until(lambda: flight.mode == "land", 12.0, "EKF failsafe")
    put("SIM_GPS_DISABLE", 0.0)
    put("SIM_GPS_GLITCH_X", 0.001)
    put("SIM_GPS_GLITCH_Y", -0.002)  # degrees, whatever a degree measures there
    truth, reported = flight.vehicle.vehicle.truth, flight.vehicle.sensors.readings.gps.values
    assert reported[interface.GPS_LAT_DEG] - math.degrees(truth[t.LAT_RAD]) == pytest.approx(0.001, abs=5e-5)
    assert reported[interface.GPS_LON_DEG] - math.degrees(truth[t.LON_RAD]) == pytest.approx(-0.002, abs=5e-5)
    put("SIM_ENGINE_MUL", 0.0)
    put("SIM_ENGINE_FAIL", 1.0)
    assert flight.vehicle.vehicle.motor_effectiveness(0) == 0.0
    assert flight.vehicle.vehicle.motor_effectiveness(1) == 1.0
