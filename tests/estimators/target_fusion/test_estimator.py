"""`TargetFusionEstimator` on a made flight of two drones: every message as cameras and autopilots send it."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import definition
from estimators.interface import Outcome
from estimators.messages import message_class
from estimators.target_fusion import TargetFusionEstimator, TargetFusionParameters
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import from_euler
from tests.rotations import rotation_matrix

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
FRAME = LocalFrame(HOME)
OMEGA_X, OMEGA_Y = 0.11, 0.17
HEIGHT_M = 25.0
TARGET = (35.0, -20.0)
TAG = 3
LATENCY_S = 0.1


def made(name: str, system: int, component: int, **values):
    found = definition(name)
    filled = {
        field.name: (0,) * field.length if field.length and field.code != "s" else 0
        for field in found.wire_fields
    }
    return message_class(found)(system, component, **(filled | values))  # type: ignore[call-arg]


def motion(t: float, system: int):
    """(north, its rate, east, its rate); the second drone is half a pattern on."""
    shift = 0.0 if system == 1 else math.pi
    return (
        30.0 * math.sin(OMEGA_Y * t + shift),
        30.0 * OMEGA_Y * math.cos(OMEGA_Y * t + shift),
        40.0 * math.cos(OMEGA_X * t + shift),
        -40.0 * OMEGA_X * math.sin(OMEGA_X * t + shift),
    )


class Flight:
    """The messages of two drones with a camera on a gimbal that points at the target.

    Args:
        noise: factor on the errors of receivers and cameras.
        earth: the gimbal tells its attitude against north.
        fixed: no gimbal: the camera looks straight down, and the vehicles bank.
    """

    def __init__(self, *, noise=1.0, earth=False, fixed=False, seed=0, nose_off_rad=0.0) -> None:
        self.rng = np.random.default_rng(seed)
        self.noise, self.earth, self.fixed = noise, earth, fixed
        self.nose_off_rad = nose_off_rad

    def home(self, system):
        return made(
            "HOME_POSITION",
            system,
            1,
            latitude=round(HOME.lat_deg * 1e7),
            longitude=round(HOME.lon_deg * 1e7),
            altitude=round(HOME.alt_m * 1e3),
        )

    def gps(self, t, system):
        scale = self.noise * np.array([0.2, 0.07, 0.2, 0.07])
        north, north_m_s, east, east_m_s = np.array(motion(t, system)) + scale * self.rng.normal(size=4)
        lat_deg, lon_deg, _ = FRAME.geodetic_from_ned(north, east, 0.0)
        return made(
            "GPS_RAW_INT",
            system,
            1,
            fix_type=3,
            lat=round(lat_deg * 1e7),
            lon=round(lon_deg * 1e7),
            alt=round((HOME.alt_m + HEIGHT_M) * 1e3),
            vel=round(100.0 * math.hypot(north_m_s, east_m_s)),
            cog=round(math.degrees(math.atan2(east_m_s, north_m_s)) % 360.0 * 100.0) % 36000,
        )

    def nose(self, t, system):
        _, north_m_s, _, east_m_s = motion(t, system)
        return math.atan2(east_m_s, north_m_s) + self.nose_off_rad

    def attitude(self, t, system):
        roll, pitch = 0.1 * math.sin(t), 0.05 * math.cos(2.0 * t)
        return made("ATTITUDE", system, 1, roll=roll, pitch=pitch, yaw=self.nose(t, system))

    def to_target(self, t, system):
        north, _, east, _ = motion(t, system)
        return np.array([TARGET[0] - north, TARGET[1] - east, HEIGHT_M])

    def gimbal(self, t, system):
        ahead = self.to_target(t, system)
        azimuth = math.atan2(ahead[1], ahead[0])
        pitch = -math.atan2(ahead[2], math.hypot(ahead[0], ahead[1]))
        nose = self.nose(t, system)
        yaw, flags = (azimuth, 64 | 16) if self.earth else (azimuth - nose, 32)
        q = from_euler(0.0, pitch, yaw)
        return made(
            "GIMBAL_DEVICE_ATTITUDE_STATUS",
            system,
            154,
            q=q,
            flags=flags,
            delta_yaw=nose if self.earth else 0.0,
        )

    def detection(self, t, system, tag=TAG):
        ahead = self.to_target(t, system)
        distance = float(np.linalg.norm(ahead))
        angles = np.zeros(2)
        if self.fixed:
            message = self.attitude(t, system)
            body = rotation_matrix(from_euler(message.roll, message.pitch, message.yaw)).T @ ahead
            angles = np.arctan2(
                [body[1], -body[0]], body[2]
            )  # straight down: right, and down the picture is aft
        size = 1.0 / distance
        size += self.noise * 0.0002 * self.rng.normal()
        angles = angles + self.noise * 0.0003 * self.rng.normal(size=2)
        return made(
            "LANDING_TARGET",
            system,
            100,
            target_num=tag,
            angle_x=float(angles[0]),
            angle_y=float(angles[1]),
            distance=0.5 / math.tan(0.5 * size),
            size_x=size,
            size_y=size,
        )

    def messages(self, duration_s, systems=(1, 2), start_s=20.0):
        """(time us, message) as they arrive: positions at 5 Hz, attitudes at 25, pictures at 10 and late."""
        found = []
        for system in systems:
            found.append((start_s, start_s, self.home(system)))
            for k in range(int(25 * duration_s)):
                t = start_s + 0.04 * k
                found.append((t, t, self.attitude(t, system)))
                if not self.fixed:
                    found.append((t, t, self.gimbal(t, system)))
                if k % 5 == 0:
                    found.append((t + 0.11, t, self.gps(t, system)))
                if k % 2:
                    found.append((t + LATENCY_S, t, self.detection(t, system)))
        found.sort(key=lambda item: item[0])
        return [(round(1e6 * t), message) for _, t, message in found]


def station(**chosen) -> TargetFusionEstimator:
    return TargetFusionEstimator(
        TargetFusionParameters(
            **{
                "omega_x_rad_s": OMEGA_X,
                "omega_y_rad_s": OMEGA_Y,
                "position_sigma_m": 0.2,
                "velocity_sigma_m_s": 0.07,
                "acceleration_psd_m2_s3": 1e-5,
                "size_sigma_rad": 0.0002,
                "bearing_sigma_rad": 0.001,
                "yaw_sigma_rad": 0.005,
            }
            | chosen
        )
    )


def run(estimator, messages):
    """Errors (n, 2) of all estimates."""
    off = []
    for time_us, message in messages:
        if estimator.handle(time_us, message) is Outcome.UPDATED:
            off += [(e.north_m - TARGET[0], e.east_m - TARGET[1]) for e in estimator.estimates]
    return np.array(off)


def rms(off):
    return float(np.sqrt(np.mean(np.sum(off[len(off) // 5 :] ** 2, axis=1))))


@pytest.mark.parametrize("heading", ["course", "yaw"])
@pytest.mark.parametrize("camera", ["vehicle frame", "earth frame", "fixed"])
def test_without_noise_the_place_is_right(heading: str, camera: str) -> None:
    flight = Flight(noise=0.0, earth=camera == "earth frame", fixed=camera == "fixed")
    mount = "fixed" if camera == "fixed" else "gimbal"
    estimator = station(heading=heading, mount=mount, min_speed_m_s=0.0)  # the pattern has a slow corner
    off = run(estimator, flight.messages(20.0))
    assert len(off) > 300
    assert np.abs(off).max() < 0.3  # cog in hundredths of a degree, vel in cm/s
    assert estimator.remarks()["detections_not_placed"] <= 6.0  # type: ignore[operator]


def test_yaw_serves_where_the_nose_does_not_lead() -> None:
    messages = Flight(noise=0.0, nose_off_rad=0.3).messages(10.0)
    assert rms(run(station(heading="yaw"), messages)) < 0.1
    by_course = station(heading="course", confirmations=1)
    assert rms(run(by_course, messages)) > 5.0


def test_who_is_too_slow_to_have_a_course_places_nothing() -> None:
    """At its slowest the pattern is flown at 0.4 m/s; a hovering drone's course is noise."""
    messages = Flight(noise=0.0).messages(20.0)
    placed = [len(run(station(min_speed_m_s=limit), messages)) for limit in (0.0, 0.5, 20.0)]
    assert placed[0] > placed[1] > 0.8 * placed[0]
    assert placed[2] == 0
    assert len(run(station(min_speed_m_s=20.0, heading="yaw"), messages)) == placed[0]


def test_nothing_is_placed_long_after_the_last_fix() -> None:
    """A receiver without a fix goes on reporting so; the pattern is not used for ever."""
    messages = [
        (t, m._replace(fix_type=0, lat=0, lon=0) if m.name == "GPS_RAW_INT" and t > 25_000_000 else m)
        for t, m in Flight(noise=0.0).messages(20.0)
    ]
    estimator = station(max_gap_s=2.0)
    times = [t for t, m in messages if estimator.handle(t, m) is Outcome.UPDATED]
    assert 26_900_000 < times[-1] < 27_500_000


def test_filters_are_better_than_samples_and_two_drones_than_one() -> None:
    """Right frequencies: the paper's row of epsilon 0."""
    both = Flight().messages(60.0)
    alone = [(t, m) for t, m in both if m.src_system == 1]
    unfiltered, kalman = (rms(run(station(form=form), both)) for form in ("measurement", "kalman"))
    assert kalman < 0.6 * unfiltered
    assert rms(run(station(form="measurement"), alone)) > 1.1 * unfiltered


def test_delayed_detections_meet_the_state_of_their_time() -> None:
    """Pictures half a second old: placed by where the drone was, not by where it is."""
    on_time = Flight(noise=0.0).messages(20.0)
    late = sorted(
        ((t + (500_000 if type(m).name == "LANDING_TARGET" else 0), t, m) for t, m in on_time),
        key=lambda item: item[0],
    )
    off = run(station(), [(t, m) for _, t, m in late])
    assert len(off) > 300 and np.abs(off).max() < 0.3


def test_missing_detections_leave_an_estimate_that_fades() -> None:
    estimator = station(walk_m_sqrt_s=1.0)
    messages = Flight().messages(40.0)
    seen = [(t, m) for t, m in messages if type(m).name != "LANDING_TARGET" or t < 30_000_000]
    run(estimator, seen)
    now, later = (estimator.target_at(t, TAG) for t in (30_000_000, 59_000_000))
    assert now is not None and later is not None
    assert later.north_variance_m2 - now.north_variance_m2 == pytest.approx(29.0, abs=0.1)
    assert (later.north_m, later.east_m) == pytest.approx(TARGET, abs=2.0)
    assert estimator.target_at(30_000_000, 200) is None


def test_a_drone_without_position_or_attitude_is_no_help() -> None:
    estimator = station()
    messages = [(t, m) for t, m in Flight().messages(10.0) if type(m).name != "GPS_RAW_INT"]
    assert len(run(estimator, messages)) == 0
    assert estimator.remarks()["detections_fused"] == 0.0
    assert estimator.estimates == ()


def test_tags_are_targets_of_their_own() -> None:
    flight = Flight()
    messages = flight.messages(10.0, systems=(1,))
    other = [
        (t, m._replace(target_num=9, angle_x=m.angle_x + 0.2))
        for t, m in messages
        if type(m).name == "LANDING_TARGET"
    ]
    estimator = station(confirmations=1)
    run(estimator, sorted(messages + other, key=lambda item: item[0]))
    first, second = estimator.target_at(30_000_000, TAG), estimator.target_at(30_000_000, 9)
    assert first is not None and second is not None
    assert math.hypot(first.north_m - second.north_m, first.east_m - second.east_m) > 3.0


def test_wrong_numbers_in_detections_are_refused() -> None:
    estimator = station()
    messages = Flight().messages(5.0)
    run(estimator, messages)
    time_us, good = next(item for item in reversed(messages) if type(item[1]).name == "LANDING_TARGET")
    assert estimator.handle(time_us, good) is Outcome.REPEATED
    assert estimator.handle(time_us, good._replace(angle_x=math.nan)) is Outcome.NOT_FINITE
    assert estimator.handle(time_us, good._replace(angle_x=2.0)) is Outcome.IMPLAUSIBLE
    assert estimator.handle(time_us - 4_000_000, good) is Outcome.LATE
    assert estimator.handle(time_us + 40_000_000, good) is Outcome.IMPLAUSIBLE
    assert estimator.handle(time_us, good._replace(target_num=77, src_system=9)) is Outcome.WAITING


def test_estimates_are_published_as_a_target_to_follow() -> None:
    estimator = station()
    run(estimator, Flight().messages(5.0))
    (message,) = estimator.publish()
    (e,) = estimator.estimates
    assert message.get_type() == "FOLLOW_TARGET"
    assert message.est_capabilities == 1  # type: ignore[attr-defined]
    north, east, down = FRAME.ned_from_geodetic(1e-7 * message.lat, 1e-7 * message.lon, message.alt)  # type: ignore[attr-defined]
    assert (north, east, down) == pytest.approx((e.north_m, e.east_m, 0.0), abs=0.02)
    assert message.position_cov[0] > 0.0 and message.timestamp == e.time_us // 1000  # type: ignore[attr-defined]
    assert dict(zip(e.COLUMNS, e.row(), strict=True))["target"] == TAG


def test_same_messages_same_bits_and_reset_forgets() -> None:
    messages = Flight().messages(5.0)
    first, second = station(), station()
    assert np.array_equal(run(first, messages), run(second, messages))
    again = run(first, messages) if first.reset() is None else None  # type: ignore[func-returns-value]
    assert np.array_equal(again, run(station(), messages))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"heading": "north"}, "heading 'north' is not one of course, yaw"),
        ({"distance": "size"}, "needs target_size_m"),
        ({"centre_vehicle": 0}, "centre_vehicle 0 is not in 1..255"),
        ({"gate": 0.0}, "gate 0 is not possible"),
        ({"confirmations": 0}, "confirmations 0"),
        ({"omega_x_rad_s": -1.0}, "omega_x_rad_s -1"),
        ({"wait_s": 3.0}, "wait_s 3 is more than history_s 2"),
    ],
)
def test_wrong_parameters_are_named(wrong, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        TargetFusionParameters(**wrong)
