"""Missions, fences and rally points of the whole stack: uploaded, read back and flown over MAVLink alone."""

import math

import pytest

from autopilot_bridge.mavlink import dialect
from flightsim.payload import CameraParameters, GimbalParameters, PayloadParameters
from tests.flights.flight import FLAVOURS, SYSTEM_ID, Flight
from tests.flights.plans import FENCE, MISSION, RALLY, at, do, download, geodetic, square, upload

NAN = math.nan


def start_mission(flight: Flight) -> None:
    """From the hover, fly the plan."""
    flight.set_mode("mission" if flight.flavour == "px4" else "auto")


def away_m(flight: Flight, north_m: float, east_m: float) -> float:
    north, east, _ = flight.position_ned_m
    return math.hypot(north - north_m, east - east_m)


@pytest.mark.parametrize("floats", [False, True])
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_all_three_plans_as_a_ground_station_sends_and_reads_them(flavour: str, floats: bool) -> None:
    """QGroundControl's order: mission, fence, rally points, each written and read."""
    flight = Flight(flavour)
    flight.fly(3.0)
    mission = [
        at(flight, 22, 5.0, 5.0, 10.0),
        at(flight, 16, 30.0, 0.0, 12.0),
        do(dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH),
    ]
    fence = [*square(flight, 80.0), at(flight, 5004, 20.0, 20.0, 0.0, 5.0, frame=0)]
    rally = [at(flight, 5100, 15.0, -15.0, 20.0, frame=3), at(flight, 5100, -15.0, 15.0, 20.0, frame=3)]
    for kind, items in ((MISSION, mission), (FENCE, fence), (RALLY, rally)):
        assert upload(flight, items, kind, floats=floats) == 0
    for kind, items in ((MISSION, mission), (FENCE, fence), (RALLY, rally)):
        read = download(flight, kind)
        read = read[1:] if flavour == "ardupilot" and kind == MISSION else read
        assert [each.command for each in read] == [item[1] for item in items]
        assert all(each.mission_type == kind for each in read)
        placed = [(each, item) for each, item in zip(read, items, strict=True) if item[6]]
        tolerance = 40 if floats else 0  # single precision
        assert all(abs(each.x - item[6]) <= tolerance for each, item in placed)
    if flavour == "ardupilot":
        flight.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_FENCE_STATUS)
        values = [flight.vehicle.autopilot.parameters.get(f"{name}_TOTAL") for name in ("FENCE", "RALLY")]
        assert values == [5, 2]
    for kind in (MISSION, FENCE, RALLY):
        flight.send(dialect.MAVLink_mission_clear_all_message(SYSTEM_ID, 1, kind))
    flight.fly(0.5)
    assert not download(flight, RALLY) and not download(flight, FENCE)


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_a_survey_with_camera_and_gimbal(flavour: str) -> None:
    payload = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
    flight = Flight(flavour, payload=payload)
    photos: list[int] = []
    pitches: list[float] = []
    original = flight._link.on_receive

    def receive(data: bytes) -> None:
        original(data)
        newest = flight.newest.pop("CAMERA_IMAGE_CAPTURED", None)
        if newest is not None:
            photos.append(newest.image_index)
        status = flight.newest.pop("GIMBAL_DEVICE_ATTITUDE_STATUS", None)
        if status is not None:
            w, x, y, z = status.q
            pitches.append(math.degrees(math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))))

    flight._link.on_receive = receive
    flight.take_off(15.0)
    plan = [
        at(flight, 16, 3.0, 0.0, 15.0),
        do(dialect.MAV_CMD_DO_MOUNT_CONTROL, -60.0, 0.0, 0.0, 0.0, z=2.0),
        do(dialect.MAV_CMD_IMAGE_START_CAPTURE, 0.0, 0.0, 1.0, 1.0),  # one
        at(flight, 16, 8.0, 0.0, 15.0),
        do(dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 5.0),
        at(flight, 16, 40.0, 0.0, 15.0),
        do(dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 0.0),
        do(dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -20.0, 0.0, NAN, NAN, x=12),
        do(dialect.MAV_CMD_DO_DIGICAM_CONTROL, x=1),  # one more
        at(flight, 16, 46.0, 0.0, 15.0),
    ]
    assert upload(flight, plan) == 0, flight.texts
    start_mission(flight)
    flight.fly_until(lambda: flight.position_ned_m[0] > 7.0, 30.0, "the first photo")
    assert pitches[-1] == pytest.approx(-60.0, abs=3.0)
    first = len(photos)
    assert first == 1
    flight.fly_until(lambda: flight.position_ned_m[0] > 44.0, 40.0, "the last leg")
    manager = flight.newest["GIMBAL_MANAGER_STATUS"]
    assert (manager.primary_control_sysid, manager.primary_control_compid) == (SYSTEM_ID, 1)
    flight.fly_until(lambda: away_m(flight, 46.0, 0.0) < 1.0, 40.0, "the end")
    flight.fly(3.0)
    assert 6 <= len(photos) - first <= 9  # 32 m in steps of 5, and the last one
    assert pitches[-1] == pytest.approx(-20.0, abs=3.0)
    if flavour == "ardupilot":  # PX4 leaves the mission after its last item
        flight.set_mode("loiter")
    flight.fly(2.0)
    manager = flight.newest["GIMBAL_MANAGER_STATUS"]
    assert (manager.primary_control_sysid, manager.primary_control_compid) == (0, 0)


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_the_fence_sends_the_vehicle_to_a_rally_point(flavour: str) -> None:
    parameters = (
        {"GF_ACTION": 3, "RTL_RETURN_ALT": 12.0, "RTL_DESCEND_ALT": 6.0}
        if flavour == "px4"
        else {"FENCE_ENABLE": 1, "FENCE_TYPE": 4, "FENCE_ACTION": 1, "RTL_ALT": 1200, "RTL_LOIT_TIME": 500}
    )
    flight = Flight(flavour, seed=3, parameters=parameters)
    flight.fly(3.0)
    assert upload(flight, square(flight, 45.0), FENCE) == 0
    assert upload(flight, [at(flight, 5100, 20.0, 25.0, 0.0, frame=3)], RALLY) == 0
    flight.take_off(10.0)
    flight.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, dialect.MAVLINK_MSG_ID_FENCE_STATUS, 2e5)
    flight.fly(0.5)
    flight.repeat(10.0, lambda _: flight.position_setpoint(velocity_ned_m_s=(5.0, 0.0, 0.0)))
    flight.fly(1.0)
    flight.set_mode("offboard" if flavour == "px4" else "guided")
    flight.fly_until(lambda: flight.mode == "return", 25.0, "return")
    flight.stop_repeating()
    assert 42.0 < flight.position_ned_m[0] < 52.0
    flight.fly(1.0)
    status = flight.newest.get("FENCE_STATUS")
    if flavour == "px4":
        assert status is None
    else:
        assert flight.text_time("Polygon fence breached") < math.inf
        assert (status.breach_status, status.breach_count, status.breach_type) == (1, 1, 3)
        bits = flight.newest["SYS_STATUS"]
        assert bits.onboard_control_sensors_enabled & dialect.MAV_SYS_STATUS_GEOFENCE
        assert not bits.onboard_control_sensors_health & dialect.MAV_SYS_STATUS_GEOFENCE
    flight.wait_disarmed(90.0)
    assert away_m(flight, 20.0, 25.0) < 1.5


def test_px4_does_not_fly_missions_that_leave_the_fence() -> None:
    flight = Flight("px4")
    flight.get_ready()
    assert upload(flight, square(flight, 50.0), FENCE) == 0
    assert upload(flight, [at(flight, 22, 0.0, 0.0, 10.0), at(flight, 16, 80.0, 0.0, 10.0)]) == 0
    assert flight.result(dialect.MAV_CMD_MISSION_START) == 2
    assert upload(flight, [at(flight, 22, 0.0, 0.0, 10.0), at(flight, 16, 40.0, 0.0, 10.0)]) == 0
    assert flight.result(dialect.MAV_CMD_MISSION_START) == 0


def test_items_that_are_commands_are_carried_out() -> None:
    """DO_FENCE_ENABLE, DO_SET_SERVO and DO_GRIPPER of a plan, as ArduPilot has them."""
    flight = Flight("ardupilot", parameters={"GRIP_ENABLE": 1})
    flight.take_off(8.0)
    plan = [
        at(flight, 16, 2.0, 0.0, 8.0),
        do(dialect.MAV_CMD_DO_FENCE_ENABLE, 1.0),
        do(dialect.MAV_CMD_DO_SET_SERVO, 9.0, 1600.0),
        do(dialect.MAV_CMD_DO_GRIPPER, 1.0, 0.0),
    ]
    assert upload(flight, [*plan, at(flight, 16, 4.0, 0.0, 8.0)]) == 0
    start_mission(flight)
    flight.fly_until(lambda: flight.text_time("Reached command #5") < math.inf, 30.0, "the end")
    assert flight.vehicle.autopilot.parameters.get("FENCE_ENABLE") == 1
    assert flight.text_time("Gripper load releasing") < math.inf


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_the_nose_follows_a_region_of_interest(flavour: str) -> None:
    flight = Flight(flavour)
    flight.take_off(10.0)
    spot = (20.0, 25.0)
    plan = [
        at(flight, 16, 2.0, 0.0, 10.0, 0.0, 0.0, 0.0, NAN),
        at(flight, 195, *spot),
        at(flight, 16, 35.0, 0.0, 10.0, 0.0, 0.0, 0.0, NAN),
    ]
    assert upload(flight, plan) == 0
    start_mission(flight)
    flight.fly_until(lambda: flight.position_ned_m[0] > 15.0, 30.0, "half the way")
    north, east, _ = flight.position_ned_m
    wanted = math.atan2(spot[1] - east, spot[0] - north)
    assert abs(math.remainder(flight.yaw_rad - wanted, 2.0 * math.pi)) < math.radians(12.0)
    assert geodetic(flight, 0.0, 0.0)[0] == pytest.approx(flight.sitl.spec.place.lat_deg)
