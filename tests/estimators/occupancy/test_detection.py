"""Detection model and anomaly detector of the occupancy search (Lum et al. 2005)."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.errors import EstimatorError
from estimators.occupancy.detection import AnomalyDetector, DetectionModel

PLACES = st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0))


def probability(model: DetectionModel, target, start, end) -> float:
    return float(model.probability(np.array(target[0]), np.array(target[1]), start, end))


def test_straight_pass_overhead_has_the_probability_requested():
    model = DetectionModel(probability_overhead=0.9, range_m=50.0)
    assert probability(model, (0.0, 0.0), (-1000.0, 0.0), (1000.0, 0.0)) == pytest.approx(0.9, abs=1e-4)


def test_pass_at_an_offset_follows_the_closed_form():
    model = DetectionModel(probability_overhead=0.9, range_m=50.0)
    expected = 1.0 - (1.0 - 0.9) ** math.exp(-0.5 * (80.0 / 50.0) ** 2)
    assert probability(model, (0.0, 80.0), (-1000.0, 0.0), (1000.0, 0.0)) == pytest.approx(expected, abs=1e-4)


@settings(max_examples=50, deadline=None)
@given(start=PLACES, end=PLACES, share=st.floats(0.05, 0.95))
def test_a_pass_cut_in_two_misses_as_often_as_the_whole(start, end, share):
    model = DetectionModel(probability_overhead=0.8, range_m=60.0)
    cut = (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
    target = (20.0, -35.0)
    whole = 1.0 - probability(model, target, start, end)
    parts = (1.0 - probability(model, target, start, cut)) * (1.0 - probability(model, target, cut, end))
    assert parts == pytest.approx(whole, abs=1e-4)


def test_standing_still_detects_nothing():
    assert probability(DetectionModel(), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)) == 0.0


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"probability_overhead": 1.0}, "`detection_probability` 1"),
        ({"probability_overhead": math.nan}, "`detection_probability` nan"),
        ({"range_m": 0.0}, "`detection_range_m` 0"),
        ({"range_m": math.inf}, "`detection_range_m` inf"),
    ],
)
def test_bad_models_are_refused_by_name(values, named):
    with pytest.raises(EstimatorError, match=named):
        DetectionModel(**values)


def feed(detector: AnomalyDetector, values_nt, map_nt=50_000.0, rate_hz=10.0):
    found = []
    for index, value in enumerate(values_nt):
        time_us = round(index * 1e6 / rate_hz)
        anomaly = detector.update(time_us, map_nt + value, map_nt, float(index), 0.0)
        if anomaly is not None:
            found.append(anomaly)
    return found


def test_anomaly_is_reported_at_its_peak_when_it_ends():
    values = [0.1] * 50 + [2.0, 6.0, 9.0, 5.0, 1.5] + [0.0] * 20
    (anomaly,) = feed(AnomalyDetector(threshold_nt=1.0), values)
    assert anomaly.peak_nt == pytest.approx(8.9, abs=0.1)
    assert anomaly.north_m == 52.0
    assert anomaly.time_us == 5_200_000
    assert anomaly.samples == 5


def test_negative_anomaly_keeps_its_sign():
    (anomaly,) = feed(AnomalyDetector(threshold_nt=1.0), [0.0] * 10 + [-4.0, -7.0, -3.0] + [0.0] * 10)
    assert anomaly.peak_nt == pytest.approx(-7.0)


def test_single_outlier_is_none():
    assert feed(AnomalyDetector(threshold_nt=1.0), [0.0] * 10 + [30.0] + [0.0] * 10) == []


def test_bias_and_slow_drift_are_followed():
    drift = np.linspace(40.0, 45.0, 3000)
    assert feed(AnomalyDetector(threshold_nt=1.0), drift.tolist()) == []


def test_bad_readings_are_dropped_and_counted():
    detector = AnomalyDetector(threshold_nt=1.0)
    detector.update(100, 50_000.0, 50_000.0, 0.0, 0.0)
    detector.update(200, math.nan, 50_000.0, 0.0, 0.0)
    detector.update(300, 50_000.0, math.nan, 0.0, 0.0)  # off the map
    detector.update(100, 50_090.0, 50_000.0, 0.0, 0.0)  # late
    assert detector.dropped == 3
    assert detector.residual_nt == 0.0


@pytest.mark.parametrize("threshold_nt", [0.0, -1.0, math.nan, math.inf])
def test_bad_threshold_is_refused_by_name(threshold_nt):
    with pytest.raises(EstimatorError, match="`threshold_nt`"):
        AnomalyDetector(threshold_nt=threshold_nt)


def test_noise_about_the_threshold_does_not_cut_an_anomaly_in_two():
    detector = AnomalyDetector(threshold_nt=3.0)
    ended = []
    for k, residual in enumerate([0.0, 0.0, 3.5, 4.0, 2.9, 3.2, 2.0, 3.4, 1.0, 0.0]):
        anomaly = detector.update(100_000 * (k + 1), 48_000.0 + residual, 48_000.0, 2.5 * k, 0.0)
        if anomaly is not None:
            ended.append(anomaly)
    (anomaly,) = ended
    assert anomaly.samples == 4  # beyond the threshold itself
    assert anomaly.peak_nt == pytest.approx(4.0, abs=0.1)


def test_a_level_that_is_off_does_not_blind_for_good():
    detector = AnomalyDetector(threshold_nt=3.0, longest_s=10.0)
    for k in range(3):
        detector.update(100_000 * (k + 1), 48_020.0, 48_000.0, 0.0, 0.0)  # begun over a target
    for k in range(3, 150):
        assert detector.update(100_000 * (k + 1), 48_000.0, 48_000.0, 2.5 * k, 0.0) is None
    assert not detector.anomalous
    assert detector.residual_nt == pytest.approx(0.0)
