"""Modes of particles: how many groups, where, and how heavy."""

import math

import numpy as np
import pytest

from estimators.tracking.modes import find_modes

CENTRES = [(0.0, -200.0, 3.0), (0.0, -200.0, -0.2), (150.0, 40.0, 1.0)]
SHARES = [0.5, 0.3, 0.2]


def cloud(seed: int, count: int = 4000):
    rng = np.random.default_rng(seed)
    which = rng.choice(len(CENTRES), count, p=SHARES)
    points = np.array(CENTRES)[which] + rng.standard_normal((count, 3)) * (15.0, 15.0, 0.12)
    points[:, 2] = np.angle(np.exp(1j * points[:, 2]))
    return points


@pytest.mark.parametrize("seed", range(5))
def test_groups_are_found_with_their_weights_places_and_angles_across_the_half_turn(seed):
    points = cloud(seed)
    found = find_modes(points, np.full(len(points), 1.0 / len(points)))
    assert len(found) == 3
    for mode, centre, share in zip(found, CENTRES, SHARES, strict=True):
        assert mode.weight == pytest.approx(share, abs=0.04)
        assert mode.mean[:2] == pytest.approx(centre[:2], abs=4.0)
        assert abs(math.remainder(mode.mean[2] - centre[2], math.tau)) < 0.05
        assert mode.sigmas == pytest.approx((15.0, 15.0, 0.12), rel=0.25)


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.5])
def test_a_moved_mode_is_that_of_the_moved_particles(turn):
    rng = np.random.default_rng(3)
    drawn = rng.standard_normal((5000, 3)) @ np.array([[30.0, 18.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 0.1]])
    cosine, sine = math.cos(turn), math.sin(turn)
    moved = drawn @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) + (0.0, 0.0, turn)
    weights = np.full(len(drawn), 1.0 / len(drawn))
    (before,), (after,) = (find_modes(points, weights, least_cell=200.0) for points in (drawn, moved))
    found = before.moved(after.mean[:2], turn)
    assert found.mean[2] == pytest.approx(after.mean[2], abs=1e-3)
    assert found.sigmas == pytest.approx(after.sigmas, rel=0.01)
    assert found.covariance_xy == pytest.approx(after.covariance_xy, rel=0.02)


def test_weights_count_and_not_particles():
    points = cloud(1)
    heavy = points[:, 0] > 90.0
    weights = np.where(heavy, 8.0, 1.0)
    found = find_modes(points, weights / weights.sum())
    assert found[0].mean[0] == pytest.approx(150.0, abs=4.0)
    assert found[0].weight == pytest.approx(1.6 / 2.4, abs=0.04)


def test_one_particle_and_equal_particles_are_one_mode():
    for count in (1, 40):
        (mode,) = find_modes(np.tile([3.0, 4.0, 0.5], (count, 1)), np.full(count, 1.0 / count))
        assert mode.mean == pytest.approx((3.0, 4.0, 0.5))
        assert mode.weight == pytest.approx(1.0)
