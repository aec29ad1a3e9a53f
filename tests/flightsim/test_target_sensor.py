"""The target sensor: probability of detection, noise and false detections against their distributions."""

import math

import numpy as np
import pytest
from scipy import stats

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.home import Home
from flightsim.payload import (
    GroundTargetParameters,
    GroundTargets,
    ScanDisturbance,
    Static,
    TargetSensor,
    TargetSensorParameters,
    Terrain,
    TerrainSpec,
)

HOME = Home()


def make(parameters, places, *, heading_rad=0.0, seed=1, terrain=None, height_m=20.0):
    streams = RandomStreams(seed)
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(HOME.lat_deg), math.radians(HOME.lon_deg)
    truth[t.ALT_M] = HOME.alt_m + height_m
    quaternion_from_euler(0.0, 0.0, heading_rad, truth[t.Q_NED_FROM_FRD])
    targets = GroundTargets(
        [GroundTargetParameters(motion=Static(north_m=n, east_m=e)) for n, e in places],
        seeds=lambda i: streams.child("target", i),
    )
    return TargetSensor(
        parameters,
        truth=truth,
        home=HOME,
        targets=targets,
        physics_rate_hz=250,
        seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
        terrain=terrain,
    )


def scans_of(sensor, count, start=0):
    found = []
    step = start
    while len(found) < count:
        scan = sensor.step(step * 4000)
        step += 1
        if scan is not None:
            found.append(scan)
    return found


def test_the_share_of_detections_is_the_papers_probability():
    # the values that follow from G = 0.98 and F = 15 m at 0, 9, 15, 30, 60 m
    expected = [0.98, 0.726, 0.594, 0.361, 0.133]
    for distance_m, probability in zip([0.0, 9.0, 15.0, 30.0, 60.0], expected, strict=True):
        sensor = make(TargetSensorParameters(period_s=0.004), [(0.0, distance_m)])
        assert sensor.parameters.probability(0.0, distance_m) == pytest.approx(probability, abs=6e-4)
        hits = sum(len(scan.detections) for scan in scans_of(sensor, 4000))
        assert stats.binomtest(hits, 4000, probability).pvalue > 1e-3


def test_noise_of_range_and_bearing_and_the_bearing_from_the_nose():
    p = TargetSensorParameters(period_s=0.004, gain=1.0, range_sigma_m=0.7, bearing_sigma_rad=0.04)
    sensor = make(p, [(8.0, 6.0)], heading_rad=math.radians(200.0))
    places = np.array([d for scan in scans_of(sensor, 6000) for d in scan.detections])
    bearing = math.remainder(math.atan2(6.0, 8.0) - math.radians(200.0), math.tau)
    assert stats.kstest((places[:, 0] - 10.0) / 0.7, "norm").pvalue > 1e-3
    off = np.array([math.remainder(value - bearing, math.tau) for value in places[:, 1]])
    assert stats.kstest(off / 0.04, "norm").pvalue > 1e-3


def test_the_field_of_view_is_the_bodys():
    p = TargetSensorParameters(forward_scale_m=30.0, right_scale_m=10.0)
    assert p.probability(30.0, 0.0) == pytest.approx(0.98 * math.exp(-0.5))
    assert p.probability(0.0, 30.0) == pytest.approx(0.98 * math.exp(-1.5))
    assert p.probability(0.0, 100.1) == 0.0


def test_false_detections_are_poisson_and_uniform_over_the_field_of_view():
    sensor = make(TargetSensorParameters(period_s=0.004, clutter_per_scan=2.0), [])
    scans = scans_of(sensor, 3000)
    counts = np.array([len(scan.detections) for scan in scans])
    assert counts.mean() == pytest.approx(2.0, abs=4.0 * math.sqrt(2.0 / 3000))
    assert counts.var() == pytest.approx(2.0, rel=0.15)
    places = np.array([d for scan in scans for d in scan.detections])
    assert stats.kstest((places[:, 0] / 100.0) ** 2, "uniform").pvalue > 1e-3
    assert stats.kstest((places[:, 1] + math.pi) / math.tau, "uniform").pvalue > 1e-3


def test_an_empty_scan_is_a_scan_and_an_outage_is_none():
    p = TargetSensorParameters(
        disturbances=(
            ScanDisturbance(start_s=2.5, duration_s=3.0),
            ScanDisturbance(start_s=7.5, duration_s=1.0, clutter_per_scan=200.0),
        )
    )
    sensor = make(p, [])
    scans = [scan for step in range(250 * 10) if (scan := sensor.step(step * 4000)) is not None]
    assert [scan.number for scan in scans] == list(range(7))
    assert [scan.time_us // 1_000_000 for scan in scans] == [0, 1, 2, 6, 7, 8, 9]
    assert [len(scan.detections) > 100 for scan in scans] == [False] * 5 + [True, False]


def test_another_target_changes_no_detection_of_the_first():
    p = TargetSensorParameters(period_s=0.02)
    one = scans_of(make(p, [(10.0, 0.0)]), 200)
    two = scans_of(make(p, [(10.0, 0.0), (-20.0, 5.0)]), 200)
    again = scans_of(make(p, [(10.0, 0.0)]), 200)
    assert one == again
    assert all(set(a.detections) <= set(b.detections) for a, b in zip(one, two, strict=True))


def test_an_outage_changes_no_later_scan():
    usual = TargetSensorParameters(period_s=0.02)
    broken = TargetSensorParameters(
        period_s=0.02, disturbances=(ScanDisturbance(start_s=1.0, duration_s=1.0),)
    )
    first, second = (scans_of(make(p, [(10.0, 0.0)]), 200) for p in (usual, broken))
    late = {scan.time_us: scan.detections for scan in first}
    assert all(late.get(scan.time_us, scan.detections) == scan.detections for scan in second)


def test_a_period_that_is_no_multiple_of_the_step_is_refused():
    with pytest.raises(ValueError, match=r"period_s = 0\.005 is not accepted"):
        make(TargetSensorParameters(period_s=0.005), [])


def test_a_ridge_hides_what_is_behind_it():
    height_m = np.zeros((41, 41))
    height_m[25, :] = 30.0  # a wall 50 m north of the first row's place at -100 m
    wall = Terrain(south_m=-100.0, west_m=-100.0, spacing_m=5.0, height_m=height_m)
    eye = (0.0, 0.0, -20.0)
    assert wall.hides(eye, 60.0, 0.0, 2.0)
    assert not wall.hides(eye, 20.0, 0.0, 2.0)
    assert not wall.hides(eye, -60.0, 0.0, 2.0)
    assert not wall.hides((0.0, 0.0, -120.0), 60.0, 0.0, 2.0)  # over the wall
    p = TargetSensorParameters(period_s=0.004, gain=1.0, forward_scale_m=1000.0)
    scans = scans_of(make(p, [(60.0, 0.0)], terrain=wall), 300)
    assert not any(scan.detections for scan in scans)


def test_terrain_is_bilinear_between_its_points():
    made = Terrain(south_m=0.0, west_m=0.0, spacing_m=10.0, height_m=np.array([[0.0, 1.0], [2.0, 5.0]]))
    at = made.at(np.array([0.0, 5.0, 10.0, 99.0]), np.array([0.0, 5.0, 0.0, 99.0]))
    assert at == pytest.approx([0.0, 2.0, 2.0, 5.0])


def test_generated_terrain_has_its_relief_and_spectrum():
    spec = TerrainSpec(south_m=-500.0, west_m=-500.0, north_m=500.0, east_m=500.0, relief_m=12.0, hurst=0.7)
    slopes = []
    for seed in range(10):
        made = spec.made(seed)
        assert np.std(made.height_m) == pytest.approx(12.0)
        # structure function: E[(h(x + d) - h(x))^2] grows as d^(2H) (Turcotte 1997)
        lags = np.array([2, 4, 8, 16])
        squares = [np.mean((made.height_m[lag:] - made.height_m[:-lag]) ** 2) for lag in lags]
        slopes.append(np.polyfit(np.log(lags), np.log(squares), 1)[0])
    assert np.mean(slopes) == pytest.approx(1.4, abs=0.2)
    assert np.array_equal(spec.made(3).height_m, spec.made(3).height_m)
    assert not np.array_equal(spec.made(3).height_m, spec.made(4).height_m)
