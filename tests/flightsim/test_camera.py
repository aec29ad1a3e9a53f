"""Camera and detector: projection against OpenCV and the paper, what is visible, statistics, streams."""

import math
from dataclasses import replace

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    LEVEL,
    NO_TAG,
    Camera,
    CameraFrame,
    CameraParameters,
    Detection,
    Gimbal,
    GimbalFlags,
    GimbalParameters,
    GroundTargetParameters,
    GroundTargets,
    HomeFrame,
    PictureDetection,
    PinholeModel,
    ResolutionDetection,
    SeenTargets,
    Static,
    camera_from_gimbal,
    gimbal_from_camera,
)
from flightsim.payload.survey_magnetometer import SurveyMagnetometerParameters

Array = NDArray[np.float64]

HOME = Home()
STEP_US = 4000
FRAME_STEPS = 25
SURE = {
    "pixel_noise_px": 0.0,
    "size_noise": 0.0,
    "latency_s": 0.0,
    "quantum_px": 0.0,
    "detection": ResolutionDetection.constant(1.0),
}


def seen(size_px: Array) -> SeenTargets:
    """Tags right below, in the middle of the picture."""
    n = size_px.size
    return SeenTargets(
        size_px=size_px,
        range_m=np.full(n, 100.0),
        sine=np.ones(n),
        blur_px=np.zeros(n),
        edge_px=np.full(n, 300.0),
        covered=np.zeros(n, dtype=np.bool_),
        tagged=np.ones(n, dtype=np.bool_),
    )


def place(truth: Array, north_m: float, east_m: float, height_m: float, *, home: Home = HOME) -> None:
    lat_deg, lon_deg = home.offset(north_m, east_m)
    truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(lat_deg), math.radians(lon_deg)
    truth[t.ALT_M] = home.alt_m + height_m


def attitude(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Array:
    q = Rotation.from_euler("ZYX", [yaw_deg, pitch_deg, roll_deg], degrees=True).as_quat()
    return np.roll(q, 1)


class Bench:
    """A camera over targets, on a vehicle that the test places."""

    def __init__(
        self,
        *targets: tuple[float, float],
        gimbal: GimbalParameters | None = None,
        seed: int = 1,
        size_m: float = 2.0,
        tags: tuple[int, ...] = (),
        **changes: object,
    ) -> None:
        streams = RandomStreams(seed)
        self.truth = np.zeros(t.TRUTH_SIZE)
        self.truth[t.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
        place(self.truth, 0.0, 0.0, 100.0)
        self.targets = GroundTargets(
            [
                GroundTargetParameters(
                    motion=Static(north_m=north_m, east_m=east_m),
                    size_m=size_m,
                    tag_id=tags[index] if tags else NO_TAG,
                )
                for index, (north_m, east_m) in enumerate(targets)
            ],
            seeds=lambda index: streams.child("target", index),
        )
        self.gimbal = (
            None
            if gimbal is None
            else Gimbal(gimbal, truth=self.truth, physics_rate_hz=250, seed=streams.child("gimbal"))
        )
        self.camera = Camera(
            CameraParameters(**changes),  # type: ignore[arg-type]
            truth=self.truth,
            home=HOME,
            targets=self.targets,
            gimbal=self.gimbal,
            physics_rate_hz=250,
            seeds=lambda name: streams.child("sensor", name),
        )
        self.time_us = 0

    def frames(self, count: int) -> list[CameraFrame]:
        delivered: list[CameraFrame] = []
        while len(delivered) < count:
            if self.gimbal is not None:
                self.gimbal.step(self.time_us)
            frame = self.camera.step(self.time_us)
            if frame is not None:
                delivered.append(frame)
            self.time_us += STEP_US
        return delivered

    def detections(self, count: int = 1) -> list[Detection]:
        return [detection for frame in self.frames(count) for detection in frame.detections]


# --- geometry ---


def test_projection_is_opencv_s() -> None:
    cv2 = pytest.importorskip("cv2", reason="opencv-python is not installed")
    model = PinholeModel(width_px=1280, height_px=720, horizontal_fov_rad=1.1)
    points = np.random.default_rng(1).uniform((-50.0, -50.0, 1.0), (50.0, 50.0, 100.0), (200, 3))
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), model.matrix, None)
    np.testing.assert_allclose(model.project(points), expected[:, 0], atol=1e-8)
    x, _, _, _, _ = cv2.calibrationMatrixValues(model.matrix, (1280, 720), 1.0, 1.0)
    assert math.radians(x) == pytest.approx(model.horizontal_fov_rad)


def test_camera_in_the_world_is_opencv_s() -> None:
    """The whole chain of vehicle, gimbal and camera, with OpenCV's extrinsics."""
    cv2 = pytest.importorskip("cv2", reason="opencv-python is not installed")
    places = [(60.0, 15.0), (75.0, -10.0), (110.0, 30.0), (90.0, 0.0)]
    bench = Bench(*places, gimbal=GimbalParameters(), **SURE)
    assert bench.gimbal is not None
    bench.truth[t.Q_NED_FROM_FRD] = attitude(17.0, -4.0, 10.0)
    place(bench.truth, 10.0, -5.0, 80.0)
    bench.gimbal.command(LEVEL, pitch_rad=math.radians(-45.0))
    found = bench.frames(20)[-1].detections
    assert len(found) == 4
    q = bench.gimbal.q_ned_from_gimbal
    r_gimbal_from_ned = Rotation.from_quat(np.roll(q, -1)).as_matrix().T
    r_camera_from_ned = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]) @ r_gimbal_from_ned
    eye = np.array([10.0, -5.0, -80.0])
    points = np.array([(*ne, 0.0) for ne in places])
    pixels, _ = cv2.projectPoints(
        points,
        cv2.Rodrigues(r_camera_from_ned)[0],
        -r_camera_from_ned @ eye,
        bench.camera.parameters.model.matrix,
        None,
    )
    expected = sorted(map(tuple, pixels[:, 0].tolist()))
    np.testing.assert_allclose([(d.u_px, d.v_px) for d in found], expected, atol=1e-3)


def test_line_of_sight_and_height_give_the_place_back() -> None:
    """Tolman et al. 2021, equations 36 to 40, from what the camera says to where the target is."""
    bench = Bench((70.0, 20.0), gimbal=GimbalParameters.two_axis(), **SURE)
    assert bench.gimbal is not None
    bench.truth[t.Q_NED_FROM_FRD] = attitude(25.0, 3.0, 35.0)
    bench.gimbal.command(LEVEL | GimbalFlags.YAW_LOCK, pitch_rad=math.radians(-50.0), yaw_rad=0.3)
    (detection,) = bench.frames(30)[-1].detections
    _, elevation, azimuth = bench.gimbal.joints_rad
    epsilon = np.array([*detection.normalised, 1.0])
    r_gimbal_from_camera = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    r_body_from_gimbal = Rotation.from_euler("ZY", [azimuth, elevation]).as_matrix()
    r_ned_from_body = Rotation.from_quat(np.roll(bench.truth[t.Q_NED_FROM_FRD], -1)).as_matrix()
    sight = r_ned_from_body @ r_body_from_gimbal @ r_gimbal_from_camera @ epsilon
    np.testing.assert_allclose(100.0 * sight / sight[2], (70.0, 20.0, 100.0), atol=1e-5)


def test_a_camera_that_is_turned_on_its_mount_sees_the_target_elsewhere() -> None:
    """The mount looks straight down; 2 degrees about the camera's right axis, 1 about its down axis."""
    turned = (0.0, math.radians(2.0), math.radians(1.0))
    (straight,) = Bench((0.0, 0.0), **SURE).detections()
    (found,) = Bench((0.0, 0.0), misalignment_rad=turned, **SURE).detections()
    assert straight.normalised == pytest.approx((0.0, 0.0), abs=1e-6)
    # the axis is turned up in the picture and to its right, so that the target is seen below and to the left
    assert found.normalised == pytest.approx((-math.tan(turned[2]), math.tan(turned[1])), rel=2e-3)
    with pytest.raises(ValueError, match="misalignment_rad"):
        CameraParameters(misalignment_rad=(0.0, math.nan, 0.0))


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_pixels_and_normalised_coordinates_are_inverse(x: float, y: float) -> None:
    model = PinholeModel()
    back = model.normalised_from_pixels(model.pixels(np.array([x, y])))
    np.testing.assert_allclose(back, (x, y), atol=1e-12)


def test_field_of_view_ends_at_the_edges() -> None:
    model = PinholeModel(width_px=640, height_px=480, horizontal_fov_rad=math.radians(50.0))
    edge = math.tan(0.5 * model.horizontal_fov_rad)
    assert model.project(np.array([edge, 0.0, 1.0]))[0] == pytest.approx(640.0)
    edge = math.tan(0.5 * model.vertical_fov_rad)
    assert model.project(np.array([0.0, edge, 1.0]))[1] == pytest.approx(480.0)
    assert not model.inside(model.project(np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]]))).any()
    frame = np.arange(3.0)
    np.testing.assert_array_equal(gimbal_from_camera(camera_from_gimbal(frame)), frame)


def test_home_frame_is_the_inverse_of_home_s_offset_and_near_the_tangent_plane() -> None:
    frame = HomeFrame(HOME)
    truth = np.zeros(t.TRUTH_SIZE)
    place(truth, 812.0, -455.0, 120.0)
    np.testing.assert_allclose(frame.position_ned_m(truth), (812.0, -455.0, -120.0), atol=1e-6)
    lat_deg, lon_deg = HOME.offset(800.0, 600.0)
    ned = pymap3d.geodetic2ned(lat_deg, lon_deg, HOME.alt_m, HOME.lat_deg, HOME.lon_deg, HOME.alt_m)
    np.testing.assert_allclose(ned[:2], (800.0, 600.0), atol=0.2)


# --- what is seen ---


def test_signs_of_angles_and_pixels() -> None:
    """Looking straight down, nose north: north is up in the picture, east is right."""
    (detection,) = Bench((20.0, 10.0), **SURE).detections()
    assert detection.angle_x_rad == pytest.approx(math.atan(0.1), abs=1e-8)
    assert detection.angle_y_rad == pytest.approx(math.atan(-0.2), abs=1e-8)
    assert detection.u_px > 640.0 and detection.v_px < 360.0
    np.testing.assert_allclose(detection.normalised, (0.1, -0.2), atol=1e-8)
    distance_m = math.sqrt(20.0**2 + 10.0**2 + 100.0**2)
    assert detection.size_rad == pytest.approx(2.0 * math.atan(1.0 / distance_m))
    assert detection.time_us == 0 and detection.target_id == NO_TAG


def test_the_place_of_the_camera_on_the_vehicle_counts() -> None:
    bench = Bench((0.0, 0.0), position_frd_m=(2.0, 0.0, 1.0), **SURE)
    bench.truth[t.Q_NED_FROM_FRD] = attitude(0.0, 0.0, 90.0)  # so it sits 2 m east, 1 m lower
    (detection,) = bench.detections()
    np.testing.assert_allclose(detection.normalised, (0.0, 2.0 / 99.0), atol=1e-8)


@pytest.mark.parametrize(
    ("north_m", "pitch_deg", "changes", "seen"),
    [
        (0.0, -90.0, {}, True),
        (100.0, -90.0, {}, False),  # outside the image
        (100.0, -45.0, {}, True),
        (-100.0, -45.0, {}, False),  # behind
        (1000.0, -5.0, {}, True),
        (1000.0, -5.0, {"max_range_m": 900.0}, False),
        (1950.0, 0.0, {}, False),  # 2.9 degrees below the horizon
        (1950.0, 0.0, {"min_depression_rad": 0.0}, True),
    ],
)
def test_what_is_visible(north_m: float, pitch_deg: float, changes: dict[str, float], seen: bool) -> None:
    bench = Bench((north_m, 0.0), mount_pitch_rad=math.radians(pitch_deg), **(SURE | changes))
    assert len(bench.detections()) == seen


def test_nothing_is_seen_from_below_the_ground_or_by_a_retracted_camera() -> None:
    below = Bench((0.0, 0.0), **SURE)
    place(below.truth, 0.0, 0.0, -5.0)
    assert below.detections() == []
    bench = Bench((100.0, 0.0), gimbal=GimbalParameters(), false_detections_per_frame=5.0, **SURE)
    assert bench.gimbal is not None
    bench.gimbal.command(LEVEL, pitch_rad=math.radians(-45.0))
    assert bench.frames(20)[-1].detections
    bench.gimbal.command(GimbalFlags.RETRACT)
    assert bench.detections(5) == []


def test_tags_are_read_and_the_order_is_that_of_the_picture() -> None:
    bench = Bench((0.0, 20.0), (0.0, -20.0), (5.0, 0.0), tags=(7, NO_TAG, 3), **SURE)
    found = bench.detections()
    assert [detection.target_id for detection in found] == [NO_TAG, 3, 7]
    assert [detection.u_px for detection in found] == sorted(detection.u_px for detection in found)


# --- statistics ---


def test_frame_rate_and_latency() -> None:
    bench = Bench((0.0, 0.0), latency_s=0.15)
    delivered = []
    for step in range(500):
        frame = bench.camera.step(step * STEP_US)
        if frame is not None:
            delivered.append((step * STEP_US, frame.time_us, frame.number))
    numbers = range(len(delivered))
    assert [number for *_, number in delivered] == list(numbers)
    assert [exposed for _, exposed, _ in delivered] == [100_000 * n for n in numbers]
    assert {due - exposed for due, exposed, _ in delivered} == {152_000}  # rounded to steps
    assert bench.camera.frame is not None and bench.camera.frame.number == len(delivered) - 1


@pytest.mark.parametrize(
    ("size_m", "tag", "half_px", "slope_px"),
    [(0.1, NO_TAG, 2.01, 0.042), (0.5, NO_TAG, 2.01, 0.042), (0.76, 3, 8.65, 0.505), (0.82, 3, 8.65, 0.505)],
)
def test_detection_follows_its_curve(size_m: float, tag: int, half_px: float, slope_px: float) -> None:
    model = PinholeModel()
    pixels = model.focal_px * 2.0 * math.atan(0.5 * size_m / 100.0)
    curve = 0.998 / (1.0 + math.exp(-(pixels - half_px) / slope_px))
    frames = 3000
    rate = len(Bench((0.0, 0.0), size_m=size_m, tags=(tag,)).detections(frames)) / frames
    assert rate == pytest.approx(curve, abs=4.0 * math.sqrt(max(curve * (1.0 - curve), 1e-3) / frames))


def test_detection_curves() -> None:
    sizes = np.linspace(0.0, 30.0, 301)
    smooth = ResolutionDetection().probability(seen(sizes))
    assert np.all(np.diff(smooth) >= 0.0) and smooth[-1] == pytest.approx(0.96)
    assert ResolutionDetection().probability(seen(np.array([4.0])))[0] == pytest.approx(0.48)
    step = ResolutionDetection(slope_px=0.0).probability(seen(sizes))
    np.testing.assert_array_equal(step, np.where(sizes >= 4.0, 0.96, 0.0))
    np.testing.assert_array_equal(ResolutionDetection.constant(0.5).probability(seen(sizes)), 0.5)


def test_detection_in_pictures_falls_with_foreshortening_blur_edges_and_cover() -> None:
    model = PictureDetection()
    (clear,) = model.probability(seen(np.array([30.0])))
    assert clear == pytest.approx(0.998, abs=1e-3)
    changes: list[dict[str, object]] = [
        {"sine": np.array([math.sin(math.radians(10.0))])},
        {"blur_px": np.array([12.0])},
        {"sine": np.array([math.sin(math.radians(4.0))]), "size_px": np.array([200.0])},
        {"edge_px": np.array([-1.0])},
        {"covered": np.array([True])},
    ]
    for change in changes:
        assert model.probability(replace(seen(np.array([30.0])), **change))[0] < 0.2, change
    ball = replace(seen(np.array([6.0])), tagged=np.array([False]), sine=np.array([0.1]))
    assert model.probability(ball)[0] > 0.95


def test_a_target_behind_another_and_one_cut_by_the_edge_are_not_seen() -> None:
    alone = Bench((0.0, 0.0), size_m=3.0, pixel_noise_px=0.0)
    assert len(alone.detections(200)) > 190
    pair = Bench((0.0, 0.0), (0.0, 0.5), size_m=3.0, pixel_noise_px=0.0)
    place(pair.truth, 0.0, -40.0, 60.0)
    pair.truth[t.Q_NED_FROM_FRD] = attitude(40.0, 0.0, 0.0)
    counts = [len(frame.detections) for frame in pair.frames(50)]
    assert max(counts) <= 1


def test_motion_during_the_exposure_blurs() -> None:
    """A tag 24 pixels large is read from a camera at rest, and not from one that turns by 3 rad/s."""
    rates = {}
    for turn_rad_s in (0.0, 3.0):
        bench = Bench((0.0, 0.0), size_m=2.2, tags=(1,), pixel_noise_px=0.0)
        found = 0
        for step in range(1, 3000):
            angle = 0.2 * math.sin(turn_rad_s / 0.2 * step * 0.004)
            bench.truth[t.Q_NED_FROM_FRD] = attitude(math.degrees(angle), 0.0, 0.0)
            frame = bench.camera.step(step * STEP_US)
            found += 0 if frame is None else len(frame.detections)
        rates[turn_rad_s] = found
    assert rates[0.0] > 100
    assert rates[3.0] < 0.85 * rates[0.0]


def test_places_are_quantised() -> None:
    places = [d.u_px / 0.25 for d in Bench((1.0, 1.3), size_m=4.0, tags=(1,), latency_s=0.0).detections(50)]
    np.testing.assert_allclose(places, np.round(places), atol=1e-9)


def test_pixel_and_size_noise() -> None:
    found = Bench((0.0, 0.0), **(SURE | {"pixel_noise_px": 2.0, "size_noise": 0.1})).detections(3000)
    u, v = (np.array([getattr(d, name) for d in found]) for name in ("u_px", "v_px"))
    spread = 5.0 * math.sqrt(2.0 / 3000)
    assert np.var(u) == pytest.approx(4.0, rel=spread) and np.var(v) == pytest.approx(4.0, rel=spread)
    assert u.mean() == pytest.approx(640.0, abs=0.2) and v.mean() == pytest.approx(360.0, abs=0.2)
    assert abs(np.corrcoef(u, v)[0, 1]) < 5.0 / math.sqrt(3000)
    sizes = np.array([d.size_rad for d in found])
    assert sizes.std() / sizes.mean() == pytest.approx(0.1, rel=spread)


def test_false_detections_are_poisson_and_uniform() -> None:
    frames = Bench(false_detections_per_frame=0.8).frames(4000)
    counts = np.array([len(frame.detections) for frame in frames])
    assert counts.mean() == pytest.approx(0.8, abs=5.0 * math.sqrt(0.8 / 4000))
    assert counts.var() == pytest.approx(0.8, rel=0.15)
    found = [d for frame in frames for d in frame.detections]
    assert {d.target_id for d in found} == {NO_TAG}
    for name, size in (("u_px", 1280.0), ("v_px", 720.0)):
        values = np.array([getattr(d, name) for d in found])
        assert np.all((values >= 0.0) & (values < size))
        assert values.mean() == pytest.approx(size / 2.0, rel=0.05)
        assert values.std() == pytest.approx(size / math.sqrt(12.0), rel=0.05)


def test_streams_of_targets_and_clutter_are_their_own() -> None:
    """One target more, clutter, or looking away for a while: the rest of the detections stays the same."""

    def of_first(bench: Bench) -> list[Detection]:
        return [d for d in bench.detections(200) if d.target_id == 1]

    alone = of_first(Bench((0.0, 5.0), tags=(1,), size_m=0.85, latency_s=0.0))
    assert 150 < len(alone) < 200
    crowd = Bench(
        (0.0, 5.0), (10.0, -5.0), tags=(1, 2), size_m=0.85, latency_s=0.0, false_detections_per_frame=2.0
    )
    assert of_first(crowd) == alone
    away = Bench((0.0, 5.0), tags=(1,), size_m=0.85, latency_s=0.0)
    place(away.truth, 0.0, 500.0, 100.0)
    assert away.frames(50)[-1].detections == ()
    place(away.truth, 0.0, 0.0, 100.0)
    assert away.detections(150) == [d for d in alone if d.time_us >= 50 * FRAME_STEPS * STEP_US]
    assert of_first(Bench((0.0, 5.0), tags=(1,), size_m=0.85, latency_s=0.0, seed=2)) != alone


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: CameraParameters(rate_hz=0), "rate_hz 0"),
        (lambda: CameraParameters(pixel_noise_px=-1.0), r"pixel_noise_px -1"),
        (lambda: CameraParameters(false_size_px=(5.0, 2.0)), r"false_size_px = \(5\.0, 2\.0\)"),
        (lambda: CameraParameters(mount_pitch_rad=math.nan), "mount_pitch_rad nan"),
        (lambda: PinholeModel(width_px=0), "width_px = 0"),
        (lambda: PinholeModel(horizontal_fov_rad=3.2), r"horizontal_fov_rad = 3\.2"),
        (lambda: ResolutionDetection(max_probability=1.1), r"max_probability 1.1"),
        (lambda: Bench(rate_hz=30), "30 Hz does not divide"),
        (lambda: SurveyMagnetometerParameters(noise_nt=-1.0), r"noise_nt -1"),
    ],
)
def test_bad_parameters_are_named(make: object, named: str) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match=named):
        make()
