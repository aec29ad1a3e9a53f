"""The classifier on the traces of an anomaly, which Lum et al. 2005 proposed and left to further work.

The paper reads the trace of the confidence by eye (figure 6): for a target it rises and stays, for a false
anomaly it drops sharply again and again. The features are that level, the drops, the duration, and the
evidence. A logistic regression and a small network were fitted to simulated encounters by the study
`magnetic-identification`; their parameters are in `classifier.toml` beside this module. Their evaluation
needs NumPy only.
"""

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.samples import TracePoint

__all__ = ["FEATURES", "TraceClassifier", "shipped_classifier", "trace_features"]

Array = NDArray[np.float64]

FEATURES: Final = ("mean", "low", "drops", "duration", "evidence", "evidence_rate")
"""Mean of the confidence; mean of its lowest fifth; share of sharp drops; logarithm of the number of points;
logarithm of the ratio of evidence, limited; and the same over the square root of the number of points.
"""
_DROP: Final = 0.5  # of the value before: a sharp drop
_LOW: Final = 0.2
_MOST_EVIDENCE: Final = 20.0


def trace_features(trace: Sequence[TracePoint]) -> Array:
    """The features of an anomaly's trace; zeros for one without confidence, as its first point has none."""
    values = np.array([point.confidence for point in trace if math.isfinite(point.confidence)])
    if not len(values):
        return np.zeros(len(FEATURES))
    lowest = np.sort(values)[: max(1, round(_LOW * len(values)))]
    drops = np.count_nonzero(values[1:] < _DROP * values[:-1]) / max(1, len(values) - 1)
    evidence = float(np.clip(trace[-1].evidence, -_MOST_EVIDENCE, _MOST_EVIDENCE))
    return np.array(
        [
            values.mean(),
            lowest.mean(),
            drops,
            math.log(len(values)),
            evidence,
            evidence / math.sqrt(len(values)),
        ]
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TraceClassifier:
    """A logistic regression, or a network of one hidden layer, on standardized features.

    Attributes:
        centre, scale: (features,) mean and standard deviation of each feature in training.
        hidden: (features, units) weights of the hidden layer; no units: a logistic regression.
        hidden_bias: (units,).
        output: (units,) weights of the hidden layer's hyperbolic tangents, or (features,) of the features.
        output_bias: of the logit.
    """

    centre: Array
    scale: Array
    hidden: Array
    hidden_bias: Array
    output: Array
    output_bias: float

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> "TraceClassifier":
        """From a table of `classifier.toml`."""
        centre = np.array(table["centre"], dtype=np.float64)
        return cls(
            centre=centre,
            scale=np.array(table["scale"], dtype=np.float64),
            hidden=np.array(table.get("hidden", []), dtype=np.float64).reshape(len(centre), -1),
            hidden_bias=np.array(table.get("hidden_bias", []), dtype=np.float64),
            output=np.array(table["output"], dtype=np.float64),
            output_bias=float(table["output_bias"]),
        )

    def logit(self, features: Array) -> Array:
        """Logarithm of the odds of a target, (...) for features (..., features)."""
        values = (features - self.centre) / self.scale
        if self.hidden.shape[1]:
            values = np.tanh(values @ self.hidden + self.hidden_bias)
        found: Array = np.asarray(values @ self.output + self.output_bias)
        return found

    def probability(self, features: Array) -> Array:
        """Probability of a target, (...) for features (..., features)."""
        found: Array = 0.5 * (1.0 + np.tanh(0.5 * self.logit(features)))
        return found


@cache
def shipped_classifier(name: str = "network") -> TraceClassifier:
    """The classifier of the package: "network" or "logistic"."""
    text = resources.files(__package__).joinpath("classifier.toml").read_text(encoding="utf-8")
    return TraceClassifier.of(tomllib.loads(text)[name])
