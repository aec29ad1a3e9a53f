"""Options of a magnetic survey."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from estimators.errors import EstimatorError
from estimators.occupancy.survey_map import SurveyMap, load_survey_map
from estimators.survey.compensation import Compensation, load_compensation
from estimators.survey.processing import LEAST_SPACING_M, ProcessingParameters
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.base.options import MissionOptions, check_positive
from missions.errors import PlanError
from missions.survey.drape import TerrainModel, load_terrain
from missions.vehicle.limits import FixedWingLimits, Limits

LARGEST_SIDE_M: Final = 60_000.0
MAX_LINES: Final = 1000
ALTITUDE_M: Final = 80.0
CALIBRATION_ALTITUDE_M: Final = 800.0
"""Height of a compensation flight, unless one is given: there the field of the ground changes slowly."""
HIGHEST_M: Final = 3000.0
TIE_SPACING: Final = 5.0
"""Distance of tie lines, in line spacings, unless one is given; survey contracts have 5 to 10."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyOptions(MissionOptions):
    """A survey of a rectangle. Places are metres from the map's home; without a map, from the vehicle's home.

    Attributes:
        altitude_m: height to fly at: above the ground of `terrain_file`, else above home.
        width_m, height_m: size of the surveyed area: across the lines when they run north, and along them.
        area_ne_m: centre of the area.
        direction_rad: direction of the lines, clockwise from north; the area turns with them.
        spacing_m: distance of the lines.
        tie_spacing_m: distance of the tie lines; None: five line spacings; 0: no tie lines.
        speed_m_s: airspeed; None: the aircraft's own.
        map_file: published map that readings are compared with; None: that of the embedded world, or none.
        map_error_nt: standard deviation of that map; None: as it states.
        terrain_file: heights of the ground (`missions.survey.drape`); None: level ground.
        climb: steepest slope of the drape, height over distance.
        calibrate: fly the manoeuvres of a compensation instead of lines.
        compensation_file: coefficients that a calibration flight has written.
        grid_m: distance of the grid's lines of the map that is made; None: a quarter of the line spacing.
        level: level the lines by the tie lines.
    """

    altitude_m: float = ALTITUDE_M
    separation_m: float = 15.0
    width_m: float = 2000.0
    height_m: float = 2000.0
    area_ne_m: tuple[float, float] = (0.0, 0.0)
    direction_rad: float = 0.0
    spacing_m: float = 200.0
    tie_spacing_m: float | None = None
    speed_m_s: float | None = None
    map_file: str | None = None
    map_error_nt: float | None = None
    terrain_file: str | None = None
    climb: float = 0.06
    calibrate: bool = False
    compensation_file: str | None = None
    grid_m: float | None = None
    level: bool = True

    def __post_init__(self) -> None:
        super(SurveyOptions, self).__post_init__()
        check_positive(
            altitude_m=self.altitude_m,
            spacing_m=self.spacing_m,
            speed_m_s=self.speed_m_s,
            grid_m=self.grid_m,
            climb=self.climb,
        )
        if not self.spacing_m >= LEAST_SPACING_M:
            raise PlanError(
                f"`spacing_m` {self.spacing_m:g} m is too small; ask for {LEAST_SPACING_M:g} m or more"
            )
        for name, side_m in (("width_m", self.width_m), ("height_m", self.height_m)):
            if not 0.0 < side_m <= LARGEST_SIDE_M:
                raise PlanError(
                    f"`{name}` {side_m:g} m is not possible; ask for more than 0, up to {LARGEST_SIDE_M:g} m"
                )
        if not all(math.isfinite(value) for value in self.area_ne_m):
            raise PlanError(
                f"`area_ne_m` {self.area_ne_m[0]:g},{self.area_ne_m[1]:g} is not a place; give NORTH,EAST"
            )
        if not math.isfinite(self.direction_rad):
            raise PlanError(f"`direction_rad` {self.direction_rad} is not a direction; give a finite angle")
        if self.tie_spacing_m is not None and not (
            math.isfinite(self.tie_spacing_m) and self.tie_spacing_m >= 0.0
        ):
            raise PlanError(
                f"`tie_spacing_m` {self.tie_spacing_m:g} m is not possible; ask for more than 0, or 0 for no "
                "tie lines"
            )
        if self.map_error_nt is not None and not (
            math.isfinite(self.map_error_nt) and self.map_error_nt >= 0.0
        ):
            raise PlanError(f"`map_error_nt` {self.map_error_nt:g} nT is not possible; ask for 0 or more")
        if not self.climb <= 0.3:
            raise PlanError(f"`climb` {self.climb:g} is steeper than 0.3, which no survey aircraft follows")
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
    def processing(self) -> ProcessingParameters:
        """How the readings are processed."""
        return ProcessingParameters(
            line_spacing_m=self.spacing_m,
            grid_m=self.grid_m,
            map_error_nt=self.map_error_nt,
            level=self.level,
        )

    def for_vehicle(self, limits: Limits) -> "SurveyOptions":
        """The same options, with the aircraft's own airspeed unless one was specified."""
        if self.speed_m_s is not None or not isinstance(limits, FixedWingLimits):
            return self
        return replace(self, speed_m_s=limits.airspeed_trim_m_s)

    def check_altitude(self, limits: FixedWingLimits) -> None:
        """Refuse an impossible altitude. Surveys may be higher than `limits` has it, with an authorization.

        Raises:
            PlanError: the altitude is not possible.
        """
        if not limits.altitude_min_m <= self.altitude_m <= HIGHEST_M:
            raise PlanError(
                f"`altitude_m` {self.altitude_m:g} m is not in {limits.altitude_min_m:g}..{HIGHEST_M:g} m"
            )

    def survey_map(self) -> SurveyMap | None:
        """The published map; None: there is none.

        Raises:
            PlanError: the file does not exist or is not a map.
        """
        if self.map_file is None:
            return None
        try:
            return load_survey_map(Path(self.map_file))
        except EstimatorError as error:
            raise PlanError(str(error)) from None

    def terrain(self) -> TerrainModel | None:
        """The heights of the ground; None: it is level.

        Raises:
            PlanError: the file does not exist or has no heights.
        """
        return None if self.terrain_file is None else load_terrain(Path(self.terrain_file))

    def compensation(self) -> Compensation | None:
        """The coefficients of the aircraft; None: none are given.

        Raises:
            PlanError: the file does not exist or holds none.
        """
        if self.compensation_file is None:
            return None
        try:
            return load_compensation(Path(self.compensation_file))
        except EstimatorError as error:
            raise PlanError(str(error)) from None


def map_frame(options: SurveyOptions, home: GeodeticPosition) -> LocalFrame:
    """The frame of the survey: the map's, or that of the vehicle's home."""
    survey_map = options.survey_map()
    return LocalFrame(home if survey_map is None else survey_map.home)
