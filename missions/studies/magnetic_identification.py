"""The Monte Carlo study `magnetic-identification`: targets and false anomalies after one and two passes.

Every trial is one map with an encounter with a target and one with a false anomaly, so no map and no target
occurs twice, and none of those that the classifier was fitted to occurs for another seed. The methods are the
threshold on the anomaly, the paper's confidence alone, the classifier on traces, and the evidence of classes.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.classifier import FEATURES, shipped_classifier, trace_features
from estimators.magnetic_identification.estimator import field_direction
from estimators.magnetic_identification.identifier import Identifier
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.occupancy.survey_map import map_error_of
from estimators.tracking.metrics import calibration_error
from missions.embedded.magnetic_encounters import Encounter, EncounterConditions, encounters
from missions.studies.design import grid
from missions.studies.magnetic_training import fitted_tables, require_training, write_tables
from missions.studies.results import Results
from missions.studies.study import Study

Array = NDArray[np.float64]

METHODS: Final = ("threshold", "trace", "classifier", "bayes")
CONDITIONS: Final[Mapping[str, EncounterConditions]] = MappingProxyType(
    {
        "nominal": EncounterConditions(),
        "offset": EncounterConditions(offset_m=150.0),
        "noise": EncounterConditions(noise_nt=1.0),
        "depth": EncounterConditions(depth_factor=1.3),
    }
)
"""By name: passes up to 150 m off, three times the noise, targets 30 % deeper than their class."""
PASSES: Final = 2
CLASSIFIER: Final = "classifier.toml"
_YEAR: Final = 2026.0
_NEAR_M: Final = 300.0  # an anomaly farther from the source is another one
_PARTICLES: Final = 3000
_TARGET, _FALSE = slice(0, PASSES), slice(PASSES, 2 * PASSES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of the design.

    Attributes:
        condition: one of `CONDITIONS`.
    """

    condition: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EncounterRow:
    """Figures after each pass over a target, then after each pass over a false anomaly; NaN: no anomaly was
    detected there.

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


def trial(cell: Cell, seed: int) -> EncounterRow:
    """One map, one target, one false anomaly."""
    conditions = CONDITIONS[cell.condition]
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
    survey_map = encounter.survey_map
    identifier = Identifier(
        IdentificationParameters(noise_nt=noise_nt, particles=_PARTICLES, seed=seed),
        map_error=map_error_of(survey_map),
        field_ned=field_direction(survey_map.home, _YEAR),
    )
    found = []
    for readings in encounter.passes:
        for reading in readings:
            map_nt = survey_map.total_nt(reading.north_m, reading.east_m, reading.height_m)
            identifier.take(1, reading, map_nt)
        found.append(_figures_of(_at(identifier, encounter.place_ne_m), encounter.place_ne_m))
    return found


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


def area_under_curve(of_targets: Array, of_others: Array) -> float:
    """Area under the receiver operating characteristic: the probability that a target has the higher score
    (Mann-Whitney). NaN scores are left out.
    """
    targets, others = of_targets[np.isfinite(of_targets)], of_others[np.isfinite(of_others)]
    if not len(targets) or not len(others):
        return math.nan
    ranked = np.sort(others)
    below = np.searchsorted(ranked, targets, "left")
    equal = np.searchsorted(ranked, targets, "right") - below
    return float(np.mean((below + 0.5 * equal) / len(ranked)))


def scores_of(results: Results) -> dict[str, Array]:
    """Scores by method, (cells, runs, 2 * passes)."""
    cells, runs, _ = results.values("peak_nt").shape
    features = results.values("features").reshape(cells, runs, 2 * PASSES, len(FEATURES))
    return {
        "threshold": results.values("peak_nt"),
        "trace": results.values("confidence"),
        "classifier": shipped_classifier().probability(features),
        "bayes": results.values("evidence"),
    }


def summarise(results: Results) -> dict[str, Any]:
    """`auc_one_pass`, `auc_two_passes` and the calibration, for the nominal encounters; the same for every
    condition under `conditions`.
    """
    scores = scores_of(results)
    probability = {"classifier": scores["classifier"], "bayes": results.values("probability")}
    conditions: dict[str, Any] = {}
    for k, cell in enumerate(results.cells):
        block: dict[str, Any] = {}
        for number, name in enumerate(("auc_one_pass", "auc_two_passes")):
            block[name] = {
                method: round(area_under_curve(values[k, :, number], values[k, :, PASSES + number]), 5)
                for method, values in scores.items()
            }
        block["calibration_error"] = {
            method: round(_calibration(values[k]), 4) for method, values in probability.items()
        }
        errors_m = results.values("error_m")[k, :, PASSES - 1]
        block["error_m_median_two_passes"] = round(float(np.nanmedian(errors_m)), 2)
        block["undetected"] = int(np.nansum(2 - results.values("detected")[k]))
        conditions[str(cell["condition"])] = block
    nominal = conditions.get("nominal", next(iter(conditions.values())))
    return {
        "auc_one_pass": nominal["auc_one_pass"],
        "auc_two_passes": nominal["auc_two_passes"],
        "calibration_error": nominal["calibration_error"],
        "conditions": conditions,
    }


def _calibration(values: Array) -> float:
    """Calibration error of probabilities (runs, 2 * passes), of all passes together."""
    happened = np.zeros(values.shape, dtype=np.bool_)
    happened[:, _TARGET] = True
    known = np.isfinite(values)
    return calibration_error(values[known], happened[known])


def report(results: Results) -> list[str]:
    """The table of the command line."""
    summary = summarise(results)
    lines = [f"{'condition':10s} {'passes':7s}" + "".join(f"{method:>12s}" for method in METHODS)]
    for condition, block in summary["conditions"].items():
        for label, name in (("one", "auc_one_pass"), ("two", "auc_two_passes")):
            lines.append(
                f"{condition:10s} {label:7s}" + "".join(f"{block[name][method]:12.4f}" for method in METHODS)
            )
    for method, error in summary["calibration_error"].items():
        lines.append(f"calibration error of {method}, nominal: {error:.4f}")
    return lines


@dataclass(frozen=True, slots=True)
class Output:
    """Writes the pictures, and, if asked to, the parameters of the classifier.

    Attributes:
        train: whether the rows are those to fit the classifier to.
    """

    train: bool

    def __call__(self, results: Results, folder: Path) -> None:
        from missions.studies.magnetic_figures import draw_curves

        scores = {method: values[0] for method, values in scores_of(results).items()}
        probability = {"classifier": scores["classifier"], "bayes": results.values("probability")[0]}
        draw_curves(folder / "roc.png", scores, probability, passes=PASSES)
        if self.train:
            features = results.values("features").reshape(-1, 2 * PASSES, len(FEATURES))
            is_target = np.zeros(features.shape[:2], dtype=np.bool_)
            is_target[:, _TARGET] = True
            known = np.all(np.isfinite(features), axis=-1)
            write_tables(
                folder / CLASSIFIER,
                fitted_tables(features[known], is_target[known]),
                made_by=f"study magnetic-identification, train, runs={results.runs}, seed={results.seed}",
            )


def study(*, train: bool = False) -> Study[Cell, EncounterRow]:
    """The study.

    Args:
        train: fit the classifier to the rows; `classifier.toml` is written to the folder.

    Raises:
        PlanError: scikit-learn is missing.
    """
    if train:
        require_training()
    return Study(
        name="magnetic-identification",
        description="Targets and false anomalies after one and two passes: Lum et al. 2005, figure 6.",
        trial=trial,
        parameters=Cell,
        row=EncounterRow,
        design=grid(condition=tuple(CONDITIONS)),
        runs=200,
        metrics=(),
        options={"train": train},
        summarise=summarise,
        report=report,
        draw=Output(train),
    )
