"""Fits the classifier of `magnetic-identification` to the rows of its study (scikit-learn, an extra)."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.classifier import FEATURES
from flightsim.foundation.packages import MissingPackage, required
from missions.errors import MissionError, PlanError

Array = NDArray[np.float64]

UNITS: Final = 6
_LOGISTIC_PENALTY: Final = 1.0
_NETWORK_PENALTY: Final = 0.3


def require_training() -> None:
    """Refuse a training without its library.

    Raises:
        PlanError: scikit-learn is not installed.
    """
    try:
        required("sklearn", "`train`")
    except MissingPackage as error:
        raise PlanError(str(error)) from None


def fitted_tables(features: Array, is_target: NDArray[np.bool_]) -> dict[str, dict[str, Any]]:
    """Parameters of both models, by name, as `TraceClassifier.of` takes them.

    Args:
        features: (n, features) of `trace_features`.
        is_target: (n,).

    Raises:
        MissionError: there are no passes of targets, or none of false anomalies.
    """
    targets = int(is_target.sum())
    if not 0 < targets < len(is_target):
        raise MissionError(
            f"the classifier can't be fitted to {targets} passes of targets and "
            f"{len(is_target) - targets} of false anomalies; both kinds are needed"
        )
    from sklearn.linear_model import LogisticRegression
    from sklearn.neural_network import MLPClassifier

    centre, scale = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-9)
    values = (features - centre) / scale
    common = {"features": list(FEATURES), "centre": _numbers(centre), "scale": _numbers(scale)}
    logistic = LogisticRegression(C=_LOGISTIC_PENALTY).fit(values, is_target)
    network = MLPClassifier(
        hidden_layer_sizes=(UNITS,),
        activation="tanh",
        solver="lbfgs",
        alpha=_NETWORK_PENALTY,
        max_iter=2000,
        random_state=0,
    ).fit(values, is_target)
    return {
        "logistic": common
        | {"output": _numbers(logistic.coef_[0]), "output_bias": round(float(logistic.intercept_[0]), 6)},
        "network": common
        | {
            "hidden": [_numbers(row) for row in network.coefs_[0]],
            "hidden_bias": _numbers(network.intercepts_[0]),
            "output": _numbers(network.coefs_[1][:, 0]),
            "output_bias": round(float(network.intercepts_[1][0]), 6),
        },
    }


def write_tables(path: Path, tables: dict[str, dict[str, Any]], *, made_by: str) -> None:
    """Write `classifier.toml`.

    Args:
        path: the file, which must not exist.
        tables: from `fitted_tables`.
        made_by: the command that made it.
    """
    lines = [f"# Parameters of the trace classifier, made by: {made_by}"]
    for name, table in tables.items():
        lines += ["", f"[{name}]"]
        for key, value in table.items():
            text = (
                "[\n" + "".join(f"  {row},\n" for row in value) + "]"
                if isinstance(value, list) and value and isinstance(value[0], list)
                else _text(value)
            )
            lines.append(f"{key} = {text}")
    with path.open("x", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def _numbers(values: Array) -> list[float]:
    return [round(float(value), 6) for value in values]


def _text(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], str):
        return "[" + ", ".join(f'"{item}"' for item in value) + "]"
    return str(value)
