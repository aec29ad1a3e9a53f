"""The study's figures: medians, wins, the table, and the contents of `summary.json`.

"The paper" is Steckenrider et al. 2020; its Table IV stands next to ours.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from missions.studies.lissajous_setting import CELLS, PAPER, READINGS, Equations, block_of
from missions.studies.lissajous_trial import Array, errors_of
from missions.studies.results import Results

_KEYS: Final = {
    Equations.CORRECTED: "",
    Equations.SIGN_AS_PRINTED: "sign_as_printed_",
    Equations.AS_PRINTED: "as_printed_",
}
_TITLES: Final = {
    Equations.CORRECTED: "corrected",
    Equations.SIGN_AS_PRINTED: "sign of 25a as printed",
    Equations.AS_PRINTED: "17 and 25a as printed",
}


def cells_of(results: Results) -> list[dict[str, float]]:
    """One entry for each cell: `n_rmse`, `k_rmse`, `p_rmse` (medians over the runs), `wins` (per cent of runs
    in which P was best), the paper's values, and standard errors.

    Keys without a prefix belong to the corrected equations or, if these were not requested, to the first
    requested ones. `f_rmse` belongs to the filter with the frequencies as states.
    """
    by_equations = errors_of(results)
    plain = _plain(tuple(by_equations))
    cells = []
    for index, (epsilon, delta) in enumerate(CELLS):
        paper = PAPER[epsilon, delta]
        cell: dict[str, float] = {"epsilon": epsilon, "delta": delta}
        for equations, errors in by_equations.items():
            done = errors[index][~np.isnan(errors[index, :, 0])]
            figures = _figures(done, [column.name for column in block_of(equations).columns])
            prefix = "" if equations is plain else _KEYS[equations]
            cell |= {f"{prefix}{key}": value for key, value in figures.items()}
        cell |= {
            "paper_n_rmse": paper.n_rmse,
            "paper_k_rmse": paper.k_rmse,
            "paper_p_rmse": paper.p_rmse,
            "paper_n_wins": paper.n_wins,
            "paper_k_wins": paper.k_wins,
            "paper_wins": paper.p_wins,
        }
        cells.append(cell)
    return cells


def _figures(errors: Array, names: Sequence[str]) -> dict[str, float]:
    runs = len(errors)
    if not runs:
        return {"runs": 0.0}
    figures: dict[str, float] = {}
    for column, name in enumerate(names):
        key = name.lower()
        figures[f"{key}_rmse"] = round(float(np.median(errors[:, column])), 5)
        figures[f"{key}_error"] = round(_median_error(errors[:, column]), 5)
    three = errors[:, :3]  # the paper compares N, K and P; a tie counts as a win
    best = three.min(axis=1, keepdims=True)
    shares = 100.0 * np.mean(three <= best * (1.0 + 1e-9), axis=0)
    figures |= {
        "n_wins": round(float(shares[0]), 2),
        "k_wins": round(float(shares[1]), 2),
        "wins": round(float(shares[2]), 2),
        "runs": float(runs),
    }
    return figures


def _median_error(values: Array) -> float:
    """Standard error of a median, from the order statistics one standard deviation away on either side."""
    half = 0.5 / math.sqrt(len(values))
    low, high = np.quantile(values, (max(0.0, 0.5 - half), min(1.0, 0.5 + half)))
    return 0.5 * float(high - low)


def summarise(results: Results) -> dict[str, Any]:
    """The study's own entries of `summary.json`."""
    readings = READINGS[str(results.options["equations"])]
    return {"equations": [str(equations) for equations in readings], "cells": cells_of(results)}


def lines_of(results: Results) -> list[str]:
    """Lines of the table: our values next to the paper's."""
    return table_of(cells_of(results), READINGS[str(results.options["equations"])])


def _plain(equations: Sequence[Equations]) -> Equations:
    """The reading whose figures have no prefix."""
    return Equations.CORRECTED if Equations.CORRECTED in equations else equations[0]


def table_of(cells: Sequence[Mapping[str, float]], equations: Sequence[Equations]) -> list[str]:
    """Lines of the table: our values next to the paper's."""
    plain = _plain(equations)
    others = [e for e in equations if e is not plain]
    head = f"{'':13}{'paper':^31}  {_TITLES[plain]:^40}"
    names = (
        f"{'epsilon delta':13}{'N':>7}{'K':>9}{'P':>8}{'P wins':>7}  {'N':>8}{'K':>9}{'P':>8}{'P wins':>7}"
    )
    with_f = any("f_rmse" in cell for cell in cells)
    names += f"{'F':>8}" if with_f else ""
    for other in others:
        literal = other is Equations.AS_PRINTED
        head += f"  {_TITLES[other]:^32}" if literal else f"  {_TITLES[other]:^22}"
        names += (f"  {'N':>8}{'K':>9}" if literal else f"  {'':7}") + f"{'P':>8}{'P wins':>7}"
    lines = [head.rstrip(), names.rstrip()]
    for cell in cells:
        if "n_rmse" not in cell:
            continue
        line = f"{cell['epsilon']:<7g} {cell['delta']:<5g}"
        line += f"{cell['paper_n_rmse']:7.4f}{cell['paper_k_rmse']:9.4f}{cell['paper_p_rmse']:8.4f}"
        line += f"{cell['paper_wins']:7.1f}  "
        line += f"{cell['n_rmse']:8.4f}{cell['k_rmse']:9.4f}{cell['p_rmse']:8.4f}{cell['wins']:7.1f}"
        line += f"{cell['f_rmse']:8.4f}" if with_f else ""
        for other in others:
            key = _KEYS[other]
            if other is Equations.AS_PRINTED:
                line += f"  {cell[f'{key}n_rmse']:8.4f}{cell[f'{key}k_rmse']:9.4f}"
            else:
                line += f"  {'':7}"
            line += f"{cell[f'{key}p_rmse']:8.4f}{cell[f'{key}wins']:7.1f}"
        lines.append(line)
    lines.append(
        "N unfiltered, K Kalman, P proposed, F frequencies as states. Medians over the runs of the mean"
    )
    lines.append("over time of sqrt((ex^2 + ey^2) / 2); wins in per cent of the runs.")
    return lines
