"""The study `magnetic-identification`, and the classifier that it fits."""

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from estimators.magnetic_identification.classifier import (
    FEATURES,
    TraceClassifier,
    shipped_classifier,
    trace_features,
)
from estimators.magnetic_identification.samples import TracePoint
from missions.embedded.magnetic_encounters import EncounterConditions, encounters
from missions.embedded.magnetic_sources import FalseSources, false_source
from missions.embedded.manoeuvre_noise import manoeuvre_noise
from missions.studies import run_trial
from missions.studies.magnetic_figures import draw_passes
from missions.studies.magnetic_identification import _verdicts, area_under_curve, study
from missions.studies.magnetic_passes import TARGET, diagonal_pass, pass_traces
from missions.studies.magnetic_training import fitted_tables, write_tables
from missions.studies.magnetic_trial import identifier_of
from missions.studies.magnetic_worlds import WORLDS
from missions.studies.options import IdentificationStudyOptions, MagneticWorlds


def test_a_trial_repeats_itself_and_tells_its_target_from_its_false_anomaly():
    first, again = (run_trial(study(), 0, runs=2) for _ in range(2))
    assert first == again
    assert first["world"] == "nominal"
    assert first["detected"] == 2
    assert first["evidence"][1] > first["evidence"][3]
    assert len(first["features"]) == 4 * len(FEATURES)


def test_decisions_are_the_same_to_the_bit_whatever_the_truth_is():
    """The true place and kind of a source are for the score only."""
    encounter = next(encounters(4, EncounterConditions()))
    poisoned = replace(encounter, is_target=False, place_ne_m=(math.nan, math.nan))

    def decided(flown):
        found = identifier_of(flown.survey_map, 4, noise_nt=0.3)
        for reading in flown.passes[0]:
            found.take(
                1, reading, flown.survey_map.total_nt(reading.north_m, reading.east_m, reading.height_m)
            )
        return [(a.probability, a.log_evidence.tobytes(), a.place_ne_m, a.trace) for a in found.anomalies]

    assert repr(decided(encounter)) == repr(decided(poisoned))
    assert decided(encounter)


def test_a_world_has_the_sources_and_the_noise_that_it_states():
    rng = np.random.default_rng(1)
    for kind in FalseSources:
        source = false_source(rng, kind)
        assert source.signatures
        if kind is FalseSources.RIDGE:
            places = np.array([(part.north_m, part.east_m) for part in source.signatures])
            assert np.ptp(places, axis=0).max() > 200.0
    noise = manoeuvre_noise(rng, 20_000, 0.1)
    assert noise.std() == pytest.approx(1.0, rel=0.15)
    first, other = encounters(3, EncounterConditions(with_target=False, false_sources=FalseSources.ANY))
    assert not first.is_target and not other.is_target


def test_the_worlds_of_the_option_are_those_of_the_study():
    names = [world.value for world in MagneticWorlds if world is not MagneticWorlds.MISMATCHED]
    assert names == list(WORLDS)
    cells = study(IdentificationStudyOptions(world=(MagneticWorlds.WIDE,))).design.cells
    assert [cell["world"] for cell in cells] == ["wide"]


def test_a_summary_counts_names_and_dismissals_by_world():
    """Four runs: a target named, one dismissed, one undecided, one not detected; two false names."""
    stated = np.array(
        [
            [0.5, 0.99, 0.98, 0.1],
            [0.02, 0.4, 0.2, 0.01],
            [0.6, 0.5, 0.1, 0.97],
            [math.nan, math.nan, 0.0, 0.0],
        ]
    )
    found = _verdicts(stated, with_target=True)
    counts = [found[key] for key in ("n", "targets", "named", "false_named", "dismissed", "undecided")]
    assert counts == [8, 4, 1, 2, 1, 2]
    assert found["brier"] == pytest.approx(
        np.mean([0.01**2, 0.6**2, 0.5**2, 0.1**2, 0.01**2, 0.97**2, 0.0]), abs=1e-4
    )
    without = _verdicts(stated, with_target=False)
    assert (without["targets"], without["false_named"]) == (0, 3)


def test_encounters_of_another_seed_have_another_map_and_another_target():
    one, other = (next(encounters(seed, EncounterConditions())) for seed in (1, 2))
    assert one.is_target and other.is_target
    assert one.place_ne_m != other.place_ne_m
    assert not np.allclose(one.survey_map.total_field_nt, other.survey_map.total_field_nt)


def test_a_deeper_target_is_weaker():
    """Its amplitude falls with the cube of the distance."""
    peaks = []
    for factor in (1.0, 1.3):
        encounter = next(encounters(5, EncounterConditions(depth_factor=factor, offset_m=1.0, noise_nt=0.01)))
        values = np.array(
            [r.total_nt - encounter.survey_map.total_nt(r.north_m, r.east_m, r.height_m)
             for r in encounter.passes[0]]
        )  # fmt: skip
        peaks.append(float(values.max()))
    assert peaks[1] < 0.65 * peaks[0]


def test_the_area_under_the_curve_is_that_of_mann_and_whitney():
    rng = np.random.default_rng(1)
    targets, others = rng.normal(1.0, 1.0, 80).round(1), rng.normal(0.0, 1.0, 60).round(1)
    expected = mannwhitneyu(targets, others).statistic / (80 * 60)
    with_gaps = np.append(targets, math.nan)
    assert area_under_curve(with_gaps, others) == pytest.approx(expected)
    assert math.isnan(area_under_curve(np.array([math.nan]), others))


def point(confidence, evidence=0.0):
    return TracePoint(
        time_us=0, number=0, residual_nt=0.0, confidence=confidence, probability=0.5, evidence=evidence
    )


def test_features_of_a_trace():
    trace = [point(math.nan), point(0.8), point(0.9), point(0.2), point(0.7, evidence=99.0)]
    mean, low, drops, duration, evidence, rate = trace_features(trace)
    assert mean == pytest.approx(0.65)
    assert low == pytest.approx(0.2)
    assert drops == pytest.approx(1 / 3)
    assert duration == pytest.approx(math.log(4))
    assert (evidence, rate) == pytest.approx((20.0, 10.0))
    assert np.all(trace_features([point(math.nan)]) == 0.0)


@pytest.mark.parametrize("name", ["network", "logistic"])
def test_the_shipped_classifier_takes_figure_6_for_what_it_is(name):
    """A trace that stays high with evidence for it, and one that drops again and again."""
    target = [point(math.nan)] + [point(0.7, evidence=8.0)] * 20
    boat = [point(math.nan)] + [point(0.7, evidence=-12.0), point(0.05, evidence=-12.0)] * 10
    found = shipped_classifier(name)
    assert found.probability(trace_features(target)) > 0.9
    assert found.probability(trace_features(boat)) < 0.2


@pytest.mark.slow
def test_fitted_tables_are_what_scikit_learn_has_fitted(tmp_path):
    learn = pytest.importorskip("sklearn.linear_model")
    rng = np.random.default_rng(3)
    features = rng.standard_normal((300, len(FEATURES)))
    is_target = features[:, 0] + 0.5 * features[:, 4] > 0.2 * rng.standard_normal(300)
    path = tmp_path / "classifier.toml"
    write_tables(path, fitted_tables(features, is_target), made_by="a test")
    tables = tomllib.loads(path.read_text())
    scaled = (features - features.mean(axis=0)) / features.std(axis=0)
    expected = learn.LogisticRegression(C=1.0).fit(scaled, is_target).predict_proba(scaled)[:, 1]
    assert TraceClassifier.of(tables["logistic"]).probability(features) == pytest.approx(expected, abs=1e-4)
    network = TraceClassifier.of(tables["network"]).probability(features)
    assert np.mean((network > 0.5) == is_target) > 0.95


@pytest.mark.slow
def test_the_passes_of_figures_4_to_6_are_drawn(tmp_path):
    traces = list(pass_traces(3, 1))
    assert [is_target for is_target, _ in traces] == [True, False]
    assert all(((trace[:, 1] >= 0.0) & (trace[:, 1] <= 1.0)).all() for _, trace in traces)
    flown = diagonal_pass(1, 4000)
    square = (flown.began[:, 0] / 1000.0) ** 2 + (flown.began[:, 1] / 500.0) ** 2
    level_nt = np.median(TARGET.amplitude_nt * np.exp(-0.5 * square))
    assert level_nt == pytest.approx(3.5, abs=1.0)  # on the level curve of the first measurement
    draw_passes(tmp_path / "passes.png", flown, traces)
    assert (tmp_path / "passes.png").stat().st_size > 50_000


def test_more_noise_than_stated_is_in_the_readings():
    stated, more = (
        next(encounters(5, EncounterConditions(noise_factor=factor))).passes[0] for factor in (1.0, 1.3)
    )
    values = [np.array([reading.total_nt for reading in readings]) for readings in (stated, more)]
    # of second differences, far from the source: white noise alone
    spreads = [np.diff(v[:200], 2).std() / math.sqrt(6.0) for v in values]
    assert spreads[0] == pytest.approx(0.3, rel=0.15)
    assert spreads[1] == pytest.approx(1.3 * spreads[0], rel=0.1)
