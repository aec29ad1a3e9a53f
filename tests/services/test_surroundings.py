"""What a vehicle receives about its surroundings: the target to follow, obstacles, external odometry."""

import math
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.flight.obstacles import SECTORS
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.navigation.external import (
    POSITION_M,
    Q_LOCAL_FROM_FRD,
    VELOCITY_M_S,
    ExternalFrame,
    ExternalSample,
)
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs.external_odometry import ExternalOdometryService
from autopilot_bridge.services.inputs.follow import FollowService
from autopilot_bridge.services.inputs.obstacles import ObstacleService
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.commander.rig import ORIGIN
from tests.services.command_rig import ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import service_of

NOW_US = 60_000_000
OTHER = Source(None, 7, 1)  # type: ignore[arg-type]  # the autopilot of another vehicle
ONBOARD = Source(None, 1, 197)  # type: ignore[arg-type]
POSITION, VELOCITY = 1, 2  # FOLLOW_TARGET.est_capabilities

# the target to follow


class Follower:
    """A vehicle with the service that receives the target."""

    def __init__(self, flavour: str = "ardupilot", **parameters: float) -> None:
        enabled = {"FOLL_ENABLE": 1} if flavour == "ardupilot" else {}
        self.rig = ServiceRig(flavour, **{**enabled, **parameters})
        self.leader = self.rig.context.surroundings.leader
        self.service = service_of(self.rig, FollowService)

    def take(self, message: Any, source: Source = OTHER, time_us: int = NOW_US) -> None:
        deliver(message, source, time_us, self.service)

    def state(self) -> tuple[Any, Any]:
        known = self.leader.at(NOW_US)
        assert known is not None
        return known

    def place(self, north_m: float, east_m: float) -> tuple[int, int]:
        frame = self.rig.context.frame
        assert frame is not None
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
        return round(lat * 1e7), round(lon * 1e7)

    def position(self, north_m: float = 100.0, east_m: float = 50.0, alt_m: float = 509.0, **at: int) -> Any:
        """GLOBAL_POSITION_INT, 12 m over its home, at a velocity of (1.5, -2.5, 0.25) m/s."""
        lat, lon = self.place(north_m, east_m)
        lat, lon = at.get("lat", lat), at.get("lon", lon)
        return dialect.MAVLink_global_position_int_message(
            0, lat, lon, round(alt_m * 1e3), 12_000, 150, -250, 25, 65535
        )

    def target(self, north_m: float = 100.0, **changed: Any) -> Any:
        """FOLLOW_TARGET with position and velocity."""
        lat, lon = self.place(north_m, 50.0)
        values = {
            "timestamp": 0,
            "est_capabilities": POSITION | VELOCITY,
            "lat": lat,
            "lon": lon,
            "alt": 509.0,
            "vel": (1.5, -2.5, 0.25),
            "acc": (0.0,) * 3,
            "attitude_q": (1.0, 0.0, 0.0, 0.0),
            "rates": (0.0,) * 3,
            "position_cov": (0.0,) * 3,
            "custom_state": 0,
        }
        return dialect.MAVLink_follow_target_message(**{**values, **changed})


def test_the_position_of_another_autopilot_is_the_target() -> None:
    vehicle = Follower()
    vehicle.take(vehicle.position())
    place, velocity = vehicle.state()
    assert place == pytest.approx((100.0, 50.0, ORIGIN.alt_m - 509.0), abs=0.05)
    assert velocity == pytest.approx((1.5, -2.5, 0.25))
    assert vehicle.service.leader_id == 7


@pytest.mark.parametrize(("home_down_m", "down_m"), [(0.0, -12.0), (3.0, -9.0), (math.nan, -12.0)])
def test_a_relative_altitude_is_over_both_homes(home_down_m: float, down_m: float) -> None:
    vehicle = Follower(FOLL_ALT_TYPE=1)
    vehicle.rig.context.home_ned_m[2] = home_down_m
    vehicle.take(vehicle.position(alt_m=9000.0))
    assert float(vehicle.state()[0][2]) == pytest.approx(down_m, abs=0.05)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_follow_target_has_position_and_velocity(flavour: str) -> None:
    vehicle = Follower(flavour)
    vehicle.take(vehicle.target())
    place, velocity = vehicle.state()
    assert place == pytest.approx((100.0, 50.0, ORIGIN.alt_m - 509.0), abs=0.05)
    assert velocity == pytest.approx((1.5, -2.5, 0.25))


@pytest.mark.parametrize(
    ("changed", "velocity"),
    [
        ({"est_capabilities": POSITION}, (0.0, 0.0, 0.0)),
        ({"vel": (1.0, math.nan, 0.0)}, (0.0, 0.0, 0.0)),
        ({"vel": (0.0, -200.0, 0.0)}, (0.0, 0.0, 0.0)),
        ({"vel": (0.0, 0.0, 200.0)}, (0.0, 0.0, 0.0)),
        ({"vel": (199.0, 0.0, 0.0)}, (100.0, 0.0, 0.0)),  # the filter's limit
        ({"est_capabilities": VELOCITY | POSITION | 4}, (1.5, -2.5, 0.25)),
    ],
)
def test_an_unknown_or_impossible_velocity_is_not_used(
    changed: dict[str, Any], velocity: tuple[float, ...]
) -> None:
    vehicle = Follower("px4")
    vehicle.take(vehicle.target(**changed))
    assert vehicle.state()[1] == pytest.approx(velocity)


@pytest.mark.parametrize(
    ("changed", "taken"),
    [
        ({"est_capabilities": VELOCITY}, False),
        ({"alt": math.nan}, False),
        ({"alt": 99_999.0}, True),
        ({"alt": -100_000.0}, False),
        ({"lat": 0, "lon": 0}, False),
    ],
)
def test_a_target_without_a_valid_position_is_none(changed: dict[str, Any], taken: bool) -> None:
    vehicle = Follower("px4")
    vehicle.take(vehicle.target(**changed))
    assert vehicle.leader.accepted == taken


@pytest.mark.parametrize(
    ("lat_e7", "lon_e7", "taken"),
    [
        (900_000_000, 1_800_000_000, True),
        (900_000_001, 1_800_000_000, False),
        (900_000_000, 1_800_000_001, False),
        (899_990_000, -1_800_000_000, True),
        (899_990_000, -1_800_000_001, False),
    ],
)
def test_latitude_and_longitude_have_limits(lat_e7: int, lon_e7: int, taken: bool) -> None:
    vehicle = Follower()
    vehicle.rig.context.frame = LocalFrame(GeodeticPosition(lat_deg=89.999, lon_deg=179.999, alt_m=0.0))
    vehicle.take(vehicle.position(lat=lat_e7, lon=lon_e7))
    assert (vehicle.leader.accepted, vehicle.service.leader_id) == ((1, 7) if taken else (0, 0))


def test_null_island_is_no_position_but_its_meridian_is() -> None:
    vehicle = Follower()
    vehicle.rig.context.frame = LocalFrame(GeodeticPosition(lat_deg=0.01, lon_deg=0.01, alt_m=0.0))
    vehicle.take(vehicle.position(lat=0, lon=0))
    assert vehicle.leader.accepted == 0
    vehicle.take(vehicle.position(lat=100_000, lon=0))
    assert vehicle.leader.accepted == 1


@pytest.mark.parametrize(
    ("reported", "farthest_m"), [(0.0, 6.0), (0.5, 6.0), (5.0, 30.0), (30.0, 180.0), (100.0, 180.0)]
)
def test_the_reported_accuracy_widens_the_gate(reported: float, farthest_m: float) -> None:
    """The filter takes 6 sigma of the position's and its own uncertainty, here equal; sigma is 1 to 30 m."""
    farthest_m *= math.sqrt(2.0)
    for distance_m, accepted in ((farthest_m - 0.3, 2), (farthest_m + 0.3, 1)):
        vehicle = Follower("px4")
        cov = (reported, 0.0, 0.0)
        vehicle.take(vehicle.target(position_cov=cov))
        vehicle.take(vehicle.target(100.0 + distance_m, position_cov=cov))
        assert vehicle.leader.accepted == accepted


def test_a_global_position_counts_as_accurate_to_a_metre() -> None:
    for distance_m, accepted in ((8.2, 2), (8.8, 1)):
        vehicle = Follower()
        vehicle.take(vehicle.position())
        vehicle.take(vehicle.position(100.0 + distance_m))
        assert vehicle.leader.accepted == accepted


def test_the_own_vehicle_and_other_components_are_not_followed() -> None:
    vehicle = Follower()
    vehicle.take(vehicle.position(), OTHER._replace(system_id=1))
    vehicle.take(vehicle.position(), OTHER._replace(component_id=2))
    assert vehicle.service.leader_id == 0 and vehicle.leader.accepted == 0


@pytest.mark.parametrize(("wanted", "system", "taken"), [(7, 7, True), (8, 7, False), (8, 8, True)])
def test_foll_sysid_selects_the_target(wanted: int, system: int, taken: bool) -> None:
    vehicle = Follower(FOLL_SYSID=wanted)
    vehicle.take(vehicle.position(), OTHER._replace(system_id=system))
    assert vehicle.leader.accepted == taken


@pytest.mark.parametrize(("after_us", "leader"), [(10_000_000, 7), (10_000_001, 9)])
def test_another_target_is_followed_after_ten_seconds(after_us: int, leader: int) -> None:
    vehicle = Follower()
    vehicle.take(vehicle.position())
    vehicle.take(vehicle.position(5000.0), OTHER._replace(system_id=9), NOW_US + after_us)
    assert vehicle.service.leader_id == leader
    assert float(vehicle.state()[0][0]) == pytest.approx(5000.0 if leader == 9 else 100.0, abs=0.1)


def test_nothing_is_followed_without_foll_enable_or_by_another_flavour() -> None:
    off, px4 = Follower(FOLL_ENABLE=0), Follower("px4")
    off.take(off.position())
    px4.take(px4.position())  # PX4 takes FOLLOW_TARGET only
    assert off.leader.accepted == px4.leader.accepted == 0


# obstacles


class Circle:
    """A vehicle with the service that receives distances."""

    def __init__(self, flavour: str = "px4", **parameters: float) -> None:
        rig = ServiceRig(flavour, **parameters)
        self.context = rig.context
        self.map = rig.context.surroundings.obstacles
        self.service = service_of(rig, ObstacleService)

    def take(self, message: Any, source: Source = ONBOARD) -> dict[int, float]:
        """Deliver; the known distances, by sector of 5 degrees."""
        deliver(message, source, NOW_US, self.service)
        return {
            int(k): float(self.map.distances_m[k]) for k in np.flatnonzero(self.map.measured_us == NOW_US)
        }


def distances(*values_cm: int, **changed: Any) -> Any:
    """OBSTACLE_DISTANCE; directions not given are unknown."""
    fields = {
        "time_usec": 0,
        "sensor_type": 0,
        "distances": (*values_cm, *(65535,) * (72 - len(values_cm))),
        "increment": 5,
        "min_distance": 20,
        "max_distance": 1000,
        "increment_f": 0.0,
        "angle_offset": 0.0,
        "frame": dialect.MAV_FRAME_BODY_FRD,
    }
    return dialect.MAVLink_obstacle_distance_message(**{**fields, **changed})


def beam(current_cm: int = 250, orientation: int = 0, **changed: Any) -> Any:
    """DISTANCE_SENSOR."""
    fields = {
        "time_boot_ms": 0,
        "min_distance": 20,
        "max_distance": 1000,
        "current_distance": current_cm,
        "type": 0,
        "id": 0,
        "orientation": orientation,
        "covariance": 0,
    }
    return dialect.MAVLink_distance_sensor_message(**{**fields, **changed})


def test_distances_are_in_centimetres_clockwise_from_the_nose() -> None:
    """Nearer than the sensor's minimum counts as the minimum, beyond its maximum as nothing within range."""
    found = Circle().take(distances(250, 65535, 10, 1000, 1001))
    assert found == {0: 2.5, 2: 0.2, 3: 10.0, 4: math.inf}
    assert Circle().take(distances(1001, max_distance=0)) == {0: 10.01}


@pytest.mark.parametrize(
    ("changed", "sectors"),
    [
        ({"angle_offset": 90.0}, {18, 19}),
        ({"increment_f": -5.0}, {0, 71}),
        ({"increment": 10}, {71, 0, 1, 2, 3}),
        ({"increment": 10, "increment_f": 5.0}, {0, 1}),
        ({"frame": dialect.MAV_FRAME_GLOBAL}, {54, 55}),  # from north; the nose points east
        ({"frame": dialect.MAV_FRAME_LOCAL_NED}, {54, 55}),
        ({"angle_offset": 720.0}, {0, 1}),
        ({"angle_offset": -720.0}, {0, 1}),
        ({"increment_f": 360.0}, set(range(72))),
        ({"increment_f": 0.5}, {0}),
    ],
)
def test_the_directions_of_an_obstacle_distance(changed: dict[str, Any], sectors: set[int]) -> None:
    circle = Circle()
    circle.context.nav[nav.EULER_RAD] = (0.0, 0.0, 0.5 * math.pi)
    assert set(circle.take(distances(250, 250, **changed))) == sectors
    assert circle.service.refused == 0


@pytest.mark.parametrize(
    "changed",
    [
        {"frame": dialect.MAV_FRAME_LOCAL_ENU},
        {"increment": 0},
        {"increment_f": 0.49},
        {"increment_f": 360.5},
        {"increment_f": math.nan},
        {"angle_offset": 720.5},
        {"angle_offset": -720.5},
        {"angle_offset": math.nan},
    ],
)
def test_an_obstacle_distance_of_unknown_directions_is_refused(changed: dict[str, Any]) -> None:
    circle = Circle()
    assert circle.take(distances(250, 250, **changed)) == {}
    assert circle.service.refused == 1


def test_a_circle_has_no_more_than_360_degrees() -> None:
    """Of steps of 30 degrees twelve fill the circle; the thirteenth value does not belong to it."""
    found = Circle().take(distances(*(500,) * 12, 100, increment=30))
    assert set(found.values()) == {5.0} and len(found) == SECTORS


@pytest.mark.parametrize(("orientation", "middle"), [(0, 0), (1, 9), (2, 18), (4, 36), (6, 54), (7, 63)])
def test_a_distance_sensor_covers_30_degrees_of_its_direction(orientation: int, middle: int) -> None:
    found = Circle().take(beam(orientation=orientation))
    assert found == dict.fromkeys([(middle + k) % SECTORS for k in range(-3, 4)], 2.5)


@pytest.mark.parametrize(
    ("fov_rad", "sectors"),
    [(0.0, 7), (0.005, 7), (0.02, 1), (math.radians(15.0), 3), (6.25, 72), (6.3, 7), (math.nan, 7)],
)
def test_the_field_of_view_of_a_distance_sensor(fov_rad: float, sectors: int) -> None:
    assert len(Circle().take(beam(horizontal_fov=fov_rad))) == sectors


@pytest.mark.parametrize(
    ("message", "distance_m"),
    [
        (beam(19), None),
        (beam(20), 0.2),
        (beam(999), 9.99),
        (beam(1000), math.inf),
        (beam(orientation=8), None),
        (beam(orientation=dialect.MAV_SENSOR_ROTATION_PITCH_270), None),
    ],
)
def test_the_range_of_a_distance_sensor(message: Any, distance_m: float | None) -> None:
    circle = Circle()
    assert set(circle.take(message).values()) == ({distance_m} if distance_m is not None else set())
    assert circle.service.refused == (distance_m is None)


@pytest.mark.parametrize(("component", "taken"), [(0, True), (1, False), (2, True), (197, True)])
def test_the_sensor_of_another_autopilot_is_not_ours(component: int, taken: bool) -> None:
    assert bool(Circle().take(beam(), Source(None, 7, component))) == taken  # type: ignore[arg-type]


@pytest.mark.parametrize(("kind", "taken"), [(0, False), (1, False), (2, True), (3, False)])
def test_ardupilot_uses_distances_with_prx1_type_2(kind: int, taken: bool) -> None:
    assert bool(Circle("ardupilot", PRX1_TYPE=kind).take(beam())) == taken


# external odometry


class Filter:
    """The part of the navigation filter that the service uses."""

    def __init__(self) -> None:
        self.frame: LocalFrame | None = None
        self.samples: list[ExternalSample] = []
        self.origins: list[GeodeticPosition] = []

    def take_external(self, sample: ExternalSample) -> None:
        self.samples.append(sample)

    def set_origin(self, origin: GeodeticPosition) -> None:
        self.frame = LocalFrame(origin)
        self.origins.append(origin)


class Odometry:
    """A vehicle with the service that receives external odometry."""

    def __init__(self, flavour: str = "ardupilot", **parameters: float) -> None:
        self.rig = ServiceRig(flavour, **parameters)
        self.filter = Filter()
        self.service = service_of(self.rig, ExternalOdometryService, navigation=self.filter)

    def take(self, message: Any, source: Source = ONBOARD) -> None:
        deliver(message, source, NOW_US, self.service)

    def sample(self, message: Any) -> ExternalSample:
        self.take(message)
        return self.filter.samples[-1]


COVARIANCE = tuple(1.0 + k for k in range(21))
"""Upper triangle of a 6 x 6 matrix, by rows: its diagonal is 0, 6, 11, 15, 18, 20."""
UNKNOWN = (math.nan, *COVARIANCE[1:])
LEVEL_EAST = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
POSES = (
    dialect.MAVLink_vision_position_estimate_message,
    dialect.MAVLink_global_vision_position_estimate_message,
    dialect.MAVLink_vicon_position_estimate_message,
)


@pytest.mark.parametrize("kind", POSES)
def test_a_pose_has_position_attitude_and_their_variances(kind: Any) -> None:
    vehicle = Odometry(VISO_TYPE=1)
    message = kind(NOW_US - 30_000, 1.0, -2.0, 3.0, 0.0, 0.0, 0.5 * math.pi, COVARIANCE)
    sample = vehicle.sample(message)
    assert tuple(sample.values[POSITION_M]) == (1.0, -2.0, 3.0)
    assert sample.values[Q_LOCAL_FROM_FRD] == pytest.approx(LEVEL_EAST)
    assert np.isnan(sample.values[VELOCITY_M_S]).all()
    assert sample.position_variance_m2 == (1.0, 7.0, 12.0) and sample.yaw_variance_rad2 == 21.0
    assert np.isnan(sample.velocity_variance_m2_s2).all()
    assert sample.frame is sample.velocity_frame is ExternalFrame.NED
    assert (sample.time_us, sample.reset_counter) == (NOW_US - 30_000, 0)


@pytest.mark.parametrize("kind", POSES)
def test_a_first_element_that_is_nan_means_no_covariance(kind: Any) -> None:
    sample = Odometry(VISO_TYPE=1).sample(kind(0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, UNKNOWN))
    assert np.isnan(sample.position_variance_m2).all() and math.isnan(sample.yaw_variance_rad2)


@pytest.mark.parametrize(("angle_rad", "known"), [(99.0, True), (-100.0, False), (math.nan, False)])
def test_a_pose_with_an_impossible_angle_has_no_attitude(angle_rad: float, known: bool) -> None:
    message = dialect.MAVLink_vision_position_estimate_message(
        0, 1.0, 2.0, 3.0, 0.0, angle_rad, 0.0, COVARIANCE, 5
    )
    sample = Odometry("px4").sample(message)
    assert bool(np.isfinite(sample.values[Q_LOCAL_FROM_FRD]).all()) == known
    assert tuple(sample.values[POSITION_M]) == (1.0, 2.0, 3.0) and sample.reset_counter == 5


def test_motion_capture_has_a_quaternion() -> None:
    message = dialect.MAVLink_att_pos_mocap_message(NOW_US - 40_000, LEVEL_EAST, 1.0, -2.0, 3.0, COVARIANCE)
    sample = Odometry("px4").sample(message)
    assert tuple(sample.values[POSITION_M]) == (1.0, -2.0, 3.0)
    assert sample.values[Q_LOCAL_FROM_FRD] == pytest.approx(LEVEL_EAST)
    assert sample.position_variance_m2 == (1.0, 7.0, 12.0) and sample.yaw_variance_rad2 == 21.0
    assert (sample.time_us, sample.reset_counter) == (NOW_US - 40_000, 0)


def test_a_speed_estimate_has_a_velocity_only() -> None:
    message = dialect.MAVLink_vision_speed_estimate_message(
        NOW_US - 50_000, 1.0, -2.0, 3.0, tuple(1.0 + k for k in range(9)), 6
    )
    sample = Odometry(VISO_TYPE=1).sample(message)
    assert tuple(sample.values[VELOCITY_M_S]) == (1.0, -2.0, 3.0)
    assert np.isnan(sample.values[POSITION_M]).all() and math.isnan(sample.yaw_variance_rad2)
    assert np.isnan(sample.position_variance_m2).all()
    assert sample.velocity_variance_m2_s2 == (1.0, 5.0, 9.0)
    assert (sample.time_us, sample.reset_counter) == (NOW_US - 50_000, 6)


@pytest.mark.parametrize(
    ("child", "frame", "velocity"),
    [
        (dialect.MAV_FRAME_LOCAL_NED, ExternalFrame.NED, (4.0, 5.0, 6.0)),
        (dialect.MAV_FRAME_LOCAL_ENU, ExternalFrame.NED, (5.0, 4.0, -6.0)),
        (dialect.MAV_FRAME_LOCAL_FRD, ExternalFrame.LOCAL_FRD, (4.0, 5.0, 6.0)),
        (dialect.MAV_FRAME_LOCAL_FLU, ExternalFrame.LOCAL_FRD, (4.0, -5.0, -6.0)),
        (dialect.MAV_FRAME_BODY_NED, ExternalFrame.BODY_FRD, (4.0, 5.0, 6.0)),
        (dialect.MAV_FRAME_BODY_OFFSET_NED, ExternalFrame.BODY_FRD, (4.0, 5.0, 6.0)),
    ],
)
def test_odometry_has_the_velocity_in_a_frame_of_its_own(
    child: int, frame: ExternalFrame, velocity: tuple[float, ...]
) -> None:
    message = dialect.MAVLink_odometry_message(
        NOW_US,
        dialect.MAV_FRAME_LOCAL_NED,
        child,
        1,
        2,
        3,
        LEVEL_EAST,
        4,
        5,
        6,
        0,
        0,
        0,
        COVARIANCE,
        COVARIANCE,
    )
    sample = Odometry("px4").sample(message)
    assert sample.velocity_frame is frame and tuple(sample.values[VELOCITY_M_S]) == velocity
    assert sample.position_variance_m2 == sample.velocity_variance_m2_s2 == (1.0, 7.0, 12.0)
    assert sample.yaw_variance_rad2 == 21.0


def test_px4_does_not_use_the_poses_of_other_messages() -> None:
    vehicle = Odometry("px4")
    for kind in POSES[1:]:
        vehicle.take(kind(0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, COVARIANCE))
    assert not vehicle.filter.samples


def origin_message(
    lat_e7: int = 473977400, lon_e7: int = -85455900, *, alt_mm: int = 1, system: int = 1
) -> Any:
    return dialect.MAVLink_set_gps_global_origin_message(system, lat_e7, lon_e7, alt_mm)


def test_the_origin_is_set_once_and_reported() -> None:
    vehicle = Odometry()
    vehicle.take(origin_message(alt_mm=489_500))
    vehicle.take(origin_message(alt_mm=1000))
    (origin,) = vehicle.filter.origins
    assert (origin.lat_deg, origin.lon_deg, origin.alt_m) == pytest.approx((47.39774, -8.54559, 489.5))
    (report,) = vehicle.rig.channel.sent
    assert report.get_type() == "GPS_GLOBAL_ORIGIN"
    assert (report.latitude, report.longitude, report.altitude) == (473977400, -85455900, 489_500)
    assert report.time_usec == NOW_US


@pytest.mark.parametrize(
    ("message", "accepted"),
    [
        (origin_message(system=2), False),
        (origin_message(900_000_000, 1_800_000_000), True),
        (origin_message(-900_000_000, -1_800_000_000), True),
        (origin_message(900_000_001), False),
        (origin_message(-900_000_001), False),
        (origin_message(0, 1_800_000_001), False),
        (origin_message(0, -1_800_000_001), False),
        (origin_message(alt_mm=99_999_999), True),
        (origin_message(alt_mm=100_000_000), False),
        (origin_message(alt_mm=-100_000_000), False),
    ],
)
def test_an_origin_must_be_a_place_for_this_vehicle(message: Any, accepted: bool) -> None:
    vehicle = Odometry()
    vehicle.take(message)
    assert bool(vehicle.filter.origins) == bool(vehicle.rig.channel.sent) == accepted
