"""The tag detector on rendered pictures: rate, corners and pose against the truth of the scene."""

import math

import cv2
import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.vision import CameraGeometry, TagDetector, TagDetectorParameters, draw_detections
from flightsim.foundation.options import OptionError
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.payload import BrownDistortion, CameraView, ImagerParameters, PinholeModel, TargetView
from flightsim.picture import Renderer
from tests.rotations import rotation_matrix

MODEL = PinholeModel(width_px=1280, height_px=720, horizontal_fov_rad=math.radians(70.0))
LENS = BrownDistortion(k1=-0.12, k2=0.04, p1=0.0005, p2=-0.0004)
IMAGER = ImagerParameters(distortion=LENS, read_noise=2.0, shot_noise=0.02)
CAMERA = CameraGeometry.of_view(
    width_px=1280, height_px=720, horizontal_fov_rad=MODEL.horizontal_fov_rad, distortion=LENS.coefficients
)


class Scene:
    """A tag in a random pose before the camera: height 10 to 90 m, tilt to 45 degrees."""

    def __init__(self, rng, number):
        self.size_m = float(rng.choice([0.5, 1.0, 2.0, 4.0, 6.0]))
        self.tag_id = int(rng.integers(587))
        height_m, tilt = rng.uniform(10.0, 90.0), rng.uniform(0.0, math.radians(45.0))
        q = np.zeros(4)
        quaternion_from_euler(0.0, tilt - 0.5 * math.pi, rng.uniform(-math.pi, math.pi), q)
        r = rotation_matrix(q)  # columns: optical axis, right, down
        while True:
            ray = r @ np.array([1.0, rng.uniform(-0.6, 0.6), rng.uniform(-0.33, 0.33)])
            if ray[2] > 0.3:
                break
        place = height_m * ray / ray[2]
        half = 0.5 * self.size_m
        corners = place + half * np.array([(1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 0)])
        self.corners_px = CAMERA.pixels((corners @ r)[:, [1, 2, 0]])
        self.place_camera_m = (r.T @ place)[[1, 2, 0]]
        right_top_out = np.array([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)]).T
        self.r_camera_from_tag = (r.T @ right_top_out)[[1, 2, 0]]
        self.side_px = float(np.linalg.norm(np.diff(self.corners_px, axis=0), axis=1).mean())
        low, high = self.corners_px.min(axis=0), self.corners_px.max(axis=0)
        margin = 0.3 * self.side_px + 6.0  # the yellow margin, and room for the corners' windows
        self.whole = bool((low > margin).all() and (high < np.array((1280, 720)) - margin).all())
        self.view = CameraView(
            time_us=1 + 100_000 * number,
            eye_ned_m=(0.0, 0.0, -height_m),
            q_ned_from_mount=tuple(q.tolist()),
            targets=(
                TargetView(position_ned_m=(place[0], place[1], 0.0), size_m=self.size_m, tag_id=self.tag_id),
            ),
            exposure_s=0.002,
            velocity_ned_m_s=(3.0, 2.0, 0.0),
        )


def examine(count, seed, imager=IMAGER):
    """Rows: side px, detected, corner error px, reprojection px, relative place error, attitude error rad;
    and false tags.
    """
    rng = np.random.default_rng(seed)
    renderer = Renderer(MODEL, imager=imager, seed=seed)
    rows, false = [], 0
    for number in range(count):
        scene = Scene(rng, number)
        if not scene.whole:
            continue
        detector = TagDetector(CAMERA, TagDetectorParameters(size_m=scene.size_m))
        window = renderer.tag_window(scene.view, 60)
        corner = None if window is None else (window.left, window.top)
        found = detector.detect(renderer.render(scene.view, window=window), corner_px=corner)
        right = [f for f in found if f.tag_id == scene.tag_id]
        false += len(found) - len(right)
        if right:
            off = np.linalg.norm(right[0].corners_px - scene.corners_px, axis=1)
            place = np.linalg.norm(right[0].position_camera_m - scene.place_camera_m)
            error = place / np.linalg.norm(scene.place_camera_m)
            turn = 0.5 * (np.trace(scene.r_camera_from_tag.T @ right[0].r_camera_from_tag) - 1.0)
            angle = math.acos(np.clip(turn, -1.0, 1.0))
            pixels = math.sqrt(np.mean(off**2)), right[0].reprojection_px
            rows.append((scene.side_px, 1.0, *pixels, error, angle))
        else:
            rows.append((scene.side_px, 0.0, *[math.nan] * 4))
    return np.array(rows), false


def check(rows, false):
    large = rows[rows[:, 0] >= 24.0]
    assert false == 0
    assert len(large) >= 5 and large[:, 1].mean() >= 0.95
    assert np.nanmedian(rows[:, 2]) < 0.5
    assert np.nanmedian(rows[:, 3]) < 0.5
    assert np.nanmedian(large[:, 4]) < 0.02
    assert np.nanmedian(large[:, 5]) < math.radians(3.0)
    assert rows[rows[:, 0] < 7.0, 1].mean() == 0.0


def test_tags_are_detected_where_they_are():
    check(*examine(40, 5))


@pytest.mark.slow
def test_500_poses():
    rows, false = examine(500, 6)
    check(rows, false)


def empty_frames(count, seed):
    """Number of detections in pictures without a tag: ground from 10 to 90 m, balls, home's mark."""
    rng = np.random.default_rng(seed)
    model = PinholeModel(width_px=640, height_px=360, horizontal_fov_rad=MODEL.horizontal_fov_rad)
    renderer = Renderer(model, imager=IMAGER, seed=seed)
    camera = CameraGeometry.of_view(
        width_px=640, height_px=360, horizontal_fov_rad=MODEL.horizontal_fov_rad, distortion=LENS.coefficients
    )
    detector = TagDetector(camera)
    found = 0
    for number in range(count):
        q = np.zeros(4)
        tilt = rng.uniform(0.0, math.radians(45.0))
        quaternion_from_euler(rng.normal(0.0, 0.1), tilt - 0.5 * math.pi, rng.uniform(-3.1, 3.1), q)
        balls = tuple(
            TargetView(position_ned_m=(*rng.uniform(-60, 60, 2).tolist(), 0.0), size_m=2.0, tag_id=-1)
            for _ in range(3)
        )
        view = CameraView(
            time_us=number,
            eye_ned_m=(*rng.uniform(-50.0, 50.0, 2).tolist(), -rng.uniform(10.0, 90.0)),
            q_ned_from_mount=tuple(q.tolist()),
            targets=balls,
        )
        found += len(detector.detect(renderer.render(view)))
    return found


def test_no_tag_is_detected_where_there_is_none():
    assert empty_frames(12, 1) == 0


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_no_tag_in_10000_frames():
    assert empty_frames(10_000, 2) == 0


def test_two_tags_and_a_tag_of_another_number():
    view = CameraView(
        time_us=0,
        eye_ned_m=(0.0, 0.0, -10.0),
        q_ned_from_mount=(math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0),
        targets=tuple(
            TargetView(position_ned_m=(0.0, east_m, 0.0), size_m=1.0, tag_id=tag_id)
            for east_m, tag_id in ((-2.0, 11), (2.5, 300))
        ),
    )
    picture = Renderer(MODEL, imager=IMAGER).render(view)
    both = TagDetector(CAMERA, TagDetectorParameters(sizes_m=((300, 1.0),))).detect(picture)
    assert [found.tag_id for found in both] == [11, 300]
    assert both[0].angle_x_rad == pytest.approx(math.atan2(-2.0, 10.0), abs=2e-3)
    assert both[1].distance_m == pytest.approx(math.hypot(10.0, 2.5), rel=0.02)
    one = TagDetector(CAMERA, TagDetectorParameters(tag_ids=(300,))).detect(picture)
    assert [found.tag_id for found in one] == [300]
    drawn = draw_detections(picture, both)
    assert drawn.shape == picture.shape and (drawn != picture).any()


@pytest.mark.parametrize("shape", [(1, 1), (2, 200), (200, 1), (8, 8)])
def test_a_part_smaller_than_a_tag_has_none(shape):
    """The library ends the process for pictures below three pixels."""
    assert TagDetector(CAMERA).detect(np.full(shape, 128, np.uint8), corner_px=(0, 0)) == ()


def test_a_picture_of_another_size_is_refused():
    with pytest.raises(EstimatorError, match="640 x 360 pixels is not of the camera of 1280 x 720"):
        TagDetector(CAMERA).detect(np.zeros((360, 640), np.uint8))


def test_rays_and_pixels_of_a_distorted_camera_are_inverse():
    pixels = np.random.default_rng(2).uniform((0.0, 0.0), (1280.0, 720.0), (50, 2))
    rays = CAMERA.rays(pixels)
    assert CAMERA.pixels(np.column_stack((rays, np.ones(50)))) == pytest.approx(pixels, abs=1e-5)
    expected = cv2.undistortPoints(
        pixels.reshape(-1, 1, 2), CAMERA.matrix, np.array(CAMERA.distortion)
    ).reshape(-1, 2)
    assert rays == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TagDetectorParameters(size_m=0.0), "size_m 0 is not possible"),
        (lambda: TagDetectorParameters(tag_ids=(587,)), "tag 587 is not in 0..586"),
        (lambda: TagDetectorParameters(corrected_bits=6), "corrected_bits 6 is not in 0..5"),
        (
            lambda: CameraGeometry.of_view(width_px=9, height_px=9, horizontal_fov_rad=4.0),
            "horizontal_fov_rad 4",
        ),
        (
            lambda: CameraGeometry(
                width_px=9, height_px=9, focal_px=(1.0, 1.0), centre_px=(4.0, 4.0), distortion=(0.1,)
            ),
            "distortion",
        ),
    ],
)
def test_impossible_values_are_named(make, message):
    with pytest.raises((EstimatorError, OptionError), match=message):
        make()
