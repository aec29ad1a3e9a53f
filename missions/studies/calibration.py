"""Verdicts of decisions in one world: right, wrong or undecided, and stated against achieved probability."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from missions.studies.statistics import share_interval

__all__ = ["ENOUGH", "TENTHS", "calibration_gap", "calibration_of", "rounded", "verdicts_of"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

TENTHS: Final = tuple(round(0.1 * k, 1) for k in range(11))
"""Edges of ten equal bins of probability."""

ENOUGH: Final = 50
"""Statements that a bin needs to say something about the calibration."""

_DIGITS: Final = 4


def calibration_of(
    stated: Array,
    happened: Flags,
    edges: Sequence[float] = TENTHS,
    clusters: NDArray[np.generic] | None = None,
) -> list[dict[str, Any]]:
    """Stated probabilities against how often what they are of happened, by bins of the stated ones.

    Args:
        stated, happened: (n,). Statements that are NaN are left out.
        edges: ascending; a bin has its upper edge, and the first one its lower edge too.
        clusters: (n,) what trials share, where they are not independent (`share_interval`).

    Returns:
        For each bin with a statement: `from`, `to`, `n`, mean `stated`, share `achieved`, and the 95 %
        interval of it, `achieved_ci95`.
    """
    found = []
    for number, (low, high) in enumerate(pairwise(edges)):
        inside = (stated > low) & (stated <= high)
        if not number:
            inside |= stated == low
        if not inside.any():
            continue
        share, interval = share_interval(happened[inside], None if clusters is None else clusters[inside])
        found.append(
            {
                "from": low,
                "to": high,
                "n": int(inside.sum()),
                "stated": rounded(float(stated[inside].mean())),
                "achieved": rounded(share),
                "achieved_ci95": [rounded(value) for value in interval],
            }
        )
    return found


def calibration_gap(bins: Sequence[dict[str, Any]], enough: int = ENOUGH) -> float | None:
    """Largest difference between stated and achieved of the bins with enough statements; None: no bin has.

    Args:
        bins: of `calibration_of`.
        enough: least number of statements.
    """
    gaps = [abs(row["stated"] - row["achieved"]) for row in bins if row["n"] >= enough]
    return rounded(max(gaps)) if gaps else None


def verdicts_of(
    right: Flags,
    wrong: Flags,
    stated: Array,
    *,
    edges: Sequence[float] = TENTHS,
    clusters: NDArray[np.generic] | None = None,
) -> dict[str, Any]:
    """Figures of the trials of one world for `summary.json`.

    Args:
        right, wrong: (n,) a decision was made, and it was this; neither: the trial stayed undecided.
        stated: (n,) probability that was stated with a decision; NaN: none.
        edges: bins of the calibration.
        clusters: (n,) what trials share, such as their map; None: each stands alone.

    Returns:
        `n`, `right`, `wrong`, `undecided`; `interval` and `wrong_interval`, the 95 % intervals of the shares
        of right and of wrong; `calibration` of the decisions, and its `calibration_gap`.
    """
    n = len(right)
    decided = right | wrong
    bins = calibration_of(
        stated[decided], right[decided], edges, None if clusters is None else clusters[decided]
    )
    return {
        "n": n,
        "right": int(right.sum()),
        "wrong": int(wrong.sum()),
        "undecided": n - int(decided.sum()),
        "interval": [rounded(value) for value in share_interval(right, clusters)[1]],
        "wrong_interval": [rounded(value) for value in share_interval(wrong, clusters)[1]],
        "calibration": bins,
        "calibration_gap": calibration_gap(bins),
    }


def rounded(value: float) -> float | None:
    """A figure as `summary.json` has it; None: there is none."""
    return round(float(value), _DIGITS) if np.isfinite(value) else None
