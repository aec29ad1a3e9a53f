"""What is true in the world of a survey, and the mission does not know."""

from dataclasses import dataclass

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyedField(PlanOptions):
    """What lies in the field, and what the magnetometer feels."""

    targets: int = option(0, least=0, most=100, help="Number of dipoles in the area, drawn from `seed`.")
    uncompensated: bool = option(
        False, help="Magnetometer that feels its whole aircraft, as with `calibrate` and `compensation_file`."
    )
    daily_variation_nt: float | None = option(
        None, least=0.0, most=1000.0, varies="none", help="Dip of the field at noon, with pulsations."
    )
    exact_map: bool = option(False, help="True field that is the map's, without the error of a survey.")
