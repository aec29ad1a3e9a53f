"""LANDING_TARGET: the place that a detector reports, by position in some frames or by angles."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs.landing_target import LandingTargetService
from flightsim.foundation.rotations import quaternion_from_euler
from tests.rotations import rotation_matrix
from tests.services.command_rig import ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import service_of

Array = NDArray[np.float64]
NOW_US = 60_000_000
POSITION = np.array([100.0, -40.0, -12.0])
CAMERA = Source(None, 1, 100)  # type: ignore[arg-type]
GIMBAL = Source(None, 1, 154)  # type: ignore[arg-type]
ELSEWHERE = Source(None, 42, 197)  # type: ignore[arg-type]


def attitude(roll: float, pitch: float, yaw: float) -> Array:
    q = np.zeros(4)
    quaternion_from_euler(roll, pitch, yaw, q)
    return q


class Track:
    """Notes what is taken: (time, local NED, sigma)."""

    def __init__(self) -> None:
        self.taken: list[tuple[int, Array, float]] = []

    def take(self, time_us: int, place: Array, *, sigma_m: float) -> bool:
        self.taken.append((time_us, place, sigma_m))
        return True


class Vehicle:
    """12 m up, tilted and turned, with the service that receives landing targets."""

    def __init__(self, flavour: str = "px4", q: Array | None = None) -> None:
        self.q = attitude(0.2, -0.15, 2.0) if q is None else q
        self.asked_us: list[int] = []
        rig = ServiceRig(flavour)
        assert rig.context.position_valid
        rig.context.nav[nav.HEIGHT_ABOVE_GROUND_M] = 12.0
        self.context, self.track = rig.context, Track()
        rig.context.surroundings.landing_target = self.track  # type: ignore[assignment]
        self.service = service_of(rig, LandingTargetService, navigation=self)

    def past_pose(self, time_us: int, now_us: int) -> tuple[Array, Array] | None:
        assert now_us == NOW_US
        self.asked_us.append(time_us)
        return POSITION, self.q

    def take(self, message: Any, source: Source = CAMERA) -> Any:
        deliver(message, source, NOW_US, self.service)
        return self.track.taken[-1] if self.track.taken else None

    def point(self, q: Array, *, in_earth: bool, age_us: int = 0, source: Source = GIMBAL) -> None:
        flags = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME if in_earth else 0
        time_ms = (NOW_US - age_us) // 1000
        deliver(
            dialect.MAVLink_gimbal_device_attitude_status_message(0, 0, time_ms, flags, q, 0.0, 0.0, 0.0, 0),
            source,
            NOW_US,
            self.service,
        )


def angles(x: float = 0.0, y: float = 0.0, distance: float = 0.0, stamp_us: int = 0) -> Any:
    return dialect.MAVLink_landing_target_message(stamp_us, 0, 8, x, y, distance, 0.0, 0.0)


def place(frame: int, *offset: float, valid: int = 1) -> Any:
    return dialect.MAVLink_landing_target_message(  # type: ignore[call-arg]
        0, 0, frame, 0.1, 0.1, 0.0, 0.0, 0.0, *offset, (1.0, 0.0, 0.0, 0.0), 0, valid
    )


OFFSET = (1.5, -2.5, 11.0)


@pytest.mark.parametrize(
    ("frame", "from_vehicle", "rotation"),
    [
        (dialect.MAV_FRAME_LOCAL_NED, False, np.eye(3)),
        (dialect.MAV_FRAME_BODY_FRD, True, rotation_matrix(attitude(0.2, -0.15, 2.0))),
        (dialect.MAV_FRAME_LOCAL_FRD, True, rotation_matrix(attitude(0.0, 0.0, 2.0))),
    ],
)
def test_positions_by_frame(frame: int, from_vehicle: bool, rotation: Array) -> None:
    """LOCAL_NED is a place; BODY_FRD and LOCAL_FRD are offsets, along the body and along the heading."""
    time_us, found, sigma_m = Vehicle().take(place(frame, *OFFSET))
    expected = rotation @ OFFSET + (POSITION if from_vehicle else 0.0)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert (time_us, sigma_m) == (NOW_US, 0.05)


@pytest.mark.parametrize(
    "frame", [dialect.MAV_FRAME_GLOBAL, dialect.MAV_FRAME_LOCAL_ENU, dialect.MAV_FRAME_BODY_NED]
)
def test_other_frames_are_refused(frame: int) -> None:
    vehicle = Vehicle()
    assert vehicle.take(place(frame, *OFFSET)) is None
    assert vehicle.service.refused == 1


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("value", "taken"), [(9.9e4, True), (-9.9e4, True), (1.1e5, False), (-1.1e5, False), (math.nan, False)]
)
def test_positions_out_of_range_are_refused(axis: int, value: float, taken: bool) -> None:
    offset = list(OFFSET)
    offset[axis] = value
    assert (Vehicle().take(place(dialect.MAV_FRAME_LOCAL_NED, *offset)) is not None) is taken


@pytest.mark.parametrize("distance", [0.0, 9.0, 199.0, 201.0, -1.0])
@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.2, -0.1), (-0.3, 0.25)])
def test_angles_of_a_camera_that_looks_down(x: float, y: float, distance: float) -> None:
    """x right, y down in the image, whose top is forward; the distance, or the height over the ground."""
    vehicle = Vehicle()
    _, found, sigma_m = vehicle.take(angles(x, y, distance), ELSEWHERE)
    line = rotation_matrix(vehicle.q) @ [-math.tan(y), math.tan(x), 1.0]
    line /= np.linalg.norm(line)
    length = distance if 0.0 < distance < 200.0 else 12.0 / line[2]
    np.testing.assert_allclose(found, POSITION + length * line, atol=1e-9)
    assert sigma_m == pytest.approx(0.05 + math.radians(1.0) * length)


@pytest.mark.parametrize("in_earth", [True, False])
def test_angles_of_the_camera_on_the_gimbal(in_earth: bool) -> None:
    """The gimbal's attitude is over north or over the heading; the optical axis is its x axis."""
    vehicle = Vehicle()
    gimbal = attitude(0.05, -1.1, 0.4)
    vehicle.point(gimbal, in_earth=in_earth)
    _, found, _ = vehicle.take(angles(0.1, 0.2, 20.0))
    line = rotation_matrix(gimbal) @ [1.0, math.tan(0.1), math.tan(0.2)]
    if not in_earth:
        line = rotation_matrix(attitude(0.0, 0.0, 2.0)) @ line
    np.testing.assert_allclose(found, POSITION + 20.0 * line / np.linalg.norm(line), atol=1e-9)


def test_the_gimbal_counts_for_its_own_camera_and_time() -> None:
    down = rotation_matrix(Vehicle().q)[:, 2]
    for source, ahead_us, of_system, uses in (
        (CAMERA, 0, 1, True),
        (CAMERA, 9_000, 1, True),
        (CAMERA, 11_000, 1, False),  # more than half a second apart
        (ELSEWHERE, 0, 1, False),
        (CAMERA, 0, 2, False),
    ):
        vehicle = Vehicle()
        gimbal = GIMBAL._replace(system_id=of_system)
        vehicle.point(attitude(0.0, -1.3, 0.0), in_earth=True, age_us=490_000, source=gimbal)
        _, found, _ = vehicle.take(angles(distance=10.0, stamp_us=NOW_US + ahead_us), source)
        by_body = np.allclose(found, POSITION + 10.0 * down)
        assert by_body is not uses, (source, ahead_us, of_system)


def test_the_nearest_report_of_the_gimbal_is_used() -> None:
    vehicle = Vehicle()
    attitudes = {300_000: -0.9, 200_000: -1.0, 100_000: -1.1}
    for age_us, pitch in attitudes.items():
        vehicle.point(attitude(0.0, pitch, 0.0), in_earth=True, age_us=age_us)
    _, found, _ = vehicle.take(angles(distance=10.0, stamp_us=NOW_US - 190_000))
    np.testing.assert_allclose(
        found, POSITION + 10.0 * np.array([math.cos(1.0), 0.0, math.sin(1.0)]), atol=1e-9
    )


@pytest.mark.parametrize("q", [np.zeros(4), np.full(4, math.nan), np.array([1.1, 0.0, 0.0, 0.0])])
def test_an_impossible_attitude_of_the_gimbal_is_not_used(q: Array) -> None:
    vehicle = Vehicle()
    vehicle.point(q, in_earth=True)
    _, found, _ = vehicle.take(angles(distance=10.0))
    np.testing.assert_allclose(found, POSITION + 10.0 * rotation_matrix(vehicle.q)[:, 2], atol=1e-9)


@pytest.mark.parametrize(
    ("x", "y", "taken"),
    [
        (1.29, 0.0, True),
        (1.31, 0.0, False),
        (-1.31, 0.0, False),
        (0.0, 1.31, False),
        (0.0, -1.31, False),
        (math.nan, 0.0, False),
    ],
)
def test_angles_far_off_the_axis_are_refused(x: float, y: float, taken: bool) -> None:
    vehicle = Vehicle(q=attitude(0.0, 0.0, 0.5))
    assert (vehicle.take(angles(x, y, 10.0), ELSEWHERE) is not None) is taken


@pytest.mark.parametrize(("pitch", "taken"), [(-0.25, True), (-0.15, False), (0.5, False)])
def test_a_line_of_sight_near_the_horizon_is_refused(pitch: float, taken: bool) -> None:
    """Its downward part is below 0.2: the place on the ground would be anywhere."""
    vehicle = Vehicle()
    vehicle.point(attitude(0.0, pitch, 1.0), in_earth=True)
    assert (vehicle.take(angles(distance=10.0)) is not None) is taken


@pytest.mark.parametrize(
    ("height_m", "home_m", "taken"),
    [(12.0, 5.0, 12.0), (math.nan, 5.0, 5.0), (0.0, 5.0, None), (-3.0, 5.0, None), (250.0, 5.0, None)],
)
def test_without_a_distance_the_height_is_used(height_m: float, home_m: float, taken: float | None) -> None:
    vehicle = Vehicle(q=attitude(0.0, 0.0, 0.5))
    vehicle.context.nav[nav.HEIGHT_ABOVE_GROUND_M] = height_m
    vehicle.context.home_ned_m[2] = 0.0
    vehicle.context.nav[nav.POS + 2] = -home_m
    found = vehicle.take(angles(), ELSEWHERE)
    if taken is None:
        assert found is None
        assert vehicle.service.refused == 1
    else:
        np.testing.assert_allclose(found[1], POSITION + [0.0, 0.0, taken] * np.ones(3), atol=1e-9)


def test_the_pose_is_that_of_the_measurement() -> None:
    vehicle = Vehicle()
    assert vehicle.take(angles(distance=10.0, stamp_us=NOW_US - 120_000))[0] == NOW_US - 120_000
    assert vehicle.take(angles(distance=10.0, stamp_us=5))[0] == NOW_US  # of another clock
    assert vehicle.asked_us == [NOW_US - 120_000, NOW_US]


def test_without_a_position_nothing_is_taken() -> None:
    vehicle = Vehicle()
    vehicle.context.health.position_horizontal_absolute = False
    vehicle.context.health.position_horizontal_relative = False
    assert vehicle.take(place(dialect.MAV_FRAME_LOCAL_NED, *OFFSET)) is None
    assert vehicle.service.refused == 1
