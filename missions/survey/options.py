"""Options of a magnetic survey."""

from dataclasses import dataclass, replace
from typing import Final

from estimators.survey.parameters import ProcessingParameters
from flightsim.foundation.options import held, option, other_default
from missions.base.options import MissionOptions
from missions.errors import PlanError

MAX_LINES: Final = 1000
CALIBRATION_ALTITUDE_M: Final = 800.0
"""Height of a compensation flight, unless one is given: there the field of the ground changes slowly."""
TIE_SPACING: Final = 5.0
"""Distance of tie lines, in line spacings, unless one is given; survey contracts have 5 to 10."""
_LARGEST_SIDE_M: Final = 60_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyOptions(MissionOptions):
    """A survey of a rectangle. Places are metres from the map's home; without a map, from the vehicle's home.

    Attributes:
        processing: parameters of the processing of the readings, but for the distance of the lines.
    """

    altitude_m: float = other_default(80.0, above=0.0, varies=f"with `calibrate`: {CALIBRATION_ALTITUDE_M:g}")
    separation_m: float = other_default(15.0)
    width_m: float = option(
        2000.0,
        above=0.0,
        most=_LARGEST_SIDE_M,
        name="size",
        metavar="SIDE|WIDTHxHEIGHT",
        separators="x,",
        lone="same",
        help="Size of the area, m, across the lines x along them.",
    )
    height_m: float = option(
        2000.0, above=0.0, most=_LARGEST_SIDE_M, name="size", help="Size of the area along the lines."
    )
    area_ne_m: tuple[float, float] = option(
        (0.0, 0.0), metavar="NORTH,EAST", help="Centre of the area, m from the map's home."
    )
    direction_rad: float = option(0.0, help="Direction of the lines, from north; the area turns with them.")
    spacing_m: float = option(200.0, least=1.0, help="Distance of the lines.")
    tie_spacing_m: float | None = option(
        None, least=0.0, varies="five line spacings", help="Distance of the tie lines; 0: none."
    )
    speed_m_s: float | None = option(
        None, above=0.0, varies="the aircraft's own", help="Airspeed of the aircraft."
    )
    map_file: str | None = option(
        None,
        name="map",
        metavar="FILE",
        varies="the embedded world makes one from `seed`; none with `connect`",
        help="Published magnetic map (.npz) to compare with.",
    )
    terrain_file: str | None = option(
        None,
        name="terrain",
        metavar="FILE",
        varies="level ground",
        help="Heights of the ground to drape the flight over: CSV north_m,east_m,ground_m, or .npz.",
    )
    climb: float = option(
        0.06, above=0.0, most=0.3, help="Steepest slope of the drape, height over distance."
    )
    calibrate: bool = option(False, help="Flight of a compensation, which writes compensation.json.")
    compensation_file: str | None = option(
        None,
        name="compensation",
        metavar="FILE",
        help="Coefficients of the aircraft, from the folder of a flight with `calibrate`.",
    )
    processing: ProcessingParameters = held(
        ProcessingParameters(), map_error="map_error_nt", grid="grid_m", no_levelling="level"
    )

    def __post_init__(self) -> None:
        if self.calibrate and not self.chosen("altitude_m"):
            object.__setattr__(self, "altitude_m", CALIBRATION_ALTITUDE_M)
        MissionOptions.__post_init__(self)

    def check_together(self) -> None:
        for name, span, step_m, what in (
            ("spacing_m", "width_m", self.spacing_m, "lines"),
            ("tie_spacing_m", "height_m", self.tie_m, "tie lines"),
        ):
            count = getattr(self, span) / step_m if step_m > 0.0 else 0.0
            if not count <= MAX_LINES:
                raise PlanError(
                    f"`{name}` {step_m:g} m makes {count:.0f} {what}; up to {MAX_LINES} are accepted: ask "
                    f"for more spacing or a smaller `{span}`"
                )
        if self.calibrate and self.compensation_file is not None:
            raise PlanError("`compensation_file` has no use with `calibrate`, which makes one; leave it out")

    @property
    def tie_m(self) -> float:
        """Distance of the tie lines; 0: none."""
        return TIE_SPACING * self.spacing_m if self.tie_spacing_m is None else self.tie_spacing_m

    @property
    def processing_parameters(self) -> ProcessingParameters:
        """How the readings are processed."""
        return replace(self.processing, line_spacing_m=self.spacing_m)
