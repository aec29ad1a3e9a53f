"""How a survey is processed."""

from dataclasses import dataclass
from typing import Final, Protocol

from flightsim.foundation.options import Options, option

BLOCKS: Final = 4.0  # of a line spacing: blocks along a line, and cells of the grid
_USUAL_SPACING_M: Final = 200.0


class Spaced(Protocol):
    """A plan of lines."""

    @property
    def spacing_m(self) -> float | None: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessingParameters(Options):
    """How a survey is processed."""

    line_spacing_m: float | None = option(
        None, least=1.0, varies="that of the plan, else 200", help="Distance of the survey lines."
    )
    grid_m: float | None = option(
        None, above=0.0, varies="a quarter of the spacing", help="Distance of the grid's lines of the map."
    )
    map_error_nt: float | None = option(
        None,
        least=0.0,
        varies="as the map states it, else 1",
        help="Standard deviation of the published map.",
    )
    level: bool = option(True, help="Levels of the lines are estimated from the crossings with tie lines.")
    decimal_year: float = option(2026.0, least=2025.0, most=2030.0, help="Date of the main field (WMM-2025).")

    def spacing_m(self, plan: Spaced) -> float:
        """Distance of the survey lines of a plan."""
        return self.line_spacing_m or plan.spacing_m or _USUAL_SPACING_M

    def cell_m(self, plan: Spaced) -> float:
        """Distance of the grid's lines of a plan."""
        return self.grid_m or self.spacing_m(plan) / BLOCKS
