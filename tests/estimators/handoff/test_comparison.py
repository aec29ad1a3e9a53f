"""Track comparison: dead reckoning, alignment, scores and evidence, each against an independent authority."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from estimators.handoff import (
    DeadReckoning,
    EvidenceComparison,
    EvidenceParameters,
    MatchComparison,
    MatchingParameters,
    Residual,
    TrackHistory,
    TrackWindows,
    align,
    blended,
)
from estimators.handoff.dead_reckoning import EYE
from estimators.relative_pose import LevelMotion, PoseMode
from estimators.vision.ground_points import CameraAxes, on_ground

STEP_US = 100_000
POSE = PoseMode(
    weight=1.0,
    forward_m=80.0,
    right_m=-30.0,
    down_m=10.0,
    heading_rad=2.3,
    covariance=np.diag([25.0, 25.0, 1.0, 0.01**2]),
)


def seen_by_handoff(places, pose=POSE):
    """Places (n, 2) of the tracker's level frame, in the handoff aircraft's."""
    return np.array([pose.from_tracker(*place) for place in places])


def walk(rng, count, *, start=(40.0, 60.0), speed=1.5):
    heading = rng.uniform(-math.pi, math.pi) + np.cumsum(0.3 * math.sqrt(0.1) * rng.standard_normal(count))
    steps = 0.1 * speed * np.column_stack((np.cos(heading), np.sin(heading)))
    return np.asarray(start) + np.cumsum(steps, axis=0)


def windows(handoff, target, others=None, k=0):
    count = len(target)
    times = STEP_US * (k + np.arange(1 - count, 1))
    return TrackWindows(
        time_us=int(times[-1]),
        times_us=times,
        handoff=handoff,
        target=target,
        eyes=(1.8 * np.arange(1.0 - count, 1.0)[:, None] * (1.0, 0.0),) * 2,
        heights_m=(120.0, 130.0),
        others=others or {},
    )


def test_past_places_are_seen_from_now_as_the_ground_is():
    """Equation 41 against a flight over the ground: a place that rests stays where it is."""
    reckoning, heading = DeadReckoning(), 0.7
    place, goal = np.array([10.0, -20.0]), np.array([130.0, 45.0])

    def level(of):
        c, s = math.cos(heading), math.sin(heading)
        return np.array([[c, s], [-s, c]]) @ (of - place)

    kept = reckoning.placed(level(goal)[None])
    for k in range(400):
        rate = 0.2 * math.sin(0.05 * k)
        for _ in range(20):
            heading += 0.5 * rate * 0.005
            place = place + 0.005 * np.array(
                [
                    18.0 * math.cos(heading) - 2.0 * math.sin(heading),
                    18.0 * math.sin(heading) + 2.0 * math.cos(heading),
                ]
            )
            heading += 0.5 * rate * 0.005
        reckoning.advance(0.1, LevelMotion(forward_m_s=18.0, right_m_s=2.0, yaw_rate_rad_s=rate))
    assert reckoning.level(kept)[0] == pytest.approx(level(goal), abs=0.05)
    assert reckoning.level(reckoning.placed(np.array([[5.0, 7.0]])))[0] == pytest.approx((5.0, 7.0))


def test_a_history_gives_windows_of_complete_tracks_only():
    history = TrackHistory(keep_s=1.0)
    for k in range(21):
        eye = DeadReckoning()
        eye.x_m = float(-k)
        history.add(k * STEP_US, eye, [(1, float(k), 0.0)] + ([(2, 0.0, float(k))] if k > 15 else []))
    times = STEP_US * np.arange(12, 21)
    assert history.window(1, times)[:, 0].tolist() == list(range(12, 21))  # type: ignore[index]
    assert history.window(1, times - STEP_US // 2)[:, 0] == pytest.approx(np.arange(12, 21) - 0.5)  # type: ignore[index]
    assert history.window(2, times) is None and history.window(3, times) is None
    assert history.window(1, STEP_US * np.arange(5, 21)) is None  # older than it keeps
    assert history.numbers == [EYE, 1, 2]
    assert history.window(EYE, times)[:, 0].tolist() == list(range(-12, -21, -1))  # type: ignore[index]
    history.add(3 * STEP_US, DeadReckoning(), [(9, 0.0, 0.0)])  # late
    assert 9 not in history.numbers


@given(
    st.floats(-3.1, 3.1), st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0)), st.integers(0, 1000)
)
def test_alignment_finds_rotation_and_translation(heading, translation, seed):
    rng = np.random.default_rng(seed)
    tracker = walk(rng, 50) + 0.2 * rng.standard_normal((50, 2))
    c, s = math.cos(heading), math.sin(heading)
    exact = tracker @ np.array([[c, -s], [s, c]]) + translation
    found = align(exact, tracker)
    assert found.heading_rad == pytest.approx(heading, abs=1e-9)
    assert found.translation_m == pytest.approx(translation, abs=1e-6)
    assert found.residual_m < 1e-6
    noisy = exact + rng.standard_normal(exact.shape)
    found = align(noisy, tracker)
    # equations 42 and 43 as printed, by the singular value decomposition
    h, r = (p - p.mean(axis=0) for p in (noisy, tracker))
    u, _, vt = np.linalg.svd(h.T @ r)
    rotation = u @ np.diag([1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    turned = math.atan2(rotation[0, 1], rotation[0, 0])
    assert math.remainder(turned - found.heading_rad, math.tau) == pytest.approx(0.0, abs=1e-9)
    residual = np.linalg.norm(h.T - rotation @ r.T)
    assert found.residual_m == pytest.approx(residual)
    assert found.rms_m == pytest.approx(residual / math.sqrt(50))


def test_alignment_refuses_windows_of_different_lengths():
    with pytest.raises(ValueError, match="windows"):
        align(np.zeros((3, 2)), np.zeros((4, 2)))


@pytest.mark.parametrize(("forgetting", "steps"), [(0.01, 299), (0.02, 149), (0.05, 59), (0.1, 29)])
def test_the_decision_takes_its_number_of_matches(forgetting, steps):
    """1 - (1 - zeta)^n > 0.95, for matches without a gap."""
    rng = np.random.default_rng(1)
    comparison = MatchComparison(MatchingParameters(forgetting=forgetting))
    target = walk(rng, 100)
    for k in range(1, steps + 1):
        assert comparison.decided is None
        comparison.update(windows({7: seen_by_handoff(target)}, target, k=k), POSE)
        assert comparison.scores[7] == pytest.approx(1.0 - (1.0 - forgetting) ** k)
    assert comparison.decided == 7


def test_each_threshold_refuses_a_match():
    rng = np.random.default_rng(2)
    target = walk(rng, 100, speed=3.0)
    own = seen_by_handoff(target)

    def match(handoff, **changes):
        comparison = MatchComparison(MatchingParameters(**changes))
        comparison.update(windows({1: handoff}, target), POSE)
        return comparison.newest[1]

    assert match(own).matches
    far = match(own + np.array([25.0, 0.0]))
    assert not far.matches and far.translation_error_m == pytest.approx(25.0)
    for angle in (0.6, -0.6):  # the sign that acos loses
        c, s = math.cos(angle), math.sin(angle)
        middle = own.mean(axis=0)
        turned = match((own - middle) @ np.array([[c, -s], [s, c]]) + middle)
        assert not turned.matches and turned.rotation_error_rad == pytest.approx(angle)
    noisy = own + 2.0 * rng.standard_normal(own.shape)
    assert not match(noisy).matches  # 28 m over 100 places
    assert match(noisy, residual=Residual.RMS).matches
    assert not match(noisy, residual=Residual.RMS, residual_m=2.0).matches


def test_scores_of_lost_tracks_fade_and_no_target_decides_nothing():
    rng = np.random.default_rng(3)
    comparison = MatchComparison(MatchingParameters(forgetting=0.5))
    target = walk(rng, 100)
    comparison.update(windows({1: seen_by_handoff(target)}, target), POSE)
    empty = replace(windows({}, target), target=None)
    for _ in range(25):
        comparison.update(empty, POSE)
    assert comparison.scores == {} and comparison.decided is None
    comparison.update(windows({1: seen_by_handoff(target)}, target), POSE)
    comparison.reset()
    assert comparison.scores == {}


def test_blending_goes_from_the_pose_to_the_track():
    assert blended((10.0, 2.0), (20.0, -2.0), 0.0) == (20.0, -2.0)
    assert blended((10.0, 2.0), (20.0, -2.0), 1.0) == (10.0, 2.0)
    assert blended((10.0, 2.0), (20.0, -2.0), 0.25) == (17.5, -1.0)


def shifted(place, eye, height, tilt, up):
    """A place on the ground as an aircraft sees it with errors of roll, pitch and height."""
    x, y = np.asarray(place) - eye
    roll, pitch = tilt
    line = np.array([x, y, height]) + np.cross((roll, pitch, 0.0), (x, y, height))
    return eye + (height + up) * line[:2] / line[2]


def slopes(function, count):
    """Derivatives at 0 by differences, (2, count)."""
    steps = 1e-4 * np.eye(count)
    return np.column_stack([(function(step) - function(-step)) / 2e-4 for step in steps])


@pytest.mark.slow
def test_the_probabilities_are_those_of_all_hypotheses_written_out():
    """Against the densities of scipy, with each error as a number and derivatives by differences."""
    rng = np.random.default_rng(4)
    p = EvidenceParameters(wrong=0.0, rough=0.0, unforeseen=0.0, decision=0.5)
    target, other = walk(rng, 41), walk(rng, 41, start=(55.0, 45.0))
    own = {
        k: seen_by_handoff(places) + rng.normal(0.0, 2.0, (41, 2)) + (4.0, -2.0)
        for k, places in ((3, target), (4, other), (5, walk(rng, 41)))
    }
    given = windows(own, target, {9: other})
    comparison = EvidenceComparison(p)
    comparison.update(given, POSE)
    sampled = slice(0, 41, 10)
    times, count = 0.1 * np.arange(-40.0, 1.0, 10.0), 5
    place = np.array([POSE.forward_m, POSE.right_m])

    def by(errors, k, track):
        """Where the tracker's place k of a track is expected among the handoff aircraft's."""
        x, y, heading, north, east, up, over, *tilts = errors
        tilts = np.reshape(tilts, (2, count, 2))
        at = shifted(track[sampled][k], given.eyes[1][sampled][k], given.heights_m[1], tilts[1, k], over)
        c, s = math.cos(POSE.heading_rad + heading), math.sin(POSE.heading_rad + heading)
        at = np.array([[c, s], [-s, c]]) @ at + place + (x, y) + times[k] * np.array([north, east])
        return shifted(at, given.eyes[0][sampled][k], given.heights_m[0], tilts[0, k], up)

    slow = np.exp(-np.abs(times[:, None] - times) / p.tilt_s)
    spread = np.zeros((7 + 4 * count, 7 + 4 * count))
    spread[:3, :3] = np.diag([25.0 + p.pose_sigma_m**2] * 2 + [1e-4 + p.pose_sigma_rad**2])
    spread[3:7, 3:7] = np.diag([p.drift_m_s**2] * 2 + [p.height_sigma_m**2] * 2)
    spread[7:, 7:] = np.kron(np.eye(2), np.kron(p.tilt_sigma_rad**2 * slow, np.eye(2)))
    noise = p.slow_sigma_m**2 * np.exp(-np.abs(times[:, None] - times) / p.slow_s) + p.sigma_m**2 * np.eye(
        count
    )
    noise = np.kron(noise, np.eye(2))
    ages = np.linspace(0.0, 4.0, 4001)  # of a velocity, from now back
    covariance = p.speed_m_s**2 * np.exp(-np.abs(ages[:, None] - ages) / p.turn_s)
    inside = (ages <= -times[:, None]) * np.where((ages == 0.0) | (ages == -times[:, None]), 5e-4, 1e-3)
    away = np.kron(p.apart_m**2 + inside @ covariance @ inside.T, np.eye(2))

    def slope(track):
        return np.vstack([slopes(lambda e, k=k: by(e, k, track), len(spread)) for k in range(count)])

    tracker = (target, other)
    jacobians = [slope(track) for track in tracker]
    expected = [np.array([by(np.zeros(len(spread)), k, track) for k in range(count)]) for track in tracker]
    off = {(i, k): (own[k][sampled] - expected[i]).ravel() for i in (0, 1) for k in own}
    free = {
        k: multivariate_normal.pdf(off[0, k], cov=jacobians[0] @ spread @ jacobians[0].T + noise + away)
        for k in own
    }
    totals = dict.fromkeys([None, *own], 0.0)
    for first in totals:
        for second in totals:
            if first is not None and first == second:
                continue
            pairs = [(i, k) for i, k in enumerate((first, second)) if k is not None]
            density = p.seen ** len(pairs) * (1.0 - p.seen) ** (2 - len(pairs))
            for k in own:
                if k not in (first, second):
                    density *= p.free * free[k]
            if pairs:
                stacked = np.vstack([jacobians[i] for i, _ in pairs])
                covariance = stacked @ spread @ stacked.T + np.kron(np.eye(len(pairs)), noise)
                density *= multivariate_normal.pdf(
                    np.concatenate([off[pair] for pair in pairs]), cov=covariance
                )
            totals[first] += density
    for k in own:
        assert comparison.scores[k] == pytest.approx(totals[k] / sum(totals.values()), rel=1e-3, abs=1e-12)
    assert 0.5 < comparison.scores[3] < 1.0 - 1e-6


def scene(seed, *, bias=8.0, noise=1.0, absent=False):
    """Five targets in both aircraft's windows; the pose is off by a bias."""
    rng = np.random.default_rng([4, seed])
    tracker = [walk(rng, 100, start=rng.uniform(-60.0, 60.0, 2)) for _ in range(5)]
    off = rng.normal(0.0, bias, 2)
    handoff = {
        10 + k: seen_by_handoff(places) + off + noise * rng.standard_normal((100, 2))
        for k, places in enumerate(tracker)
    }
    if absent:
        del handoff[10]
    others = {k: tracker[k] + noise * rng.standard_normal((100, 2)) for k in range(1, 5)}
    return handoff, tracker[0] + noise * rng.standard_normal((100, 2)), others


def test_probabilities_are_calibrated_and_the_pattern_of_all_targets_helps():
    pose = PoseMode(
        weight=1.0,
        forward_m=80.0,
        right_m=-30.0,
        down_m=10.0,
        heading_rad=2.3,
        covariance=np.diag([64.0, 64.0, 1.0, 0.01**2]),
    )
    right = {True: 0, False: 0}
    stated, count = 0.0, 60
    for seed in range(count):
        handoff, target, others = scene(seed)
        for pattern in (True, False):
            comparison = EvidenceComparison()
            comparison.update(windows(handoff, target, others if pattern else {}), pose)
            best = max(comparison.scores, key=lambda k: comparison.scores[k])
            right[pattern] += best == 10
            if pattern:
                stated += comparison.scores[best]
                assert sum(comparison.scores.values()) <= 1.0 + 1e-9
    assert right[True] >= right[False]
    assert right[True] >= 0.9 * count
    assert right[True] / count > stated / count - 0.05


@pytest.mark.slow
def test_a_target_that_is_not_seen_is_not_decided_for():
    wrong = 0
    for seed in range(30):
        handoff, target, others = scene(seed, absent=True)
        comparison = EvidenceComparison(EvidenceParameters(hold_s=0.1, every_s=0.1))
        for k in range(3):
            comparison.update(windows(handoff, target, others, k=2 * k), POSE)
        wrong += comparison.decided is not None
    assert wrong <= 2


def test_a_doubtful_identity_of_the_target_bounds_the_probability():
    rng = np.random.default_rng(6)
    target = walk(rng, 100)
    own = {1: seen_by_handoff(target)}
    comparison = EvidenceComparison()
    comparison.update(windows(own, target), POSE)
    sure = comparison.scores[1]
    assert 0.99 < sure < 1.0 - comparison.parameters.unforeseen  # nothing that the tracks show is certain
    doubtful = EvidenceComparison()
    doubtful.update(replace(windows(own, target), identity=0.75), POSE)
    assert doubtful.scores[1] == pytest.approx(0.75 * sure)


def test_two_targets_side_by_side_are_not_decided_between():
    """Both walk alike, half a metre apart: neither may get a high probability."""
    rng = np.random.default_rng(6)
    target = walk(rng, 100)
    own = {k: seen_by_handoff(target) + np.array([x, 0.0]) for k, x in ((1, 0.3), (2, -0.3))}
    comparison = EvidenceComparison()
    comparison.update(windows(own, target), POSE)
    assert max(comparison.scores.values()) < 0.6
    assert sum(comparison.scores.values()) > 0.9


def test_the_decision_needs_time_above_the_threshold():
    handoff, target, others = scene(2, bias=2.0)
    comparison = EvidenceComparison(EvidenceParameters(hold_s=1.0, every_s=0.1))
    for k in range(11):
        assert comparison.decided is None
        comparison.update(windows(handoff, target, others, k=k), POSE)
    assert comparison.decided == 10
    comparison.reset()
    assert comparison.decided is None and comparison.scores == {}


def test_a_track_that_is_seldom_measured_is_not_decided_for():
    """A track that leaves its target still has a window of the target's way; a decision waits for it."""
    rng = np.random.default_rng(6)
    target = walk(rng, 100)
    own = {1: seen_by_handoff(target)}
    comparison = EvidenceComparison(EvidenceParameters(hold_s=1.0, every_s=0.1))
    for k in range(0, 60, 2):
        comparison.update(replace(windows(own, target, k=k), doubtful=frozenset({1})), POSE)
        assert comparison.decided is None and comparison.scores[1] > 0.99
    for k in range(60, 71, 2):
        comparison.update(windows(own, target, k=k), POSE)
        assert comparison.decided == (1 if k >= 70 else None)


def test_image_points_come_back_as_places_on_the_ground():
    """Equations 36 to 40, there and back; the covariance against samples."""
    camera = CameraAxes.towards(90.0, -50.0, 120.0)
    assert camera.axes @ camera.axes.T == pytest.approx(np.eye(3))
    places = np.array([[90.0, -50.0], [100.0, -20.0], [60.0, -70.0]])
    points = camera.project(np.column_stack((places, np.full(3, 120.0))))
    assert points[0] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert points[1, 0] > 0.0 and points[2, 1] > 0.0  # farther right is right, nearer is lower in the image
    found, covariances = on_ground(camera.directions(points), 120.0, 0.002)
    assert found == pytest.approx(places)
    rng = np.random.default_rng(5)
    noisy = points[1] + 0.002 * rng.standard_normal((20000, 2))
    spread = np.cov(on_ground(camera.directions(noisy), 120.0, 0.002)[0].T)
    assert np.linalg.eigvalsh(spread) == pytest.approx(np.linalg.eigvalsh(covariances[1]), rel=0.25)
    behind = camera.project(np.array([[-500.0, 300.0, 120.0]]))
    assert np.isnan(behind).all()
    assert np.isnan(on_ground(np.array([[1.0, 0.0, -0.1]]), 120.0, 0.002)[0]).all()
    with pytest.raises(ValueError, match="camera"):
        CameraAxes.towards(0.0, 0.0, 0.0)
    down = CameraAxes.towards(0.0, 0.0, 50.0)
    assert down.project(np.array([[0.0, 10.0, 50.0]]))[0] == pytest.approx((0.2, 0.0))
