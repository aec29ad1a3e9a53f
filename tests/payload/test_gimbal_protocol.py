"""Gimbal protocol v2 on the wire, beyond what the first components' test covers."""

import math

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.payload import GIMBAL_COMPONENT
from flightsim.payload import Gimbal
from tests.payload.test_components import HOME, SYSTEM, World, pointing

ACCEPTED, DENIED = dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_DENIED
UNSUPPORTED = dialect.MAV_RESULT_UNSUPPORTED
AUTOPILOT, OTHER_VEHICLE, GROUND = (SYSTEM, 1), (SYSTEM + 1, 1), (255, 190)
M_PER_DEG_LAT = 111_180.0


@pytest.fixture
def world() -> World:
    world = World()
    world.run(1.0)
    report_place(world, 0.0, 100.0, sender=AUTOPILOT)
    return world


def say(world: World, command: int, *values: float, sender=GROUND) -> int | None:
    return world.command(GIMBAL_COMPONENT, command, *values, sender=sender)


def report_place(world: World, north_m: float, height_m: float, *, sender, vx: float = 0.0) -> None:
    world.deliver(
        dialect.MAVLink_global_position_int_message(
            0,
            round((HOME.lat_deg + north_m / M_PER_DEG_LAT) * 1e7),
            round(HOME.lon_deg * 1e7),
            round(1e3 * (HOME.alt_m + height_m)),
            round(1e3 * height_m),
            round(100.0 * vx),
            0,
            0,
            0,
        ),
        sender=sender,
    )


def test_another_system_is_looked_at_and_taken_on(world):
    assert say(world, dialect.MAV_CMD_DO_SET_ROI_SYSID, SYSTEM + 1) == ACCEPTED
    world.run(1.0)
    assert pointing(world).pitch == pytest.approx(0.0, abs=1.0)  # not received of yet
    report_place(world, 100.0, 0.0, sender=OTHER_VEHICLE, vx=20.0)
    world.run(2.5)
    look = pointing(world)
    # 150 m ahead by now, 100 m down
    assert (look.pitch, look.yaw) == pytest.approx((-math.degrees(math.atan2(100.0, 150.0)), 0.0), abs=4.0)
    report_place(world, -100.0, 0.0, sender=(SYSTEM + 2, 1))  # another vehicle
    world.run(0.4)
    assert abs(pointing(world).yaw) < 10.0
    world.run(3.0)  # no word for longer than is taken on: it stays where it looks
    assert pointing(world).pitch == pytest.approx(look.pitch, abs=6.0)
    for nonsense in (0.0, 256.0, float(SYSTEM), math.nan):
        assert say(world, dialect.MAV_CMD_DO_SET_ROI_SYSID, nonsense) == DENIED


def test_a_ground_station_that_moves_is_looked_at(world):
    assert say(world, dialect.MAV_CMD_DO_SET_ROI_SYSID, GROUND[0]) == ACCEPTED
    zeros = [0.0] * 3
    world.deliver(
        dialect.MAVLink_follow_target_message(
            0,
            1,
            round((HOME.lat_deg - 100.0 / M_PER_DEG_LAT) * 1e7),
            round(HOME.lon_deg * 1e7),
            HOME.alt_m,
            zeros,
            zeros,
            [1.0, 0.0, 0.0, 0.0],
            zeros,
            zeros,
            0,
        )
    )
    world.run(2.5)
    look = pointing(world)
    assert look.pitch == pytest.approx(-45.0, abs=4.0)
    assert abs(look.yaw) == pytest.approx(180.0, abs=5.0)


def test_pointing_by_hand_ends_the_region_of_interest(world):
    say(world, dialect.MAV_CMD_DO_SET_ROI_SYSID, SYSTEM + 1)
    report_place(world, 100.0, 0.0, sender=OTHER_VEHICLE)
    world.run(1.0)
    assert say(world, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -10.0, 0.0) == ACCEPTED
    report_place(world, 100.0, 0.0, sender=OTHER_VEHICLE)
    world.run(2.0)
    assert pointing(world).pitch == pytest.approx(-10.0, abs=1.0)


def test_the_mount_of_before(world):
    control, configure = dialect.MAV_CMD_DO_MOUNT_CONTROL, dialect.MAV_CMD_DO_MOUNT_CONFIGURE
    targeting = float(dialect.MAV_MOUNT_MODE_MAVLINK_TARGETING)
    assert say(world, configure, targeting) == ACCEPTED
    assert say(world, control, -35.0, 0.0, 15.0, 0, 0, 0, targeting) == ACCEPTED
    world.run(2.0)
    look = pointing(world)
    assert (look.pitch, look.yaw) == pytest.approx((-35.0, 15.0), abs=1.0)
    mount = world.request(GIMBAL_COMPONENT, dialect.MAVLINK_MSG_ID_MOUNT_ORIENTATION)
    assert (mount.pitch, mount.yaw) == pytest.approx((-35.0, 15.0), abs=1.0)
    there = (0.0, HOME.lat_deg + 100.0 / M_PER_DEG_LAT, HOME.lon_deg)  # over home
    report_place(world, 0.0, 100.0, sender=AUTOPILOT)
    assert say(world, control, 0, 0, 0, *there, float(dialect.MAV_MOUNT_MODE_GPS_POINT)) == ACCEPTED
    world.run(2.5)
    assert pointing(world).pitch == pytest.approx(-45.0, abs=4.0)
    assert say(world, control, 0, 0, 0, 0, 0, 0, float(dialect.MAV_MOUNT_MODE_NEUTRAL)) == ACCEPTED
    world.run(2.0)
    assert pointing(world).pitch == pytest.approx(0.0, abs=1.5)
    assert say(world, configure, float(dialect.MAV_MOUNT_MODE_RETRACT)) == ACCEPTED
    world.run(0.5)
    assert world.payload.get(Gimbal).retracted
    assert say(world, control, 0, 0, 0, 0, 0, 0, float(dialect.MAV_MOUNT_MODE_RC_TARGETING)) == UNSUPPORTED
    assert say(world, control, math.inf, 0, 0, 0, 0, 0, targeting) == DENIED


def test_a_change_of_control_is_reported_at_once(world):
    def reported() -> list:
        return world.messages(dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS)

    configure = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
    before = len(reported())
    assert say(world, configure, *GROUND, 254, 1, 0, 0, GIMBAL_COMPONENT) == ACCEPTED
    assert len(reported()) == before + 1
    status = reported()[-1]
    assert (status.primary_control_sysid, status.primary_control_compid) == GROUND
    assert (status.secondary_control_sysid, status.secondary_control_compid) == (254, 1)
    assert say(world, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -20.0, sender=(254, 1)) == ACCEPTED
    assert say(world, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -20.0, sender=(253, 1)) == DENIED
    assert say(world, configure, -1, -1, -1, -1) == ACCEPTED
    assert len(reported()) == before + 1  # nothing has changed
    assert say(world, configure, 300, 1, -1, -1) == DENIED
    assert say(world, configure, *GROUND, -1, -1, 0, 0, 99) == UNSUPPORTED
    assert (
        say(world, configure, 0, 0, 0, 0, sender=(253, 1)) == ACCEPTED
    )  # no controller, says another component
    assert reported()[-1].primary_control_sysid == 0


def test_the_own_autopilot_always_points(world):
    say(world, dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, *GROUND, -1, -1)
    pitchyaw = dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
    assert say(world, pitchyaw, -20.0, sender=AUTOPILOT) == ACCEPTED
    assert say(world, pitchyaw, -20.0, sender=OTHER_VEHICLE) == DENIED


def test_an_attitude_with_roll(world):
    half = math.radians(10.0)
    q = [math.cos(half), math.sin(half), 0.0, 0.0]
    flags = dialect.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK
    world.deliver(
        dialect.MAVLink_gimbal_manager_set_attitude_message(
            SYSTEM, GIMBAL_COMPONENT, flags, GIMBAL_COMPONENT, q, math.nan, math.nan, math.nan
        )
    )
    world.run(2.0)
    mount = world.request(GIMBAL_COMPONENT, dialect.MAVLINK_MSG_ID_MOUNT_ORIENTATION)
    assert (mount.roll, mount.pitch) == pytest.approx((20.0, 0.0), abs=1.0)


def test_yaw_may_be_given_in_the_earths_frame(world):
    information = world.request(GIMBAL_COMPONENT, dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION)
    assert information.cap_flags & dialect.GIMBAL_MANAGER_CAP_FLAGS_SUPPORTS_YAW_IN_EARTH_FRAME
    assert information.cap_flags & dialect.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL
    status = world.messages(dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS)[-1]
    assert status.flags & dialect.GIMBAL_DEVICE_FLAGS_ACCEPTS_YAW_IN_EARTH_FRAME
