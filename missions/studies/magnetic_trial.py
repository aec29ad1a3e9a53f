"""One trial of the study `magnetic-identification`: passes over a target and a false anomaly of one map."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.classifier import FEATURES, trace_features
from estimators.magnetic_identification.estimator import field_direction
from estimators.magnetic_identification.identifier import Identifier
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.occupancy.survey_map import SurveyMap, map_error_of
from missions.embedded.magnetic_encounters import Encounter, encounters
from missions.studies.magnetic_worlds import WORLDS

__all__ = ["PASSES", "EncounterRow", "MagneticCell", "anomalies_of", "identifier_of", "trial"]

PASSES: Final = 2
_YEAR: Final = 2026.0
_NEAR_M: Final = 300.0  # an anomaly farther from the source is another one
_PARTICLES: Final = 3000


@dataclass(frozen=True, slots=True, kw_only=True)
class MagneticCell:
    """A cell of the design.

    Attributes:
        world: one of `WORLDS`.
    """

    world: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EncounterRow:
    """Figures after each pass over a target, or over a false anomaly in a world without targets, then after
    each pass over a false anomaly; NaN: no anomaly was detected there.

    Attributes:
        detected: number of the sources, of two, at which an anomaly was detected.
        peak_nt: largest measurement.
        confidence: mean of the paper's confidence.
        evidence: logarithm of the evidence ratio.
        probability: of a target, by the evidence.
        error_m: distance of the place from the true one.
        features: those of the classifier, one pass after the other.
    """

    detected: int
    peak_nt: tuple[float, ...]
    confidence: tuple[float, ...]
    evidence: tuple[float, ...]
    probability: tuple[float, ...]
    error_m: tuple[float, ...]
    features: tuple[float, ...]


def trial(cell: MagneticCell, seed: int) -> EncounterRow:
    """One map, one target, one false anomaly."""
    conditions = WORLDS[cell.world].setting
    figures = [
        after_pass
        for encounter in encounters(seed, conditions, passes=PASSES)
        for after_pass in figures_of_passes(encounter, seed, noise_nt=conditions.noise_nt)
    ]
    columns = np.array(figures)
    return EncounterRow(
        detected=int(np.isfinite(columns[PASSES - 1, 0])) + int(np.isfinite(columns[-1, 0])),
        peak_nt=tuple(columns[:, 0].tolist()),
        confidence=tuple(columns[:, 1].tolist()),
        evidence=tuple(columns[:, 2].tolist()),
        probability=tuple(columns[:, 3].tolist()),
        error_m=tuple(columns[:, 4].tolist()),
        features=tuple(columns[:, 5:].ravel().tolist()),
    )


def figures_of_passes(encounter: Encounter, seed: int, *, noise_nt: float) -> list[list[float]]:
    """After each pass: peak, mean confidence, evidence ratio, probability, error of the place, and the
    features of the classifier.
    """
    return [
        _figures_of(anomaly, encounter.place_ne_m)
        for anomaly in anomalies_of(encounter, seed, noise_nt=noise_nt)
    ]


def anomalies_of(encounter: Encounter, seed: int, *, noise_nt: float) -> Iterator[Anomaly | None]:
    """The anomaly at the source after each pass; None: no anomaly was detected there."""
    survey_map = encounter.survey_map
    identifier = identifier_of(survey_map, seed, noise_nt=noise_nt)
    for readings in encounter.passes:
        for reading in readings:
            map_nt = survey_map.total_nt(reading.north_m, reading.east_m, reading.height_m)
            identifier.take(1, reading, map_nt)
        yield _at(identifier, encounter.place_ne_m)


def identifier_of(survey_map: SurveyMap, seed: int, *, noise_nt: float) -> Identifier:
    """The identification of an encounter: all that it knows of it is the published map."""
    return Identifier(
        IdentificationParameters(noise_nt=noise_nt, particles=_PARTICLES, seed=seed),
        map_error=map_error_of(survey_map),
        field_ned=field_direction(survey_map.home, _YEAR),
    )


def _at(identifier: Identifier, place_ne_m: tuple[float, float]) -> Anomaly | None:
    """The strongest anomaly at a place."""
    near = [a for a in identifier.anomalies if math.dist(a.place_ne_m, place_ne_m) <= _NEAR_M]
    return max(near, key=_peak_nt, default=None)


def _peak_nt(anomaly: Anomaly) -> float:
    return max(abs(point.residual_nt) for point in anomaly.trace)


def _figures_of(anomaly: Anomaly | None, place_ne_m: tuple[float, float]) -> list[float]:
    if anomaly is None:
        return [math.nan] * (5 + len(FEATURES))
    features = trace_features(anomaly.trace)
    return [
        _peak_nt(anomaly),
        float(features[0]),
        anomaly.trace[-1].evidence,
        anomaly.probability,
        math.dist(anomaly.place_ne_m, place_ne_m),
        *features.tolist(),
    ]
