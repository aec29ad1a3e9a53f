"""What payload components say and are reported, in messages; attitude commands and their masks."""

import math
from types import SimpleNamespace

import pytest

from autopilot_bridge.mavlink import FrameParser, decode, dialect
from autopilot_bridge.mavlink.components import GIMBAL_COMPONENT
from missions.errors import PlanError
from missions.vehicle import AttitudeSetpoint
from missions.vehicle.notes import FlightNotes
from missions.vehicle.payload import Payload, detection, gimbal_attitude  # type: ignore[attr-defined]

d = dialect


def landing_target(angle_x, angle_y, number=3):
    return d.MAVLink_landing_target_message(
        1_500_000, number, d.MAV_FRAME_BODY_FRD, angle_x, angle_y, 0.0, 0.01, 0.01
    )


def test_angles_become_normalized_image_coordinates():
    found = detection(landing_target(math.radians(20.0), math.radians(-10.0)))
    assert (found.time_us, found.target) == (1_500_000, 3)
    assert (found.image_x, found.image_y) == pytest.approx(
        (math.tan(math.radians(20.0)), math.tan(math.radians(-10.0)))
    )


@pytest.mark.parametrize("angle", [math.nan, math.inf, 2.0, -1.7])
def test_angles_that_are_none_make_no_detection(angle):
    assert detection(landing_target(angle, 0.0)) is None
    assert detection(landing_target(0.0, angle)) is None


def status(flags, q=(1.5, 0.0, 0.0, 0.0)):
    return d.MAVLink_gimbal_device_attitude_status_message(0, 0, 1234, flags, list(q), 0.0, 0.0, 0.0, 0)


@pytest.mark.parametrize(
    ("flags", "from_north"),
    [
        (d.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME, False),
        (d.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME, True),
        (d.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME | d.GIMBAL_DEVICE_FLAGS_YAW_LOCK, False),
        (d.GIMBAL_DEVICE_FLAGS_YAW_LOCK, True),  # older than the frame flags
        (0, False),
    ],
)
def test_a_gimbal_says_what_its_yaw_is_from(flags, from_north):
    attitude = gimbal_attitude(status(flags))
    assert attitude.from_north is from_north
    assert (attitude.time_us, attitude.q) == (1_234_000, (1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), (math.inf, 0.0, 0.0, 0.0)])
def test_a_quaternion_that_is_none_makes_no_attitude(q):
    assert gimbal_attitude(status(32, q)) is None


# who points the gimbal


class Rig:
    """A vehicle as a payload sees it."""

    def __init__(self):
        self.system_id = 1
        self.clock = SimpleNamespace(time_us=0)
        self.notes = FlightNotes()
        self.sent = []
        self.primary = None
        self.connection = SimpleNamespace(system_id=255, component_id=190, latest=self.latest)

    def latest(self, kind, system_id, component_id):
        if kind is not d.MAVLink_gimbal_manager_status_message or self.primary is None:
            return None
        return d.MAVLink_gimbal_manager_status_message(0, 0, 0, *self.primary, 0, 0)  # type: ignore[call-arg]

    def send(self, message):
        self.sent.append(message)


@pytest.mark.parametrize(
    ("primary", "warned"),
    [(None, False), ((0, 0), False), ((255, 190), False), ((255, 191), True), ((42, 190), True)],
)
def test_a_gimbal_that_another_client_points_is_warned_of_once(primary, warned):
    rig = Rig()
    payload = Payload(rig)
    payload.take_gimbal_control()
    rig.primary = (42, 190)  # it takes the manager some time to report the controller
    payload.point_gimbal(pitch_rad=-0.5, yaw_rad=0.0)
    assert rig.notes.warnings == []
    rig.primary = primary
    for time_us in range(4_000_000, 20_000_000, 1_000_000):
        rig.clock.time_us = time_us
        payload.point_gimbal(pitch_rad=-0.5, yaw_rad=0.0)
    assert len(rig.sent) > 16  # it goes on pointing: control may come back
    if not warned:
        assert rig.notes.warnings == []
        return
    (warning,) = rig.notes.warnings
    assert f"controlled by system {primary[0]}, component {primary[1]}" in warning


# attitude commands


def test_roll_alone_travels_as_ardupilots_plane_takes_it():
    setpoint = AttitudeSetpoint(roll_rad=0.4)
    assert setpoint.type_mask == 0xC6


def test_roll_and_pitch_leave_the_throttle():
    assert AttitudeSetpoint(roll_rad=0.4, pitch_rad=0.1).type_mask == 0x47


def test_a_complete_attitude_ignores_the_rates_only():
    setpoint = AttitudeSetpoint(roll_rad=0.4, pitch_rad=0.1, thrust=0.6, yaw_rad=1.0)
    message = setpoint.message(2_000_000, 1)
    assert (message.type_mask, message.thrust) == (0x07, 0.6)  # type: ignore[attr-defined]
    w, x, y, z = message.q  # type: ignore[attr-defined]
    assert math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(0.4)
    assert math.asin(2 * (w * y - z * x)) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"roll_rad": math.nan}, "roll of nan"),
        ({"roll_rad": 0.0, "pitch_rad": math.inf}, "pitch of inf"),
        ({"roll_rad": 0.0, "pitch_rad": 0.0, "thrust": 1.2}, "thrust of 1.2"),
    ],
)
def test_attitudes_that_are_none_are_refused(values, words):
    with pytest.raises(PlanError, match=words):
        AttitudeSetpoint(**values)


# with a vehicle


def test_pointing_speaks_gimbal_protocol(flown):
    async def mission(vehicle, autopilot):
        received, parser, receive = [], FrameParser(), autopilot.receive

        def tap(data):
            received.extend(decode(frame) for frame in parser.feed(data))
            receive(data)

        autopilot.link.on_receive = tap
        vehicle.payload.take_gimbal_control()
        vehicle.payload.point_gimbal(pitch_rad=-0.5, yaw_rad=1.2)
        vehicle.payload.turn_gimbal(pitch_rate_rad_s=0.1, yaw_rate_rad_s=-0.2)
        vehicle.payload.point_gimbal_at(47.4, 8.5, 500.0)
        return received

    received = flown(mission)
    pointed = [m for m in received if m.get_type() == "GIMBAL_MANAGER_SET_PITCHYAW"]
    assert (pointed[0].pitch, pointed[0].yaw) == pytest.approx((-0.5, 1.2))
    assert pointed[0].flags == d.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    assert math.isnan(pointed[1].pitch)
    assert math.isnan(pointed[1].yaw)
    assert (pointed[1].pitch_rate, pointed[1].yaw_rate) == pytest.approx((0.1, -0.2))
    commands = [m for m in received if m.get_type() == "COMMAND_LONG"]
    assert commands[0].command == d.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
    assert commands[0].target_component == GIMBAL_COMPONENT
    assert (commands[0].param1, commands[0].param2) == (255.0, 190.0)
    roi = next(m for m in received if m.get_type() == "COMMAND_INT")
    assert (roi.command, roi.x) == (d.MAV_CMD_DO_SET_ROI_LOCATION, 474_000_000)


def test_wings_are_required_of_wings_only(flown):
    async def mission(vehicle, _autopilot):
        with pytest.raises(PlanError, match="for aircraft with wings; this is a multicopter"):
            _ = vehicle.wing

    flown(mission)
