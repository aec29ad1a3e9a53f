"""What a survey reads: the published map, the heights of the ground, the coefficients of the aircraft."""

from pathlib import Path

from estimators.errors import EstimatorError
from estimators.occupancy.survey_map import SurveyMap, load_survey_map
from estimators.survey.compensation import Compensation, load_compensation
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import PlanError
from missions.survey.drape import TerrainModel, load_terrain
from missions.survey.options import SurveyOptions


def survey_map_of(options: SurveyOptions) -> SurveyMap | None:
    """The published map; None: there is none.

    Raises:
        PlanError: the file does not exist or is not a map.
    """
    if options.map_file is None:
        return None
    try:
        return load_survey_map(Path(options.map_file))
    except EstimatorError as error:
        raise PlanError(str(error)) from None


def terrain_of(options: SurveyOptions) -> TerrainModel | None:
    """The heights of the ground; None: it is level.

    Raises:
        PlanError: the file does not exist or has no heights.
    """
    return None if options.terrain_file is None else load_terrain(Path(options.terrain_file))


def compensation_of(options: SurveyOptions) -> Compensation | None:
    """The coefficients of the aircraft; None: none are given.

    Raises:
        PlanError: the file does not exist or holds none.
    """
    if options.compensation_file is None:
        return None
    try:
        return load_compensation(Path(options.compensation_file))
    except EstimatorError as error:
        raise PlanError(str(error)) from None


def map_frame(options: SurveyOptions, home: GeodeticPosition) -> LocalFrame:
    """The frame of the survey: the map's, or that of the vehicle's home."""
    survey_map = survey_map_of(options)
    return LocalFrame(home if survey_map is None else survey_map.home)
