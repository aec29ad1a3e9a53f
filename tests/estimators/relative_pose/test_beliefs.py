"""Beliefs about a relative pose: equations against flights over the ground, convergence, consistency."""

import math

import numpy as np
import pytest

from estimators.relative_pose import (
    GaussianBank,
    LevelMotion,
    ParticlePose,
    PoseMeasurement,
    RelativePoseParameters,
)
from estimators.relative_pose import particles as kernels
from estimators.relative_pose.belief import joined_modes
from estimators.relative_pose.particle_belief import motion_array
from tests.estimators.relative_pose.encounters import RATE_HZ, Encounter, pose_error
from tests.slow import slow

KINDS = (ParticlePose, GaussianBank)
DT = 1.0 / RATE_HZ


def fly(belief, encounter, seconds, *, change=None):
    """Flies; yields the time of each step after it."""
    for k in range(round(seconds * RATE_HZ)):
        own, other, measured = encounter.step()
        if change is not None:
            measured = change(k * DT, measured)
        belief.predict(DT, own, other)
        belief.update(measured)
        yield k * DT


def converged_at(kind, seed, seconds, far_m=1500.0):
    """Time after which the target's error stays below 20 m in a converged mode, and NEES values after it."""
    encounter, since, values = Encounter(seed, far_m), None, []
    belief = kind(RelativePoseParameters(seed=seed))
    for time_s in fly(belief, encounter, seconds):
        good = belief.converged and encounter.target_error_m(belief.best) < 20.0
        if not good:
            since, values = None, []
            continue
        since = time_s if since is None else since
        if round(time_s * RATE_HZ) % RATE_HZ == 0:
            error = pose_error(belief.best, encounter.true_pose())
            values.append(float(error @ np.linalg.solve(belief.best.covariance, error)))
    return since, values


@pytest.mark.parametrize("kind", [slow(ParticlePose), GaussianBank])
def test_it_converges_within_30_s(kind):
    times, nees = zip(*(converged_at(kind, seed, 35.0) for seed in range(6)), strict=True)
    assert sum(time is not None and time <= 30.0 for time in times) >= 5
    assert 0.5 < np.mean(np.concatenate(nees)) < 8.0  # four states: 4


@pytest.mark.slow
@pytest.mark.timeout(1500)
@pytest.mark.parametrize("kind", KINDS)
def test_it_converges_within_30_s_in_95_percent_of_200_starts(kind):
    times, nees = zip(*(converged_at(kind, seed, 45.0, 1000.0) for seed in range(200)), strict=True)
    assert sum(time is not None and time <= 30.0 for time in times) >= 190
    assert 1.0 < np.mean(np.concatenate(nees)) < 6.0


def test_particles_move_as_the_aircraft_do_over_the_ground():
    """The pose from two paths in NED, with the tracker's turn, which equation 26 as printed leaves out."""
    encounter = Encounter(3)
    encounter.tracker.rate, encounter.handoff.rate = 0.15, -0.15  # orbits of 100 m at 15 m/s, opposite
    forward, right, down, heading = encounter.true_pose()
    particles = np.array([[forward], [right], [down], [math.cos(heading)], [math.sin(heading)]])
    still, none = np.zeros((kernels.NOISES, 1)), np.zeros(3)
    own, other = (
        motion_array(LevelMotion(forward_m_s=a.speed, yaw_rate_rad_s=a.rate))
        for a in (encounter.handoff, encounter.tracker)
    )
    for _ in range(300):
        encounter.step()
        kernels.move(particles, own, other, DT, still, none)
    found = [*particles[:3, 0], math.atan2(particles[4, 0], particles[3, 0])]
    assert found == pytest.approx(encounter.true_pose(), abs=0.3)
    turned = math.remainder(found[3] - heading, math.tau)
    assert turned == pytest.approx(math.remainder(-0.30 * 30.0, math.tau), abs=1e-6)  # printed: -0.15


def test_weights_are_products_of_gaussian_likelihoods():
    rng = np.random.default_rng(5)
    n = 500
    angles = rng.normal(0.4, 0.02, n)
    places = rng.normal(0.0, 5.0, (3, n)) + np.array([[80.0], [60.0], [20.0]])
    particles = np.array([*places, np.cos(angles), np.sin(angles)])
    weights = rng.random(n)
    weights /= weights.sum()
    measured, sigmas = np.array([104.0, 19.0, 0.41]), np.array([3.0, 1.5, 0.0141])
    slant = np.sqrt((particles[:3] ** 2).sum(axis=0))
    off = np.array([slant - measured[0], particles[2] - measured[1], angles - measured[2]])
    expected = weights * np.exp(-0.5 * ((off / sigmas[:, None]) ** 2).sum(axis=0))
    mean = weights @ off[0]
    variance = weights @ off[0] ** 2 - mean**2 + 9.0
    nis = kernels.weigh(particles, weights, measured, sigmas, np.empty(n))
    assert weights == pytest.approx(
        expected / expected.sum(), rel=2e-2, abs=1e-9
    )  # von Mises is a little wider
    assert nis == pytest.approx(mean**2 / variance)
    before = weights.copy()
    assert math.isnan(kernels.weigh(particles, weights, np.full(3, math.nan), sigmas, np.empty(n)))
    assert weights == pytest.approx(before)


def test_gaussians_that_are_joined_have_the_mean_and_the_covariance_of_both():
    """The moments of the sum, written out; the headings are on both sides of pi."""
    weights = np.array([0.2, 0.5, 0.3])
    means = np.array([[3.0, -1.0, 2.0, -3.1], [0.0, 1.0, 1.0, 3.1], [500.0, 0.0, 0.0, 0.0]])
    rng = np.random.default_rng(5)
    roots = rng.normal(0.0, 1.0, (3, 4, 4))
    covariances = roots @ roots.transpose(0, 2, 1) + np.eye(4)
    joined, far = joined_modes(weights, means, covariances, apart_sigmas=2.0, least_weight=0.05)
    turned = means[:2] + np.array([[0.0, 0.0, 0.0, math.tau], [0.0] * 4])
    shares = weights[:2] / 0.7
    mean = shares @ turned
    second = sum(
        share * (covariance + np.outer(one, one))
        for share, covariance, one in zip(shares, covariances[:2], turned, strict=True)
    )
    found = np.array([joined.forward_m, joined.right_m, joined.down_m, joined.heading_rad])
    assert found == pytest.approx([*mean[:3], math.remainder(mean[3], math.tau)])
    np.testing.assert_allclose(joined.covariance, second - np.outer(mean, mean), atol=1e-9)
    assert (joined.weight, far.weight, far.forward_m) == pytest.approx((0.7, 0.3, 500.0))
    np.testing.assert_allclose(far.covariance, covariances[2])


@pytest.mark.parametrize("kind", KINDS)
def test_straight_flight_leaves_two_bearings_which_a_turn_decides(kind):
    """The range alone has two solutions, mirrored at the relative velocity (equation 29)."""
    encounter = Encounter(11)
    for aircraft in (encounter.tracker, encounter.handoff):
        aircraft.rate = 0.0
    belief = kind(RelativePoseParameters(seed=1))
    for _ in fly(belief, encounter, 15.0):
        pass
    assert len(belief.modes) == 2 and not belief.converged
    true = encounter.true_pose()
    assert min(math.hypot(m.forward_m - true[0], m.right_m - true[1]) for m in belief.modes) < 60.0
    other = encounter.tracker
    c, s = math.cos(true[3]), math.sin(true[3])
    along = math.atan2(-s * other.speed, c * other.speed - encounter.handoff.speed)
    mirrored = [math.remainder(m.bearing_rad - along, math.tau) for m in belief.modes]
    assert mirrored[0] == pytest.approx(-mirrored[1], abs=0.15)
    encounter.tracker.rate = 0.12
    for _ in fly(belief, encounter, 30.0):
        pass
    assert belief.converged and encounter.target_error_m(belief.best) < 20.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_range_of_another_aircraft_resets_it(kind):
    encounter = Encounter(4)
    belief = kind()

    def change(time_s, measured):
        far = measured.range_m + (400.0 if time_s > 30.0 else 0.0)
        return PoseMeasurement(range_m=far, down_m=measured.down_m, heading_rad=measured.heading_rad)

    for time_s in fly(belief, encounter, 36.0, change=change):
        if time_s < 29.0:
            assert belief.resets == 0
    assert belief.resets >= 1


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.sampled(1)
def test_60_s_without_range_widen_it_and_do_not_lose_it(kind):
    encounter = Encounter(6)
    belief = kind(RelativePoseParameters(seed=2))
    sigma = {}

    def change(time_s, measured):
        if 40.0 <= time_s < 100.0:
            return PoseMeasurement(down_m=measured.down_m, heading_rad=measured.heading_rad)
        return measured

    for time_s in fly(belief, encounter, 110.0, change=change):
        sigma[round(time_s)] = belief.best.horizontal_sigma_m if belief.known else math.nan
    assert belief.resets == 0
    assert 1.2 * sigma[39] < sigma[99] < 20.0
    assert belief.converged and encounter.target_error_m(belief.best) < 20.0


def test_it_waits_for_a_complete_measurement():
    belief = ParticlePose()
    belief.predict(DT, LevelMotion(forward_m_s=20.0), LevelMotion(forward_m_s=20.0))
    belief.update(PoseMeasurement(range_m=500.0, heading_rad=0.1))
    assert not belief.known and belief.best is None and not belief.converged and belief.modes == ()
    belief.update(PoseMeasurement(range_m=500.0, down_m=30.0, heading_rad=0.1))
    assert belief.known and not belief.converged
    assert belief.poses.shape == (kernels.POSE, RelativePoseParameters().start_particles)
    slant = np.sqrt((belief.poses[:3] ** 2).sum(axis=0))
    assert slant.mean() == pytest.approx(500.0, abs=0.2) and slant.std() == pytest.approx(3.0, abs=0.2)


@pytest.mark.slow
def test_fewer_particles_follow_a_converged_pose_and_the_seed_decides_all():
    results = []
    for seed in (1, 1, 2):
        belief = ParticlePose(RelativePoseParameters(seed=seed))
        for _ in fly(belief, Encounter(9), 30.0):
            pass
        assert belief.weights.size == 1000
        results.append(belief.poses.copy())
    assert np.array_equal(results[0], results[1]) and not np.array_equal(results[0], results[2])


def test_parameters_name_what_is_wrong():
    with pytest.raises(ValueError, match="range_sigma_m"):
        RelativePoseParameters(range_sigma_m=0.0)
    with pytest.raises(ValueError, match="start_particles"):
        RelativePoseParameters(particles=2000, start_particles=1000)
    with pytest.raises(ValueError, match="resample_below"):
        RelativePoseParameters(resample_below=1.5)
