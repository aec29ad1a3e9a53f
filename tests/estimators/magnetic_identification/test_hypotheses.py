"""Filters of one hypothesis: evidence against the density of all measurements, and figures 4 and 5."""

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from estimators.magnetic_identification import particles as p
from estimators.magnetic_identification.classes import DipoleClass, GaussianClass
from estimators.magnetic_identification.hypotheses import Before, ShapelessHypothesis
from estimators.magnetic_identification.particle_hypotheses import DipoleHypothesis, GaussianHypothesis
from estimators.tracking.modes import find_modes
from flightsim.payload import DipoleSignature
from missions.studies.magnetic_passes import diagonal_pass
from tests.estimators.magnetic_identification.encounters import (
    CORRELATION_M,
    DIRECTION,
    HEIGHT_M,
    MAP_NT,
    NOISE_NT,
    measurement,
    straight,
)
from tests.slow import slow_after

STEP_M = 20.0
COUNT = 15
ALONG_M = -140.0 + STEP_M * np.arange(COUNT)


def map_covariance():
    apart = np.abs(ALONG_M[:, None] - ALONG_M)
    return MAP_NT**2 * np.exp(-apart / CORRELATION_M) + NOISE_NT**2 * np.eye(COUNT)


def put(hypothesis, *, y_m, **places):
    """All particles at one pose, on a straight track along x."""
    hypothesis.particles[p.X], hypothesis.particles[p.Y] = ALONG_M[0], y_m
    hypothesis.particles[p.COS], hypothesis.particles[p.SIN] = 1.0, 0.0
    for place, value in places.items():
        hypothesis.particles[getattr(p, place)] = value
    hypothesis.weights[:] = 1.0 / len(hypothesis.weights)


def density_of(hypothesis, values):
    """Logarithm of the density of all measurements, by the filter's steps."""
    total = hypothesis.step(straight(0.0), measurement(values[0])).log_density
    return total + sum(hypothesis.step(straight(STEP_M), measurement(v)).log_density for v in values[1:])


def test_the_evidence_of_a_gaussian_is_the_density_of_all_measurements_together():
    of = GaussianClass(name="target", amplitude_spread=0.2, size_spread=0.0)
    hypothesis = GaussianHypothesis(of, 10, np.random.default_rng(1))
    hypothesis.start(measurement(3.0), MAP_NT**2)
    put(
        hypothesis,
        y_m=25.0,
        PER_ALONG=1.0 / 80.0,
        PER_ACROSS=1.0 / 60.0,
        AMPLITUDE=1.0,
        MAP=0.0,
        AMPLITUDE_VAR=0.04,
        AMPLITUDE_MAP=0.0,
        MAP_VAR=MAP_NT**2,
    )
    shape = 30.0 * np.exp(-0.5 * ((ALONG_M / 80.0) ** 2 + (25.0 / 60.0) ** 2))
    values = 1.1 * shape + np.random.default_rng(2).standard_normal(COUNT)
    together = multivariate_normal(shape, map_covariance() + 0.04 * np.outer(shape, shape))
    assert density_of(hypothesis, values) == pytest.approx(together.logpdf(values), abs=1e-6)


def test_the_evidence_of_a_dipole_is_the_density_of_all_measurements_together():
    of = DipoleClass(name="boat", strength_nt=10.0)
    hypothesis = DipoleHypothesis(of, 10, np.random.default_rng(1), field_ned=DIRECTION)
    hypothesis.start(measurement(3.0), MAP_NT**2)
    hypothesis.particles[p.MEANS : p.DIPOLE] = 0.0
    put(hypothesis, y_m=-30.0, HEIGHT=0.0, RANGE=HEIGHT_M)
    for diagonal in p.STRENGTH_VARIANCES:
        hypothesis.particles[diagonal] = 100.0
    hypothesis.particles[p.DIPOLE_MAP_VAR] = MAP_NT**2
    # the simulator's dipole; in a field this strong only its part along the field changes the magnitude
    moment = HEIGHT_M**3 / 100.0
    terms = np.array(
        [
            DipoleSignature(north_m=0.0, east_m=0.0, height_m=0.0, moment_ned_a_m2=axis).anomaly_nt(
                ALONG_M, np.full(COUNT, -30.0), HEIGHT_M, 1e9 * DIRECTION
            )
            for axis in ((moment, 0.0, 0.0), (0.0, moment, 0.0), (0.0, 0.0, moment))
        ]
    )
    values = 12.0 * terms[2] + np.random.default_rng(2).standard_normal(COUNT)
    together = multivariate_normal(np.zeros(COUNT), map_covariance() + 100.0 * terms.T @ terms)
    assert density_of(hypothesis, values) == pytest.approx(together.logpdf(values), abs=1e-4)


def test_the_evidence_without_a_signature_is_that_of_the_process():
    values = np.random.default_rng(4).standard_normal(COUNT)
    hypothesis = ShapelessHypothesis(MAP_NT)
    total = hypothesis.start(measurement(values[0]), MAP_NT**2)
    total += sum(hypothesis.step(straight(STEP_M), measurement(v)).log_density for v in values[1:])
    assert total == pytest.approx(multivariate_normal(np.zeros(COUNT), map_covariance()).logpdf(values))


def test_the_first_evidence_is_the_mean_density_over_the_ellipse():
    """Importance sampling on the level curve, against plain sampling of the ellipse."""
    of = GaussianClass(name="target", amplitude_spread=0.15, size_spread=0.0)
    found = [
        GaussianHypothesis(of, 20_000, np.random.default_rng(seed)).start(measurement(4.0), MAP_NT**2)
        for seed in range(4)
    ]
    square = 3.5**2 * np.random.default_rng(9).random(2_000_000)
    level = 30.0 * np.exp(-0.5 * square)
    variance = NOISE_NT**2 + MAP_NT**2 + (0.15 * level) ** 2
    plain = np.mean(np.exp(-0.5 * (4.0 - level) ** 2 / variance) / np.sqrt(2.0 * math.pi * variance))
    assert found == pytest.approx([math.log(plain)] * 4, abs=0.03)


def test_an_anomaly_begins_where_the_track_enters_it():
    """The evidence of the first measurement beyond the threshold and of the one before, against plain
    sampling of tracks.
    """
    of = GaussianClass(name="target", amplitude_spread=0.0, size_spread=0.0)
    threshold_nt, then, now, control = 3.0, 1.5, 6.0, straight(STEP_M)
    before = Before(seen=measurement(then), control=control)
    found = []
    for seed in range(4):
        hypothesis = GaussianHypothesis(of, 20_000, np.random.default_rng(seed))
        found.append(hypothesis.start(measurement(now), MAP_NT**2, threshold_nt, before))
        outwards = hypothesis.particles[p.X] * hypothesis.particles[p.COS] / of.sigma_along_m**2
        outwards += hypothesis.particles[p.Y] * hypothesis.particles[p.SIN] / of.sigma_across_m**2
        assert hypothesis.weights[outwards > 0.0].sum() < 0.05
    rng = np.random.default_rng(9)
    count = 1_000_000
    distance, angle, course = 3.5 * np.sqrt(rng.random(count)), *rng.uniform(-math.pi, math.pi, (2, count))
    x, y = distance * np.cos(angle) * of.sigma_along_m, distance * np.sin(angle) * of.sigma_across_m
    ends = np.array([(x - STEP_M * np.cos(course), y - STEP_M * np.sin(course)), (x, y)])
    square = (ends[:, 0] / of.sigma_along_m) ** 2 + (ends[:, 1] / of.sigma_across_m) ** 2
    signal = of.amplitude_nt * np.exp(-0.5 * square)
    errors = multivariate_normal(
        np.zeros(2),
        MAP_NT**2 * np.array([[1.0, control.decay], [control.decay, 1.0]]) + NOISE_NT**2 * np.eye(2),
    )
    density = np.mean(errors.pdf(np.array([then, now]) - signal.T))
    seen = np.abs(signal.T + errors.rvs(count, random_state=rng))
    begins = np.mean((seen[:, 0] <= threshold_nt) & (seen[:, 1] > threshold_nt))
    assert found == pytest.approx([math.log(density / begins)] * 4, abs=0.15)


def test_without_a_signature_a_beginning_counts_given_that_it_is_one():
    then, now, threshold_nt = 1.0, 4.0, 3.0
    found = ShapelessHypothesis(MAP_NT).start(
        measurement(now), MAP_NT**2, threshold_nt, Before(seen=measurement(then), control=straight(STEP_M))
    )
    variance, shared = MAP_NT**2 + NOISE_NT**2, MAP_NT**2 * straight(STEP_M).decay
    pair = multivariate_normal(np.zeros(2), [[variance, shared], [shared, variance]])
    upper = [threshold_nt, -threshold_nt]
    # the second below, the first between the bounds; twice, for the other sign
    begins = 2.0 * (pair.cdf(upper) - pair.cdf([-threshold_nt, -threshold_nt]))
    assert found == pytest.approx(pair.logpdf([then, now]) - math.log(begins), abs=5e-3)


def test_equation_8_puts_the_source_where_it_is_seen_from_the_vehicle():
    """Vehicle 100 m along and 50 m right of the axis, flying across it to the right."""
    particle = np.zeros((p.GAUSSIAN, 1))
    particle[: p.POSE, 0] = (100.0, 50.0, 0.0, 1.0)
    out = np.empty((1, 3))
    p.relative_sources(particle, out)
    assert out[0] == pytest.approx((-50.0, 100.0, -0.5 * math.pi))


@pytest.mark.parametrize("seed", slow_after(1, range(2)))
def test_a_diagonal_pass_leaves_four_modes(seed):
    """Figures 4 and 5 with 200,000 particles: the modes that the paper's pair merged are separate."""
    hypothesis = diagonal_pass(seed, 200_000).hypothesis
    modes = find_modes(hypothesis.sources(), hypothesis.weights, least_cell=25.0)
    angles = sorted(math.degrees(mode.mean[2]) for mode in modes)
    assert angles == pytest.approx([-168.7, -11.3, 11.3, 168.7], abs=3.0)
    forward = sum(mode.weight * mode.mean[0] for mode in modes)
    right = sum(mode.weight * mode.mean[1] for mode in modes)
    assert forward == pytest.approx(-2250.0, rel=0.05)
    assert abs(right) < 0.05 * 2250.0
