"""The Monte Carlo study `magnetic-identification`: targets and false anomalies after one and two passes.

Every trial is one map with an encounter with a target and one with a false anomaly, so no map and no target
occurs twice, and none of those that the classifier was fitted to occurs for another seed. The methods are the
threshold on the anomaly, the paper's confidence alone, the classifier on traces, and the evidence of classes.

The worlds are the nominal one, whose sources are of the identification's classes, and others that it does not
know (`magnetic_worlds`). A target is named, and an anomaly dismissed, at the probabilities of a search.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.classifier import FEATURES, shipped_classifier
from estimators.tracking.metrics import calibration_error
from missions.occupancy.suspect import ACCEPT, DISMISS
from missions.studies.calibration import calibration_gap, calibration_of, rounded
from missions.studies.design import grid
from missions.studies.magnetic_figures import draw_curves, draw_passes
from missions.studies.magnetic_passes import diagonal_pass, pass_traces
from missions.studies.magnetic_training import fitted_tables, require_training, write_tables
from missions.studies.magnetic_trial import PASSES, EncounterRow, MagneticCell, trial
from missions.studies.magnetic_worlds import WORLDS
from missions.studies.options import IdentificationStudyOptions
from missions.studies.results import Results
from missions.studies.statistics import share_interval
from missions.studies.study import Study
from missions.studies.summary import aligned
from missions.studies.worlds import NOMINAL, chosen_worlds, described

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
    """Figures of each world under `worlds`; `auc_one_pass`, `auc_two_passes` and `calibration_error` of the
    nominal one, or of the first one, also by themselves.
    """
    scores = scores_of(results)
    stated = {"classifier": scores["classifier"], "bayes": _of_passes(results, "probability")}
    errors_m = _of_passes(results, "error_m")
    worlds: dict[str, Any] = {}
    for k, cell in enumerate(results.cells):
        name = str(cell["world"])
        ended = results.finished[k]
        with_target = WORLDS[name].setting.with_target
        block = {**described(WORLDS[name]), **_verdicts(stated["bayes"][k, ended], with_target)}
        for number, key in enumerate(("auc_one_pass", "auc_two_passes")):
            block[key] = {
                method: rounded(area_under_curve(values[k, :, number], values[k, :, PASSES + number]))
                if with_target
                else None
                for method, values in scores.items()
            }
        block["auc"] = block["auc_two_passes"]["bayes"]
        block["calibration_error"] = {
            method: rounded(_calibration(values[k], with_target)) for method, values in stated.items()
        }
        known_m = errors_m[k, :, PASSES - 1]
        known_m = known_m[np.isfinite(known_m)]
        block["error_m_median_two_passes"] = rounded(float(np.median(known_m))) if len(known_m) else None
        block["undetected"] = int(np.nansum(2 - results.values("detected")[k]))
        worlds[name] = block
    shown = worlds.get(NOMINAL, next(iter(worlds.values())))
    return {
        **{key: shown[key] for key in ("auc_one_pass", "auc_two_passes", "calibration_error")},
        "worlds": worlds,
    }


def _verdicts(stated: Array, with_target: bool) -> dict[str, Any]:
    """What a search would decide, and how well the probabilities are stated.

    A target is named by its last pass. A false anomaly counts as named, and a target as dismissed, if it is
    so after any pass, as a search decides at its end.

    Args:
        stated: (runs, 2 * passes) probability of a target after each pass; NaN: nothing was detected.
        with_target: whether the first of both encounters of a run is with a target.
    """
    firsts, others = stated[:, _TARGET], stated[:, _FALSE]
    targets = firsts if with_target else firsts[:0]
    false = others if with_target else np.concatenate((firsts, others))
    runs = np.arange(len(stated))
    named, dismissed = targets[:, -1] >= ACCEPT, np.any(targets <= DISMISS, axis=1)
    false_named = np.any(false >= ACCEPT, axis=1)
    found: dict[str, Any] = {
        "n": 2 * len(stated),
        "targets": len(targets),
        "named": int(named.sum()),
        "false_named": int(false_named.sum()),
        "dismissed": int(dismissed.sum()),
        "undecided": int(np.sum(~named & ~dismissed)),
        "false_dismissed": int(np.sum(false[:, -1] <= DISMISS)),
    }
    for key, counted in (("named", named), ("false_named", false_named), ("dismissed", dismissed)):
        clusters = None if len(counted) <= len(runs) else np.tile(runs, 2)
        found[f"{key}_interval"] = [rounded(value) for value in share_interval(counted, clusters)[1]]
    for number, key in enumerate(("calibration_one_pass", "calibration")):
        after = np.concatenate((targets[:, number], false[:, number]))
        happened = np.arange(len(after)) < len(targets)
        known = np.isfinite(after)
        found[key] = calibration_of(after, happened)
        found[f"{key}_gap"] = calibration_gap(found[key])
        squared = (after[known] - happened[known]) ** 2
        found["brier"] = rounded(float(np.mean(squared))) if len(squared) else None
    return found


def _calibration(values: Array, with_target: bool) -> float:
    """Calibration error of probabilities (runs, 2 * passes), of all passes together."""
    happened = np.zeros(values.shape, dtype=np.bool_)
    happened[:, _TARGET] = with_target
    known = np.isfinite(values)
    return calibration_error(values[known], happened[known])


def report(results: Results) -> list[str]:
    """The table of the command line."""
    worlds = summarise(results)["worlds"]
    rows = [
        ["world", "n", "named", "false named", "dismissed", "undecided", "AUC 1", "AUC 2", "Brier", "gap"],
        *(
            [
                name,
                str(block["n"]),
                _counted(block, "named", block["targets"]),
                _counted(block, "false_named", block["n"] - block["targets"]),
                _counted(block, "dismissed", block["targets"]),
                str(block["undecided"]),
                _shown(block["auc_one_pass"]["bayes"]),
                _shown(block["auc"]),
                _shown(block["brier"]),
                _shown(block["calibration_gap"]),
            ]
            for name, block in worlds.items()
        ),
    ]
    lines = aligned(rows)
    lines += [
        f"named: targets with a probability of {ACCEPT:g} or more after the last pass; false named: false "
        f"anomalies after any pass; dismissed: targets at {DISMISS:g} or less after any pass; 95 % intervals",
        "AUC: area under the ROC by evidence after one and two passes; gap: largest difference between "
        "stated and achieved after two passes, of ten bins those with 50 cases or more",
        "",
    ]
    rows = [["world", "passes", *METHODS]]
    for name, block in worlds.items():
        for label, key in (("one", "auc_one_pass"), ("two", "auc_two_passes")):
            rows.append([name, label, *(_shown(block[key][method]) for method in METHODS)])
    return [
        *lines,
        *aligned(rows),
        "areas under the ROC; trace: by the paper's confidence alone; classifier: on its trace",
    ]


def _counted(block: dict[str, Any], name: str, of: int) -> str:
    """A count with the interval of its share."""
    if not of:
        return "-"
    low, high = block[f"{name}_interval"]
    return f"{block[name]}/{of} [{low:.3f}, {high:.3f}]"


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


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
    o = options or IdentificationStudyOptions()
    worlds, train = chosen_worlds(o.world, WORLDS), o.train
    if train:
        require_training()
    return Study(
        name="magnetic-identification",
        description="Targets and false anomalies after one and two passes: Lum et al. 2005, figure 6.",
        trial=trial,
        parameters=MagneticCell,
        row=EncounterRow,
        design=grid(world=worlds),
        runs=200,
        metrics=(),
        options={"world": ",".join(worlds), "train": train},
        summarise=summarise,
        report=report,
        draw=Output(train),
    )
