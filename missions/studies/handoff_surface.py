"""The picture of the trade-off between windows and thresholds of a handoff (Tolman et al. 2021, figure 9)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from estimators.reports.figure import blank_figure, save_figure

__all__ = ["draw_surface"]

_COLOURS: Final = ("#c2410c", "#1769aa", "#15803d")


def draw_surface(
    cells: Sequence[Mapping[str, Any]], paper: Mapping[str, float], timeout_s: float, folder: Path
) -> None:
    """Draw `trade_off.png`: for each comparison the share of correct decisions, with its Wilson interval, and
    the mean time of the decisions, over the threshold, one line for each window.

    Args:
        cells: entries of `cells_of_handoff`.
        paper: the paper's "runs", "correct" and "mean_time_s", at 15 m.
        timeout_s: time without a decision that is a failure.
        folder: of the picture.
    """

    kinds = list(dict.fromkeys(cell["comparison"] for cell in cells))
    windows = sorted({cell["window"] for cell in cells})
    figure = blank_figure(4.2 * len(kinds), 6.4)
    grid = figure.subplots(2, len(kinds), squeeze=False)
    for column, kind in enumerate(kinds):
        shares, times = grid[0, column], grid[1, column]
        for place, (window, colour) in enumerate(zip(windows, _COLOURS, strict=False)):
            own = [cell for cell in cells if (cell["comparison"], cell["window"]) == (kind, window)]
            x = [cell["residual_m"] * (1.0 + 0.02 * (place - 1)) for cell in own]  # side by side
            share = [cell["correct"] / max(1, cell["runs"]) for cell in own]
            below = [max(0.0, s - cell["correct_ci95"][0]) for s, cell in zip(share, own, strict=True)]
            above = [max(0.0, cell["correct_ci95"][1] - s) for s, cell in zip(share, own, strict=True)]
            shares.errorbar(
                x, share, yerr=[below, above], fmt="o-", markersize=4, linewidth=1.0, color=colour,
                label=f"{window} samples",
            )  # fmt: skip
            known = [(a, cell["mean_time_s"]) for a, cell in zip(x, own, strict=True) if cell["mean_time_s"]]
            times.plot(
                [a for a, _ in known], [b for _, b in known], "o-", markersize=4, linewidth=1.0, color=colour
            )
        shares.set_title(kind, fontsize=10)
        shares.set_ylim(-0.03, 1.03)
        times.set_ylim(0.0, max(timeout_s, paper["mean_time_s"]) * 1.05)
        times.set_xlabel("T_r, m" if kind != "evidence" else "T_r has no effect", fontsize=9)
        if kind == "paper":
            shares.plot(15.0, paper["correct"] / paper["runs"], "*", color="#1f2937", markersize=11)
            times.plot(15.0, paper["mean_time_s"], "*", color="#1f2937", markersize=11, label="paper")
            times.legend(fontsize=8, frameon=False)
        for axes in (shares, times):
            axes.grid(color="#e5e7eb", linewidth=0.8)
            axes.tick_params(labelsize=8)
            if kind == "evidence":
                axes.set_xticks([])
    grid[0, 0].set_ylabel("share of runs that decide rightly, 95 %", fontsize=9)
    grid[1, 0].set_ylabel("mean time of a decision, s", fontsize=9)
    grid[0, 0].legend(fontsize=8, frameon=False)
    save_figure(figure, folder / "trade_off.png")
