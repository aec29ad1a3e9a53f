"""Payload components on the wire: gimbal protocol v2, camera protocol, detections, field readings."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.payload import (
    CAMERA_COMPONENT,
    GIMBAL_COMPONENT,
    SURVEY_MAGNETOMETER_COMPONENT,
    PayloadStation,
)
from flightsim import truth as t
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.home import Home
from flightsim.payload import (
    CameraParameters,
    Carrier,
    GimbalParameters,
    GroundTargetParameters,
    GroundTargets,
    MagneticField,
    MagneticMap,
    Payload,
    PayloadParameters,
    Static,
    SurveyMagnetometerParameters,
)
from tests.rotations import pitch_rad, yaw_rad

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
STEP_US = 4000
SYSTEM = 7


class World:
    """A vehicle standing still in the air, 100 m over home, with everything on board."""

    def __init__(self, *, heading_rad: float = 0.0, target_ne_m=(0.0, 100.0)) -> None:
        truth = np.zeros(t.TRUTH_SIZE)
        truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(HOME.lat_deg), math.radians(HOME.lon_deg)
        truth[t.ALT_M] = HOME.alt_m + 100.0
        truth[t.HEIGHT_ABOVE_GROUND_M] = 100.0
        truth[t.MAG_NED_GAUSS] = (0.21, 0.01, 0.43)
        quaternion_from_euler(0.0, 0.0, heading_rad, truth[t.Q_NED_FROM_FRD])
        lines = np.linspace(-500.0, 500.0, 11)
        survey = MagneticMap(
            north_m=lines, east_m=lines, total_field_nt=np.full((11, 11), 48_000.0), height_m=100.0, home=HOME
        )
        self.targets = GroundTargets(
            [GroundTargetParameters(motion=Static(north_m=target_ne_m[0], east_m=target_ne_m[1]), tag_id=3)],
            seeds=lambda i: np.random.SeedSequence([9, i]),
        )
        self.payload = Payload(
            PayloadParameters(
                gimbal=GimbalParameters(),
                camera=CameraParameters(false_detections_per_frame=0.0),
                magnetometer=SurveyMagnetometerParameters(),
            ),
            Carrier(
                truth=truth,
                home=HOME,
                physics_rate_hz=250,
                seeds=lambda name: np.random.SeedSequence([1, *name.encode()]),
                targets=self.targets,
                magnetic_field=MagneticField(survey),
            ),
        )
        self._parser = FrameParser()
        self.frames = []
        self.station = PayloadStation(self.payload, system_id=SYSTEM, send=self._take)
        self.time_us = 0
        self._clients: dict[tuple[int, int], FrameEncoder] = {}

    def _take(self, data: bytes) -> None:
        self.frames += self._parser.feed(data)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6) // STEP_US):
            self.time_us += STEP_US
            self.targets.step(self.time_us)
            self.station.step(self.time_us)

    def deliver(self, message, sender=(255, 190)) -> None:
        encoder = self._clients.setdefault(sender, FrameEncoder(*sender))
        self.station.receive(encoder.encode(message))

    def command(self, component: int, command: int, *values: float, sender=(255, 190)) -> int | None:
        before = len(self.frames)
        params = (*values, *(0.0,) * (7 - len(values)))
        self.deliver(dialect.MAVLink_command_long_message(SYSTEM, component, command, 0, *params), sender)
        acks = [decode(f) for f in self.frames[before:] if f.message_id == dialect.MAVLINK_MSG_ID_COMMAND_ACK]
        assert len(acks) <= 1
        if not acks:
            return None
        assert acks[0].command == command  # type: ignore[attr-defined]
        assert (acks[0].target_system, acks[0].target_component) == sender  # type: ignore[attr-defined]
        return acks[0].result  # type: ignore[attr-defined]

    def messages(self, message_id: int, component: int | None = None) -> list:
        return [
            decode(f)
            for f in self.frames
            if f.message_id == message_id and component in (None, f.component_id)
        ]

    def request(self, component: int, message_id: int):
        assert (
            self.command(component, dialect.MAV_CMD_REQUEST_MESSAGE, message_id)
            == dialect.MAV_RESULT_ACCEPTED
        )
        return self.messages(message_id, component)[-1]


@pytest.fixture
def world() -> World:
    return World()


def pointing(world: World) -> SimpleNamespace:
    """Pitch, yaw (deg) by the newest attitude status, and what its yaw refers to."""
    status = world.messages(dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS)[-1]
    return SimpleNamespace(
        pitch=math.degrees(pitch_rad(status.q)),
        yaw=math.degrees(yaw_rad(status.q)),
        in_earth=bool(status.flags & dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME),
        delta=math.degrees(status.delta_yaw),
    )


def test_heartbeats_streams_and_ids(world):
    world.run(10.0)
    kinds = {(f.system_id, f.component_id) for f in world.frames}
    assert kinds == {
        (SYSTEM, CAMERA_COMPONENT),
        (SYSTEM, GIMBAL_COMPONENT),
        (SYSTEM, SURVEY_MAGNETOMETER_COMPONENT),
    }
    for component, mav_type in [
        (CAMERA_COMPONENT, dialect.MAV_TYPE_CAMERA),
        (GIMBAL_COMPONENT, dialect.MAV_TYPE_GIMBAL),
        (SURVEY_MAGNETOMETER_COMPONENT, dialect.MAV_TYPE_ONBOARD_CONTROLLER),
    ]:
        beats = world.messages(dialect.MAVLINK_MSG_ID_HEARTBEAT, component)
        assert len(beats) == 10
        assert {(b.type, b.autopilot) for b in beats} == {(mav_type, dialect.MAV_AUTOPILOT_INVALID)}
    assert len(world.messages(dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS)) == pytest.approx(
        91, abs=1
    )


def test_field_readings_are_named_values(world):
    world.run(5.0)
    readings = world.messages(dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT, SURVEY_MAGNETOMETER_COMPONENT)
    assert len(readings) == 50
    assert {r.name for r in readings} == {"MAG_NT"}
    assert np.mean([r.value for r in readings]) == pytest.approx(48_000.0, abs=2.0)
    assert readings[10].time_boot_ms - readings[0].time_boot_ms == 1000


def test_gimbal_points_and_camera_tells_where_the_target_is(world):
    assert (
        world.command(
            GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -45.0, 90.0, math.nan, math.nan
        )
        == dialect.MAV_RESULT_ACCEPTED
    )
    world.run(4.0)
    look = pointing(world)
    assert (look.pitch, look.yaw) == pytest.approx((-45.0, 90.0), abs=1.0)
    detections = world.messages(dialect.MAVLINK_MSG_ID_LANDING_TARGET, CAMERA_COMPONENT)
    assert len(detections) > 15
    newest = detections[-1]
    assert newest.target_num == 3
    assert newest.position_valid == 0
    assert (newest.angle_x, newest.angle_y) == pytest.approx((0.0, 0.0), abs=math.radians(3.0))


def test_locked_yaw_is_from_north_and_followed_yaw_from_the_nose():
    world = World(heading_rad=math.radians(60.0))
    flags = dialect.GIMBAL_MANAGER_FLAGS_YAW_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK
    world.deliver(
        dialect.MAVLink_gimbal_manager_set_pitchyaw_message(
            SYSTEM, GIMBAL_COMPONENT, flags, 0, math.radians(-20.0), math.radians(100.0), math.nan, math.nan
        )
    )
    world.run(3.0)
    look = pointing(world)
    assert look.in_earth
    assert (look.pitch, look.yaw) == pytest.approx((-20.0, 100.0), abs=4.0)
    assert look.delta == pytest.approx(60.0, abs=4.0)
    world.deliver(
        dialect.MAVLink_gimbal_manager_set_pitchyaw_message(
            SYSTEM,
            GIMBAL_COMPONENT,
            dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK,
            0,
            0.0,
            math.radians(30.0),
            0.0,
            0.0,
        )
    )
    world.run(3.0)
    look = pointing(world)
    assert not look.in_earth
    assert (look.pitch, look.yaw) == pytest.approx((0.0, 30.0), abs=1.0)


def test_rates_turn_the_gimbal(world):
    world.run(2.0)
    world.deliver(
        dialect.MAVLink_gimbal_manager_set_pitchyaw_message(
            SYSTEM, GIMBAL_COMPONENT, 0, 0, math.nan, math.nan, 0.0, math.radians(10.0)
        )
    )
    world.run(4.0)
    assert pointing(world).yaw == pytest.approx(40.0, abs=2.0)


def test_sticks_steer_the_gimbal_by_what_they_give(world):
    world.run(2.0)
    steer = dialect.MAVLink_gimbal_manager_set_manual_control_message
    unset = math.nan
    world.deliver(steer(SYSTEM, GIMBAL_COMPONENT, 0, 0, -0.5, unset, unset, unset))
    world.run(3.0)
    look = pointing(world)
    assert (look.pitch, look.yaw) == pytest.approx((-45.0, 0.0), abs=1.0)
    world.deliver(steer(SYSTEM, GIMBAL_COMPONENT, 0, 0, unset, unset, unset, 0.25))
    world.run(2.0)
    assert pointing(world).yaw == pytest.approx(30.0, abs=2.0)


def test_who_has_control_points_and_others_do_not(world):
    world.run(2.0)
    configure = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
    assert world.command(GIMBAL_COMPONENT, configure, 255, 190, -1, -1) == dialect.MAV_RESULT_ACCEPTED
    other = (1, 191)
    pitchyaw = dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
    assert world.command(GIMBAL_COMPONENT, pitchyaw, -60.0, sender=other) == dialect.MAV_RESULT_DENIED
    world.deliver(
        dialect.MAVLink_gimbal_manager_set_pitchyaw_message(
            SYSTEM, GIMBAL_COMPONENT, 0, 0, -1.0, 0.0, 0.0, 0.0
        ),
        sender=other,
    )
    world.run(2.0)
    assert pointing(world).pitch == pytest.approx(0.0, abs=1.0)
    status = world.messages(dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS)[-1]
    assert (status.primary_control_sysid, status.primary_control_compid) == (255, 190)
    assert (
        world.command(GIMBAL_COMPONENT, configure, -2, -2, -1, -1, sender=other)
        == dialect.MAV_RESULT_ACCEPTED
    )
    assert world.command(GIMBAL_COMPONENT, pitchyaw, -30.0, sender=other) == dialect.MAV_RESULT_ACCEPTED
    assert world.command(GIMBAL_COMPONENT, pitchyaw, -10.0) == dialect.MAV_RESULT_DENIED
    assert (
        world.command(GIMBAL_COMPONENT, configure, -3, -3, -1, -1) == dialect.MAV_RESULT_ACCEPTED
    )  # not its own
    assert world.command(GIMBAL_COMPONENT, pitchyaw, -10.0) == dialect.MAV_RESULT_DENIED
    assert (
        world.command(GIMBAL_COMPONENT, configure, -3, -3, -1, -1, sender=other)
        == dialect.MAV_RESULT_ACCEPTED
    )
    assert world.command(GIMBAL_COMPONENT, pitchyaw, -10.0) == dialect.MAV_RESULT_ACCEPTED


def test_region_of_interest_is_looked_at(world):
    roi = dialect.MAVLink_command_int_message(
        SYSTEM, GIMBAL_COMPONENT,
        dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, dialect.MAV_CMD_DO_SET_ROI_LOCATION, 0, 0,
        0.0, 0.0, 0.0, 0.0, round((HOME.lat_deg + 100.0 / 111_180.0) * 1e7), round(HOME.lon_deg * 1e7), 0.0,
    )  # fmt: skip
    world.run(1.0)
    world.deliver(roi)
    acks = world.messages(dialect.MAVLINK_MSG_ID_COMMAND_ACK)
    assert acks[-1].result == dialect.MAV_RESULT_TEMPORARILY_REJECTED  # it doesn't know where it is
    position = dialect.MAVLink_global_position_int_message(
        0, round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7), 580_000, 100_000, 0, 0, 0, 0
    )
    world.deliver(position, sender=(SYSTEM, 1))
    world.deliver(roi)
    world.run(3.0)
    look = pointing(world)
    assert (look.pitch, look.yaw) == pytest.approx((-45.0, 0.0), abs=4.0)
    assert world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_SET_ROI_NONE) == dialect.MAV_RESULT_ACCEPTED
    world.run(2.0)
    assert pointing(world).pitch == pytest.approx(0.0, abs=1.0)


def test_informations_tell_the_devices(world):
    manager = world.request(GIMBAL_COMPONENT, dialect.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION)
    limits = GimbalParameters()
    assert (manager.pitch_min, manager.pitch_max) == pytest.approx(
        (limits.pitch_min_rad, limits.pitch_max_rad)
    )
    assert manager.gimbal_device_id == GIMBAL_COMPONENT
    world.request(GIMBAL_COMPONENT, dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION)
    camera = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION)
    fov = 2.0 * math.atan(0.5 * camera.sensor_size_h / camera.focal_length)
    assert fov == pytest.approx(CameraParameters().model.horizontal_fov_rad)
    assert (camera.resolution_h, camera.resolution_v) == (1280, 720)
    assert camera.gimbal_device_id == GIMBAL_COMPONENT
    for message_id in (
        dialect.MAVLINK_MSG_ID_CAMERA_SETTINGS,
        dialect.MAVLINK_MSG_ID_STORAGE_INFORMATION,
        dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS,
    ):
        world.request(CAMERA_COMPONENT, message_id)


def test_photos_are_counted(world):
    start = dialect.MAV_CMD_IMAGE_START_CAPTURE
    assert world.command(CAMERA_COMPONENT, start, 0, 0, 1) == dialect.MAV_RESULT_ACCEPTED
    world.run(0.1)
    assert world.command(CAMERA_COMPONENT, start, 0, 0.5, 0) == dialect.MAV_RESULT_ACCEPTED
    world.run(1.9)
    assert world.command(CAMERA_COMPONENT, dialect.MAV_CMD_IMAGE_STOP_CAPTURE) == dialect.MAV_RESULT_ACCEPTED
    world.run(2.0)
    captured = world.messages(dialect.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED)
    assert [c.image_index for c in captured] == list(range(5))
    assert world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS).image_count == 5
    assert world.command(CAMERA_COMPONENT, start, 0, 0.0, 0) == dialect.MAV_RESULT_DENIED
    assert world.command(CAMERA_COMPONENT, start, 0, math.nan, 3) == dialect.MAV_RESULT_DENIED


def test_intervals_can_be_set_and_read(world):
    attitude = dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS
    world.run(2.0)
    assert world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, attitude, 40_000) == 0
    before = len(world.messages(attitude))
    world.run(2.0)
    assert len(world.messages(attitude)) - before == pytest.approx(50, abs=1)
    assert world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_GET_MESSAGE_INTERVAL, attitude) == 0
    assert world.messages(dialect.MAVLINK_MSG_ID_MESSAGE_INTERVAL)[-1].interval_us == 40_000
    assert world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, attitude, -1) == 0
    before = len(world.messages(attitude))
    world.run(2.0)
    assert len(world.messages(attitude)) == before
    unknown = world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 30, 40_000)
    assert unknown == dialect.MAV_RESULT_UNSUPPORTED


def test_a_listener_may_answer_a_stream_at_once():
    """On a memory link the answer arrives while the streams of this step are still being sent."""
    world = World()
    attitude = dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS
    take = world._take

    def answer(data: bytes) -> None:
        take(data)
        newest = world.frames[-1]
        if newest.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT and newest.component_id == GIMBAL_COMPONENT:
            world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, attitude, -1)

    world.station = PayloadStation(world.payload, system_id=SYSTEM, send=answer)
    world.run(3.0)
    assert len(world.messages(attitude)) == 0
    assert len(world.messages(dialect.MAVLINK_MSG_ID_HEARTBEAT, GIMBAL_COMPONENT)) == 3


def test_commands_for_others_and_to_all(world):
    assert world.command(GIMBAL_COMPONENT, 31999) == dialect.MAV_RESULT_UNSUPPORTED
    assert world.command(0, 31999) is None
    assert world.command(1, dialect.MAV_CMD_REQUEST_MESSAGE, 280) is None
    assert world.command(0, dialect.MAV_CMD_REQUEST_MESSAGE, 280) == dialect.MAV_RESULT_ACCEPTED


def test_garbage_is_dropped_and_counted(world):
    junk = np.random.default_rng(3).bytes(20_000)
    world.station.receive(junk)
    counters = world.station.parser.counters
    assert counters.bytes_junk + world.station.parser.pending_bytes >= 19_000
    world.run(1.5)
    assert world.messages(dialect.MAVLINK_MSG_ID_HEARTBEAT, GIMBAL_COMPONENT)


EXTREME = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e38, -1e38, 1e9, 2.0**31, 154.0, 285.0])
SHARED = World()


@settings(max_examples=300, deadline=None)
@given(
    component=st.sampled_from([0, CAMERA_COMPONENT, GIMBAL_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT]),
    command=st.sampled_from([511, 510, 512, 1000, 1001, 195, 197, 2000, 2001, 530, 526, 40_000]),
    values=st.lists(EXTREME, min_size=7, max_size=7),
    flags=st.integers(0, 2**16 - 1),
)
def test_extreme_values_never_raise(component, command, values, flags):
    world = SHARED
    world.deliver(dialect.MAVLink_command_long_message(SYSTEM, component, command, 0, *values))
    world.deliver(
        dialect.MAVLink_command_int_message(  # type: ignore[call-arg]
            SYSTEM, component, 6, command, 0, 0, *values[:4], 2**31 - 1, -(2**31), values[6]
        )
    )
    for kind in (
        dialect.MAVLink_gimbal_manager_set_pitchyaw_message,
        dialect.MAVLink_gimbal_manager_set_manual_control_message,
    ):
        world.deliver(kind(SYSTEM, GIMBAL_COMPONENT, flags, 0, *values[:4]))
    world.deliver(
        dialect.MAVLink_gimbal_manager_set_attitude_message(
            SYSTEM, GIMBAL_COMPONENT, flags, 0, values[:4], *values[4:7]
        )
    )
    world.run(0.04)
    world.frames.clear()
