"""The centre of a Gaussian from passes by it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.occupancy.detection import AnomalyDetector
from estimators.occupancy.localisation import gaussian_centre
from missions.occupancy.candidate import Candidate

TARGET = (430.0, -270.0)


def passed(offset_m, course_rad, *, amplitude_nt=30.0, sigmas=(70.0, 70.0), turn_rad=0.0, noise=0.0, seed=0):
    """Readings along a straight pass at an offset: (north, east, nT)."""
    along = np.arange(-400.0, 400.0, 2.5)
    c, s = math.cos(course_rad), math.sin(course_rad)
    north, east = TARGET[0] + along * c - offset_m * s, TARGET[1] + along * s + offset_m * c
    d_n, d_e = north - TARGET[0], east - TARGET[1]
    a = (d_n * math.cos(turn_rad) + d_e * math.sin(turn_rad)) / sigmas[0]
    b = (d_e * math.cos(turn_rad) - d_n * math.sin(turn_rad)) / sigmas[1]
    value = amplitude_nt * np.exp(-0.5 * (a * a + b * b))
    return north, east, value + np.random.default_rng(seed).normal(0.0, noise, len(along))


def together(*passes):
    return [np.concatenate(columns) for columns in zip(*passes, strict=True)]


@given(
    first=st.floats(-120.0, 120.0),
    second=st.floats(-120.0, 120.0),
    course=st.floats(0.0, 6.3),
    between=st.floats(0.7, 2.4),
    sign=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=50)
def test_two_crossing_passes_without_noise_give_the_centre(first, second, course, between, sign):
    readings = together(
        passed(first, course, amplitude_nt=30.0 * sign),
        passed(second, course + between, amplitude_nt=30.0 * sign),
    )
    centre = gaussian_centre(*readings, noise_nt=0.1)
    assert centre is not None
    assert centre == pytest.approx(TARGET, abs=0.5)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("sigmas", [(70.0, 70.0), (80.0, 60.0)])
def test_noise_and_a_target_that_is_not_quite_round_cost_some_metres(seed, sigmas):
    readings = together(
        passed(60.0, 0.3, sigmas=sigmas, turn_rad=0.8, noise=0.4, seed=seed),
        passed(-40.0, 1.9, sigmas=sigmas, turn_rad=0.8, noise=0.4, seed=seed + 100),
    )
    centre = gaussian_centre(*readings, noise_nt=0.5)
    assert centre is not None
    assert math.dist(centre, TARGET) < 40.0


def test_a_single_straight_pass_tells_no_centre():
    assert gaussian_centre(*passed(80.0, 0.5, noise=0.4), noise_nt=0.5) is None


@pytest.mark.parametrize("values", [[], [5.0] * 3, [0.1] * 50, [9.0] * 50])
def test_readings_that_are_no_gaussian_tell_nothing(values):
    rng = np.random.default_rng(3)
    north, east = rng.uniform(-100.0, 100.0, (2, len(values)))
    assert gaussian_centre(north, east, np.array(values), noise_nt=0.5) is None


def test_a_candidate_is_where_its_readings_say():
    seen = []
    for offset_m, course_rad in ((110.0, 0.2), (-90.0, 1.6)):
        detector = AnomalyDetector(threshold_nt=3.0)
        for k, (north, east, value) in enumerate(zip(*passed(offset_m, course_rad), strict=True)):
            anomaly = detector.update(100_000 * (k + 1), 48_000.0 + value, 48_000.0, north, east)
            if anomaly is not None:
                seen.append((0, anomaly))
    assert len(seen) == 2
    peaks = np.mean([(anomaly.north_m, anomaly.east_m) for _, anomaly in seen], axis=0)
    candidate = Candidate(anomalies=seen)
    assert math.dist(candidate.place_ne_m, TARGET) < 12.0 < math.dist(peaks, TARGET)
    alone = Candidate(anomalies=seen[:1])
    assert alone.place_ne_m == pytest.approx((seen[0][1].north_m, seen[0][1].east_m))
