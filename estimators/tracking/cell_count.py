"""How many cells a grid over an area has, and how many it may have."""

import math
from typing import Final

from estimators.errors import EstimatorError

MAX_CELLS: Final = 250_000


def cells_over(
    width_m: float, height_m: float, cell_m: float, most_cells: int = MAX_CELLS
) -> tuple[int, int]:
    """Rows and columns of a grid over an area; partial cells are left out.

    Raises:
        EstimatorError: there are too few cells or too many.
    """
    if not (math.isfinite(cell_m) and cell_m > 0.0):
        raise EstimatorError(f"`cell_m` {cell_m:g} m is not possible; ask for more than 0")
    rows, columns = math.floor(height_m / cell_m + 1e-9), math.floor(width_m / cell_m + 1e-9)
    if rows < 2 or columns < 2:
        raise EstimatorError(
            f"`cell_m` {cell_m:g} m leaves {rows} x {columns} cells in the area; "
            "ask for smaller cells or a larger `width_m, height_m`: at least 2 x 2 make a map"
        )
    if rows * columns > most_cells:
        raise EstimatorError(
            f"`cell_m` {cell_m:g} m makes {rows * columns} cells, more than "
            f"{most_cells}; ask for larger cells or a smaller `width_m, height_m`"
        )
    return rows, columns
