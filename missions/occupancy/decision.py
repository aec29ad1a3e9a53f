"""Decides which neighbouring cell a searcher flies to next: the utility of Lum et al. 2005, equation 9."""

import math
from collections.abc import Collection
from dataclasses import dataclass

from estimators.occupancy.occupancy_map import OccupancyMap
from estimators.tracking.grid import GridCell
from missions.errors import PlanError
from missions.occupancy.parameters import DecisionParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The next cell to fly to.

    Attributes:
        cell: the chosen cell.
        heading_rad: direction from the searcher to its centre, 0..2 pi.
        utility: J of equation 9, in mean prior scores.
    """

    cell: GridCell
    heading_rad: float
    utility: float


def decide(
    occupancy: OccupancyMap,
    *,
    north_m: float,
    east_m: float,
    heading_rad: float,
    parameters: DecisionParameters,
    taken: Collection[GridCell] = (),
) -> Decision:
    """The neighbouring cell of greatest utility J = B_i - alpha |psi - psi_i| (heading difference wrapped).

    When the searcher is off the map, the neighbourhood is that of the nearest cell, and that cell can be
    chosen too. Of cells with equal utility the one with the smallest number is chosen, so that a flight can
    be repeated.

    Args:
        occupancy: the shared map.
        north_m, east_m, heading_rad: position and heading of the searcher.
        parameters: parameters of its decisions.
        taken: cells that other searchers fly to; chosen only when there is no other cell.
    """
    layout = occupancy.layout
    here = layout.cell_at(north_m, east_m)
    reach = parameters.neighbourhood
    cells = [
        (row, column)
        for row in range(max(0, here[0] - reach), min(layout.rows, here[0] + reach + 1))
        for column in range(max(0, here[1] - reach), min(layout.columns, here[1] + reach + 1))
        if (row, column) != here or not layout.contains(north_m, east_m)
    ]
    free = [cell for cell in cells if cell not in taken] or cells
    scale = layout.rows * layout.columns
    best: Decision | None = None
    for cell in free:
        centre_n_m, centre_e_m = layout.centre_of(cell)
        bearing_rad = math.atan2(centre_e_m - east_m, centre_n_m - north_m)
        turn_rad = abs(math.remainder(bearing_rad - heading_rad, math.tau))
        utility = scale * float(occupancy.scores[cell]) - parameters.heading_penalty * turn_rad / math.pi
        if best is None or utility > best.utility:
            best = Decision(cell=cell, heading_rad=bearing_rad % math.tau, utility=utility)
    if best is None:
        raise PlanError("the map has no cell to fly to")
    return best
