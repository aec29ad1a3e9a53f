"""Hypotheses of an anomaly: evidence against the density of all measurements, and figures 4 and 5."""

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from estimators.magnetic_identification import particles as p
from estimators.magnetic_identification import signatures as s
from estimators.magnetic_identification.classes import DipoleClass, GaussianClass
from estimators.magnetic_identification.hypotheses import (
    BackgroundHypothesis,
    Beginning,
    EdgeHypothesis,
    ShapelessHypothesis,
)
from estimators.magnetic_identification.measurements import Measurements
from estimators.magnetic_identification.samples import Sample
from estimators.magnetic_identification.source_hypotheses import (
    BodyHypothesis,
    DipoleHypothesis,
    GaussianHypothesis,
)
from estimators.occupancy.detection import MapError
from estimators.tracking.modes import find_modes
from flightsim.payload import DipoleSignature
from missions.studies.magnetic_passes import diagonal_pass
from tests.estimators.magnetic_identification.encounters import (
    CORRELATION_M,
    DIRECTION,
    HEIGHT_M,
    MAP_NT,
    NOISE_NT,
)
from tests.slow import slow_after

STEP_M = 20.0
COUNT = 15
ALONG_M = -140.0 + STEP_M * np.arange(COUNT)
ERROR = MapError(sigma_nt=MAP_NT, correlation_m=CORRELATION_M)
THRESHOLD_NT = 3.0


def sample(north_m, residual_nt):
    return Sample(
        time_us=0, vehicle=1, north_m=north_m, east_m=0.0, height_m=HEIGHT_M, course_rad=0.0,
        residual_nt=residual_nt, readings=1, excess_nt2=0.0,
    )  # fmt: skip


def measurements(values, along_m=ALONG_M):
    found = Measurements(ERROR, sample(float(along_m[0]), float(values[0])))
    for north_m, value in zip(along_m[: len(values)].tolist(), values.tolist(), strict=True):
        found.add(sample(north_m, value), NOISE_NT**2)
    return found


def map_covariance(along_m=ALONG_M):
    """A Matern process with one derivative that is 1/e at the correlation distance."""
    apart = 2.1462 / CORRELATION_M * np.abs(along_m[:, None] - along_m)
    return MAP_NT**2 * (1.0 + apart) * np.exp(-apart) + NOISE_NT**2 * np.eye(len(along_m))


def beginning(north_m=ALONG_M[1], *, step_m=STEP_M):
    shared = float(map_covariance(np.array([0.0, step_m or 0.0]))[0, 1])
    return Beginning(
        threshold_nt=THRESHOLD_NT,
        north_m=float(north_m),
        east_m=0.0,
        step_ne_m=None if step_m is None else (step_m, 0.0),
        map_nt2=MAP_NT**2,
        shared_nt2=shared,
        white_nt2=NOISE_NT**2,
    )


def run(hypothesis, values):
    """Logarithm of the density of all measurements, of which the second begins the anomaly."""
    seen = measurements(values[:2])
    total = hypothesis.start(seen, beginning())
    for north_m, value in zip(ALONG_M[2:].tolist(), values[2:].tolist(), strict=True):
        seen.add(sample(north_m, value), NOISE_NT**2)
        total += hypothesis.step(seen).log_density
    return total


def test_whitened_measurements_have_the_density_of_all_together():
    values = np.random.default_rng(4).standard_normal(COUNT)
    seen = measurements(values)
    together = multivariate_normal(np.zeros(COUNT), map_covariance())
    assert seen.log_density() == pytest.approx(together.logpdf(values))
    assert seen.log_density(5) == pytest.approx(
        together.logpdf(values)
        - multivariate_normal(np.zeros(5), map_covariance(ALONG_M[:5])).logpdf(values[:5])
    )
    signals = np.random.default_rng(5).standard_normal((COUNT, 2))
    white = seen.whitened(signals)
    assert white.T @ white == pytest.approx(signals.T @ np.linalg.inv(map_covariance()) @ signals)
    assert seen.whitened_next(signals[-1], white[:-1]) == pytest.approx(white[-1])


def test_there_is_room_for_any_number_of_measurements():
    along_m = 30.0 * np.arange(150)
    values = np.random.default_rng(4).standard_normal(150)
    together = multivariate_normal(np.zeros(150), map_covariance(along_m))
    assert measurements(values, along_m).log_density() == pytest.approx(together.logpdf(values))


def one_source(hypothesis, values, **places):
    """The density under one source, which does not move."""
    seen = measurements(values)
    hypothesis.start(measurements(values[:1]), beginning(ALONG_M[0], step_m=None))
    hypothesis.sources[:] = 0.0
    for place, value in places.items():
        hypothesis.sources[getattr(s, place)] = value
    _, precision, product = hypothesis._weighed(hypothesis.sources, seen, COUNT)
    gains, _, _ = hypothesis._integrated(precision, product)
    return seen.log_density() + gains[0]


def test_the_evidence_of_a_gaussian_is_the_density_of_all_measurements_together():
    """Of seven members one is atypical: the strengths are a mixture."""
    of = GaussianClass(name="target", amplitude_spread=0.2, size_spread=0.0)
    shape = 30.0 * np.exp(-0.5 * ((ALONG_M / 80.0) ** 2 + (25.0 / 60.0) ** 2))
    values = 1.1 * shape + np.random.default_rng(2).standard_normal(COUNT)
    found = one_source(
        GaussianHypothesis(of, 10, np.random.default_rng(1)),
        values,
        EAST=-25.0,
        LOG_ALONG=math.log(80.0),
        LOG_ACROSS=math.log(60.0),
    )
    density = sum(
        share * multivariate_normal(shape, map_covariance() + spread**2 * np.outer(shape, shape)).pdf(values)
        for share, spread in ((5.0 / 6.0, 0.2), (1.0 / 6.0, 0.5))
    )
    assert found == pytest.approx(math.log(density), abs=1e-6)


def test_the_evidence_of_a_dipole_is_the_density_of_all_measurements_together():
    of = DipoleClass(name="boat", strength_nt=10.0)
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
    found = one_source(
        DipoleHypothesis(of, 10, np.random.default_rng(1), field_ned=DIRECTION),
        values,
        EAST=30.0,
        LOG_DEPTH=math.log(HEIGHT_M),
    )
    together = multivariate_normal(np.zeros(COUNT), map_covariance() + 100.0 * terms.T @ terms)
    assert found == pytest.approx(together.logpdf(values), abs=1e-4)


def target_values(seed):
    shape = 30.0 * np.exp(-0.5 * (((ALONG_M - 40.0) / 80.0) ** 2 + (25.0 / 60.0) ** 2))
    return shape + np.random.default_rng(seed).multivariate_normal(np.zeros(COUNT), map_covariance())


@pytest.mark.parametrize("number", range(3))
def test_the_evidence_hardly_depends_on_the_random_numbers_and_is_that_of_plain_sampling(number):
    """A million sources without any resampling, against the sampler with 600."""
    values = target_values(3)
    of = GaussianClass(name="target")

    def made(count, seed):
        rng = np.random.default_rng(seed)
        if number == 2:
            return DipoleHypothesis(DipoleClass(name="boat"), count, rng, field_ned=DIRECTION)
        return GaussianHypothesis(of, count, rng) if number == 0 else BodyHypothesis([of], count, rng)

    found = [run(made(600, seed), values) for seed in range(4)]
    plain = made(50_000, 9)
    start = plain.start(measurements(values[:2]), beginning())
    seen = measurements(values)
    began = plain._gains.copy()
    _, precision, product = plain._weighed(plain.sources, seen, COUNT)
    gains, _, _ = plain._integrated(precision, product)
    rest = seen.log_density(2) + math.log(float(plain.weights @ np.exp(gains - began)))
    assert np.std(found) < 0.5
    assert np.mean(found) == pytest.approx(start + rest, abs=0.5)


def test_the_evidence_of_an_edge_is_the_density_of_all_measurements_together():
    values = 8.0 * (np.arange(COUNT) > 0) + np.random.default_rng(4).standard_normal(COUNT)
    offset = (np.arange(COUNT) > 0).astype(np.float64)
    together = multivariate_normal(np.zeros(COUNT), map_covariance() + 100.0 * np.outer(offset, offset))
    pair = together.cov[:2, :2]
    assert run(EdgeHypothesis(10.0), values) == pytest.approx(
        together.logpdf(values) - math.log(entering(pair)), abs=5e-3
    )


def test_the_evidence_without_a_signature_is_that_of_the_processes():
    values = 5.0 * np.random.default_rng(4).standard_normal(COUNT)
    apart = ALONG_M[:, None] - ALONG_M
    density = begins = 0.0
    for length_m in (35.0, 60.0, 100.0):
        for sigma_nt in (6.0, 12.0, 24.0):
            covariance = map_covariance() + sigma_nt**2 * np.exp(-0.5 * (apart / length_m) ** 2)
            density += multivariate_normal(np.zeros(COUNT), covariance).pdf(values) / 9.0
            begins += entering(covariance[:2, :2]) / 9.0
    assert run(ShapelessHypothesis(10.0, 100.0), values) == pytest.approx(
        math.log(density) - math.log(begins), abs=5e-3
    )


def entering(covariance):
    """Probability that the first is within the threshold and the second beyond it."""
    pair = multivariate_normal(np.zeros(2), covariance)
    upper = [THRESHOLD_NT, -THRESHOLD_NT]
    return 2.0 * (pair.cdf(upper) - pair.cdf([-THRESHOLD_NT, -THRESHOLD_NT]))


def test_without_a_signature_a_beginning_counts_given_that_it_is_one():
    values = np.array([1.0, 4.0])
    found = BackgroundHypothesis().start(measurements(values, ALONG_M[:2]), beginning())
    covariance = map_covariance(ALONG_M[:2])
    density = multivariate_normal(np.zeros(2), covariance).logpdf(values)
    assert found == pytest.approx(density - math.log(entering(covariance)), abs=5e-3)


def test_an_anomaly_begins_where_the_track_enters_it():
    """The evidence of the first measurement beyond the threshold and of the one before, against plain
    sampling of tracks.
    """
    of = GaussianClass(name="target", amplitude_spread=0.0, size_spread=0.0)
    values = np.array([1.5, 6.0])
    found = []
    for seed in range(4):
        hypothesis = GaussianHypothesis(of, 5_000, np.random.default_rng(seed))
        found.append(hypothesis.start(measurements(values, ALONG_M[:2]), beginning()))
        behind = hypothesis.sources[s.NORTH] < ALONG_M[1]
        assert hypothesis.weights[behind].sum() < 0.2
    rng = np.random.default_rng(9)
    count = 400_000
    distance, angle, course = 3.5 * np.sqrt(rng.random(count)), *rng.uniform(-math.pi, math.pi, (2, count))
    x, y = distance * np.cos(angle) * of.sigma_along_m, distance * np.sin(angle) * of.sigma_across_m
    ends = np.array([(x - STEP_M * np.cos(course), y - STEP_M * np.sin(course)), (x, y)])
    square = (ends[:, 0] / of.sigma_along_m) ** 2 + (ends[:, 1] / of.sigma_across_m) ** 2
    signal = of.amplitude_nt * np.exp(-0.5 * square)
    errors = multivariate_normal(np.zeros(2), map_covariance(ALONG_M[:2]))
    # the extent along the course does not make a beginning rarer
    weights = 1.0 / np.hypot(np.cos(course) / of.sigma_along_m, np.sin(course) / of.sigma_across_m)
    density = np.average(errors.pdf(values - signal.T), weights=weights)
    seen = np.abs(signal.T + errors.rvs(count, random_state=rng))
    begins = np.average((seen[:, 0] <= THRESHOLD_NT) & (seen[:, 1] > THRESHOLD_NT), weights=weights)
    assert found == pytest.approx([math.log(density / begins)] * 4, abs=0.25)


def test_equation_8_puts_the_source_where_it_is_seen_from_the_vehicle():
    """Vehicle 100 m along and 50 m right of the axis, flying across it to the right."""
    particle = np.zeros((p.POSE, 1))
    particle[:, 0] = (100.0, 50.0, 0.0, 1.0)
    out = np.empty((1, 3))
    p.relative_sources(particle, out)
    assert out[0] == pytest.approx((-50.0, 100.0, -0.5 * math.pi))


@pytest.mark.parametrize("seed", slow_after(1, range(2)))
def test_a_diagonal_pass_leaves_four_modes(seed):
    """Figures 4 and 5 with 200,000 particles: the modes that the paper's pair merged are separate."""
    paper = diagonal_pass(seed, 200_000).filter
    modes = find_modes(paper.sources(), paper.weights, least_cell=25.0)
    angles = sorted(math.degrees(mode.mean[2]) for mode in modes)
    assert angles == pytest.approx([-168.7, -11.3, 11.3, 168.7], abs=3.0)
    forward = sum(mode.weight * mode.mean[0] for mode in modes)
    right = sum(mode.weight * mode.mean[1] for mode in modes)
    assert forward == pytest.approx(-2250.0, rel=0.05)
    assert abs(right) < 0.05 * 2250.0
