"""Association of measurements or estimates with targets: the assignment of least total cost."""

import math

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]


def assign(cost: Array) -> NDArray[np.int64]:
    """Assign each row to its own column so that the sum of the costs is smallest.

    Shortest augmenting paths (Jonker and Volgenant 1987); the time grows with rows^2 * columns.

    Args:
        cost: (n, m) finite costs, n <= m. A forbidden pair has a cost larger than all others together.

    Returns:
        (n,) column of each row.

    Raises:
        ValueError: there are more rows than columns, or a cost is not finite.
    """
    if cost.ndim != 2 or cost.shape[0] > cost.shape[1]:
        raise ValueError(f"the shape {cost.shape} is not accepted: as many columns as rows, or more, are")
    if not np.all(np.isfinite(cost)):
        raise ValueError("a cost is not finite; give a forbidden pair a large cost")
    column_of = np.zeros(cost.shape[0], dtype=np.int64)
    assign_rows(np.ascontiguousarray(cost, dtype=np.float64), column_of)
    return column_of


@kernel
def assign_rows(cost: Array, column_of: NDArray[np.int64]) -> None:
    """`assign` within kernels, without its checks: (n, m) costs, (n,) column of each row as the result."""
    rows, columns = cost.shape
    row_price, column_price = np.zeros(rows + 1), np.zeros(columns + 1)
    row_of = np.full(columns + 1, rows)  # the last column and the last row are the start of each path
    before = np.zeros(columns + 1, dtype=np.int64)
    for row in range(rows):
        row_of[columns] = row
        least = np.full(columns + 1, math.inf)
        done = np.zeros(columns + 1, dtype=np.bool_)
        at = columns
        while row_of[at] != rows:
            done[at] = True
            here, delta, following = row_of[at], math.inf, columns
            for column in range(columns):
                if not done[column]:
                    reduced = cost[here, column] - row_price[here] - column_price[column]
                    if reduced < least[column]:
                        least[column], before[column] = reduced, at
                    if least[column] < delta:
                        delta, following = least[column], column
            for column in range(columns + 1):
                if done[column]:
                    row_price[row_of[column]] += delta
                    column_price[column] -= delta
                else:
                    least[column] -= delta
            at = following
        while at != columns:
            row_of[at] = row_of[before[at]]
            at = before[at]
    for column in range(columns):
        if row_of[column] != rows:
            column_of[row_of[column]] = column
