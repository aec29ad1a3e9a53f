"""The Monte Carlo study `magnetic-identification`: targets and false anomalies after one and two passes.

Every trial is one map with an encounter with a target and one with a false anomaly, so no map and no target
occurs twice, and none of those that the classifier was fitted to occurs for another seed. The methods are the
threshold on the anomaly, the paper's confidence alone, the classifier on traces, and the evidence of classes.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.classifier import FEATURES, shipped_classifier
from estimators.tracking.metrics import calibration_error
from missions.studies.design import grid
from missions.studies.magnetic_figures import draw_curves, draw_passes
from missions.studies.magnetic_passes import diagonal_pass, pass_traces
from missions.studies.magnetic_training import fitted_tables, require_training, write_tables
from missions.studies.magnetic_trial import CONDITIONS, PASSES, EncounterRow, MagneticCell, trial
from missions.studies.options import IdentificationStudyOptions
from missions.studies.results import Results
from missions.studies.study import Study

Array = NDArray[np.float64]

METHODS: Final = ("threshold", "trace", "classifier", "bayes")
CLASSIFIER: Final = "classifier.toml"
_PICTURED: Final = 200_000  # particles of figures 4 and 5
_TRACES: Final = 8  # encounters of figure 6
_TARGET, _FALSE = slice(0, PASSES), slice(PASSES, 2 * PASSES)


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
    return {
        "threshold": _of_passes(results, "peak_nt"),
        "trace": _of_passes(results, "confidence"),
        "classifier": shipped_classifier().probability(_features(results)),
        "bayes": _of_passes(results, "evidence"),
    }


def _of_passes(results: Results, name: str) -> Array:
    """A column with a value for each pass, (cells, runs, 2 * passes)."""
    return results.values(name, 2 * PASSES)


def _features(results: Results) -> Array:
    """Features of each pass, (cells, runs, 2 * passes, features)."""
    values = results.values("features", 2 * PASSES * len(FEATURES))
    return values.reshape(*values.shape[:2], 2 * PASSES, len(FEATURES))


def summarise(results: Results) -> dict[str, Any]:
    """`auc_one_pass`, `auc_two_passes` and the calibration, for the nominal encounters; the same for every
    condition under `conditions`.
    """
    scores = scores_of(results)
    probability = {"classifier": scores["classifier"], "bayes": _of_passes(results, "probability")}
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
        errors_m = _of_passes(results, "error_m")[k, :, PASSES - 1]
        known_m = errors_m[np.isfinite(errors_m)]
        block["error_m_median_two_passes"] = round(float(np.median(known_m)), 2) if len(known_m) else None
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
            shown = "".join(f"{_shown(block[name][method]):>12s}" for method in METHODS)
            lines.append(f"{condition:10s} {label:7s}{shown}")
    lines.append("areas under the ROC; trace: by the paper's confidence alone; classifier: on its trace")
    for method, error in summary["calibration_error"].items():
        lines.append(f"calibration error of {method}, nominal: {_shown(error)}")
    return lines


def _shown(value: float) -> str:
    return f"{value:.4f}" if math.isfinite(value) else "-"


@dataclass(frozen=True, slots=True)
class Output:
    """Writes the pictures, and, if asked to, the parameters of the classifier.

    Attributes:
        train: whether the rows are those to fit the classifier to.
    """

    train: bool

    def __call__(self, results: Results, folder: Path) -> None:

        scores = {method: values[0] for method, values in scores_of(results).items()}
        probability = {"classifier": scores["classifier"], "bayes": _of_passes(results, "probability")[0]}
        draw_curves(folder / "roc.png", scores, probability, passes=PASSES)
        draw_passes(
            folder / "passes.png",
            diagonal_pass(results.seed, _PICTURED),
            list(pass_traces(results.seed, _TRACES)),
        )
        if self.train:
            features = _features(results).reshape(-1, 2 * PASSES, len(FEATURES))
            is_target = np.zeros(features.shape[:2], dtype=np.bool_)
            is_target[:, _TARGET] = True
            known = np.all(np.isfinite(features), axis=-1)
            write_tables(
                folder / CLASSIFIER,
                fitted_tables(features[known], is_target[known]),
                made_by=f"study magnetic-identification, train, runs={results.runs}, seed={results.seed}",
            )


def study(options: IdentificationStudyOptions | None = None) -> Study[MagneticCell, EncounterRow]:
    """The study.

    Args:
        options: None: the defaults.

    Raises:
        PlanError: scikit-learn is missing.
    """
    train = (options or IdentificationStudyOptions()).train
    if train:
        require_training()
    return Study(
        name="magnetic-identification",
        description="Targets and false anomalies after one and two passes: Lum et al. 2005, figure 6.",
        trial=trial,
        parameters=MagneticCell,
        row=EncounterRow,
        design=grid(condition=tuple(CONDITIONS)),
        runs=200,
        metrics=(),
        options={"train": train},
        summarise=summarise,
        report=report,
        draw=Output(train),
    )
