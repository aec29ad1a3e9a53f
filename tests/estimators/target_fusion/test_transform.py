"""Equations 31 to 35 against finite differences and matrix algebra, and what a camera makes of a target."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.target_fusion import Range, TargetFusionParameters
from estimators.target_fusion.sight import Detection, place_in_level_frame
from estimators.target_fusion.transform import INFORMATION, add_information, belief_of, ground_target
from flightsim.foundation.vectors import from_euler, product, rotate, yaw_of

DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)


def spread(seed, size=2):
    root = np.random.default_rng(seed).normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


def packed(mean, covariance):
    return np.array([*mean, covariance[0, 0], covariance[0, 1], covariance[1, 1]])


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.floats(-4.0, 4.0))
def test_ground_target_is_the_first_order_transform(seed: int, heading: float) -> None:
    rng = np.random.default_rng(seed)
    drone, seen = rng.normal(size=2), 30.0 * rng.normal(size=2)
    own, camera, variance = spread(seed), spread(seed + 1), 0.02

    def place(values):
        x, y, angle, forward, side = values
        c, s = math.cos(angle), math.sin(angle)
        return np.array([x + c * forward - s * side, y + s * forward + c * side])

    at = np.array([*drone, heading, *seen])
    slope = np.stack(
        [(place(at + 1e-6 * unit) - place(at - 1e-6 * unit)) / 2e-6 for unit in np.eye(5)], axis=1
    )
    full = np.zeros((5, 5))
    full[:2, :2], full[2, 2], full[3:, 3:] = own, variance, camera
    expected = slope @ full @ slope.T
    out = np.zeros(5)
    ground_target(*drone, own[0, 0], own[0, 1], own[1, 1], heading, variance, seen, camera, out)  # type: ignore[call-arg]
    assert out == pytest.approx(packed(place(at), expected), rel=1e-6, abs=1e-6)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 5))
def test_fusion_is_equation_35(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    means = rng.normal(size=(count, 2))
    covariances = [spread(seed + k) for k in range(count)]
    information = np.zeros(INFORMATION)
    for mean, covariance in zip(means, covariances, strict=True):
        assert add_information(packed(mean, covariance), information)
    expected = np.linalg.inv(sum(np.linalg.inv(c) for c in covariances))
    fused = expected @ sum(np.linalg.solve(c, m) for c, m in zip(covariances, means, strict=True))
    out = np.zeros(5)
    assert belief_of(information, out)
    assert out == pytest.approx(packed(fused, expected))


@pytest.mark.parametrize(
    "covariance", [(0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (math.nan, 0.0, 1.0), (1.0, 0.0, math.inf)]
)
def test_what_is_no_covariance_is_left_out(covariance: tuple[float, float, float]) -> None:
    information = np.zeros(INFORMATION)
    assert not add_information(np.array([1.0, 2.0, *covariance]), information)
    assert not information.any()
    assert not belief_of(information, np.zeros(5))


@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_rotations_are_yaw_pitch_roll(angles: tuple[float, float, float]) -> None:
    roll, pitch, yaw = angles
    whole = from_euler(roll, pitch, yaw)
    parts = product(from_euler(0, 0, yaw), product(from_euler(0, pitch, 0), from_euler(roll, 0, 0)))
    assert whole == pytest.approx(parts)
    assert yaw_of(from_euler(roll, 0.0, yaw)) == pytest.approx(yaw)
    assert rotate(from_euler(0.0, pitch, 0.0), (1.0, 0.0, 0.0)) == pytest.approx(
        (math.cos(pitch), 0.0, -math.sin(pitch))
    )


def detected(x=0.0, y=0.0, distance=0.0, size=0.0):
    return Detection(0, 1, 7, x, y, distance, size)


@pytest.mark.parametrize(
    ("chosen", "given_by"),
    [
        ({"distance": Range.MESSAGE}, {"distance": 25.0 * math.sqrt(1.25), "size": 0.04}),
        (
            {"distance": Range.SIZE, "target_size_m": 1.0},
            {"size": 2.0 * math.atan(0.5 / (25.0 * math.sqrt(1.25)))},
        ),
        ({"distance": Range.HEIGHT}, {}),
        ({}, {}),
    ],
)
def test_a_camera_that_looks_down_finds_the_place(chosen, given_by) -> None:
    """25 m up, the target half of that to the right in the picture: to the right of the nose."""
    found = place_in_level_frame(
        detected(x=math.atan(0.5), **given_by), DOWN, 25.0, TargetFusionParameters(**chosen)
    )
    assert found is not None
    assert found.place_m == pytest.approx((0.0, 12.5), abs=1e-9)
    assert np.all(np.linalg.eigvalsh(found.covariance_m2) > 0.0)


def test_a_stated_range_counts_along_the_line_of_sight() -> None:
    """A level line of sight at 40 m: the range's error forward, the bearing's across."""
    p = TargetFusionParameters(range_sigma=0.1, bearing_sigma_rad=0.01, tilt_sigma_rad=1e-6)
    found = place_in_level_frame(detected(distance=40.0), (1.0, 0.0, 0.0, 0.0), math.nan, p)
    assert found is not None
    assert found.place_m == pytest.approx((40.0, 0.0))
    assert found.covariance_m2 == pytest.approx(np.diag([16.0, 0.16]), abs=1e-6)


def test_a_line_of_sight_without_a_length_gives_nothing() -> None:
    level = (1.0, 0.0, 0.0, 0.0)
    p = TargetFusionParameters()
    assert place_in_level_frame(detected(), level, 25.0, p) is None  # meets no ground
    assert place_in_level_frame(detected(), DOWN, math.nan, p) is None
    assert (
        place_in_level_frame(detected(size=0.04), DOWN, 25.0, TargetFusionParameters(distance="message"))
        is None
    )
