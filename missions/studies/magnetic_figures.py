"""Pictures of the study `magnetic-identification`: ROC and reliability."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

Array = NDArray[np.float64]

_COLOURS: Final = ("#9ca3af", "#c2410c", "#1769aa", "#15803d")
_INK: Final = "#1f2937"
_BINS: Final = 10


def draw_curves(
    path: Path, scores: Mapping[str, Array], probability: Mapping[str, Array], *, passes: int
) -> None:
    """Draw the ROC of each method after one and two passes, and the reliability of the probabilities,.

    Args:
        path: the file; it must not exist.
        scores: (runs, 2 * passes) by method, of targets and then of false anomalies.
        probability: likewise, of the methods that give one.
        passes: number of passes.
    """
    figure = Figure(figsize=(12.0, 4.2), dpi=130, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 3)
    for number, axes in enumerate(panels[:2]):
        for (method, values), colour in zip(scores.items(), _COLOURS, strict=True):
            false_rate, true_rate = _roc(values[:, number], values[:, passes + number])
            axes.plot(false_rate, true_rate, color=colour, linewidth=1.6, label=method)
        axes.plot([0, 1], [0, 1], color="#e5e7eb", linewidth=1.0, zorder=0)
        axes.set_title(("after one pass", "after two passes")[number], fontsize=10, loc="left", color=_INK)
        axes.set_xlabel("false anomalies named", fontsize=9)
        axes.set_ylabel("targets named", fontsize=9)
        axes.legend(fontsize=8, frameon=False, loc="lower right")
    for (method, values), colour in zip(probability.items(), _COLOURS[2:], strict=True):
        _draw_reliability(panels[2], method, values, passes, colour)
    panels[2].plot([0, 1], [0, 1], color="#e5e7eb", linewidth=1.0, zorder=0)
    panels[2].set_title("reliability, all passes", fontsize=10, loc="left", color=_INK)
    panels[2].set_xlabel("stated probability", fontsize=9)
    panels[2].set_ylabel("share of targets", fontsize=9)
    panels[2].legend(fontsize=8, frameon=False, loc="upper left")
    for axes in panels:
        axes.tick_params(labelsize=8, colors=_INK)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    with path.open("xb") as file:
        figure.savefig(file, format="png", metadata={"Software": None})


def _roc(of_targets: Array, of_others: Array) -> tuple[Array, Array]:
    targets = np.sort(of_targets[np.isfinite(of_targets)])
    others = np.sort(of_others[np.isfinite(of_others)])
    levels = np.concatenate(([np.inf], np.unique(np.concatenate((targets, others)))[::-1]))
    return tuple(
        1.0 - np.searchsorted(values, levels, "left") / max(1, len(values)) for values in (others, targets)
    )  # type: ignore[return-value]


def _draw_reliability(axes: Any, method: str, values: Array, passes: int, colour: str) -> None:
    happened = np.zeros(values.shape)
    happened[:, :passes] = 1.0
    known = np.isfinite(values)
    which = np.minimum((values[known] * _BINS).astype(np.int64), _BINS - 1)
    count = np.bincount(which, minlength=_BINS)
    filled = count > 0
    stated = np.bincount(which, weights=values[known], minlength=_BINS)[filled] / count[filled]
    share = np.bincount(which, weights=happened[known], minlength=_BINS)[filled] / count[filled]
    axes.plot(stated, share, marker="o", markersize=4, color=colour, linewidth=1.2, label=method)
