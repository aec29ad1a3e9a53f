"""Messages that a vehicle takes in besides commands: frames, senders, geometry, and any other content."""

import math
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink.generator.mavcrc import x25crc

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.flight.obstacles import SECTORS, ObstacleMap
from autopilot_bridge.flight.target_motion import TargetMotion
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.navigation import layout as nav_layout
from autopilot_bridge.navigation.external import (
    POSITION_M,
    Q_LOCAL_FROM_FRD,
    VELOCITY_M_S,
    ExternalFrame,
    ExternalSample,
)
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs.external_odometry import ExternalOdometryService
from autopilot_bridge.services.inputs.landing_target import LandingTargetService
from autopilot_bridge.sitl import Sitl
from flightsim.airframe import AirframeKind
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import SensorReadings
from flightsim.world_spec import VehicleSpec, WorldSpec
from tests.rotations import rotation_matrix
from tests.services.dispatch import deliver

FLAVOURS = ("px4", "ardupilot")
_UNKNOWN = [math.nan] * 21
_CAMERA = Source(None, 1, 100)  # type: ignore[arg-type]
_ELSEWHERE = Source(None, 1, 197)  # type: ignore[arg-type]

TAKEN_IN = (
    dialect.MAVLINK_MSG_ID_ODOMETRY,
    dialect.MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE,
    dialect.MAVLINK_MSG_ID_VISION_SPEED_ESTIMATE,
    dialect.MAVLINK_MSG_ID_VICON_POSITION_ESTIMATE,
    dialect.MAVLINK_MSG_ID_GLOBAL_VISION_POSITION_ESTIMATE,
    dialect.MAVLINK_MSG_ID_ATT_POS_MOCAP,
    dialect.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN,
    dialect.MAVLINK_MSG_ID_FOLLOW_TARGET,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    dialect.MAVLINK_MSG_ID_LANDING_TARGET,
    dialect.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS,
    dialect.MAVLINK_MSG_ID_OBSTACLE_DISTANCE,
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR,
)
ALL_ON: dict[str, dict[str, float]] = {
    "px4": {"EKF2_EV_CTRL": 15, "CP_DIST": 2.0},
    "ardupilot": {
        "VISO_TYPE": 1,
        "EK3_SRC1_POSXY": 6,
        "EK3_SRC1_YAW": 6,
        "FOLL_ENABLE": 1,
        "PLND_ENABLED": 1,
        "PLND_TYPE": 1,
        "PRX1_TYPE": 2,
    },
}


class _Filter:
    """Notes what would be fused."""

    def __init__(self) -> None:
        self.samples: list[ExternalSample] = []

    def take_external(self, sample: ExternalSample) -> None:
        self.samples.append(sample)


def odometry_service(flavour: str, parameters: dict[str, float]) -> tuple[ExternalOdometryService, _Filter]:
    autopilot = Autopilot(
        get_flavour(flavour, AirframeKind.MULTICOPTER),
        system_id=1,
        readings=SensorReadings(),
        physics_rate_hz=250,
        parameters=parameters,
    )
    service = next(more for more in autopilot._services if isinstance(more, ExternalOdometryService))
    noted = _Filter()
    service._navigation = noted  # type: ignore[assignment]
    return service, noted


def odometry(frame: int, child: int, *, q: tuple[float, ...], stamp_us: int = 0) -> Any:
    return dialect.MAVLink_odometry_message(
        stamp_us, frame, child, 1.0, 2.0, 3.0, q, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, _UNKNOWN, _UNKNOWN, 7, 0, 80
    )


def _euler(roll: float, pitch: float, yaw: float) -> Any:
    q = np.zeros(4)
    quaternion_from_euler(roll, pitch, yaw, q)
    return q


@pytest.mark.parametrize(
    ("frame", "kind", "position"),
    [
        (dialect.MAV_FRAME_LOCAL_NED, ExternalFrame.NED, (1.0, 2.0, 3.0)),
        (dialect.MAV_FRAME_LOCAL_ENU, ExternalFrame.NED, (2.0, 1.0, -3.0)),
        (dialect.MAV_FRAME_LOCAL_FRD, ExternalFrame.LOCAL_FRD, (1.0, 2.0, 3.0)),
        (dialect.MAV_FRAME_LOCAL_FLU, ExternalFrame.LOCAL_FRD, (1.0, -2.0, -3.0)),
    ],
)
def test_px4_takes_four_frames(frame: int, kind: ExternalFrame, position: tuple[float, ...]) -> None:
    service, noted = odometry_service("px4", {})
    message = odometry(frame, dialect.MAV_FRAME_BODY_FRD, q=(1.0, 0.0, 0.0, 0.0), stamp_us=900_000)
    assert deliver(message, _ELSEWHERE, 1_000_000, service)
    (sample,) = noted.samples
    assert sample.frame is kind and tuple(sample.values[POSITION_M]) == position
    assert sample.velocity_frame is ExternalFrame.BODY_FRD and tuple(sample.values[VELOCITY_M_S]) == (4, 5, 6)
    assert (sample.time_us, sample.reset_counter, sample.quality) == (900_000, 7, 80)
    assert math.isnan(sample.position_variance_m2[0])


def test_an_attitude_in_ros_axes_is_the_same_attitude() -> None:
    """East-north-up from forward-left-up: heading 30 degrees east of north is 60 degrees from east."""
    service, noted = odometry_service("px4", {})
    q = _euler(0.1, -0.2, math.radians(60.0))
    deliver(
        odometry(dialect.MAV_FRAME_LOCAL_ENU, dialect.MAV_FRAME_BODY_FRD, q=tuple(q)), _ELSEWHERE, 0, service
    )
    wanted = _euler(0.1, 0.2, math.radians(30.0))
    found = noted.samples[0].values[Q_LOCAL_FROM_FRD]
    np.testing.assert_allclose(
        math.copysign(1.0, float(found @ wanted)) * np.asarray(found), wanted, atol=1e-9
    )


def test_ardupilot_takes_one_frame_and_only_with_viso_type() -> None:
    taken = odometry(dialect.MAV_FRAME_LOCAL_FRD, dialect.MAV_FRAME_BODY_FRD, q=(1.0, 0.0, 0.0, 0.0))
    off, noted = odometry_service("ardupilot", {})
    assert deliver(taken, _ELSEWHERE, 0, off) and not noted.samples
    on, noted = odometry_service("ardupilot", {"VISO_TYPE": 1})
    for frame in (dialect.MAV_FRAME_LOCAL_NED, dialect.MAV_FRAME_LOCAL_ENU, 99):
        deliver(odometry(frame, dialect.MAV_FRAME_BODY_FRD, q=(1.0, 0.0, 0.0, 0.0)), _ELSEWHERE, 0, on)
    assert not noted.samples and on.wrong_frames == 3
    deliver(taken, _ELSEWHERE, 0, on)
    assert noted.samples[0].frame is ExternalFrame.NED
    external, noted = odometry_service("ardupilot", {"VISO_TYPE": 1, "EK3_SRC1_YAW": 6})
    deliver(taken, _ELSEWHERE, 0, external)
    assert noted.samples[0].frame is ExternalFrame.LOCAL_FRD


def test_the_telemetry_of_another_vehicle_is_not_odometry_of_this_one() -> None:
    service, noted = odometry_service("px4", {})
    message = odometry(dialect.MAV_FRAME_LOCAL_FRD, dialect.MAV_FRAME_BODY_FRD, q=(1.0, 0.0, 0.0, 0.0))
    assert deliver(message, Source(None, 2, 1), 0, service) and not noted.samples  # type: ignore[arg-type]


def test_a_time_stamp_of_another_clock_is_not_used() -> None:
    service, noted = odometry_service("px4", {})
    for stamp in (0, 1_700_000_000_000_000, 4_400_000, 5_100_000):
        message = odometry(
            dialect.MAV_FRAME_LOCAL_FRD, dialect.MAV_FRAME_BODY_FRD, q=(1, 0, 0, 0), stamp_us=stamp
        )
        deliver(message, _ELSEWHERE, 5_000_000, service)
    assert [sample.time_us for sample in noted.samples] == [5_000_000] * 4


# whatever may be in them


@pytest.fixture(scope="module", params=FLAVOURS)
def vehicle(request: pytest.FixtureRequest) -> Iterator[Any]:
    """On the ground with everything switched on, and its link."""
    parameters = ALL_ON[request.param]
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=request.param, parameters=parameters),)))
    for _ in range(1500):
        sitl.advance()
    yield sitl, sitl.connect(0)
    sitl.close()


_EXTREMES = st.sampled_from((math.nan, math.inf, -math.inf, 1e38, -1e38, 1e-40, 0.0, 1.0, -1.0))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    message_id=st.sampled_from(TAKEN_IN),
    payload=st.binary(min_size=0, max_size=255),
    floats=st.lists(_EXTREMES, max_size=40),
    sender=st.sampled_from(((255, 190), (1, 100), (1, 154), (1, 197), (2, 1))),
)
def test_no_content_upsets_the_vehicle(
    vehicle: Any, message_id: int, payload: bytes, floats: list[float], sender: tuple[int, int]
) -> None:
    sitl, link = vehicle
    size = dialect.mavlink_map[message_id].unpacker.size
    raw = (payload + b"".join(struct.pack("<f", value) for value in floats)).ljust(size, b"\0")[:size]
    link.send(on_the_wire(message_id, raw, sender))
    for _ in range(10):
        sitl.advance()
    state = sitl.vehicles[0].autopilot.navigation.state
    assert np.isfinite(state[:28]).all()


def on_the_wire(message_id: int, payload: bytes, sender: tuple[int, int]) -> bytes:
    """A MAVLink 2 frame of any payload."""
    head = struct.pack("<BBBBBB", len(payload), 0, 0, 0, *sender) + message_id.to_bytes(3, "little")
    crc = x25crc(head + payload)
    crc.accumulate(bytes((dialect.mavlink_map[message_id].crc_extra,)))
    return b"\xfd" + head + payload + struct.pack("<H", crc.crc)


def test_what_is_fuzzed_is_understood() -> None:
    message = odometry(dialect.MAV_FRAME_LOCAL_FRD, dialect.MAV_FRAME_BODY_FRD, q=(1.0, 0.0, 0.0, 0.0))
    (frame,) = FrameParser().feed(FrameEncoder(255, 190).encode(message))
    size = dialect.mavlink_map[message.get_msgId()].unpacker.size
    wire = on_the_wire(message.get_msgId(), bytes(frame.payload).ljust(size, b"\0"), (255, 190))
    (parsed,) = FrameParser().feed(wire)
    assert decode(parsed).get_type() == "ODOMETRY" and decode(parsed).vz == 6.0  # type: ignore[attr-defined]


# lines of sight


class _Pose:
    """A vehicle at 10 m with an attitude."""

    def __init__(self, q: Any) -> None:
        self._q = q

    def past_pose(self, measured_us: int, time_us: int) -> Any:
        return np.array((100.0, 50.0, -10.0)), self._q


@pytest.mark.parametrize("by_gimbal", [False, True])
@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.2, -0.15, 2.0)])
def test_angles_point_at_the_target(attitude: tuple[float, ...], by_gimbal: bool) -> None:
    """A target 2 m north and 1 m east of the place below, seen by a camera fixed or on a gimbal."""
    q = _euler(*attitude)
    autopilot = Autopilot(
        get_flavour("px4", AirframeKind.MULTICOPTER),
        system_id=1,
        readings=SensorReadings(),
        physics_rate_hz=250,
    )
    service = next(more for more in autopilot._services if isinstance(more, LandingTargetService))
    service._navigation = _Pose(q)  # type: ignore[assignment]
    autopilot.context.health = type("Sound", (), {"position_horizontal_relative": True})()  # type: ignore[assignment]
    autopilot.context.nav[nav_layout.HEIGHT_ABOVE_GROUND_M] = 10.0
    line = np.array((2.0, 1.0, 10.0))
    if by_gimbal:  # stabilised, looking straight down, turning with the vehicle
        gimbal_q = _euler(0.0, -0.5 * math.pi, 0.0)
        status = dialect.MAVLink_gimbal_device_attitude_status_message(
            0, 0, 1000, 0, gimbal_q, 0.0, 0.0, 0.0, 0
        )
        deliver(status, Source(None, 1, 154), 1_000_000, service)  # type: ignore[arg-type]
        heading = _euler(0.0, 0.0, attitude[2])
        seen = rotation_matrix(gimbal_q).T @ rotation_matrix(heading).T @ line
        right, down = seen[1] / seen[0], seen[2] / seen[0]
    else:
        seen = rotation_matrix(q).T @ line
        right, down = seen[1] / seen[2], -seen[0] / seen[2]
    message = dialect.MAVLink_landing_target_message(
        1_000_000, 0, dialect.MAV_FRAME_BODY_FRD, math.atan(right), math.atan(down), 0.0, 0.0, 0.0
    )
    assert deliver(message, _CAMERA if by_gimbal else _ELSEWHERE, 1_000_000, service)
    track = autopilot.context.surroundings.landing_target
    assert track.place(1_000_000) == pytest.approx((102.0, 51.0), abs=1e-6)


# the circle of obstacles


@settings(deadline=None)
@given(
    first=st.floats(-6.0, 6.0),
    direction=st.floats(-6.0, 6.0),
    room=st.floats(0.0, 100.0),
    delay=st.floats(0.0, 3.0),
    deceleration=st.floats(0.5, 10.0),
)
def test_a_speed_limit_stops_before_the_margin(
    first: float, direction: float, room: float, delay: float, deceleration: float
) -> None:
    circle = ObstacleMap()
    circle.take(first, math.radians(5.0), room + 2.0, 1)
    limit = circle.speed_limit(
        direction,
        1,
        margin_m=2.0,
        acceleration_m_s2=deceleration,
        delay_s=delay,
        guard_rad=math.radians(30.0),
        timeout_us=500_000,
    )
    off = abs(math.remainder(first - direction, math.tau))
    if off > math.radians(36.0):
        assert limit == math.inf
    elif off < math.radians(24.0):
        stop_m = limit * delay + limit * limit / (2.0 * deceleration)
        assert stop_m * math.cos(math.radians(30.0)) <= room + 1e-6
        assert stop_m >= room * (1.0 - 1e-9) - 1e-6


def test_old_and_absent_sectors_limit_nothing() -> None:
    circle = ObstacleMap()
    requested: Any = {
        "margin_m": 1.0,
        "acceleration_m_s2": 2.0,
        "delay_s": 0.0,
        "guard_rad": 0.5,
        "timeout_us": 500_000,
    }
    assert circle.speed_limit(0.0, 10, **requested) == math.inf and not circle.known(
        0.0, 10, timeout_us=500_000
    )
    circle.take(0.0, 0.1, 1.0, 10)
    assert circle.speed_limit(0.0, 10, **requested) == 0.0 and circle.known(0.0, 10, timeout_us=500_000)
    assert circle.speed_limit(0.0, 600_000, **requested) == math.inf
    circle.take(0.0, math.tau, math.inf, 700_000)
    assert circle.speed_limit(0.0, 700_000, **requested) == math.inf
    assert int((circle.measured_us == 700_000).sum()) == SECTORS


# a target's motion


def test_motion_is_bridged_over_gaps_and_jumps_are_refused() -> None:
    motion = TargetMotion()
    for k in range(10):
        position = np.array((3.0 * k, -1.0 * k, 0.0))
        assert motion.take(k * 1_000_000, position, None, sigma_m=1.0)
    known = motion.at(11_000_000)
    assert known is not None
    assert known[0] == pytest.approx((33.0, -11.0, 0.0), abs=2.0)
    assert known[1] == pytest.approx((3.0, -1.0, 0.0), abs=0.5)
    assert motion.course_rad == pytest.approx(math.atan2(-1.0, 3.0), abs=0.2)
    elsewhere = np.array((500.0, 0.0, 0.0))
    assert not motion.take(10_000_000, elsewhere, None, sigma_m=1.0)
    assert not motion.take(10_100_000, elsewhere, None, sigma_m=1.0)
    assert motion.take(10_200_000, elsewhere, None, sigma_m=1.0)  # it is there
    known = motion.at(10_200_000)
    assert known is not None and known[0][0] == pytest.approx(500.0)
    assert not motion.take(9_000_000, elsewhere, None, sigma_m=1.0)  # late
    assert motion.age_s(12_200_000) == pytest.approx(2.0)
