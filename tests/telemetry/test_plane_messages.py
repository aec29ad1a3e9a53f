"""Messages of aircraft: values of a state that is known, and the conventions of the recorded flights."""

import functools
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.firmware.ardupilot.plane import messages as ardupilot_plane
from autopilot_bridge.firmware.ardupilot.plane.messages import ArduPlaneMessages
from autopilot_bridge.firmware.ardupilot.plane.modes import CUSTOM_MODES
from autopilot_bridge.firmware.ardupilot.services import PLANE_SERVICES
from autopilot_bridge.firmware.px4.plane import messages as px4_plane
from autopilot_bridge.firmware.px4.plane.messages import Px4PlaneMessages
from autopilot_bridge.flight.context import FlightContext, LandedState
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, LoiterTask, MissionTask
from autopilot_bridge.mavlink import decode
from autopilot_bridge.mavlink.definitions import definition
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.message_interval import MessageIntervalService
from autopilot_bridge.services.messages.flight_path import FlightPath, flight_path
from autopilot_bridge.telemetry import motion
from autopilot_bridge.telemetry.streams import PayloadCache, StreamTable
from autopilot_bridge.telemetry.view import TelemetryView
from autopilot_bridge.tlog import TlogReader
from flightsim import interface
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import SensorReadings
from tests.recorded_logs import recorded_log

ORIGIN = GeodeticPosition(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.0)
NORTH, EAST, DOWN = 300.0, -40.0, -95.0


class Aircraft:
    """An aircraft in the air, heading north at 25 m/s in a wind from the west, with its sources."""

    def __init__(self) -> None:
        self.context = FlightContext(parameters=FixedWingFlightParameters())
        state = self.context.nav
        state[:] = 0.0
        q = np.zeros(4)
        quaternion_from_euler(0.1, math.radians(4.0), 0.0, q)
        state[nav.Q_NED_FROM_FRD] = q
        state[nav.EULER_RAD] = (0.1, math.radians(4.0), 0.0)
        state[nav.POS_NED_M] = (NORTH, EAST, DOWN)
        state[nav.VEL_NED_M_S] = (25.0, 3.0, 0.0)
        state[nav.WIND_NED_M_S] = (0.0, 3.0, math.nan)
        state[nav.AIRSPEED_M_S], state[nav.AIRSPEED_TRUE_M_S] = 24.0, 25.0
        self.health = NavigationHealth()
        self.health.attitude = True
        self.health.wind_variance_m2_s2 = (0.2, 0.3)
        navigation = SimpleNamespace(state=state, health=self.health, covariance=np.eye(24))
        self.controller = FixedWingController(FixedWingParameters(), physics_rate_hz=250, nav=state)
        self.context.setpoint = self.controller.setpoint
        self.context.setpoint[sp.LEVEL] = sp.FLY
        self.context.frame = LocalFrame(ORIGIN)
        self.context.home_ned_m[:] = 0.0
        self.context.armed = True
        self.context.landed_state = LandedState.IN_AIR
        readings = SensorReadings()
        readings.airspeed.time_us = 1_000_000
        readings.airspeed.values[:] = (350.0, 12.0)
        readings.barometer.time_us = 1_000_000
        readings.barometer.values[:] = (95_000.0, 14.0)
        self.mode = FlightMode.HOLD
        self.task: Any = LoiterTask(np.array([300.0, 60.0, -100.0]), -80.0)
        self.task.activate(self.context)
        self.missions = MissionStore()
        view = TelemetryView(self.context, state, readings)
        view.advance(2_000_000)
        aircraft = self

        class Tasks:
            orbit = None
            task = property(lambda tasks: aircraft.task)

        class Status:
            def heartbeat(self) -> tuple[int, ...]:
                return (1, 3, 0, CUSTOM_MODES[aircraft.mode], 4, 3)

        self.parts: Any = SimpleNamespace(
            view=view,
            commander=SimpleNamespace(
                context=self.context,
                tasks=Tasks(),
                missions=self.missions,
                battery_level=1,
                situation=SimpleNamespace(position=True),
            ),
            navigation=navigation,
            controller=self.controller,
            readings=readings,
            status=Status(),
            memory=SimpleNamespace(unix_epoch_us=0),
        )
        self.px4 = Px4PlaneMessages(self.parts)
        self.ardupilot = ArduPlaneMessages(self.parts)

    def actuate(self, **values: float) -> None:
        for name, value in values.items():
            self.controller.actuators[getattr(interface, name)] = value


def fields(name: str, values: Any) -> dict[str, Any]:
    return dict(zip(definition(name).field_names, values, strict=True))


def test_px4_servo_outputs() -> None:
    aircraft = Aircraft()
    aircraft.actuate(AILERON=0.5, ELEVATOR=-0.2, RUDDER=1.0, THROTTLE=0.6)
    out = fields("SERVO_OUTPUT_RAW", aircraft.px4.servo_output_raw())
    assert [out[f"servo{i}_raw"] for i in range(1, 7)] == [1750, 1400, 2000, 1600, 900, 900]
    aircraft.context.setpoint[sp.LEVEL] = sp.IDLE
    out = fields("SERVO_OUTPUT_RAW", aircraft.px4.servo_output_raw())
    assert (out["servo1_raw"], out["servo4_raw"]) == (1750, 900)
    aircraft.context.armed = False
    out = fields("SERVO_OUTPUT_RAW", aircraft.px4.servo_output_raw())
    assert {out[f"servo{i}_raw"] for i in range(1, 17)} == {900}


def test_arduplane_servo_outputs() -> None:
    aircraft = Aircraft()
    aircraft.actuate(AILERON=0.5, ELEVATOR=1.0, RUDDER=-1.0, THROTTLE=0.6)
    out = fields("SERVO_OUTPUT_RAW", aircraft.ardupilot.servo_output_raw())
    assert [out[f"servo{i}_raw"] for i in range(1, 6)] == [1700, 1900, 1600, 1100, 0]
    aircraft.context.armed = False
    out = fields("SERVO_OUTPUT_RAW", aircraft.ardupilot.servo_output_raw())
    assert [out[f"servo{i}_raw"] for i in range(1, 6)] == [1500, 1500, 1000, 1500, 0]


def test_navigation_errors() -> None:
    aircraft = Aircraft()
    out = fields("NAV_CONTROLLER_OUTPUT", aircraft.px4.nav_controller_output())
    assert (out["nav_roll"], out["nav_pitch"]) == (0.0, 0.0)
    assert (out["target_bearing"], out["wp_dist"]) == (180, 100)  # along the left-hand circle
    assert out["alt_error"] == pytest.approx(5.0)  # to climb
    assert out["xtrack_error"] == pytest.approx(20.0)  # outside of the circle
    out = fields("NAV_CONTROLLER_OUTPUT", aircraft.ardupilot.nav_controller_output())
    assert (out["nav_bearing"], out["target_bearing"], out["wp_dist"]) == (90, 90, 100)
    assert out["alt_error"] == pytest.approx(5.0)
    aircraft.mode = FlightMode.FBWA
    assert aircraft.ardupilot.nav_controller_output() is None


def test_targets() -> None:
    aircraft = Aircraft()
    out = fields("POSITION_TARGET_GLOBAL_INT", aircraft.px4.position_target_global_int())
    lat, lon, alt = aircraft.context.frame.geodetic_from_ned(300.0, 60.0, -100.0)  # type: ignore[union-attr]
    assert (out["lat_int"], out["lon_int"]) == (round(lat * 1e7), round(lon * 1e7))
    assert (out["coordinate_frame"], out["type_mask"], out["alt"]) == (5, 0, pytest.approx(alt))
    assert math.isnan(out["vx"])
    out = fields("POSITION_TARGET_GLOBAL_INT", aircraft.ardupilot.position_target_global_int())
    assert (out["coordinate_frame"], out["type_mask"], out["vx"]) == (0, 0xFDF8, 0.0)
    out = fields("POSITION_TARGET_LOCAL_NED", aircraft.px4.position_target_local_ned())
    assert (out["x"], out["y"], out["z"]) == pytest.approx((300.0, -20.0, -100.0))  # nearest of the circle
    assert out["type_mask"] == 3576
    aircraft.task = None
    assert aircraft.px4.position_target_global_int() is None
    aircraft.context.armed = False
    out = fields("POSITION_TARGET_LOCAL_NED", aircraft.px4.position_target_local_ned())
    assert (out["x"], out["y"], out["z"]) == pytest.approx((NORTH, EAST, 489.0))


def test_wind_and_airspeed() -> None:
    aircraft = Aircraft()
    out = fields("WIND_COV", aircraft.px4.wind_cov())
    assert (out["wind_x"], out["wind_y"], out["wind_z"]) == (0.0, 3.0, 0.0)
    assert (out["var_horiz"], out["wind_alt"]) == (pytest.approx(0.5), pytest.approx(489.0 + 95.0))
    direction, speed, down = aircraft.ardupilot.wind()
    assert (direction, speed, down) == pytest.approx((-90.0, 3.0, 0.0))  # from the west
    out = fields("AIRSPEED", aircraft.ardupilot.airspeed())
    assert (out["airspeed"], out["raw_press"], out["temperature"]) == (24.0, 350.0, 1200)
    assert out["flags"] == mavlink.AIRSPEED_SENSOR_UNHEALTHY
    aircraft.health.airspeed_valid = True
    assert fields("AIRSPEED", aircraft.ardupilot.airspeed())["flags"] == mavlink.AIRSPEED_SENSOR_USING
    for messages in (aircraft.px4, aircraft.ardupilot):
        assert fields("VFR_HUD", messages.vfr_hud())["airspeed"] == 24.0
        assert fields("SCALED_PRESSURE", messages.scaled_pressure())["press_diff"] == pytest.approx(3.5)


def test_wind_is_reported_from_the_first_flight_on() -> None:
    aircraft = Aircraft()
    aircraft.context.landed_state = LandedState.ON_GROUND
    assert aircraft.px4.wind_cov() is None
    aircraft.context.landed_state = LandedState.IN_AIR
    assert aircraft.px4.wind_cov() is not None
    aircraft.context.landed_state = LandedState.ON_GROUND
    assert aircraft.px4.wind_cov() is not None
    aircraft.context.nav[nav.WIND_NED_M_S] = math.nan
    assert aircraft.px4.wind_cov() is None


def test_flow_angles() -> None:
    aircraft = Aircraft()
    _, attack_deg, slip_deg = aircraft.ardupilot.flow_angles()
    assert attack_deg == pytest.approx(4.0 * math.cos(0.1), abs=0.05)
    assert slip_deg == pytest.approx(4.0 * math.sin(0.1), abs=0.05)
    aircraft.context.landed_state = LandedState.ON_GROUND
    assert aircraft.ardupilot.flow_angles()[1:] == (0.0, 0.0)


def test_dead_reckoning_is_a_relative_position() -> None:
    aircraft = Aircraft()
    health = aircraft.health
    health.velocity_horizontal = health.velocity_vertical = health.position_vertical_absolute = True
    health.position_horizontal_relative = health.position_horizontal_absolute = True
    assert aircraft.ardupilot.ekf_status_flags() == 831
    health.wind_dead_reckoning = True
    flags = aircraft.ardupilot.ekf_status_flags()
    assert flags & mavlink.EKF_POS_HORIZ_REL
    assert not flags & (mavlink.EKF_POS_HORIZ_ABS | mavlink.EKF_PRED_POS_HORIZ_ABS)


def test_estimator_status_has_the_airspeeds_ratio_while_it_is_fused() -> None:
    aircraft = Aircraft()
    assert math.isnan(fields("ESTIMATOR_STATUS", aircraft.px4.estimator_status())["tas_ratio"])
    aircraft.health.airspeed_in_use, aircraft.health.airspeed_test_ratio = True, 0.5
    assert fields("ESTIMATOR_STATUS", aircraft.px4.estimator_status())["tas_ratio"] == 0.25


def test_the_leg_of_a_plan() -> None:
    aircraft = Aircraft()
    frame = aircraft.context.frame
    assert frame is not None

    def waypoint(north_m: float, east_m: float) -> MissionItem:
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
        return MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=6, x=lat, y=lon, z=100.0)

    aircraft.missions.replace(
        (waypoint(0.0, 0.0), MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED), waypoint(600.0, 0.0)), 1
    )
    aircraft.missions.current = 2
    path = flight_path(MissionTask(aircraft.missions), aircraft.context, aircraft.missions)
    assert path is not None
    assert path[:3] == pytest.approx((600.0, 0.0, -100.0), abs=0.05)
    assert path.track_error_m(NORTH, EAST) == pytest.approx(-40.0, abs=0.05)  # left of the line
    assert path.nearest_point(NORTH, EAST) == pytest.approx((300.0, 0.0), abs=0.05)
    assert math.degrees(path.bearing_rad(NORTH, EAST)) == pytest.approx(7.6, abs=0.1)


def test_every_message_has_the_fields_of_its_definition() -> None:
    for messages in (Aircraft().px4, Aircraft().ardupilot):
        for name in (
            *("NAV_CONTROLLER_OUTPUT", "SERVO_OUTPUT_RAW", "POSITION_TARGET_LOCAL_NED", "VFR_HUD"),
            *("POSITION_TARGET_GLOBAL_INT", "EXTENDED_SYS_STATE"),
        ):
            values = messages.builders[definition(name).message_id]()
            assert values is not None and len(values) == len(definition(name).field_names), name
    names = ("CURRENT_EVENT_SEQUENCE", "FENCE_STATUS", "MISSION_CURRENT", *motion.MESSAGES)
    of_services = {definition(name).message_id for name in names}
    arduplane = set(Aircraft().ardupilot.builders) | of_services
    for group in ardupilot_plane.STREAM_GROUPS.values():
        assert set(group) <= arduplane
    assert set(px4_plane.ONBOARD_RATES_HZ) <= set(Aircraft().px4.builders) | of_services


@pytest.mark.parametrize(("rate_hz", "result"), [(40.0, Result.ACCEPTED), (45.0, 2), (50.0, 2), (4.0, 0)])
def test_arduplane_refuses_rates_beyond_its_loop(rate_hz: float, result: int) -> None:
    """A loop of 50 Hz sends 40 Hz, and says what to increase for more (docs/firmware/ardupilot.md, 2)."""
    cache = PayloadCache({definition("ATTITUDE").message_id: bytes})
    channel = SimpleNamespace(name="one", send=lambda message: None)
    table = StreamTable(cache, channel, {}, physics_step_us=4000)  # type: ignore[arg-type]
    texts: list[str] = []
    service = MessageIntervalService(
        PLANE_SERVICES.intervals, {"one": table}, cache, lambda severity, text: texts.append(text)
    )
    source = Source(channel, 255, 190)
    assert service.set_interval(source, definition("ATTITUDE").message_id, 1e6 / rate_hz) == result
    assert bool(texts) is (result == 2)
    if texts:
        assert texts == ["Requested rate for message ID 30 too fast. Increase SCHED_LOOP_RATE"]


# the recorded flights


@functools.cache
def recorded(file: str) -> list[Any]:
    """Messages of a recorded flight that the tests below look at, in order."""
    return [
        decode(frame)
        for _, frame in TlogReader(recorded_log(file))
        if frame.definition.name in _LOOKED_AT and frame.system_id != 255
    ]


_LOOKED_AT = {
    "AIRSPEED",
    "GLOBAL_POSITION_INT",
    "NAV_CONTROLLER_OUTPUT",
    "POSITION_TARGET_GLOBAL_INT",
    "SERVO_OUTPUT_RAW",
    "HEARTBEAT",
    "WIND_COV",
    "VFR_HUD",
}
PX4_LOG, ARDUPLANE_LOG = "px4_plane_mission.tlog", "arduplane_loiter.tlog"


def snapshots(file: str, of: str) -> list[dict[str, Any]]:
    """The newest message of each kind whenever a message `of` comes, with all others known."""
    newest: dict[str, Any] = {}
    found = []
    for message in recorded(file):
        newest[message.get_type()] = message
        if (
            message.get_type() == of
            and {"GLOBAL_POSITION_INT", "POSITION_TARGET_GLOBAL_INT"} <= newest.keys()
        ):
            found.append(dict(newest))
    return found


def path_of(snapshot: dict[str, Any]) -> tuple[FlightPath, float, float, float]:
    """The target as a path, and the position, local NED at the target."""
    target, here = snapshot["POSITION_TARGET_GLOBAL_INT"], snapshot["GLOBAL_POSITION_INT"]
    frame = LocalFrame(
        GeodeticPosition(lat_deg=target.lat_int * 1e-7, lon_deg=target.lon_int * 1e-7, alt_m=target.alt)
    )
    north, east, down = frame.ned_from_geodetic(here.lat * 1e-7, here.lon * 1e-7, here.alt * 1e-3)
    return FlightPath(0.0, 0.0, 0.0), north, east, down


@pytest.mark.parametrize("file", [PX4_LOG, ARDUPLANE_LOG])
def test_distance_bearing_and_height_error_are_as_recorded(file: str) -> None:
    """The recorded controller and our arithmetic agree on what the fields mean."""
    rows = snapshots(file, "NAV_CONTROLLER_OUTPUT")
    distance, bearing, height = [], [], []
    for row in rows[len(rows) // 4 :: 25]:
        path, north, east, down = path_of(row)
        out = row["NAV_CONTROLLER_OUTPUT"]
        if not 60.0 < path.distance_m(north, east) < 400.0 or row["VFR_HUD"].groundspeed < 8.0:
            continue
        distance.append(out.wp_dist - path.distance_m(north, east))
        turned = out.target_bearing - math.degrees(path.bearing_rad(north, east))
        bearing.append(math.remainder(turned, 360.0))
        height.append(out.alt_error - down)
    assert len(distance) > 20
    assert np.median(np.abs(distance)) < 6.0
    # PX4 gives the path's direction in a (clockwise) circle, at right angles to the bearing of its centre
    along = [abs(angle) < 10.0 for angle in bearing]
    across = [abs(angle + 90.0) < 10.0 for angle in bearing]
    assert sum(along) + sum(across) > 0.8 * len(bearing)
    assert sum(along) > 5
    assert (sum(across) > 5) is (file == PX4_LOG)
    assert np.median(np.abs(height)) < 0.6


def test_airspeed_errors_have_the_recorded_signs() -> None:
    px4 = [row for row in snapshots(PX4_LOG, "NAV_CONTROLLER_OUTPUT") if row["VFR_HUD"].airspeed > 8.0]
    assert np.median([row["NAV_CONTROLLER_OUTPUT"].aspd_error for row in px4]) < 0.0  # an airplane too slow
    plane = snapshots(ARDUPLANE_LOG, "NAV_CONTROLLER_OUTPUT")
    slow = [row for row in plane if row["VFR_HUD"].airspeed < 20.0]
    # cm/s, wanted less flown
    assert np.median([row["NAV_CONTROLLER_OUTPUT"].aspd_error for row in slow]) > 100.0


def test_pitot_pressure_is_recorded_in_pascal() -> None:
    flown = [m for m in recorded(ARDUPLANE_LOG) if m.get_type() == "AIRSPEED" and m.airspeed > 15.0]
    ratio = [m.airspeed**2 / m.raw_press for m in flown]
    assert np.median(ratio) == pytest.approx(2.0, rel=0.03)  # ARSPD_RATIO
    assert np.median([m.flags for m in flown]) == mavlink.AIRSPEED_SENSOR_USING


@pytest.mark.parametrize(
    ("file", "at_rest", "throttle", "low", "high"),
    [
        (PX4_LOG, (900, 900, 900, 900, 900), 4, 1000, 2000),
        (ARDUPLANE_LOG, (1500, 1500, 1000, 1500, 0), 3, 1100, 1900),
    ],
)
def test_outputs_as_recorded(file: str, at_rest: tuple[int, ...], throttle: int, low: int, high: int) -> None:
    armed, moved, powered = False, [], []
    for message in recorded(file):
        if message.get_type() == "HEARTBEAT":
            armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        elif message.get_type() == "SERVO_OUTPUT_RAW":
            pulses = [getattr(message, f"servo{i}_raw") for i in range(1, 6)]
            if not powered and not armed and not moved:
                assert tuple(pulses) == at_rest or pulses[0] != at_rest[0]
            if armed and pulses[0] != 900:
                moved += [p for i, p in enumerate(pulses[:4], start=1) if i != throttle]
                powered.append(pulses[throttle - 1])
    assert low <= min(moved) and max(moved) <= high
    assert 1900 < max(powered) <= 2000
    aircraft = Aircraft()
    aircraft.context.armed = False
    messages = aircraft.px4 if file == PX4_LOG else aircraft.ardupilot
    ours = fields("SERVO_OUTPUT_RAW", messages.servo_output_raw())
    assert tuple(ours[f"servo{i}_raw"] for i in range(1, 6)) == at_rest
