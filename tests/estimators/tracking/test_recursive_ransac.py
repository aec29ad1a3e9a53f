"""Recursive RANSAC: its kernels against closed forms, and tracks of targets in clutter against the truth."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import linear_sum_assignment

from estimators.tracking import ransac_kernels as kernels
from estimators.tracking.ospa import gospa
from estimators.tracking.recursive_ransac import RansacParameters, RecursiveRansac, TargetModel

STEP_US = 100_000


def walkers(rng, count, scans, *, speed=1.5, turn=0.3, half=70.0):
    """Places (scans, n, 2) of targets that walk with changing headings."""
    places = np.empty((scans, count, 2))
    place, heading = rng.uniform(-half, half, (count, 2)), rng.uniform(-math.pi, math.pi, count)
    for k in range(scans):
        heading += turn * math.sqrt(0.1) * rng.standard_normal(count)
        place = place + 0.1 * speed * np.column_stack((np.cos(heading), np.sin(heading)))
        places[k] = place
    return places


def measured(rng, places, *, detected=0.9, sigma=1.0, false=3.0, half=100.0):
    seen = rng.random(len(places)) < detected
    true = places[seen] + sigma * rng.standard_normal((int(seen.sum()), 2))
    return np.vstack((true, rng.uniform(-half, half, (rng.poisson(false), 2))))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_motion_is_that_of_white_noise_in_the_next_derivative(order):
    """Against Van Loan 1978: both matrices from one exponential."""
    size, dt, density = 2 * (order + 1), 0.7, 0.4
    drift, diffusion = np.zeros((size, size)), np.zeros((size, size))
    drift[: size - 2, 2:] = np.eye(size - 2)
    diffusion[-2:, -2:] = density * np.eye(2)
    both = np.block([[-drift, diffusion], [np.zeros((size, size)), drift.T]]) * dt
    whole = expm(both)
    expected = whole[size:, size:].T
    transition, noise = kernels.transition_and_noise(order, dt, density)
    assert transition == pytest.approx(expected, abs=1e-12)
    assert noise == pytest.approx(expected @ whole[:size, size:], abs=1e-12)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_fit_is_weighted_least_squares(order):
    rng = np.random.default_rng(2)
    ages, places = np.linspace(2.0, 0.0, 9), rng.normal(0.0, 5.0, (9, 2))
    roots = rng.normal(0.0, 1.0, (9, 2, 2))
    noises = roots @ roots.transpose(0, 2, 1) + 0.5 * np.eye(2)
    rows, values = [], []
    for age, place, noise in zip(ages, places, noises, strict=True):
        white = np.linalg.inv(np.linalg.cholesky(noise))
        terms = [(-age) ** i / math.factorial(i) for i in range(order + 1)]
        rows.append(white @ np.kron(terms, np.eye(2)))
        values.append(white @ place)
    design = np.vstack(rows)
    expected = np.linalg.lstsq(design, np.concatenate(values), rcond=None)[0]
    size = 2 * (order + 1)
    mean, covariance = np.empty(size), np.empty((size, size))
    assert kernels.fit(ages, places, noises, order, mean, covariance)
    assert mean == pytest.approx(expected)
    assert covariance == pytest.approx(np.linalg.inv(design.T @ design))
    if order:  # one time does not determine a velocity
        assert not kernels.fit(np.zeros(9), places, noises, order, mean, covariance)


def test_search_finds_the_polynomial_that_most_scans_support():
    rng = np.random.default_rng(4)
    scans = np.repeat(np.arange(10), 8)
    ages = 0.1 * (10.0 - scans)
    places = rng.uniform(-50.0, 50.0, (80, 2))
    own = np.arange(0, 80, 8)[[0, 1, 2, 4, 5, 6, 8, 9]]  # eight scans have the target
    places[own] = np.array([3.0, -4.0]) - ages[own, None] * (12.0, 5.0) + 0.1 * rng.standard_normal((8, 2))
    inliers = np.zeros(80, dtype=bool)
    arguments = (np.array([3.0, -4.0]), ages, scans, places, 1, 0.8)
    marks = rng.random((200, 1))
    assert kernels.search(*arguments, 30.0, 10, marks, inliers) == 8
    assert np.array_equal(np.flatnonzero(inliers), own)
    assert kernels.search(*arguments, 10.0, 10, marks, inliers) < 8  # slower than the target is


def test_tracks_follow_targets_in_clutter():
    rng = np.random.default_rng(1)
    truth = walkers(rng, 5, 300)
    tracker = RecursiveRansac(RansacParameters(window=20, clutter_per_m2=3.0 / 200.0**2, noise_density=0.3))
    values, numbers = [], []
    for k, places in enumerate(truth):
        tracker.scan(k * STEP_US, measured(rng, places))
        if k >= 60:
            states = np.array([track.state[:2] for track in tracker.tracks]).reshape(-1, 2)
            values.append(gospa(states, places, cutoff=5.0))
            numbers.append(tuple(track.number for track in tracker.tracks))
    assert np.mean([value.missed for value in values]) < 0.15
    assert np.mean([value.false for value in values]) < 0.15
    located = [value.localization / 5.0 for value in values if not value.missed]
    assert math.sqrt(np.mean(located)) < 0.9  # a measurement: 1.4 m
    assert len({number for row in numbers for number in row}) <= 7  # numbers are kept


@pytest.mark.parametrize("model", TargetModel)
def test_every_model_follows_a_target(model):
    rng = np.random.default_rng(7)
    tracker = RecursiveRansac(
        RansacParameters(model=model, window=20, noise_density=0.5, clutter_per_m2=1e-4)
    )
    for k in range(100):
        t = 0.1 * k
        place = np.array([[1.2 * t, 8.0 * math.sin(0.2 * t)]])
        tracker.scan(k * STEP_US, place + 0.3 * rng.standard_normal((1, 2)))
    (track,) = tracker.tracks
    assert track.number == 1 and track.seen and track.inlier_ratio > 0.8
    assert math.dist(track.state[:2], place[0]) < 1.0
    if model is not TargetModel.RANDOM_WALK:
        assert track.state[2] == pytest.approx(1.2, abs=0.5)


def test_targets_that_cross_keep_two_tracks():
    rng = np.random.default_rng(3)
    tracker = RecursiveRansac(RansacParameters(window=20, clutter_per_m2=1e-4, noise_density=0.05))
    for k in range(200):
        t = 0.1 * k - 10.0
        places = np.array([[2.0 * t, 0.3], [-0.3, 2.0 * t]])
        tracker.scan(k * STEP_US, measured(rng, places, detected=1.0, sigma=0.3, false=1.0))
        if k == 50:
            before = {track.number: track.state[2:4] for track in tracker.tracks}
    after = {track.number: track.state[2:4] for track in tracker.tracks}
    assert len(before) == 2 and before.keys() == after.keys()
    for number, velocity in before.items():
        assert np.linalg.norm(after[number] - velocity) < 0.6


@pytest.mark.parametrize("seed", range(6))
def test_measurements_are_assigned_as_by_the_hungarian_method(seed):
    rng = np.random.default_rng(seed)
    tracks, measurements, missed = 5, 6, 1e-6
    given = rng.uniform(1e-4, 0.1, (tracks, measurements)) * (rng.random((tracks, measurements)) < 0.6)
    scores, found = given.copy(), given.any(axis=1)
    kernels.assign(scores, np.ones(tracks, dtype=np.bool_), missed, given.sum(axis=0), found)
    costs = np.hstack(
        (np.where(given > 0.0, -np.log(np.maximum(given, 1e-300) / missed), 1e6), np.zeros((5, 5)))
    )
    rows, columns = linear_sum_assignment(costs)
    for row, column in zip(rows, columns, strict=True):
        if column < measurements:
            others = [k for k in range(tracks) if k != row]
            assert scores[row, column] == given[row, column] and not scores[others, column].any()
    taken = set(columns)
    free = [i for i in range(measurements) if i not in taken]
    assert np.array_equal(scores[:, free], given[:, free])
    assert np.array_equal(found, scores.any(axis=1))


def test_targets_that_walk_side_by_side_for_a_time_keep_their_tracks():
    """They come within two standard deviations: measurements that were shared made one track of both."""
    rng = np.random.default_rng(7)
    changed = 0
    for _ in range(8):
        tracker, owners = RecursiveRansac(RansacParameters(window=20, noise_density=0.5, lost_after=40)), {}
        for k in range(300):
            gap = 1.0 + 9.0 * abs(k - 150) / 150.0
            targets = np.array([[0.12 * k, 0.5 * gap], [0.12 * k, -0.5 * gap]])
            places = targets[rng.random(2) < 0.9]
            tracker.scan(100_000 * (k + 1), places + rng.normal(0.0, 0.5, places.shape))
            for track in tracker.tracks if k in (60, 280) else ():
                owners.setdefault(track.number, []).append(track.state[1] > 0.0)
        changed += sum(len(owner) != 2 or owner[0] != owner[1] for owner in owners.values())
    assert changed <= 2


def test_a_target_that_leaves_is_dropped_and_its_number_is_not_used_again():
    rng = np.random.default_rng(8)
    tracker = RecursiveRansac(RansacParameters(clutter_per_m2=1e-4))
    for k in range(40):
        tracker.scan(k * STEP_US, np.array([[0.1 * k, 0.0]]) + 0.2 * rng.standard_normal((1, 2)))
    assert [track.number for track in tracker.tracks] == [1]
    for k in range(40, 60):
        tracker.scan(k * STEP_US, np.empty((0, 2)))
    assert not tracker.tracks and not tracker.hypotheses
    for k in range(60, 100):
        tracker.scan(k * STEP_US, np.array([[0.1 * k, 0.0]]) + 0.2 * rng.standard_normal((1, 2)))
    assert [track.number for track in tracker.tracks] == [2]


def test_clutter_alone_makes_no_tracks_and_fills_the_bank_to_its_size():
    rng = np.random.default_rng(9)
    tracker = RecursiveRansac(RansacParameters(clutter_per_m2=20.0 / 200.0**2, hypotheses=2))
    shown, sizes = 0, []
    for k in range(200):
        tracker.scan(k * STEP_US, rng.uniform(-100.0, 100.0, (20, 2)))
        sizes.append(tracker.hypotheses)
        shown += len(tracker.tracks)
    assert max(sizes) == 2  # without the limit 3
    assert shown <= 4


def test_a_full_bank_keeps_its_track():
    rng = np.random.default_rng(3)
    tracker = RecursiveRansac(RansacParameters(clutter_per_m2=20.0 / 200.0**2, hypotheses=2))
    full = 0
    for k in range(200):
        # far from its path the target has a bank full of false hypotheses beside it
        false = rng.uniform(-100.0, 100.0, (20 if k >= 30 else 0, 2))
        tracker.scan(k * STEP_US, np.vstack(([[0.1 * k, 0.0]] + 0.2 * rng.standard_normal((1, 2)), false)))
        full += tracker.hypotheses == 2
        if k >= 30:
            assert 1 in [track.number for track in tracker.tracks]
    assert full >= 20


def test_old_scans_are_ignored_and_the_seed_decides_all():
    def run(seed):
        rng = np.random.default_rng(1)
        tracker = RecursiveRansac(RansacParameters(seed=seed, iterations=3))
        for k in range(80):
            tracker.scan(k * STEP_US, measured(rng, np.array([[0.1 * k, 0.0]]), false=10.0))
            tracker.scan(0, np.array([[500.0, 500.0]]))
        return [track.state.tolist() for track in tracker.tracks]

    assert run(1) == run(1)


def test_parameters_name_what_is_wrong():
    with pytest.raises(ValueError, match="window"):
        RansacParameters(window=3, seed_support=3)
    with pytest.raises(ValueError, match="seed_support"):
        RansacParameters(model=TargetModel.CONSTANT_ACCELERATION, seed_support=1)
    with pytest.raises(ValueError, match="detected"):
        RansacParameters(detected=1.5)


def test_the_update_of_one_hypothesis_is_that_of_probabilistic_data_association():
    """Against the textbook's sums (Bar-Shalom, Li and Kirubarajan 2001, section 3.4), and the sharing."""
    rng = np.random.default_rng(6)
    roots = rng.normal(0.0, 1.0, (4, 4))
    before, prior = rng.normal(0.0, 1.0, 4), roots @ roots.T + np.eye(4)
    places, noises = before[:2] + rng.normal(0.0, 1.0, (3, 2)), np.tile(0.8 * np.eye(2), (3, 1, 1))
    gate, detected, clutter = 9.2, 0.9, 0.01
    innovation = prior[:2, :2] + 0.8 * np.eye(2)
    offs = places - before[:2]
    squared = np.einsum("ni,ij,nj->n", offs, np.linalg.inv(innovation), offs)
    assert (squared < gate).all()
    density = detected * np.exp(-0.5 * squared) / (math.tau * math.sqrt(np.linalg.det(innovation)))
    none = clutter * (1.0 - detected * (1.0 - math.exp(-0.5 * gate)))
    gain = prior[:, :2] @ np.linalg.inv(innovation)
    for copies in (1, 2):  # two tracks at one place share the measurement that is assigned to none
        found, rivals = np.ones(copies, dtype=bool), np.ones(copies, dtype=bool)
        scores, shared = np.tile(density, (copies, 1)), copies * density
        kernels.assign(scores, rivals, none, shared, found)
        assert np.count_nonzero(scores[0]) == (3, 2)[copies - 1]
        shares = scores[0] / (scores[0].sum() + shared - scores[0] + none)
        mean_off = shares @ offs
        spread = np.einsum("n,ni,nj->ij", shares, offs, offs) - np.outer(mean_off, mean_off)
        expected = prior - shares.sum() * gain @ innovation @ gain.T + gain @ spread @ gain.T
        means, covariances = np.tile(before, (copies, 1)), np.tile(prior, (copies, 1, 1))
        found, explained = np.zeros(copies, dtype=bool), np.zeros(3, dtype=bool)
        kernels.associate(
            *(copies, means, covariances, places, noises, gate, detected, clutter, rivals, found, explained)
        )
        assert found.all() and explained.all()
        assert means[0] == pytest.approx(before + gain @ mean_off)
        assert covariances[0] == pytest.approx(expected)
