"""The likelihood of a camera's frame: against the paper's tables, and against drawn poses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from estimators.errors import EstimatorError
from estimators.tracking.camera_likelihood import FrameLikelihood, _fold, ground_spread, image_spread
from estimators.tracking.camera_sight import (
    CameraSight,
    DetectionRate,
    PoseErrors,
    SightModel,
    rotation_matrix,
)
from estimators.vision import CameraGeometry
from flightsim.foundation.vectors import from_euler, product

DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)
BARREL = (-0.08, 0.02, 0.0004, -0.0003, 0.0)
SURE = SightModel(rate=DetectionRate(peak=0.9, constant=50.0), target_size_m=2.0, false_rate=0.004)
PAPER_RATE = DetectionRate.of_gaussians(detected=(60.0, 40.06), missed=(60.0, 62.03), rate=0.96)
NONE = dict.fromkeys(("forward_m", "right_m", "height_m", "yaw_rad", "pitch_rad", "roll_rad"), 0.0)
TABLE_II = PoseErrors(forward_m=10.5, right_m=5.5, height_m=5.5, yaw_rad=0.01, pitch_rad=0.05, roll_rad=0.02)


def sight(
    errors, euler=(0.0, 0.0, 0.0), *, place=(0.0, 0.0, -90.0), detections=(), distortion=BARREL, **more
):
    q = from_euler(*euler)
    place_m2, rotation_rad2 = errors.covariances(q, DOWN)
    return CameraSight(
        place_ned_m=place,
        q_ned_from_mount=product(q, DOWN),
        place_m2=place_m2,
        rotation_rad2=rotation_rad2,
        width_px=1280,
        height_px=720,
        focal_px=914.0,
        distortion=distortion,
        detections=np.array(detections, dtype=float).reshape(-1, 2),
        **more,
    )


@pytest.mark.parametrize(
    ("error", "printed_m"),
    [
        ({"forward_m": 10.5}, 10.5), ({"right_m": 5.5}, 5.5), ({"height_m": 5.5}, 1.77),
        ({"yaw_rad": 0.01}, 0.29), ({"pitch_rad": 0.05}, 4.65), ({"roll_rad": 0.02}, 1.96),
    ],
)  # fmt: skip
def test_the_error_budget_is_that_of_table_ii_to_two_digits(error, printed_m):
    """Tisdale et al. 2008: the target is in the middle of the picture, theta = 0.17, phi = 0.26, psi = 0."""
    found = ground_spread((0.0, 0.0), sight(PoseErrors(**{**NONE, **error}), (0.26, 0.17, 0.0)), SURE)
    radius_m = math.sqrt(np.trace(found))
    half_a_digit_m = 0.05 * 10.0 ** math.floor(math.log10(printed_m))
    assert radius_m == pytest.approx(printed_m, abs=half_a_digit_m)


def test_the_rate_is_bayes_rule_on_the_resolutions():
    resolution_px = np.array([5.0, 30.0, 60.0, 90.0, 150.0])
    detected = 0.96 * stats.norm.pdf(resolution_px, 60.0, 40.06)
    missed = 0.04 * stats.norm.pdf(resolution_px, 60.0, 62.03)
    assert PAPER_RATE.probability(resolution_px) == pytest.approx(detected / (detected + missed))
    assert PAPER_RATE.probability(60.0) == pytest.approx(0.974, abs=5e-4)
    assert PAPER_RATE.probability(150.0) == pytest.approx(0.895, abs=5e-4)


NO_ERRORS = PoseErrors(**NONE)
ERRORS = PoseErrors(
    forward_m=3.0, right_m=1.5, height_m=2.0, yaw_rad=0.03, pitch_rad=0.03, roll_rad=0.02, mount_rad=0.01
)


def drawn_pixels(euler, place, targets, count, rng, errors=ERRORS):
    """Pixels (targets, count, 2) at which drawn poses see the targets, and the resolutions: the projection of
    OpenCV, not linearised.
    """
    camera = CameraGeometry(
        width_px=1280, height_px=720, focal_px=(914.0, 914.0), centre_px=(640.0, 360.0), distortion=BARREL
    )
    pixels, resolutions = np.empty((len(targets), count, 2)), np.empty((len(targets), count))
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # to OpenCV's
    yaw = euler[2]
    sigmas = (errors.roll_rad, errors.pitch_rad, errors.yaw_rad)
    for k in range(count):
        angles = np.array(euler) + rng.standard_normal(3) * sigmas
        forward, right, height = rng.standard_normal(3) * (errors.forward_m, errors.right_m, errors.height_m)
        moved = (
            forward * math.cos(yaw) - right * math.sin(yaw),
            forward * math.sin(yaw) + right * math.cos(yaw),
            height,
        )
        eye = np.add(place, moved)
        mount = from_euler(*(errors.mount_rad * rng.standard_normal(3)))
        to_camera = axes @ rotation_matrix(product(product(from_euler(*angles), DOWN), mount)).T
        points = (np.column_stack((targets, np.zeros(len(targets)))) - eye) @ to_camera.T
        pixels[:, k] = camera.pixels(points)
        resolutions[:, k] = 914.0 * 2.0 * np.sqrt(-eye[2] / points[:, 2] ** 3)
    return pixels, resolutions


@pytest.mark.slow
def test_the_probability_of_detection_is_that_of_drawn_poses():
    euler, place = (0.2, -0.1, 0.7), (10.0, -5.0, -90.0)
    targets = np.random.default_rng(1).uniform(-110.0, 110.0, (60, 2))
    pixels, px = drawn_pixels(euler, place, targets, 3000, np.random.default_rng(2))
    edge = SURE.border_sides * px
    visible = (pixels[..., 0] > edge) & (pixels[..., 0] < 1280.0 - edge)
    visible &= (pixels[..., 1] > edge) & (pixels[..., 1] < 720.0 - edge)
    drawn = 0.9 * visible.mean(axis=1)
    found = 1.0 - FrameLikelihood.of(sight(ERRORS, euler, place=place), SURE, 1e3).at(*targets.T)
    assert np.sum((drawn > 0.05) & (drawn < 0.85)) >= 6  # targets at the border
    # the smoothing is linearised; errors of 3 degrees and 3 m bend it by some percent
    assert np.abs(found - drawn).max() < 0.03
    assert np.abs(found - drawn).mean() < 0.005


def test_the_density_of_a_detection_is_that_of_drawn_poses():
    """Where it is detected given that it is: relative likelihoods of places as those of a kernel estimate."""
    euler, place, small = (0.1, -0.1, 0.7), (0.0, 0.0, -90.0), PoseErrors(forward_m=2.0, right_m=1.0)
    targets = np.array([[5.0, 0.0], [10.0, 12.0], [-8.0, 6.0]])
    pixels, _ = drawn_pixels(euler, place, targets, 8000, np.random.default_rng(4), small)
    for target, seen in zip(targets, pixels, strict=True):
        rays = CameraGeometry(
            width_px=1280, height_px=720, focal_px=(914.0, 914.0), centre_px=(640.0, 360.0), distortion=BARREL
        ).rays(seen)
        middle = rays.mean(axis=0)
        for off in ((0.0, 0.0), (0.01, 0.01), (-0.02, 0.0)):
            z = middle + off
            density = stats.multivariate_normal(middle, np.cov(rays.T)).pdf(z)
            frame = FrameLikelihood.of(
                sight(small, euler, place=place, detections=[z]),
                SightModel(rate=SURE.rate, target_size_m=2.0, pixel_sigma_px=1e-3),
                1e3,
            )
            likelihood = float(frame.at(target[:1], target[1:])[0])
            area = 1280 * 720 / 914.0**2
            assert likelihood == pytest.approx(0.1 + 0.9 * density * area / 0.004, rel=0.12)


@pytest.mark.parametrize("ray", [(0.0, 0.0), (0.4, -0.3), (-0.5, 0.2)])
def test_the_ellipse_on_the_ground_is_that_of_the_picture(ray):
    """The spread in the picture through the derivative of the place that a ray meets, with its sign of the
    correlation: oblique cameras have long ellipses across neither axis.
    """
    seen = sight(ERRORS, (0.3, -0.2, 0.7))
    r = rotation_matrix(seen.q_ned_from_mount)

    def ground(a, b):
        direction = r @ (1.0, a, b)
        return 90.0 * direction[:2] / direction[2]

    step = 1e-5
    derivative = np.column_stack(
        [
            (ground(ray[0] + step, ray[1]) - ground(ray[0] - step, ray[1])) / (2.0 * step),
            (ground(ray[0], ray[1] + step) - ground(ray[0], ray[1] - step)) / (2.0 * step),
        ]
    )
    expected = derivative @ image_spread(ray, seen, SURE) @ derivative.T
    assert abs(expected[0, 1]) > 0.05 * math.sqrt(expected[0, 0] * expected[1, 1])
    assert ground_spread(ray, seen, SURE) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    "distortion",
    [
        (-0.3, 0.0, 0.0, 0.0, 0.0), (-0.2, 0.05, 0.0, 0.0, -0.02), (-0.1, -0.05, 0.0, 0.0, 0.0),
        (0.1, 0.0, 0.0, 0.0, -0.3), (0.1, -0.2, 0.0, 0.0, 0.01),
    ],
)  # fmt: skip
def test_the_fold_is_where_the_distorted_radius_stops_growing(distortion):
    """r (1 + k1 r^2 + k2 r^4 + k3 r^6) grows by less than a twentieth from there on."""
    k1, k2, _, _, k3 = distortion
    radius = np.linspace(0.0, 3.0, 30_001)
    growth = np.gradient(radius * (1.0 + k1 * radius**2 + k2 * radius**4 + k3 * radius**6), radius)
    fold = radius[np.argmax(growth <= 0.05)]
    assert math.sqrt(_fold(distortion)) == pytest.approx(fold, rel=0.021)


@pytest.mark.parametrize("height_m", [0.0, 1e-30, 1e-3, 60.0, 1e30])
@pytest.mark.parametrize("root", [(0.0, 0.0, 0.0), (65_000.0, -65_000.0, 65_000.0), (1e-7, 65_000.0, 0.0)])
def test_extreme_numbers_of_other_vehicles_do_not_raise(height_m, root):
    """As they may come over a link; covariances of rounded numbers are not quite positive definite."""
    seen = replace(
        sight(NO_ERRORS, place=(0.0, 0.0, -height_m), detections=[(10.0, -10.0)]),
        place_m2=np.array([[1e8, 1e8 + 1.0, 0.0], [1e8 + 1.0, 1e8, 0.0], [0.0, 0.0, 1e8]]),
        rotation_rad2=np.full((3, 3), 10.0),
        roots=np.array([root]),
    )
    for frame in (seen, seen.blurred(0.04), replace(seen, roots=None)):
        assert frame.known_m2 >= 0.0
        likelihood = FrameLikelihood.of(frame, SURE, 1e3)
        assert np.all(likelihood.at(np.zeros(2), np.array([0.0, 50.0])) >= 0.0)
        assert np.all(np.isfinite(likelihood.places()))


def test_two_detections_share_the_chance_to_be_true():
    one, two = ([(0.0, 0.0)], [(0.0, 0.0), (0.3, 0.1)])
    here = np.zeros(1), np.zeros(1)
    a, b = (FrameLikelihood.of(sight(ERRORS, detections=d), SURE, 1e3).at(*here)[0] for d in (one, two))
    assert b - 0.1 == pytest.approx(0.5 * (a - 0.1), rel=1e-3)


@settings(max_examples=40, deadline=None)
@given(
    roll=st.floats(-0.6, 0.6),
    pitch=st.floats(-0.6, 0.6),
    yaw=st.floats(-3.1, 3.1),
    height_m=st.floats(30.0, 150.0),
    scale=st.floats(0.0, 1.0),
    detected=st.booleans(),
)
def test_nothing_changes_outside_the_box(roll, pitch, yaw, height_m, scale, detected):
    errors = PoseErrors(**{name: scale * getattr(TABLE_II, name) for name in NONE}, mount_rad=0.01 * scale)
    frame = FrameLikelihood.of(
        sight(errors, (roll, pitch, yaw), place=(3.0, -2.0, -height_m), detections=[(0.1, 0.0)] * detected),
        SightModel(rate=DetectionRate.rising(half_px=12.0, width_px=2.0, peak=0.97), target_size_m=2.0),
        400.0,
    )
    south, west, north, east = frame.box
    places = np.random.default_rng(5).uniform(-400.0, 400.0, (4000, 2))
    found = frame.at(*np.ascontiguousarray(places.T))
    inside = (
        (places[:, 0] >= south) & (places[:, 0] <= north) & (places[:, 1] >= west) & (places[:, 1] <= east)
    )
    assert np.all(found >= 0.0)
    assert np.abs(found[~inside] - 1.0).max(initial=0.0) < 1e-3


def test_a_camera_that_sees_the_horizon_is_bounded_by_its_resolution():
    rising = DetectionRate.rising(half_px=12.0, width_px=1.0, peak=0.97)
    model = SightModel(rate=rising, target_size_m=2.0)
    frame = FrameLikelihood.of(sight(ERRORS, (0.0, 1.3, 0.0)), model, 1e5)
    assert 100.0 < frame.box[2] < 2000.0  # type: ignore[index]
    places = np.linspace(frame.box[2], 1e5, 1000)  # type: ignore[index]
    assert frame.at(places, np.zeros(1000)).min() > 1.0 - 1e-4
    far = FrameLikelihood.of(sight(ERRORS, (0.0, 1.3, 0.0)), SURE, 5000.0)
    assert far.box[2] == 5000.0  # type: ignore[index]


def test_a_camera_on_the_ground_says_nothing():
    frame = FrameLikelihood.of(sight(ERRORS, place=(0.0, 0.0, 0.5)), SURE, 1e3)
    assert frame.box is None
    assert frame.at(np.zeros(3), np.arange(3.0)).tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("make", "reported"),
    [
        (lambda: SightModel(rate=PAPER_RATE, target_size_m=2.0, false_rate=0.0), "false_rate 0"),
        (lambda: SightModel(rate=PAPER_RATE, target_size_m=0.0), "target_size_m 0"),
        (lambda: DetectionRate(peak=1.1), "peak 1.1"),
        (lambda: PoseErrors(forward_m=-1.0), "forward_m -1"),
        (lambda: sight(ERRORS, place=(math.nan, 0.0, -1.0)), "not finite"),
        (lambda: sight(ERRORS, distortion=(0.0,)), "is not k1, k2, p1, p2, k3"),
    ],
)
def test_impossible_values_are_named(make, reported):
    with pytest.raises(EstimatorError, match=reported):
        make()
