"""Identification of anomalies from readings of passes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimators.magnetic_identification.goodness import fitting_share
from estimators.magnetic_identification.identifier import Identifier
from estimators.magnetic_identification.noise_level import NoiseLevel
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.occupancy.detection import MapError
from flightsim.payload import GaussianSignature
from missions.embedded.manoeuvre_noise import manoeuvre_noise
from tests.estimators.magnetic_identification.encounters import (
    CORRELATION_M,
    DIRECTION,
    MAP_NT,
    boat,
    readings,
    target,
    track,
)

PARAMETERS = IdentificationParameters(particles=3000, noise_nt=0.2)


def identifier(parameters=PARAMETERS):
    return Identifier(
        parameters, map_error=MapError(sigma_nt=MAP_NT, correlation_m=CORRELATION_M), field_ned=DIRECTION
    )


def fly(found, rng, signatures, *, passes=1, vehicle=1, start_us=0, offset_m=30.0, first_rad=0.3):
    """Straight passes, each across the last one; returns the ended passes."""
    ended = []
    for k in range(passes):
        places = track(rng, offset_m=offset_m * (-1) ** k, course_rad=first_rad + 0.5 * math.pi * k)
        for reading in readings(rng, places, signatures, start_us=start_us + k * 120_000_000):
            progress = found.take(vehicle, reading, 0.0)
            if progress is not None and progress.pass_ended is not None:
                ended.append(progress.pass_ended)
    return ended


@pytest.mark.parametrize("seed", range(6))
def test_a_target_is_identified_in_two_passes_and_localized(seed):
    rng, found = np.random.default_rng(seed), identifier()
    ended = fly(found, rng, [target(rng)], passes=2)
    anomaly = found.anomalies[0]
    assert ended.count(anomaly) == anomaly.passes == 2
    assert all(other.probability < 0.1 for other in found.anomalies[1:])
    assert anomaly.probability > 0.9
    assert math.hypot(*anomaly.place_ne_m) < 20.0
    assert anomaly.modes()[0].weight > 0.2


@pytest.mark.parametrize("seed", range(6))
def test_a_boat_is_not_a_target(seed):
    rng, found = np.random.default_rng(seed), identifier()
    fly(found, rng, [boat(rng)], passes=2)
    assert all(anomaly.probability < 0.1 for anomaly in found.anomalies)


def test_the_second_pass_may_be_another_vehicle_s():
    rng, found = np.random.default_rng(1), identifier()
    of = target(rng)
    fly(found, rng, [of], vehicle=1)
    after_one = found.anomalies[0].probability
    fly(found, rng, [of], vehicle=2, start_us=60_000_000, first_rad=1.9)
    (anomaly,) = found.anomalies
    assert anomaly.passes == 2
    assert anomaly.probability > 0.95 * max(0.9, after_one)  # both are near one


def test_two_sources_apart_are_two_anomalies():
    rng, found = np.random.default_rng(2), identifier()
    sources = [target(rng, (-600.0, 0.0)), boat(rng, (600.0, 0.0))]
    places = track(rng, offset_m=20.0, course_rad=0.0, half_m=1400.0)
    for reading in readings(rng, places, sources):
        found.take(1, reading, 0.0)
    first, second = found.anomalies
    assert first.probability > 0.5 > second.probability


def test_the_map_s_error_alone_is_no_target():
    """Where it exceeds the threshold, the background explains it."""
    rng, found = np.random.default_rng(3), identifier()
    for k in range(12):
        places = track(rng, offset_m=300.0 * k, course_rad=0.0, half_m=2000.0)
        for reading in readings(rng, places, [], start_us=k * 200_000_000):
            found.take(1, reading, 0.0)
    assert all(anomaly.probability < 0.5 for anomaly in found.anomalies)


def test_the_number_of_kept_anomalies_is_bounded():
    rng = np.random.default_rng(4)
    found = identifier(IdentificationParameters(particles=100, noise_nt=0.2, most_anomalies=3))
    sources = [boat(rng, (800.0 * k, 0.0)) for k in range(-3, 4)]
    for reading in readings(rng, track(rng, offset_m=10.0, course_rad=0.0, half_m=3200.0), sources):
        found.take(1, reading, 0.0)
    assert found.started > 3
    assert len(found.anomalies) == 3


def test_the_confidence_of_the_paper_stays_for_a_target_and_drops_for_a_boat():
    """Figure 6."""
    means = []
    for source in (target, boat):
        values = []
        for seed in range(6):
            rng, found = np.random.default_rng(seed), identifier()
            fly(found, rng, [source(rng)])
            trace = [point.confidence for anomaly in found.anomalies for point in anomaly.trace[1:]]
            values += trace
        means.append(np.mean(values))
    assert means[0] > means[1] + 0.1


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"targets": ()}, "targets names no class: there is nothing to identify"),
        ({"targets": ("ship:cube:1:2:3",)}, "class 'ship:cube:1:2:3' is not accepted; give NAME:gaussian"),
        ({"targets": ("ship:gaussian:1:2",)}, "is not accepted; give NAME:gaussian"),
        ({"targets": ("ship:gaussian:30:-1:60",)}, "sigma_along_m -1 of class ship is not accepted; 1 to"),
        ({"targets": ("ship:gaussian:1e308:80:60",)}, "amplitude_nt 1e.308 of class ship is not accepted"),
        ({"targets": ("ship:gaussian:30:80:1e-300",)}, "sigma_across_m 1e-300 of class ship"),
        ({"targets": ("ship:gaussian:2:80:60",)}, "amplitude_nt 2 of class ship does not exceed"),
        ({"false_anomalies": ("boat:dipole:1e200:50:150",)}, "strength_nt 1e.200 of class boat is not"),
        ({"false_anomalies": ("boat:dipole:15:150:50",)}, "most_m 50 of class boat is not more than least_m"),
        ({"shape_error": 1e300}, "shape_error 1e.300 is not in 0..1"),
        ({"seed": -1}, "seed -1 is not possible; ask for 0 or more"),
        ({"targets": ("a:gaussian:1:2:3",), "false_anomalies": ("a:dipole:1:2:3",)}, "a name of their own"),
        ({"target_prior": 1.0}, "target_prior 1 is not possible; ask for more than 0, less than 1"),
        ({"particles": 10}, "particles 10 is not in 100..1000000"),
        ({"interval_s": math.nan}, "interval_s nan is not possible"),
    ],
)
def test_impossible_parameters_are_refused(values, said):
    with pytest.raises(ValueError, match=said):
        IdentificationParameters(**values).require_detectable()


def test_another_source_within_reach_of_a_known_anomaly_is_an_anomaly_of_its_own():
    rng, found = np.random.default_rng(5), identifier()
    wreck = GaussianSignature(
        north_m=0.0, east_m=0.0, amplitude_nt=14.0, sigma_along_m=35.0, sigma_across_m=25.0
    )
    fly(found, rng, [wreck], offset_m=0.0, first_rad=0.0)
    (known,) = found.anomalies
    before = known.log_density, known.passes, known.place_ne_m
    beside = track(rng, offset_m=0.0, course_rad=0.0) + np.array([0.0, 190.0])
    source = target(rng, (0.0, 190.0))
    for reading in readings(rng, beside, [wreck, source], start_us=200_000_000):
        found.take(1, reading, 0.0)
    _, another = found.anomalies
    # one pass does not tell a target from another body that is as wide along the track
    assert another.probability > 0.6 > 0.1 > known.probability
    assert math.dist(another.place_ne_m, (0.0, 190.0)) < 60.0
    assert (known.passes, known.place_ne_m) == before[1:]
    assert known.log_density == pytest.approx(before[0], abs=20.0)  # but for the quiet ones before the pass


def test_a_source_right_after_another_ends_the_pass_over_that():
    rng, found = np.random.default_rng(6), identifier()
    sources = [target(rng), boat(rng, (0.0, 290.0))]
    places = track(rng, offset_m=0.0, course_rad=0.5 * math.pi)
    ended = []
    for reading in readings(rng, places, sources):
        progress = found.take(1, reading, 0.0)
        if progress is not None and progress.pass_ended is not None:
            ended.append((progress.pass_ended, progress.loudest.residual_nt, progress.sample.residual_nt))
    (first, loudest_nt, beyond_nt), *_ = ended
    assert first is found.anomalies[0]
    assert loudest_nt > 20.0
    assert beyond_nt > 3.0  # there is nothing quiet between the two
    assert [anomaly for anomaly, _, _ in ended].count(first) == 1
    assert not first.under_way


def test_a_vehicle_that_begins_at_a_source_does_not_take_the_wrong_level_for_anomalies():
    """Its first reading is the level, which is too high: where nothing is, everything is too low."""
    rng, found = np.random.default_rng(7), identifier()
    source = target(rng)
    away = track(rng, offset_m=10.0, course_rad=0.3, half_m=2000.0)
    start = int(np.argmin(np.hypot(*away.T)))
    reported = []
    for reading in readings(rng, away[start:], [source]):
        progress = found.take(1, reading, 0.0)
        if progress is not None and progress.pass_ended is not None:
            reported.append(progress.pass_ended)
    assert found.started > 0
    assert found.anomalies == reported == []
    fly(found, rng, [source], passes=2, start_us=300_000_000)
    assert found.anomalies[0].probability > 0.9


def test_mirror_places_are_kept_apart():
    """A straight pass beside a target does not show on which side it was; the mean would be on the track."""
    shares = []
    for seed in range(4):
        rng, found = np.random.default_rng(seed), identifier()
        fly(found, rng, [target(rng)], offset_m=60.0, first_rad=0.0)
        (anomaly,) = found.anomalies
        place = anomaly.likeliest_place(40.0)
        assert abs(abs(place.east_m - 60.0) - 60.0) < 35.0  # at the target, or at its mirror image
        shares.append(place.share)
        fly(found, rng, [target(rng)], offset_m=0.0, first_rad=0.5 * math.pi, start_us=200_000_000)
        # the second target is another one of the class: its place is known a little less well
        assert anomaly.likeliest_place(40.0).share > 0.8
    assert max(shares) < 0.9


def ridge(length_m=400.0, across_m=55.0):
    """A dike: as wide and as strong as a target across it, and much longer."""
    return GaussianSignature(
        north_m=0.0, east_m=0.0, amplitude_nt=28.0, sigma_along_m=length_m, sigma_across_m=across_m
    )


def test_a_ridge_is_named_neither_in_a_pass_across_it_nor_along_it():
    """Across it looks like a target: that is not enough."""
    rng, found = np.random.default_rng(2), identifier()
    fly(found, rng, [ridge()], offset_m=10.0, first_rad=0.5 * math.pi)
    (across,) = found.anomalies
    assert 0.03 < across.probability < 0.97
    fly(found, rng, [ridge()], offset_m=10.0, first_rad=0.0, start_us=200_000_000)
    assert all(anomaly.probability < 0.97 for anomaly in found.anomalies)


def test_noise_that_is_not_stated_dismisses_no_target():
    """2 nT by the motion of the aircraft: seven times what is stated."""
    for seed in range(3):
        rng, found = np.random.default_rng(seed), identifier()
        source = target(rng)
        places = track(rng, offset_m=20.0, course_rad=0.4)
        motion = 2.0 * manoeuvre_noise(rng, len(places), 0.1)
        for reading, extra in zip(readings(rng, places, [source]), motion.tolist(), strict=True):
            found.take(1, replace(reading, total_nt=reading.total_nt + extra), 0.0)
        assert max(anomaly.probability for anomaly in found.anomalies) > 0.2


def test_a_hypothesis_that_fits_badly_loses_its_probability_but_is_not_dismissed():
    assert fitting_share(20.0, 30) == 1.0
    assert fitting_share(30.0 * 1.5, 30) > fitting_share(30.0 * 3.0, 30)
    assert 0.29 < fitting_share(30.0 * 10.0, 30) < 0.31
    assert fitting_share(1e300, 3) == 1.0  # too few to judge by


def test_the_noise_of_quiet_track_is_found_for_straight_and_for_turning_flight():
    """Without an error of the map the excess is that of the readings; turning flight has its own."""
    rng = np.random.default_rng(1)
    level = NoiseLevel(MapError(sigma_nt=0.0, correlation_m=CORRELATION_M))
    for k in range(120):
        turn_rad = 0.2 if k % 2 else 0.0
        level.take((3.3 if k % 2 else 0.1) * float(rng.standard_normal()), 0.01, 25.0, turn_rad)
    assert level.excess_nt2(0.0) < 0.1
    assert math.sqrt(level.excess_nt2(0.2)) == pytest.approx(3.3, rel=0.35)


def test_the_probability_hardly_depends_on_the_seed_of_the_filter():
    """The same readings with other random numbers: the log-odds of a target are alike."""
    odds = []
    for seed in range(4):
        rng, found = np.random.default_rng(2), identifier(replace(PARAMETERS, particles=4000, seed=seed))
        fly(found, rng, [target(rng)], passes=2)
        evidence = found.anomalies[0].log_evidence
        odds.append(evidence[0] - evidence[2])  # of a target and of any body, its nearest competitor
    assert np.std(odds) < 1.5
