"""The Monte Carlo study `handoff`: which of five walking targets is the tracker's (Tolman et al. 2021)."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.reports.figure import blank_figure, save_figure
from missions.studies.calibration import calibration_of, rounded, verdicts_of
from missions.studies.design import listed
from missions.studies.handoff_paired import PairedTrial
from missions.studies.handoff_surface import draw_surface
from missions.studies.handoff_trial import Comparison, Handoff, HandoffCell, HandoffTrial
from missions.studies.handoff_world import HandoffSetting
from missions.studies.handoff_worlds import HANDOFF_WORLDS
from missions.studies.options import Comparisons, HandoffStudyOptions, Operator, Points
from missions.studies.results import Results
from missions.studies.statistics import figures_of, rate_of
from missions.studies.study import Study
from missions.studies.worlds import chosen_worlds, described

__all__ = ["study"]

Array = NDArray[np.float64]

PAPER: Final[Mapping[str, float]] = {"runs": 500, "correct": 486, "mean_time_s": 314.0}
"""The paper's result, with windows of 100 samples, T_r = 15 m and T_gamma = 0.95."""

PIXELS_HZ: Final = 30.0
"""Frames of the paper's camera."""

WINDOWS: Final = (25, 50, 100)
RESIDUALS_M: Final[Mapping[Comparison, tuple[float, ...]]] = {
    Comparison.PAPER: (10.0, 15.0, 30.0),
    Comparison.RMS: (1.0, 1.5, 3.0),
    Comparison.EVIDENCE: (15.0,),
}
"""Windows and thresholds of the trade-off (figure 9)."""

_BINS: Final = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 0.995, 0.999, 1.0)
_COLOURS: Final = ("#c2410c", "#1769aa", "#15803d")


def study(options: HandoffStudyOptions | None = None) -> Study[HandoffCell, Handoff]:
    """The study.

    Args:
        options: None: the defaults.
    """
    o = options or HandoffStudyOptions()
    pixels = o.camera is Points.PIXELS
    rate_hz = o.rate_hz or (PIXELS_HZ if pixels else HandoffSetting().rate_hz)
    kinds = tuple(Comparison) if o.comparison is Comparisons.ALL else (Comparison(o.comparison.value),)
    cells = [
        HandoffCell(
            operator=operator.value,
            world=world,
            comparison=kind.value,
            window=samples,
            residual_m=residual_m,
            belief=o.belief.value,
        )
        for operator in Operator
        if operator in o.operator
        for world in chosen_worlds(o.world, HANDOFF_WORLDS)
        for kind in kinds
        for samples in (WINDOWS if o.trade_off else (o.window,))
        for residual_m in (RESIDUALS_M[kind] if o.trade_off else (_residual_m(kind),))
    ]
    trial = HandoffTrial(setting=HandoffSetting(rate_hz=rate_hz), pixels=pixels, timeout_s=o.timeout_s)
    return Study(
        name="handoff",
        description=(
            "Moving-target handoff without GPS: five walking targets, of which one is the tracker's "
            "(Tolman et al. 2021)."
        ),
        trial=PairedTrial(trial=trial, cells=tuple(cells)) if o.trade_off else trial,
        parameters=HandoffCell,
        row=Handoff,
        design=listed([asdict(cell) for cell in cells]),
        runs=500,
        success="correct",
        metrics=("time_s", "converged_s", "track_error_m"),
        options={
            **asdict(o),
            "rate_hz": rate_hz,
            "operator": ",".join(o.operator),
            "world": ",".join(o.world),
        },
        summarise=summarise,
        report=lines_of,
        draw=partial(draw_trade_off, timeout_s=o.timeout_s) if o.trade_off else draw,
    )


def _residual_m(kind: Comparison) -> float:
    """The paper's 15 m as a norm; over 100 samples it is a root mean square of 1.5 m."""
    return 1.5 if kind is Comparison.RMS else 15.0


def summarise(results: Results) -> Mapping[str, Any]:
    """Entries of `summary.json`: those of the first cell, of all cells, by operator and by world, and the
    paper's.
    """
    cells = [_cell(results, number) for number in range(len(results.cells))]
    first = {key: value for key, value in cells[0].items() if key not in results.cells[0]}
    return {
        **first,
        "operators": {
            name: _operator(results, numbers) for name, numbers in _by(results, "operator").items()
        },
        "worlds": {name: _world(results, name, numbers) for name, numbers in _by(results, "world").items()},
        "cells_of_handoff": cells,
        "paper": dict(PAPER),
    }


def _by(results: Results, name: str) -> dict[str, list[int]]:
    """Cells by a parameter."""
    found: dict[str, list[int]] = {}
    for number, cell in enumerate(results.cells):
        found.setdefault(str(cell[name]), []).append(number)
    return found


def _operator(results: Results, numbers: Sequence[int]) -> dict[str, Any]:
    """Figures of an operator, of its first world and comparison."""
    number = numbers[0]
    times = figures_of(results.values("time_s")[number])
    requests = results.values("requests")[number]
    return {
        "world": results.cells[number]["world"],
        **_verdicts(results, numbers[:1]),
        "mean_time_s": rounded(times.mean),
        "longest_time_s": rounded(times.n and float(np.nanmax(results.values("time_s")[number]))),
        "mean_requests": rounded(figures_of(requests).mean),
    }


def _world(results: Results, name: str, numbers: Sequence[int]) -> dict[str, Any]:
    """Figures of a world, of its first operator and comparison, and the right, wrong and undecided of all."""
    first = numbers[0]
    nees = results.values("pose_nees")[first]
    return {
        **described(HANDOFF_WORLDS[name]),
        "operator": results.cells[first]["operator"],
        **_verdicts(results, numbers[:1]),
        "mean_time_s": rounded(figures_of(results.values("time_s")[first]).mean),
        "pose_nees_per_state": rounded(figures_of(nees).mean / 2.0),
    }


def _verdicts(results: Results, numbers: Sequence[int]) -> dict[str, Any]:
    """Right, wrong and undecided trials of cells."""
    correct, wrong, stated = (
        np.concatenate([results.values(name)[number] for number in numbers])
        for name in ("correct", "wrong", "score")
    )
    known = np.isfinite(correct)
    return verdicts_of(correct[known] > 0.0, wrong[known] > 0.0, stated[known], edges=_BINS)


def _cell(results: Results, number: int) -> dict[str, Any]:
    flags = {name: results.values(name)[number] for name in ("correct", "wrong", "timeout")}
    known = np.isfinite(flags["correct"])
    counts = {name: int(np.nansum(values)) for name, values in flags.items()}
    rate = rate_of(counts["correct"], int(known.sum()))
    times = figures_of(results.values("time_s")[number])
    converged = results.values("converged_s")[number]
    return {
        **results.cells[number],
        "runs": rate.n,
        "correct": counts["correct"],
        "correct_ci95": [rounded(value) for value in rate.ci95],
        "mean_time_s": rounded(times.mean),
        "mean_time_s_ci95": [rounded(value) for value in times.mean_ci95],
        "median_time_s": rounded(times.median),
        "wrong": counts["wrong"],
        "timeouts": counts["timeout"],
        "converged_in_30_s": int(np.sum(converged <= 30.0)),
        "mean_stated": rounded(np.nanmean(results.values("score")[number]) if counts["correct"] else np.nan),
        "causes": _causes(results, number),
        "calibration": _calibration(results, number, "score", "correct"),
        "calibration_early": _calibration(results, number, "early_score", "early_correct"),
    }


def _causes(results: Results, number: int) -> dict[str, int]:
    """Failures by cause, with the seeds that repeat them."""
    rows = results.table.select(["cell", "cause", "correct"]).to_pylist()
    return dict(
        sorted(
            Counter(row["cause"] for row in rows if row["cell"] == number and row["correct"] is False).items()
        )
    )


def _calibration(results: Results, number: int, score: str, right: str) -> list[dict[str, Any]]:
    """Tracks by the score that was stated with them, and how many were right.

    Args:
        score, right: fields of the rows: those of the decision, or those of the first comparison.
    """
    stated = results.values(score)[number]
    return calibration_of(stated, results.values(right)[number] > 0.0, _BINS)


def lines_of(results: Results) -> Sequence[str]:
    """The table of the study."""
    lines = [
        f"{'operator':<9} {'world':<8} "
        f"{'comparison':<10} {'window':>6} {'T_r m':>6} {'runs':>5} {'correct':>8} {'95 %':>14} {'wrong':>6} "
        f"{'timeouts':>8} {'mean s':>7} {'median':>7}"
    ]
    for number in range(len(results.cells)):
        cell = _cell(results, number)
        low, high = cell["correct_ci95"]
        share = f"{100.0 * cell['correct'] / cell['runs']:.1f} %" if cell["runs"] else ""
        times = "".join(
            f"{'' if cell[name] is None else format(cell[name], '.0f'):>8}"
            for name in ("mean_time_s", "median_time_s")
        )
        lines.append(
            f"{cell['operator']:<9} {cell['world']:<8} "
            f"{cell['comparison']:<10} {cell['window']:>6} {cell['residual_m']:>6g} {cell['runs']:>5} "
            f"{share:>8} {100 * low:>6.1f} to {100 * high:<5.1f} {cell['wrong']:>5} {cell['timeouts']:>8} "
            f"{times}"
        )
        lines += [f"    {count} x {cause}" for cause, count in cell["causes"].items()]
    if any(cell["operator"] == Operator.WATCHES for cell in results.cells):
        lines.append("watches reads the true targets and designates anew without limit: an upper bound")
    lines.append("paper      window 100, T_r 15 m: 500 runs, 97.2 % correct, mean 314 s")
    return lines


def draw_trade_off(results: Results, folder: Path, *, timeout_s: float) -> None:
    """Draw `handoff.png` and `trade_off.png`."""
    draw(results, folder)
    cells = [_cell(results, number) for number in range(len(results.cells))]
    draw_surface(cells, PAPER, timeout_s, folder)


def draw(results: Results, folder: Path) -> None:
    """Draw `handoff.png`: correct decisions against the time that they take, beside the paper's point; and
    the share of runs that have decided over time.
    """

    figure = blank_figure(11.0, 4.4)
    left, right = figure.subplots(1, 2)
    colours = dict(zip((kind.value for kind in Comparison), _COLOURS, strict=True))
    times = results.values("time_s")
    for number, given in enumerate(results.cells):
        cell, colour = _cell(results, number), colours[given["comparison"]]
        if cell["mean_time_s"] is not None:
            share = cell["correct"] / cell["runs"]
            low, high = cell["correct_ci95"]
            left.errorbar(
                cell["mean_time_s"],
                share,
                yerr=[[max(0.0, share - low)], [max(0.0, high - share)]],
                fmt="o",
                markersize=4,
                color=colour,
                linewidth=1.0,
            )
            left.annotate(
                f"{given['window']}, {given['residual_m']:g} m",
                (cell["mean_time_s"], share),
                xytext=(4, 4),
                textcoords="offset points",
                fontsize=7,
                color=colour,
            )
        decided = np.sort(times[number][np.isfinite(times[number])])
        if len(decided):
            shares = np.arange(1, len(decided) + 1) / max(1, cell["runs"])
            right.step(
                decided, shares, where="post", color=colour, linewidth=1.2, alpha=1.0 if number == 0 else 0.5
            )
    paper = PAPER["mean_time_s"], PAPER["correct"] / PAPER["runs"]
    left.plot(*paper, "*", color="#1f2937", markersize=10)
    left.annotate("paper", paper, xytext=(-8, -3), textcoords="offset points", ha="right", fontsize=8)
    for name, colour in colours.items():
        if any(cell["comparison"] == name for cell in results.cells):
            left.plot([], [], "o", color=colour, markersize=4, label=name)
    left.set_xlabel("mean time of a decision, s", fontsize=9)
    left.set_ylabel("share of correct decisions, 95 % interval", fontsize=9)
    left.legend(fontsize=8, frameon=False, loc="center right")
    right.set_xlabel("time, s", fontsize=9)
    right.set_ylabel("share of runs with a decision", fontsize=9)
    right.set_ylim(0.0, 1.02)
    for axes in (left, right):
        axes.grid(color="#e5e7eb", linewidth=0.8)
        axes.tick_params(labelsize=8)
    save_figure(figure, folder / "handoff.png")
