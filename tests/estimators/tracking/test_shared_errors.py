"""Detections that share errors add up to what is known, in worlds that the filter does not know."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.localization_coverage import DEFAULT, FOCAL_PX, INSIDE_95, WORLDS, fly
from estimators.tracking.camera_sight import PoseErrors, rotation_matrix
from estimators.tracking.shared_errors import SharedErrors, View
from estimators.vision_search.models import pose_errors_of
from flightsim.foundation.vectors import from_euler, product

DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)
ERRORS = pose_errors_of(DEFAULT)
PIXEL_RAD = DEFAULT.pixel_sigma_px / FOCAL_PX


def view_of(look):
    return View(
        time_us=round(1e6 * look.time_s),
        place_ne_m=look.place_ned_m[:2],
        height_m=-look.place_ned_m[2],
        q_ned_from_frd=look.q_ned_from_frd,
        q_frd_from_mount=DOWN,
        ray=look.ray,
        rate_m_s=look.velocity_m_s,
    )


def on_ground(view, detection):
    """Information and information vector (north, east) of a detection, by plain geometry."""
    rotation = rotation_matrix(product(view.q_ned_from_frd, DOWN))

    def place(a, b):
        line = rotation @ (1.0, a, b)
        return np.array(view.place_ne_m) + view.height_m * line[:2] / line[2]

    step, (a, b) = 1e-5, view.ray
    by_ray = np.column_stack(
        [
            (place(a + step, b) - place(a - step, b)) / (2.0 * step),
            (place(a, b + step) - place(a, b - step)) / (2.0 * step),
        ]
    )
    root = np.array([[detection.first, 0.0], [detection.cross, detection.last]])
    by_place = np.linalg.inv(by_ray)
    information = by_place.T @ root @ root.T @ by_place
    stands_for = place(a, b) + by_ray @ (detection.a - a, detection.b - b)
    return information, information @ stands_for


def product_of(views, errors=ERRORS):
    """Mean and covariance of the product of the detections' Gaussians, and what the filter knows itself."""
    shared = SharedErrors(errors, PIXEL_RAD)
    parts = [on_ground(view, shared.take(view)) for view in views]
    covariance = np.linalg.inv(sum(part[0] for part in parts))
    return covariance @ sum(part[1] for part in parts), covariance, shared.covariance_m2


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("world", "passes"), [("nominal", 6), ("mixed", 2), ("mixed", 6)])
def test_the_ellipse_holds_the_tag_in_worlds_that_the_filter_does_not_know(world, passes):
    """Of a mount turned by a degree, late pictures, a biased heading and another ground the filter knows only
    that such errors exist.
    """
    squared, sigma_m = [], []
    for seed in range(60):
        looks, target = fly(WORLDS[world].setting, seed, passes)
        mean, covariance, _ = product_of([view_of(look) for look in looks])
        off = target - mean
        squared.append(float(off @ np.linalg.solve(covariance, off)))
        sigma_m.append(np.linalg.det(covariance) ** 0.25)
    assert np.mean(np.array(squared) <= INSIDE_95) >= 0.9
    assert 0.6 < 0.5 * np.mean(squared) < 1.4
    assert np.median(sigma_m) < (0.16 if passes == 6 else 0.6)  # six directions estimate the errors


def test_the_product_of_the_detections_is_what_the_filter_knows():
    """Information below 1/400 of a detection waits for the next one, and stand-ins of 1e-5 replace it."""
    looks, _ = fly(WORLDS["mixed"].setting, 3, 4)
    _, covariance, known = product_of([view_of(look) for look in looks])
    assert covariance == pytest.approx(known, rel=0.03, abs=0.01 * np.trace(known))


def test_independent_errors_all_count():
    independent = PoseErrors()
    shared = SharedErrors(independent, 1e-3)
    found = [
        shared.take(
            View(
                time_us=250_000 * k, place_ne_m=(3.0, 4.0), height_m=60.0,
                q_ned_from_frd=from_euler(0.0, 0.1, 0.3), q_frd_from_mount=DOWN, ray=(0.1, -0.2),
            )
        )
        for k in range(5)
    ]  # fmt: skip
    for detection in found[1:]:
        assert detection == pytest.approx(found[0], rel=1e-6)


def alone(**errors):
    return PoseErrors(**(dict.fromkeys(PoseErrors.__dataclass_fields__, 0.0) | errors))


def looking(time_s, heading_rad, ray=(0.0, 0.0), rate_m_s=(0.0, 0.0)):
    return View(
        time_us=round(1e6 * time_s),
        place_ne_m=(0.0, 0.0),
        height_m=60.0,
        q_ned_from_frd=from_euler(0.0, 0.0, heading_rad),
        q_frd_from_mount=DOWN,
        ray=ray,
        rate_m_s=rate_m_s,
    )


def test_a_constant_error_counts_once_and_an_opposite_view_reveals_it():
    """A camera that is turned by 0.01 rad sees the tag 0.6 m off, and from the other side the other way."""
    shared = SharedErrors(alone(mount_rad=0.005), 1e-6)
    first = shared.take(looking(0.0, 0.0, (0.0, 0.01)))
    assert 1.0 / first.first == pytest.approx(0.005, rel=1e-3)
    again = shared.take(looking(1.0, 0.0, (0.0, 0.01)))
    assert max(again.first, again.last) < 0.01 * first.first
    shared.take(looking(60.0, math.pi, (0.0, 0.01)))
    known = shared.covariance_m2
    assert known is not None
    assert math.sqrt(known[0, 0]) < 1e-3  # what was 0.3 m


@pytest.mark.parametrize(
    ("errors", "rate_m_s", "ray", "sigma_m"),
    [
        ({"latency_s": 0.1}, (8.0, 0.0), (0.0, 0.0), (0.8, 0.0)),
        ({"ground_m": 4.0}, (0.0, 0.0), (0.25, 0.0), (0.0, 1.0)),
        ({"yaw_bias_rad": 0.05}, (0.0, 0.0), (0.25, 0.0), (0.75, 0.0)),
    ],
)
def test_errors_move_the_place_as_geometry_says(errors, rate_m_s, ray, sigma_m):
    """Late pictures along the way, the ground's height along the ray, and the heading across it."""
    shared = SharedErrors(alone(**errors), 1e-7)
    shared.take(looking(0.0, 0.0, ray, rate_m_s))
    known = shared.covariance_m2
    assert known is not None
    assert np.sqrt(np.diag(known)) == pytest.approx(sigma_m, abs=1e-3)


def test_a_false_detection_does_not_move_the_place():
    looks, target = fly(WORLDS["mixed"].setting, 5, 3)
    views = [view_of(look) for look in looks]
    shared = SharedErrors(ERRORS, PIXEL_RAD)
    parts = []
    for k, view in enumerate(views):
        if k == 5:
            shared.take(replace(view, time_us=view.time_us - 1, ray=(view.ray[0] + 0.4, view.ray[1])))
        parts.append(on_ground(view, shared.take(view)))
    with_false = np.linalg.solve(sum(part[0] for part in parts), sum(part[1] for part in parts))
    without, covariance, _ = product_of(views)
    assert np.abs(with_false - without).max() < 0.05 * math.sqrt(np.trace(covariance))
    assert np.hypot(*(with_false - target)) < 2.0
