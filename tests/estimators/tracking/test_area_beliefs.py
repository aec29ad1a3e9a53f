"""Beliefs about a target's place, one test for all of them: against drawn targets and closed forms."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.tracking.camera_likelihood import ground_spread
from estimators.tracking.camera_sight import CameraSight, DetectionRate, PoseErrors, SightModel
from estimators.tracking.grid import GridLayout
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.search_grid import Scale, SearchGrid
from estimators.tracking.search_particles import SearchParticles
from flightsim.foundation.vectors import from_euler, product

DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)
MODEL = SightModel(rate=DetectionRate(peak=0.8, constant=50.0), target_size_m=2.0, false_rate=0.004)
ERRORS = PoseErrors(forward_m=2.0, right_m=1.0, height_m=1.0, yaw_rad=0.02, pitch_rad=0.02, roll_rad=0.02)
FINE = GridLayout.over(width_m=300.0, height_m=200.0, cell_m=1.0, centre_ne_m=(20.0, -10.0))
COARSE = GridLayout.over(width_m=300.0, height_m=200.0, cell_m=20.0, centre_ne_m=(20.0, -10.0))
SEED = np.random.SeedSequence(7)

MIDDLE = GridLayout.over(width_m=300.0, height_m=200.0, cell_m=2.5, centre_ne_m=(20.0, -10.0))


def particles(layout=FINE, walk_m_sqrt_s=0.0):
    walk = Motion(kind=MotionKind.RANDOM_WALK, walk_m_sqrt_s=walk_m_sqrt_s) if walk_m_sqrt_s else None
    return SearchParticles(layout, MODEL, seed=SEED, motion=walk)


BELIEFS = {
    "float64": lambda layout=FINE, **more: SearchGrid(layout, MODEL, **more),
    "float32": lambda layout=FINE, **more: SearchGrid(layout, MODEL, dtype=np.float32, **more),
    "log": lambda layout=FINE, **more: SearchGrid(layout, MODEL, scale=Scale.LOG, **more),
    "log float32": lambda layout=FINE, **more: SearchGrid(
        layout, MODEL, scale=Scale.LOG, dtype=np.float32, **more
    ),
    "particles": particles,
}
_LESS = (pytest.mark.slow,)  # the same code as float32 and as logarithms
each_belief = pytest.mark.parametrize(
    "belief",
    [
        pytest.param(make, id=name, marks=_LESS if name == "log float32" else ())
        for name, make in BELIEFS.items()
    ],
)


def sight(place, euler=(0.0, 0.0, 0.0), *, errors=ERRORS, detections=()):
    q = from_euler(*euler)
    place_m2, rotation_rad2 = errors.covariances(q, DOWN)
    return CameraSight(
        place_ned_m=place,
        q_ned_from_mount=product(q, DOWN),
        place_m2=place_m2,
        rotation_rad2=rotation_rad2,
        width_px=640,
        height_px=480,
        focal_px=500.0,
        detections=np.array(detections, dtype=float).reshape(-1, 2),
    )


TRACK = [
    ((-60.0 + 8.0 * k, -100.0 + 12.0 * k, -60.0), (0.1 * math.sin(k), 0.1, 0.9 + 0.05 * k)) for k in range(18)
]


@cache
def missed_targets(count, seed):
    """Drawn targets that the track does not detect: each frame at a pose drawn about the reported one, by
    plain trigonometry.
    """
    rng = np.random.default_rng(seed)
    targets = rng.uniform((FINE.south_m, FINE.west_m), (FINE.north_m, FINE.east_m), (count, 2))
    missed = np.ones(count, dtype=bool)
    for place, (roll, pitch, yaw) in TRACK:
        n, e = (targets - place[:2]).T
        forward = 2.0 * rng.standard_normal(count)
        right = rng.standard_normal(count)
        n = n - forward * math.cos(yaw) + right * math.sin(yaw)
        e = e - forward * math.sin(yaw) - right * math.cos(yaw)
        h = -place[2] + rng.standard_normal(count)
        r, p, y = (a + 0.02 * rng.standard_normal(count) for a in (roll, pitch, yaw))
        x, right_m = n * np.cos(y) + e * np.sin(y), e * np.cos(y) - n * np.sin(y)
        ahead, down = x * np.cos(p) - h * np.sin(p), x * np.sin(p) + h * np.cos(p)
        across, depth = right_m * np.cos(r) + down * np.sin(r), down * np.cos(r) - right_m * np.sin(r)
        u, v = 500.0 * across / depth, -500.0 * ahead / depth
        edge = 0.6 * 2.0 * 500.0 * np.sqrt(h / depth**3)
        seen = (depth > 0.0) & (np.abs(u) < 320.0 - edge) & (np.abs(v) < 240.0 - edge)
        missed &= ~(seen & (rng.random(count) < 0.8))
    return targets, missed


@each_belief
@pytest.mark.sampled(2)
def test_without_detections_it_agrees_with_drawn_targets(belief):
    """Information is honest: probability of detection and belief against brute-force Monte Carlo."""
    belief = belief()
    evidence = math.prod(belief.update(sight(place, euler)) for place, euler in TRACK)
    targets, missed = missed_targets(200_000, 5)
    sigma = math.sqrt(missed.mean() * (1.0 - missed.mean()) / missed.size)
    assert belief.probability_of_detection == pytest.approx(1.0 - missed.mean(), abs=4.0 * sigma + 2e-3)
    assert evidence == pytest.approx(1.0 - belief.probability_of_detection)
    edges = [low + 20.0 * np.arange(count + 1) for low, count in ((COARSE.south_m, 10), (COARSE.west_m, 15))]
    drawn = np.histogram2d(*targets[missed].T, bins=edges)[0] / missed.sum()  # type: ignore[call-overload]
    found = belief.shares(COARSE)
    assert found.sum() == pytest.approx(1.0)
    noise = np.sqrt(drawn / missed.sum()) + 1e-4
    tolerance = 8e-4 if isinstance(belief, SearchParticles) else 2e-4  # 43 particles in a cell
    assert np.abs(found - drawn).max() < 5.0 * noise.max() + tolerance
    assert belief.moments()[0] == pytest.approx(targets[missed].mean(axis=0), abs=1.0)


@each_belief
@pytest.mark.sampled(2)
def test_detections_give_the_product_of_their_gaussians(belief):
    """Level cameras above the target: the posterior is the information filter's."""
    belief = belief()
    rng = np.random.default_rng(11)
    target = np.array([33.0, -41.0])
    information, vector = np.zeros((2, 2)), np.zeros(2)
    for k in range(8):
        yaw = 0.8 * k
        place = (target[0] + 5.0 * math.sin(k), target[1] + 4.0 * math.cos(k), -60.0)
        base = sight(place, (0.0, 0.0, yaw))
        spread = ground_spread((0.0, 0.0), base, MODEL)
        off = rng.multivariate_normal((0.0, 0.0), spread)
        n, e = target + off - place[:2]
        across, ahead = e * math.cos(yaw) - n * math.sin(yaw), n * math.cos(yaw) + e * math.sin(yaw)
        assert belief.update(sight(place, (0.0, 0.0, yaw), detections=[(across / 60.0, -ahead / 60.0)])) > 1.0
        information += np.linalg.inv(spread)
        vector += np.linalg.inv(spread) @ (target + off)
    mean, covariance = belief.moments()
    expected = np.linalg.inv(information)
    # the spread depends on the place in the picture, which the closed form neglects
    assert mean == pytest.approx(expected @ vector, abs=0.25 * math.sqrt(np.trace(expected)))
    assert np.sqrt(np.diag(covariance)) == pytest.approx(np.sqrt(np.diag(expected)), rel=0.2)
    assert math.dist(belief.mode_ne_m, mean) < 1.5
    gauss_nats = 0.5 * math.log((math.tau * math.e) ** 2 * np.linalg.det(covariance))
    assert belief.entropy_nats == pytest.approx(gauss_nats, abs=0.35)


@each_belief
def test_the_probability_of_detection_ends_with_the_first_detection(belief):
    belief = belief()
    for place, euler in TRACK[:5]:
        belief.update(sight(place, euler))
    before = belief.probability_of_detection
    assert 0.0 < before < 1.0
    belief.update(sight((30.0, -40.0, -60.0), detections=[(0.0, 0.0)]))
    for place, euler in TRACK[5:]:
        belief.update(sight(place, euler))
    assert belief.probability_of_detection == before


@each_belief
def test_a_false_detection_is_overruled(belief):
    belief = belief()
    belief.update(sight((60.0, 60.0, -60.0), detections=[(0.1, 0.0)]))
    for _ in range(12):
        belief.update(sight((60.0, 60.0, -60.0)))
    for k in range(6):
        belief.update(sight((-20.0, -60.0 + k, -60.0), detections=[(-k / 60.0, 0.0)]))
    mean, covariance = belief.moments()
    assert mean == pytest.approx((-20.0, -60.0), abs=2.0)
    assert np.trace(covariance) < 16.0


@each_belief
def test_a_walking_target_spreads_as_its_walk(belief):
    belief = belief(MIDDLE, walk_m_sqrt_s=2.0)
    for k in range(6):
        belief.update(sight((20.0, -10.0 + k, -60.0), detections=[(-k / 60.0, 0.0)]))
    before = belief.moments()[1]
    for _ in range(40):
        belief.predict(0.25)
    after = belief.moments()[1]
    assert np.diag(after - before) == pytest.approx([40.0, 40.0], rel=0.08)
    for _ in range(8):
        belief.predict(3000.0)
    sides = np.array([FINE.north_m - FINE.south_m, FINE.east_m - FINE.west_m])
    assert np.diag(belief.moments()[1]) == pytest.approx(sides**2 / 12.0, rel=0.1)


@each_belief
def test_frames_that_contradict_every_place_leave_a_belief(belief):
    belief = belief(MIDDLE)
    for _ in range(20):
        for k in range(6):
            for j in range(4):
                belief.update(sight((-80.0 + 60.0 * j, -160.0 + 60.0 * k, -100.0)))
    mean, covariance = belief.moments()
    assert np.all(np.isfinite(mean)) and np.all(np.isfinite(covariance))
    assert belief.probability_of_detection == pytest.approx(1.0)
    assert math.isfinite(belief.entropy_nats)


def test_a_frame_beside_the_area_changes_nothing():
    belief = SearchGrid(FINE, MODEL)
    assert belief.update(sight((2000.0, 0.0, -60.0))) == 1.0
    assert belief.update(sight((0.0, 0.0, 1.0))) == 1.0
    assert belief.probability_of_detection == 0.0


def test_the_place_in_a_coarse_cell_is_uncertain():
    """The grid of the paper: a narrow likelihood between two centres is not lost."""
    belief = SearchGrid(COARSE, MODEL)
    exact = PoseErrors(**dict.fromkeys(PoseErrors.__dataclass_fields__, 0.0))
    place = (COARSE.south_m + 40.0, COARSE.west_m + 60.0, -60.0)  # a corner of four cells
    for _ in range(3):
        belief.update(sight(place, errors=exact, detections=[(0.0, 0.0)]))
    mean, covariance = belief.moments()
    assert mean == pytest.approx(place[:2], abs=0.5)
    assert np.sqrt(np.diag(covariance)) == pytest.approx([10.0] * 2, rel=0.1)  # to the cells' centres


def test_the_particles_are_those_of_the_seed_and_are_resampled_by_effective_size():
    first, second = (BELIEFS["particles"](), BELIEFS["particles"]())
    for belief in (first, second):
        belief.update(sight(*TRACK[0]))
        assert belief.resampled == 0  # a small part was seen
        belief.update(sight((30.0, -40.0, -60.0), detections=[(0.0, 0.0)]))
        assert belief.resampled == 1
    assert np.array_equal(first.places, second.places)
    assert np.unique(first.places, axis=1).shape == first.places.shape  # spread, not copied
    low, high = first.places.min(axis=1), first.places.max(axis=1)
    assert low[0] >= FINE.south_m and low[1] >= FINE.west_m
    assert high[0] <= FINE.north_m and high[1] <= FINE.east_m


def test_moving_particles_keep_their_velocity():
    """Over seeds: one set of particles has few velocities left in the end."""
    motion = Motion(kind=MotionKind.CONSTANT_VELOCITY, acceleration_m_s2_sqrt_hz=0.0, speed_sigma_m_s=1.0)
    moved = []
    for seed in range(9):
        belief = SearchParticles(FINE, MODEL, seed=np.random.SeedSequence(seed), motion=motion)
        for k in range(25):  # a target that moves east at 1 m/s
            belief.predict(1.0)
            place = (20.0, -30.0 + k, -60.0)
            belief.update(
                sight(place, errors=replace(ERRORS, forward_m=0.5, right_m=0.5), detections=[(0.0, 0.0)])
            )
        before = belief.moments()[0]
        belief.predict(10.0)
        moved.append(belief.moments()[0] - before)
    assert np.median(moved, axis=0) == pytest.approx([0.0, 10.0], abs=3.0)


@pytest.mark.parametrize(
    ("make", "reported"),
    [
        (lambda: SearchGrid(FINE, MODEL, dtype=np.int32), "dtype int32"),
        (lambda: SearchGrid(FINE, MODEL, prior=np.zeros((200, 300))), "not all 0"),
        (lambda: SearchGrid(FINE, MODEL, prior=np.ones((2, 3))), r"\(2, 3\) cells, the map \(200, 300\)"),
        (lambda: SearchGrid(FINE, MODEL, walk_m_sqrt_s=-1.0), "walk_m_sqrt_s -1"),
        (lambda: SearchParticles(FINE, MODEL, seed=SEED, count=3), "`particles` 3"),
        (lambda: SearchParticles(FINE, MODEL, seed=SEED, resample_share=0.0), "resample_share 0"),
    ],
)
def test_impossible_values_are_named(make, reported):
    with pytest.raises(EstimatorError, match=reported):
        make()
