"""Pictures of the study `magnetic-identification`: ROC and reliability, and figures 4 to 6 of the paper."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.reports.figure import INK, blank_figure, save_figure
from missions.studies.magnetic_passes import BEYOND_M, DIAGONAL_RAD, TARGET, DiagonalPass

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_COLOURS: Final = ("#9ca3af", "#c2410c", "#1769aa", "#15803d")
_BINS: Final = 10
_TARGET_COLOUR, _FALSE_COLOUR, _TRUTH_COLOUR = "#1769aa", "#c2410c", "#dc2626"
_DOTS: Final = 4000  # particles that are drawn
_FAR_M: Final = 4500.0


def draw_curves(
    path: Path, scores: Mapping[str, Array], probability: Mapping[str, Array], *, passes: int
) -> None:
    """Draw the ROC of each method after one and two passes, and the reliability of the probabilities.

    Args:
        path: the file; it must not exist.
        scores: (runs, 2 * passes) by method, of targets and then of false anomalies.
        probability: likewise, of the methods that give one.
        passes: number of passes.
    """
    figure = blank_figure(12.0, 4.2, dpi=130)
    panels = figure.subplots(1, 3)
    for number, axes in enumerate(panels[:2]):
        for (method, values), colour in zip(scores.items(), _COLOURS, strict=True):
            false_rate, true_rate = _roc(values[:, number], values[:, passes + number])
            axes.plot(false_rate, true_rate, color=colour, linewidth=1.6, label=method)
        axes.plot([0, 1], [0, 1], color="#e5e7eb", linewidth=1.0, zorder=0)
        axes.set_title(("after one pass", "after two passes")[number], fontsize=10, loc="left", color=INK)
        axes.set_xlabel("false anomalies named", fontsize=9)
        axes.set_ylabel("targets named", fontsize=9)
        axes.legend(fontsize=8, frameon=False, loc="lower right")
    for (method, values), colour in zip(probability.items(), _COLOURS[2:], strict=True):
        _draw_reliability(panels[2], method, values, passes, colour)
    panels[2].plot([0, 1], [0, 1], color="#e5e7eb", linewidth=1.0, zorder=0)
    panels[2].set_title("reliability, all passes (area: their number)", fontsize=10, loc="left", color=INK)
    panels[2].set_xlabel("stated probability", fontsize=9)
    panels[2].set_ylabel("share of targets", fontsize=9)
    panels[2].legend(fontsize=8, frameon=False, loc="upper left")
    for axes in panels:
        axes.tick_params(labelsize=8, colors=INK)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    save_figure(figure, path)


def draw_passes(path: Path, flown: DiagonalPass, traces: Sequence[tuple[bool, Array]]) -> None:
    """Draw figures 4 and 5 (the particles of a diagonal pass) and 6 (the confidence along passes).

    Args:
        path: the file; it must not exist.
        flown: the diagonal pass.
        traces: see `pass_traces`.
    """
    figure = blank_figure(12.0, 9.0, dpi=130)
    in_target, in_vehicle, angles, confidence = figure.subplots(2, 2).ravel()
    rng = np.random.default_rng(0)
    count = len(flown.filter.weights)
    shown = rng.choice(count, min(count, _DOTS), replace=False)
    chosen = rng.choice(count, min(count, _DOTS), p=flown.filter.weights)
    _draw_in_target(in_target, flown, shown, chosen)
    sources = flown.filter.sources()[chosen]
    in_vehicle.plot(sources[:, 1], sources[:, 0], ".", color=_TARGET_COLOUR, markersize=2, alpha=0.4)
    in_vehicle.plot(0.0, 0.0, "^", color=INK, markersize=9)
    in_vehicle.plot(0.0, -BEYOND_M, "+", color=_TRUTH_COLOUR, markersize=12, markeredgewidth=1.8)
    in_vehicle.set_aspect("equal")
    in_vehicle.set_xlim(-1500.0, 1500.0)
    _title(in_vehicle, "the target, seen from the vehicle (8)", "right, m", "forward, m")
    psi_deg = np.degrees(flown.ended[:, 2])
    angles.hist(psi_deg, bins=180, range=(-180.0, 180.0), weights=flown.filter.weights, color=_TARGET_COLOUR)
    for sign in (-1.0, 1.0):
        for angle in (math.degrees(DIAGONAL_RAD), 180.0 - math.degrees(DIAGONAL_RAD)):
            angles.axvline(sign * angle, color=_TRUTH_COLOUR, linewidth=0.9, linestyle="--")
    angles.set_xticks(range(-180, 181, 60))
    _title(angles, "course relative to the target's axis", "psi, degrees", "weight")
    for is_target, trace in traces:
        colour = _TARGET_COLOUR if is_target else _FALSE_COLOUR
        confidence.plot(trace[:, 0], trace[:, 1], color=colour, linewidth=1.1, alpha=0.75)
    for label, colour in (("target", _TARGET_COLOUR), ("false anomaly", _FALSE_COLOUR)):
        confidence.plot([], [], color=colour, label=label)
    confidence.set_ylim(0.0, 1.0)
    confidence.legend(fontsize=8, frameon=False, loc="lower right")
    _title(confidence, "confidence along first passes (7)", "time since the begin of the anomaly, s", "C")
    save_figure(figure, path)


def _draw_in_target(axes: Any, flown: DiagonalPass, shown: Indices, chosen: Indices) -> None:
    """Figure 4: the particles at the first measurement and at the end, on the target's signature."""
    side = np.linspace(-_FAR_M, _FAR_M, 200)
    square = (side[:, None] / TARGET.sigma_along_m) ** 2 + (side / TARGET.sigma_across_m) ** 2
    axes.contour(
        side, side, TARGET.amplitude_nt * np.exp(-0.5 * square), levels=[3.0, 10.0, 30.0, 80.0],
        colors="#9ca3af", linewidths=0.7,
    )  # fmt: skip
    axes.plot(
        flown.began[shown, 1], flown.began[shown, 0], ".", color="#9ca3af", markersize=2, alpha=0.4,
        label="first measurement",
    )  # fmt: skip
    ended = flown.ended[chosen]
    axes.plot(ended[:, 1], ended[:, 0], ".", color=_TARGET_COLOUR, markersize=2, alpha=0.4, label="end")
    along_m = np.array([flown.began_along_m, BEYOND_M])
    axes.plot(
        along_m * math.sin(DIAGONAL_RAD), along_m * math.cos(DIAGONAL_RAD), color=_TRUTH_COLOUR,
        linewidth=1.2, label="track",
    )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlim(-3000.0, 3000.0)
    axes.set_ylim(-_FAR_M, _FAR_M)
    axes.legend(fontsize=8, frameon=False, loc="lower right", markerscale=4)
    _title(axes, "particles in the target's frame", "right of the axis, m", "along the axis, m")


def _title(axes: Any, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=10, loc="left", color=INK)
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8, colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


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
    axes.scatter(stated, share, s=4.0 + 0.6 * count[filled], color=colour, alpha=0.7, label=method)
