"""Default and requested streams of both firmwares against the tables recorded from the real ones.

On virtual time, through memory links: what a client receives in ten seconds of flight readiness.
"""

from collections.abc import Mapping

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import VehicleSpec, WorldSpec
from tests.system.wire_client import WINDOW_S, Client

PX4_ONBOARD_HZ = {
    "ATTITUDE": 100,
    **dict.fromkeys(("ATTITUDE_QUATERNION", "GLOBAL_POSITION_INT", "HIGHRES_IMU"), 50),
    **dict.fromkeys(("LOCAL_POSITION_NED", "ODOMETRY"), 30),
    **dict.fromkeys(("ALTITUDE", "DISTANCE_SENSOR", "SERVO_OUTPUT_RAW", "TIMESYNC", "VFR_HUD"), 10),
    **dict.fromkeys(("ATTITUDE_TARGET", "POSITION_TARGET_LOCAL_NED"), 10),
    "GPS_RAW_INT": 8,
    **dict.fromkeys(("EXTENDED_SYS_STATE", "SYS_STATUS"), 5),
    **dict.fromkeys(("HEARTBEAT", "SYSTEM_TIME", "PING", "ESTIMATOR_STATUS", "SCALED_PRESSURE"), 1),
    **dict.fromkeys(("MISSION_CURRENT", "OPEN_DRONE_ID_LOCATION", "OPEN_DRONE_ID_SYSTEM"), 1),
    **dict.fromkeys(("BATTERY_STATUS", "CURRENT_MODE", "HOME_POSITION", "VIBRATION"), 0.5),
    "CURRENT_EVENT_SEQUENCE": 1 / 3,
}
"""docs/firmware/px4.md, section 6, without two messages pymavlink does not know; disarmed."""

PX4_GCS_HZ = {
    **dict.fromkeys(("ATTITUDE", "ATTITUDE_QUATERNION", "GLOBAL_POSITION_INT"), 50),
    **dict.fromkeys(("LOCAL_POSITION_NED", "SERVO_OUTPUT_RAW"), 50),
    **dict.fromkeys(("ATTITUDE_TARGET", "POSITION_TARGET_LOCAL_NED"), 50),
    "GPS_RAW_INT": 5,
    "VFR_HUD": 4,
    **dict.fromkeys(("ALTITUDE", "EXTENDED_SYS_STATE", "HEARTBEAT", "MISSION_CURRENT"), 1),
    **dict.fromkeys(("SCALED_PRESSURE", "SYS_STATUS", "OPEN_DRONE_ID_LOCATION", "OPEN_DRONE_ID_SYSTEM"), 1),
    **dict.fromkeys(("BATTERY_STATUS", "CURRENT_MODE", "HOME_POSITION", "DISTANCE_SENSOR"), 0.5),
    "ESTIMATOR_STATUS": 0.5,
    **dict.fromkeys(("VIBRATION", "PING"), 0.1),
}

PX4_IN_FLIGHT_ONBOARD_HZ = {
    "ATTITUDE_TARGET": 10,
    "POSITION_TARGET_LOCAL_NED": 10,
    "POSITION_TARGET_GLOBAL_INT": 10,
}

ARDUPILOT_AT_4_HZ = {
    *("AHRS", "AHRS2", "ATTITUDE", "BATTERY_STATUS", "EKF_STATUS_REPORT", "ESC_TELEMETRY_1_TO_4"),
    *("GLOBAL_POSITION_INT", "GPS_RAW_INT", "LOCAL_POSITION_NED", "MEMINFO", "MISSION_CURRENT"),
    *("NAV_CONTROLLER_OUTPUT", "POWER_STATUS", "RAW_IMU", "RC_CHANNELS", "SCALED_IMU2", "SCALED_IMU3"),
    *("SCALED_PRESSURE", "SCALED_PRESSURE2", "SERVO_OUTPUT_RAW", "SIMSTATE", "SYSTEM_TIME", "SYS_STATUS"),
    *("TERRAIN_REPORT", "VFR_HUD", "VIBRATION", "WIND"),
}
"""docs/firmware/ardupilot.md, section 2: everything that REQUEST_DATA_STREAM(ALL, 4 Hz) gives, disarmed."""

NOT_ON_OUR_VEHICLE = {"SCALED_IMU3", "SCALED_PRESSURE2", "SIMSTATE"}
"""It has no third IMU and no second barometer, and truth is not sent by the autopilot."""

ONLY_ON_OUR_VEHICLE = {"DISTANCE_SENSOR"}
"""It has a rangefinder, which ArduPilot's default simulated copter has not."""


def ready(flavour: str, seconds: float) -> Sitl:
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour),), seed=1))
    while sitl.time_us < seconds * 1e6:
        sitl.advance()
    return sitl


def check(found_hz: Mapping[str, float], wanted_hz: Mapping[str, float]) -> None:
    """The same streams, each within one message of its rate."""
    assert sorted(found_hz) == sorted(wanted_hz)
    wrong = {
        name: (found_hz[name], rate_hz)
        for name, rate_hz in wanted_hz.items()
        if abs(found_hz[name] - rate_hz) > 1.01 / WINDOW_S
    }
    assert not wrong


def test_px4_default_streams() -> None:
    sitl = ready("px4", 6.0)
    onboard, gcs = Client(sitl), Client(sitl, role="gcs")
    check(onboard.rates_hz(), PX4_ONBOARD_HZ)
    check(gcs.rates_hz(), PX4_GCS_HZ)


@pytest.mark.slow
def test_px4_streams_of_a_flight() -> None:
    sitl = ready("px4", 6.0)
    client = Client(sitl)
    assert client.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)[0] == mavlink.MAV_RESULT_ACCEPTED
    nan = float("nan")
    assert client.command(mavlink.MAV_CMD_NAV_TAKEOFF, *(nan,) * 7)[0] == mavlink.MAV_RESULT_ACCEPTED
    client.run(5.0)
    found_hz = client.rates_hz()
    for name, rate_hz in PX4_IN_FLIGHT_ONBOARD_HZ.items():
        assert found_hz[name] == pytest.approx(rate_hz, abs=1.01 / WINDOW_S), name


def test_ardupilot_sends_little_until_asked() -> None:
    client = Client(ready("ardupilot", 30.0))
    check(client.rates_hz(), {"HEARTBEAT": 1, "TIMESYNC": 0.1})


def test_ardupilot_streams_at_the_requested_rate() -> None:
    client = Client(ready("ardupilot", 45.0))
    streams = ARDUPILOT_AT_4_HZ - NOT_ON_OUR_VEHICLE | ONLY_ON_OUR_VEHICLE
    client.request_streams(mavlink.MAV_DATA_STREAM_ALL, 4)
    client.run(1.0)
    check(client.rates_hz(), {**dict.fromkeys(streams, 4.0), "HEARTBEAT": 1.0, "TIMESYNC": 0.1})
    client.request_streams(mavlink.MAV_DATA_STREAM_ALL, 0, 0)
    client.run(1.0)
    check(client.rates_hz(), {"HEARTBEAT": 1.0, "TIMESYNC": 0.1})


@pytest.mark.slow
def test_ardupilot_stream_groups() -> None:
    client = Client(ready("ardupilot", 45.0))
    client.request_streams(mavlink.MAV_DATA_STREAM_POSITION, 10)
    client.run(1.0)
    found_hz = client.rates_hz()
    assert found_hz.pop("HEARTBEAT") == 1.0
    found_hz.pop("TIMESYNC")
    assert found_hz == {"GLOBAL_POSITION_INT": 10.0, "LOCAL_POSITION_NED": 10.0}


INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
GET_INTERVAL = mavlink.MAV_CMD_GET_MESSAGE_INTERVAL
PROTOCOL_VERSION = 300
ACCEPTED, DENIED, FAILED = (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_FAILED)


@pytest.mark.parametrize(
    ("flavour", "command", "parameters", "result"),
    [
        ("px4", INTERVAL, (mavlink.MAVLINK_MSG_ID_HEARTBEAT, 500_000), FAILED),
        ("px4", INTERVAL, (12345, 100_000), FAILED),
        ("px4", INTERVAL, (mavlink.MAVLINK_MSG_ID_VFR_HUD, 50_000), ACCEPTED),
        ("px4", REQUEST, (12345,), DENIED),
        ("px4", REQUEST, (mavlink.MAVLINK_MSG_ID_ATTITUDE,), ACCEPTED),
        ("px4", REQUEST, (mavlink.MAVLINK_MSG_ID_GPS_RAW_INT,), DENIED),  # the stream has sent the newest
        ("px4", REQUEST, (mavlink.MAVLINK_MSG_ID_RC_CHANNELS,), DENIED),  # no sticks
        ("px4", REQUEST, (mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION,), ACCEPTED),
        ("px4", REQUEST, (mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,), ACCEPTED),
        ("px4", REQUEST, (PROTOCOL_VERSION,), ACCEPTED),
        ("px4", mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION, (1,), ACCEPTED),
        ("px4", REQUEST, (mavlink.MAVLINK_MSG_ID_HOME_POSITION,), ACCEPTED),
        ("px4", GET_INTERVAL, (12345,), ACCEPTED),
        ("ardupilot", INTERVAL, (mavlink.MAVLINK_MSG_ID_ATTITUDE, 20_000), ACCEPTED),
        ("ardupilot", INTERVAL, (mavlink.MAVLINK_MSG_ID_ATTITUDE, 5_000), ACCEPTED),
        ("ardupilot", INTERVAL, (mavlink.MAVLINK_MSG_ID_ATTITUDE, 1_000), DENIED),
        ("ardupilot", INTERVAL, (12345, 100_000), DENIED),
        ("ardupilot", INTERVAL, (mavlink.MAVLINK_MSG_ID_ODOMETRY, 100_000), DENIED),
        ("ardupilot", INTERVAL, (mavlink.MAVLINK_MSG_ID_HEARTBEAT, 500_000), ACCEPTED),
        ("ardupilot", GET_INTERVAL, (12345,), FAILED),
        ("ardupilot", REQUEST, (12345,), FAILED),
        ("ardupilot", REQUEST, (mavlink.MAVLINK_MSG_ID_ODOMETRY,), FAILED),
        ("ardupilot", REQUEST, (mavlink.MAVLINK_MSG_ID_TIMESYNC,), FAILED),
        ("ardupilot", REQUEST, (mavlink.MAVLINK_MSG_ID_ATTITUDE,), ACCEPTED),
        ("ardupilot", REQUEST, (mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,), ACCEPTED),
    ],
)
def test_results_of_stream_commands(
    flavour: str, command: int, parameters: tuple[float, ...], result: int
) -> None:
    assert Client(ready(flavour, 4.0)).command(command, *parameters)[0] == result


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
def test_an_interval_is_set_read_back_and_taken_back(flavour: str) -> None:
    client = Client(ready(flavour, 6.0))
    vibration = mavlink.MAVLINK_MSG_ID_VIBRATION
    before_hz = client.rates_hz(10.0).get("VIBRATION", 0.0)
    assert client.command(INTERVAL, vibration, 40_000)[0] == ACCEPTED
    assert client.rates_hz(10.0)["VIBRATION"] == 25.0
    _, received = client.command(GET_INTERVAL, vibration)
    order = [m.get_type() for m in received if m.get_type() in ("COMMAND_ACK", "MESSAGE_INTERVAL")]
    assert order == ["MESSAGE_INTERVAL", "COMMAND_ACK"]
    (interval,) = (m for m in received if m.get_type() == "MESSAGE_INTERVAL")
    assert (interval.message_id, interval.interval_us) == (vibration, 40_000)
    assert client.command(INTERVAL, vibration, -1)[0] == ACCEPTED
    assert "VIBRATION" not in client.rates_hz(10.0)
    assert client.command(INTERVAL, vibration, 0)[0] == ACCEPTED
    assert client.rates_hz(10.0).get("VIBRATION", 0.0) == pytest.approx(before_hz, abs=0.11)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_requested_message_follows_its_acknowledgement(flavour: str) -> None:
    client = Client(ready(flavour, 6.0))
    _, received = client.command(REQUEST, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    order = [m.get_type() for m in received if m.get_type() in ("COMMAND_ACK", "AUTOPILOT_VERSION")]
    assert order == ["COMMAND_ACK", "AUTOPILOT_VERSION"]
